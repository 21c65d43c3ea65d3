"""The examples of the documentation run and print what the pages say.

A ```text block directly after a ```python block is the output of that example. Blocks in other
languages, and Python that must not run, have another word after the fence.
"""

import contextlib
import io
from itertools import pairwise
import re
import warnings

import pytest

from disc_sim_ros.cli import fly as fly_command
from docs.pages import DOCS, PAGES, ROOT, blocks


def run_examples(text: str, name: str) -> str:
    """Run the examples of a page in order, in one namespace; return what they print."""
    namespace = {'__name__': '__example__'}
    lines, fenced, printed = text.splitlines(), list(blocks(text)), ''
    for i, block in enumerate(fenced):
        if block.kind != 'python':
            continue
        source = '\n' * (block.first - 1) + block.text  # tracebacks show the line of the page
        with contextlib.redirect_stdout(io.StringIO()) as out, warnings.catch_warnings():
            warnings.simplefilter('error')
            exec(compile(source, name, 'exec'), namespace)
        after = fenced[i + 1] if i + 1 < len(fenced) else None
        if after and after.kind == 'text' and not ''.join(lines[block.last : after.first - 2]):
            assert out.getvalue().rstrip() == after.text.rstrip(), f'{name}, line {after.first}'
        printed += out.getvalue()
    return printed


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_examples_run_and_print_what_the_page_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('MPLBACKEND', 'agg')
    run_examples(page.read_text(encoding='utf-8'), str(page))


def fly_examples(text: str) -> list[tuple[str, str]]:
    """Return flags and output of each sh block that has one `fly` and a text block after it."""
    pairs = pairwise(blocks(text))
    return [
        (block.text.removeprefix('.venv/bin/fly').strip(), after.text)
        for block, after in pairs
        if block.kind == 'sh' and after.kind == 'text' and after.first - block.last < 4
        if block.text.startswith('.venv/bin/fly') and block.text.count('\n') == 1
    ]


@pytest.mark.parametrize('page', [DOCS / 'fly.md', ROOT / 'README.md'], ids=lambda p: p.name)
def test_fly_prints_what_the_page_says(page, capsys):
    (example,) = fly_examples(page.read_text(encoding='utf-8'))
    assert fly_command.main(example[0].split()) == 0
    assert capsys.readouterr().out.rstrip() == example[1].rstrip()


@pytest.mark.parametrize(
    ('example', 'error'),
    [
        ('```python\n1 / 0\n```\n', ZeroDivisionError),
        ('```python\nimport warnings\nwarnings.warn("old")\n```\n', UserWarning),
        ('```python\nprint(1)\n```\n\n```text\n2\n```\n', AssertionError),
        ('- x\n  ```python\n  y = 1\n  assert y == 2\n  ```\n', AssertionError),
        ('```python\nprint(1)\n', AssertionError),
    ],
)
def test_a_wrong_example_is_noticed(example, error):
    with pytest.raises(error):
        run_examples(example, 'page')


def test_a_page_has_its_own_namespace():
    page = '```python\nx = 1\n```\n\n```python\nprint(x)\n```\n\n```text\n1\n```\n'
    assert run_examples(page, 'page') == '1\n'
    with pytest.raises(NameError):
        run_examples('```python\nprint(x)\n```\n', 'page')


def test_signs_at_a_glance_are_what_the_examples_print():
    text = (DOCS / 'axes.md').read_text(encoding='utf-8')
    glance = text.partition('## Signs at a glance')[2]
    stated = re.findall(r'`([\w.]+ = [^`]+)`', glance)
    printed = run_examples(text, 'axes.md').splitlines()
    assert len(stated) > 15
    assert [line for line in stated if line not in printed] == []
    rows = [row for row in glance.splitlines() if row.startswith('| ')][1:]
    assert [row for row in rows if ' = ' not in row and 'C_Side' not in row] == []
