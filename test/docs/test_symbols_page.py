"""docs/symbols.md names every field of the physics, and every name on it exists."""

import dataclasses
from functools import cached_property
import importlib.util
import inspect
import re

import pytest

from disc_sim_ros.analysis import flight_report
from disc_sim_ros.cli.fly import parser
from disc_sim_ros.physics import disc, disc_file, environment, theory
from disc_sim_ros.physics.flight import Flight, Setup, fly
from disc_sim_ros.physics.kernels import aerodynamics, equations
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.trajectory import Trajectory
from disc_sim_ros.quantities import LAUNCH
from docs.pages import DOCS, ROOT

SYMBOLS = (DOCS / 'symbols.md').read_text(encoding='utf-8')
CODE, ELSEWHERE, UNIT = 2, 3, 4  # columns
COMPLETE = {
    equations: ['State', 'Plant', 'Velocity', 'Control', 'Flow', 'Coefficients', 'Moment'],
    aerodynamics: ['Linear'],
    disc: ['Disc', 'LinearAero', 'AeroTable', 'SpinTable'],
    environment: ['Air', 'Wind'],
}


def rows() -> list[list[str]]:
    """Return the rows of the tables that have a column of code."""
    cells = [
        [cell.strip() for cell in line.strip('|').split('|')]
        for line in SYMBOLS.splitlines()
        if line.startswith('|')
    ]
    return [row for row in cells if len(row) == 6 and row[CODE] not in {'code', '---'}]


def names_in(cell: str) -> list[str]:
    return re.findall(r'`([^`]+)`', cell)


def fields_of(cls: type) -> list[str]:
    if dataclasses.is_dataclass(cls):
        return [field.name for field in dataclasses.fields(cls)]
    return list(cls._fields)


def properties_of(cls: type) -> list[str]:
    return [n for n, v in vars(cls).items() if isinstance(v, property | cached_property)]


def exists(name: str) -> bool:
    """Return True if physics or its kernels have `module.function` or `module.Class.field`."""
    module, *path = name.split('.')
    places = ('disc_sim_ros.physics', 'disc_sim_ros.physics.kernels')
    full = next(
        (f'{p}.{module}' for p in places if importlib.util.find_spec(f'{p}.{module}')), None
    )
    if not path or full is None:
        return False
    thing = importlib.import_module(full)
    for i, part in enumerate(path):
        if isinstance(thing, type):
            last = i == len(path) - 1
            return last and part in fields_of(thing) + properties_of(thing)
        thing = getattr(thing, part, None)
        if thing is None:
            return False
    return True


def documented() -> set[str]:
    return {name for row in rows() for name in names_in(row[CODE])}


def elsewhere(word: str) -> set[str]:
    """Return the names after a word such as YAML in the column *elsewhere*."""
    return {name for row in rows() for name in re.findall(rf'{word} `([^`]+)`', row[ELSEWHERE])}


def test_every_row_has_all_cells():
    tables = [line for line in SYMBOLS.splitlines() if line.startswith('|')]
    widths = {len(line.strip('|').split('|')) for line in tables}
    assert widths == {3, 6}  # the last table has the symbols without a name in the code
    assert len(rows()) > 80
    assert [row for row in rows() if not all(row)] == []


def test_every_name_in_the_code_column_exists():
    assert sorted(name for name in documented() if not exists(name)) == []


def test_every_other_name_of_a_module_exists():
    modules = {path.stem for path in (ROOT / 'disc_sim_ros' / 'physics').rglob('*.py')}
    dotted = {n for n in names_in(SYMBOLS) if n.split('.')[0] in modules and '.' in n}
    classes = {'equations.State', 'equations.Moment', 'equations.Coefficients'}
    assert sorted(n for n in dotted if not exists(n) and n not in classes) == []


@pytest.mark.parametrize(
    'name', ['equatons.State.X', 'equations.State.W', 'equations.State.count', 'theory.gone',
             'disc.Disc.weight', 'launch'],
)  # fmt: skip
def test_a_name_that_does_not_exist_is_noticed(name):
    assert not exists(name)


@pytest.mark.parametrize(
    'cls', [getattr(m, n) for m, names in COMPLETE.items() for n in names]
    + [Launch, Setup, Flight, Trajectory],
    ids=lambda cls: cls.__name__,
)  # fmt: skip
def test_no_field_is_missing(cls):
    module = cls.__module__.rpartition('.')[2]
    wanted = fields_of(cls) + (properties_of(cls) if cls in {Flight, Trajectory} else [])
    assert wanted
    missing = [n for n in wanted if f'{module}.{cls.__name__}.{n}' not in documented()]
    assert missing == []


def test_no_derived_quantity_is_missing():
    functions = {
        name
        for name, value in vars(theory).items()
        if inspect.isfunction(value) and value.__module__ == theory.__name__
    }
    assert {f'theory.{name}' for name in functions if name[0] != '_'} <= documented()


def test_flags_of_fly_exist_and_no_flag_of_a_launch_is_missing():
    known = {flag for action in parser()._actions for flag in action.option_strings}
    flags = {n for row in rows() for n in names_in(row[ELSEWHERE]) if n.startswith('--')}
    assert flags - known == set()
    launched = next(g for g in parser()._action_groups if g.title == 'launch')
    assert {flag for a in launched._group_actions for flag in a.option_strings} <= flags


def test_yaml_keys_are_those_of_the_catalogue():
    properties = {*disc_file._PROPERTIES, 'description', 'based_on', 'flight_numbers', 'aero'}
    sections = {f'{s}.{key}' for s, keys in disc_file._SECTIONS.items() for key in keys}
    assert elsewhere('YAML') == properties | sections


def test_json_keys_are_those_of_fly():
    flight = fly(Launch(), Setup(disc=disc_file.load_disc('frisbee')), sample_rate=2.0)
    document = flight_report.document(flight)
    of_no_quantity = {'version', 'wind'}  # `wind` has the fields of Wind
    known = set(document) | set(document['launch'])
    assert elsewhere('JSON') == known - of_no_quantity


def test_units_of_a_launch_are_those_of_the_code():
    units = {
        name.removeprefix('launch.Launch.'): row[UNIT]
        for row in rows()
        for name in names_in(row[CODE])
        if name.startswith('launch.Launch.')
    }
    assert units == {q.name: q.unit for q in LAUNCH.values()}
