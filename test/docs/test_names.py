"""Names and phrases that CONTRIBUTING.md rules out are in no file of the project.

The old names were replaced by terms of the field: a Timeline is a SimClock, a Question a Study.
The phrases do not name the actor or the noun.
"""

import ast
from collections.abc import Iterator
import io
from pathlib import Path
import re
import tokenize

import pytest

from docs.pages import ROOT

FOLDERS = (
    '.github', 'benchmarks', 'config', 'disc_sim_ros', 'docs', 'examples', 'launch', 'rviz',
    'scripts', 'security', 'test', 'tools', 'urdf',
)  # fmt: skip
SUFFIXES = {
    '', '.c', '.cfg', '.cpp', '.dot', '.js', '.json', '.md', '.mjs', '.py', '.rst', '.rviz',
    '.toml', '.urdf', '.xml', '.yaml', '.yml',
}  # fmt: skip
GENERATED = {'__pycache__', 'node_modules', 'api'}
OLD_NAMES = {
    'Timeline', 'punctual', 'Track', 'Listener', 'Medium', 'Wire', 'Entry', 'Held', 'leap',
    '_blow', 'Ledger', 'Piece', 'refly', 'Refly', 'Question', 'Aboard', 'manned', 'Polled',
    'Outputs',
}  # fmt: skip
PARTICIPLES = {'found', 'told', 'seen', 'heard'}  # as names of variables
PHRASES = re.compile(
    r'\b(nobody|in\s+vain|say\s+whether|tell\s+whether|for\s+good\b(?!\s+\w)|by\s+nothing'
    r'|who\s+comes|what\s+acts|whoever)\b',
    re.IGNORECASE,
)


def files() -> Iterator[Path]:
    """Yield the text files of the project, without this one and without generated folders."""
    top = [path for path in ROOT.iterdir() if path.name != 'LICENSE']
    below = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob('*'))]
    for path in (*top, *below):
        if path == Path(__file__) or not path.is_file() or path.suffix not in SUFFIXES:
            continue
        if not GENERATED & set(path.relative_to(ROOT).parts):
            yield path


def phrases(text: str) -> list[str]:
    """Return 'line: phrase' for each phrase in a text."""
    return [f'{text.count(chr(10), 0, m.start()) + 1}: {m[0]}' for m in PHRASES.finditer(text)]


def words(text: str) -> set[str]:
    """Return the words of a text: a source without a name in them needs no parser."""
    return set(re.findall(r'\w+', text))


def old_names_in_code(source: str) -> list[str]:
    """Return 'line: name' for each old name among the identifiers of a Python source."""
    if not OLD_NAMES & words(source):
        return []
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    names = [(t.start[0], t.string) for t in tokens if t.type == tokenize.NAME]
    return [f'{line}: {name}' for line, name in names if name in OLD_NAMES]


def old_names_in_prose(text: str) -> list[str]:
    """Return the old names between backticks."""
    return [name for name in re.findall(r'`(?:\w+\.)*(\w+)`', text) if name in OLD_NAMES]


def participles(source: str) -> list[str]:
    """Return 'line: name' for each variable and argument with a name of PARTICIPLES."""
    if not PARTICIPLES & words(source):
        return []
    nodes = list(ast.walk(ast.parse(source)))
    names = [(n.lineno, n.id) for n in nodes if isinstance(n, ast.Name)]
    names += [(n.lineno, n.arg) for n in nodes if isinstance(n, ast.arg)]
    return [f'{line}: {name}' for line, name in sorted(set(names)) if name in PARTICIPLES]


TEXTS = {path.relative_to(ROOT): path.read_text(encoding='utf-8') for path in files()}
SOURCES = {path: text for path, text in TEXTS.items() if path.suffix == '.py'}


def test_the_whole_project_is_read():
    assert len(SOURCES) > 200
    for name in ('README.md', 'Makefile', 'docs/axes.md', 'test/conftest.py', 'config/sim.yaml'):
        assert Path(name) in TEXTS


def test_no_file_has_the_phrases():
    assert {str(path): hits for path, text in TEXTS.items() if (hits := phrases(text))} == {}


def test_no_code_has_the_old_names():
    hits = {str(path): old_names_in_code(text) for path, text in SOURCES.items()}
    assert {path: names for path, names in hits.items() if names} == {}


def test_no_page_or_docstring_has_the_old_names():
    hits = {str(path): old_names_in_prose(text) for path, text in TEXTS.items()}
    assert {path: names for path, names in hits.items() if names} == {}


def test_no_variable_is_a_participle():
    hits = {str(path): participles(text) for path, text in SOURCES.items()}
    assert {path: names for path, names in hits.items() if names} == {}


@pytest.mark.parametrize(
    ('text', 'count'),
    [
        ('waited 90 s in\nvain for it', 1),
        ('"""Say whether it flies."""', 1),
        ('a topic that nobody hears, who comes later, what acts', 3),
        ('It ends for good.', 1),
        ('for good reasons, Whoever throws', 1),
        ('It returns True if it flies.', 0),
    ],
)
def test_a_planted_phrase_is_noticed(text, count):
    assert len(phrases(text)) == count


def test_a_planted_name_is_noticed():
    assert old_names_in_code('clock = bags.Timeline()\n# Held: a comment\n') == ['1: Timeline']
    assert old_names_in_code('def refly(wire): ...\n') == ['1: refly']
    assert old_names_in_prose('`Question` and `studies.Question`, a question') == ['Question'] * 2
    source = 'found = 1\ndef f(told): return seen\nfor heard in (): print(path.found, "told")\n'
    assert participles(source) == ['1: found', '2: seen', '2: told', '3: heard']
