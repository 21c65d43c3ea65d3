"""The lock file and the table of dependencies agree with setup.py."""

from importlib import metadata
import importlib.util
from pathlib import Path
import re

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
import pytest

ROOT = Path(__file__).parents[2]
spec = importlib.util.spec_from_file_location('dependencies', ROOT / 'tools' / 'dependencies.py')
dependencies = importlib.util.module_from_spec(spec)
spec.loader.exec_module(dependencies)

NEEDED = dependencies.needed()
PAGE = dependencies.PAGE.read_text(encoding='utf-8')
ROWS = dict(re.findall(r'^\| ([\w.-]+) \| (.*) \|$', PAGE, re.MULTILINE))
LOCK = dependencies.LOCK.read_text(encoding='utf-8')
LINES = [line for line in LOCK.splitlines() if not line.startswith('#')]
LOCKED = dependencies.pinned(LOCK)


def all_requirements():
    return [(extra, r) for extra, requirements in NEEDED.items() for r in requirements]


def test_setup_is_read_without_running_it():
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


def test_every_row_belongs_to_a_requirement():
    rows = {name for name in ROWS if name not in {'dependency'}}
    assert rows == {r.name for _, r in all_requirements()}


def test_every_line_of_the_lock_file_pins_one_exact_version():
    assert sorted(LINES, key=lambda line: line.partition('==')[0].lower()) == LINES
    assert len(LOCKED) == len(LINES) > 50
    for line in LINES:
        assert re.fullmatch(r'[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+', line), line


def test_the_lock_file_satisfies_the_bounds():
    assert dependencies.stale_pin(LOCK) == ''


@pytest.mark.parametrize(
    ('pin', 'changed', 'reason'),
    [
        ('numpy==', 'numpy==3.1  # ', 'setup.py needs numpy<3,>=1.26, and the file has 3.1'),
        ('Sphinx==', 'sphynx==', 'setup.py needs Sphinx<10,>=8, which is not in the file'),
    ],
)
def test_a_stale_lock_file_is_reported_in_one_line(pin, changed, reason):
    assert LOCK.count(f'\n{pin}') == 1
    said = dependencies.stale_pin(LOCK.replace(f'\n{pin}', f'\n{changed}'))
    assert said.startswith(reason)
    assert 'make lock' in said
    assert '\n' not in said


def test_the_lock_file_pins_all_dependencies_of_its_packages():
    """Checked for the packages that are installed in the version of the lock file."""
    checked = 0
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
                pin = LOCKED[canonicalize_name(inner.name)]
                assert inner.specifier.contains(pin, prereleases=True), (name, line)
        checked += 1
    assert checked > 50


def test_the_lock_file_suits_the_oldest_python():
    """Debian 12 has Python 3.11.2, and pip refuses the whole file for one package."""
    checked = 0
    for name, version in LOCKED.items():
        try:
            distribution = metadata.distribution(name)
        except metadata.PackageNotFoundError:
            continue
        if distribution.version == version:
            needed = distribution.metadata['Requires-Python'] or ''
            assert SpecifierSet(needed).contains('3.11.0'), (name, version, needed)
            checked += 1
    assert checked > 50


def test_incompatible_licences_are_not_allowed():
    for text in ('GPL-3.0', '?', 'MIT AND GPL-2.0', 'Proprietary', ''):
        assert not dependencies.is_allowed(text, tool=True)
        assert not dependencies.is_allowed(text, tool=False)
    assert not dependencies.is_allowed('MPL-2.0', tool=False)
    assert dependencies.is_allowed('MPL-2.0', tool=True)
    assert dependencies.is_allowed('GPL-2.0 OR MIT', tool=False)


def test_a_dependency_without_a_reason_is_refused(monkeypatch):
    monkeypatch.delitem(dependencies.WHY, 'numpy')
    with pytest.raises(ValueError, match='numpy: add the reason'):
        dependencies.tables()


def test_an_unknown_licence_is_refused(monkeypatch):
    monkeypatch.setattr(dependencies, 'PERMISSIVE', {'MIT'})
    with pytest.raises(ValueError, match='is not known to be compatible with'):
        dependencies.tables()
