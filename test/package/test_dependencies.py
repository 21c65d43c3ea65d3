"""The lock file and the table of dependencies against setup.py."""

from importlib import metadata
import importlib.util
from pathlib import Path
import re
import sys

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
import pytest

ROOT = Path(__file__).parents[2]
spec = importlib.util.spec_from_file_location('dependencies', ROOT / 'tools' / 'dependencies.py')
dependencies = importlib.util.module_from_spec(spec)
spec.loader.exec_module(dependencies)

NEEDED = dependencies.needed()
PAGE = dependencies.PAGE.read_text(encoding='utf-8')
ROWS = dict(re.findall(r'^\| ([\w.-]+) \| (.*) \|$', PAGE, re.MULTILINE))
LINES = [
    line
    for line in dependencies.LOCK.read_text(encoding='utf-8').splitlines()
    if not line.startswith('#')
]
LOCKED = {
    canonicalize_name(name): version for name, _, version in (x.partition('==') for x in LINES)
}


def all_requirements():
    return [(extra, r) for extra, requirements in NEEDED.items() for r in requirements]


def test_setup_is_read_as_it_is():
    """The tool reads setup.py without running it: the same as what was installed of it."""
    names = {r.name for _, r in all_requirements()}
    assert {'numpy', 'mcap', 'ros-jazzy-rclpy', 'pytest'} <= names
    assert set(dependencies.EXTRAS) <= set(NEEDED)


@pytest.mark.parametrize(('extra', 'requirement'), all_requirements(), ids=str)
def test_every_dependency_has_a_row_with_its_bounds_and_a_reason(extra, requirement):
    bounds, purpose, why, licence = ROWS[requirement.name].split(' | ')
    listed = '' if bounds == 'any' else bounds
    assert Requirement(f'x {listed}').specifier == requirement.specifier
    assert 'all' if extra == '' else f'[{extra}]' in purpose
    assert why == dependencies.WHY[requirement.name]
    assert dependencies.is_allowed(licence, tool=extra not in dependencies.DISTRIBUTED)


def test_no_row_is_of_what_is_not_needed():
    rows = {name for name in ROWS if name not in {'dependency'}}
    assert rows == {r.name for _, r in all_requirements()}


def test_every_line_of_the_lock_file_is_one_exact_version():
    assert sorted(LINES, key=lambda line: line.partition('==')[0].lower()) == LINES
    assert len(LOCKED) == len(LINES) > 50
    for line in LINES:
        assert re.fullmatch(r'[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+', line), line


@pytest.mark.parametrize('extra', ['', *dependencies.EXTRAS])
def test_the_lock_file_satisfies_the_bounds(extra):
    for requirement in NEEDED[extra]:
        version = LOCKED[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(version, prereleases=True), requirement


def test_the_lock_file_brings_all_that_its_own_packages_need():
    """As far as the very versions are installed here, whose metadata tell it."""
    seen = 0
    for name, version in LOCKED.items():
        try:
            distribution = metadata.distribution(name)
        except metadata.PackageNotFoundError:
            continue
        if distribution.version != version:
            continue
        for line in distribution.requires or ():
            inner = Requirement(line)
            if inner.marker is None or inner.marker.evaluate({'extra': ''}):
                found = LOCKED[canonicalize_name(inner.name)]
                assert inner.specifier.contains(found, prereleases=True), (name, line)
        seen += 1
    assert seen or sys.version_info[:2] != (3, 11)


def test_licences_that_do_not_fit_are_not_allowed():
    for text in ('GPL-3.0', '?', 'MIT AND GPL-2.0', 'Proprietary', ''):
        assert not dependencies.is_allowed(text, tool=True)
        assert not dependencies.is_allowed(text, tool=False)
    assert not dependencies.is_allowed('MPL-2.0', tool=False)
    assert dependencies.is_allowed('MPL-2.0', tool=True)
    assert dependencies.is_allowed('GPL-2.0 OR MIT', tool=False)


def test_a_dependency_without_a_reason_is_refused(monkeypatch):
    monkeypatch.delitem(dependencies.WHY, 'numpy')
    with pytest.raises(ValueError, match='numpy: say'):
        dependencies.tables()


def test_a_licence_that_is_not_known_is_refused(monkeypatch):
    monkeypatch.setattr(dependencies, 'PERMISSIVE', {'MIT'})
    with pytest.raises(ValueError, match='is not known to go with'):
        dependencies.tables()
