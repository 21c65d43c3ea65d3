"""docs/deviations.md has a test behind each line, and each test that it names exists."""

import ast
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / 'docs/deviations.md').read_text(encoding='utf-8')
TESTS = ROOT / 'test/physics'
DEFAULT = 'test_errata.py'


def names_of_tests(file: str) -> set[str]:
    """Return the names of the tests in a file, from test/physics, without the prefix."""
    tree = ast.parse((TESTS / file).read_text(encoding='utf-8'))
    return {
        node.name.removeprefix('test_')
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name.startswith('test_')
    }


def named_tests(text: str) -> list[tuple[str, str]]:
    """Return (file, test) for every test that a text names: an identifier with underscores."""
    names = re.findall(r'`(?:((?:\.\./paper/)?test_\w+\.py)`:\s+`)?([a-z]\w*_\w+)`', text)
    return [(file or DEFAULT, name) for file, name in names if name not in NOT_TESTS]


NOT_TESTS = {
    'flat_plate', 'frisbee_as_printed', 'frisbee_linear', 'frisbee_roll_moment',
    'constant_spin', 'wraith_tunnel',
}  # fmt: skip


def missing(text: str) -> list[str]:
    return [
        f'{file}: {name}' for file, name in named_tests(text) if name not in names_of_tests(file)
    ]


def evidence() -> list[str]:
    """Return the last cells of the tables of equations and figures."""
    rows = [line.strip('|').split(' | ') for line in PAGE.splitlines() if line.startswith('| ')]
    return [cells[-1] for cells in rows if len(cells) == 4 and cells[-1].strip() != 'evidence']


def test_every_named_test_exists():
    assert len(named_tests(PAGE)) > 30
    assert missing(PAGE) == []


def test_every_row_names_a_test_or_the_test_above():
    rows = evidence()
    assert len(rows) > 18
    assert [r for r in rows if not named_tests(r) and 'the same test' not in r] == []


def test_every_section_names_a_test():
    sections = re.split('^## ', PAGE, flags=re.MULTILINE)[1:]
    assert [s.splitlines()[0] for s in sections if not named_tests(s)] == []


def test_a_test_that_does_not_exist_is_noticed():
    assert missing('`lift_does_no_work`') == []
    assert missing('`lift_does_work`') == ['test_errata.py: lift_does_work']
    assert missing('`test_symmetry.py`:\n  `gone_away`') == ['test_symmetry.py: gone_away']


@pytest.mark.parametrize('name', sorted(NOT_TESTS))
def test_the_exceptions_are_discs_and_models(name):
    discs = {path.stem for path in (ROOT / 'disc_sim_ros/physics/discs').glob('*.yaml')}
    assert name in discs | {'constant_spin'}
