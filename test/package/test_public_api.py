"""The public names of the package, and what an import of them loads."""

import ast
import importlib
import json
from pathlib import Path
import subprocess
import sys

import pytest

import disc_sim_ros

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / 'disc_sim_ros'
HEAVY = {'scipy', 'matplotlib', 'pyarrow', 'dask', 'distributed', 'rclpy', 'PIL'}
# Names of flights and bags; those of studies import scipy once they draw.
LIGHT = (
    'Launch', 'Setup', 'Wind', 'Air', 'Disc', 'load_disc', 'disc_names', 'fly', 'fly_many',
    'Flight', 'Landings', 'Trajectory', 'Control', 'State', 'FlightSimulator', 'Bag', 'open_bag',
    'BagWriter', 'Qos', 'Topic', 'Quantity', 'QUANTITIES', 'AeroTable', 'LinearAero', 'SpinTable',
    'DiscSimError', 'ConfigError', 'IntegrationError', 'BagError', 'DamageError', 'WriteError',
)  # fmt: skip


def loaded_by(line: str) -> set[str]:
    """Return the top-level names of the modules in a fresh process after a line of Python."""
    program = f'import json, sys\n{line}\nprint(json.dumps(sorted(sys.modules)))'
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, check=True, timeout=120
    )
    return {name.partition('.')[0] for name in json.loads(done.stdout)}


def test_the_package_alone_loads_nothing_but_the_standard_library():
    before = loaded_by('')
    others = loaded_by('import disc_sim_ros') - before - set(sys.stdlib_module_names)
    assert others == {'disc_sim_ros'}


def test_the_names_of_flights_and_bags_load_no_heavy_package():
    """All in one process: a name alone loads no more than all of them do."""
    loaded = loaded_by(f'from disc_sim_ros import {", ".join(LIGHT)}')
    by_name = {}
    if loaded & HEAVY:
        by_name = {name: loaded_by(f'from disc_sim_ros import {name}') & HEAVY for name in LIGHT}
    assert loaded & HEAVY == set(), by_name


FLIGHTS = """
from disc_sim_ros import FlightSimulator, Launch, Setup, fly, fly_many, load_disc
setup = Setup(disc=load_disc('frisbee'))
fly(Launch(), setup)
fly_many({'pitch': [1.0, 2.0]}, setup)
FlightSimulator(setup, Launch().state()).advance(10)
"""


def test_flights_load_no_heavy_package_where_their_machine_code_is_on_disk():
    if loaded_by(FLIGHTS) & HEAVY:  # it compiled what was not there
        assert loaded_by(FLIGHTS) & HEAVY == set()


def test_help_of_studies_loads_no_heavy_package():
    program = 'from disc_sim_ros.cli import optimise, sweep; optimise.parser(); sweep.parser()'
    assert loaded_by(program) & HEAVY == set()


def test_a_heavy_import_is_noticed():
    """Plots need matplotlib, the checks of a bag scipy."""
    loaded = loaded_by('import disc_sim_ros.analysis.plots, disc_sim_ros.analysis.checks')
    assert {'matplotlib', 'scipy'} <= loaded


def test_every_public_name_is_there_and_comes_from_its_module():
    for name in disc_sim_ros.__all__:
        assert getattr(disc_sim_ros, name) is not None
    assert set(LIGHT) <= set(disc_sim_ros.__all__)
    assert set(disc_sim_ros.__all__) <= set(dir(disc_sim_ros))
    assert '__version__' in dir(disc_sim_ros)
    from disc_sim_ros.physics.launch import Launch

    assert disc_sim_ros.Launch is Launch


def test_a_misspelt_name_is_an_import_error():
    with pytest.raises(ImportError, match='Lunch'):
        from disc_sim_ros import Lunch  # noqa: F401
    with pytest.raises(AttributeError, match='Lunch'):
        disc_sim_ros.Lunch  # noqa: B018


def typed_imports(source: str) -> dict[str, str]:
    """Return the module of each name that type checkers see imported."""
    (block,) = (
        node
        for node in ast.parse(source).body
        if isinstance(node, ast.If) and ast.unparse(node.test) == 'TYPE_CHECKING'
    )
    return {
        alias.name: statement.module.removeprefix('disc_sim_ros.')
        for statement in block.body
        for alias in statement.names
    }


def test_type_checkers_see_the_names_that_python_imports():
    typed = typed_imports((PACKAGE / '__init__.py').read_text(encoding='utf-8'))
    assert typed == disc_sim_ros._MODULE_OF
    assert sorted(typed) == sorted(disc_sim_ros.__all__)
    for name, module in typed.items():  # where it is defined, not passed on
        defined = getattr(importlib.import_module(f'disc_sim_ros.{module}'), name)
        assert getattr(defined, '__module__', f'disc_sim_ros.{module}') == f'disc_sim_ros.{module}'


def from_the_public_api(source: str) -> list[str]:
    """Return what a module of the package imports through the public interface."""
    return [
        alias.name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom) and node.module == 'disc_sim_ros'
        for alias in node.names
        if alias.name in disc_sim_ros.__all__
    ]


def test_modules_of_the_package_import_each_other_directly():
    """The import rules do not follow an import through the public interface."""
    for path in PACKAGE.rglob('*.py'):
        assert from_the_public_api(path.read_text(encoding='utf-8')) == [], path
    assert from_the_public_api('def f():\n    from disc_sim_ros import open_bag\n') == ['open_bag']
