"""Compilation: flights with and without numba are the same, and the cache on disk is safe."""

import ast
import json
import math
import os
from pathlib import Path
import runpy
import shutil
import subprocess
import sys

from hypothesis import assume, given
import numba
import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels import code_cache, jit
from disc_sim_ros.physics.kernels.equations import derivative
from disc_sim_ros.physics.simulator import FlightSimulator
from envelope import CONTROLS, launches, setups, thorough, winds

PACKAGE = Path(jit.__file__).parents[2]
KERNELS = Path(jit.__file__).parent
compiled = pytest.mark.skipif(not jit.COMPILED, reason='without compilation there is no cache')

FLIGHTS = """
import json, sys
if 'hide' in sys.argv:
    sys.modules['numba'] = sys.modules['llvmlite'] = None  # an import of them fails

from disc_sim_ros.physics import disc_file, ensemble, flight, simulator
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import MODELS, Setup, fly
from disc_sim_ros.physics.kernels import jit
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch

# It rises to its apex and lands soon: plain Python takes a while for each step.
launch, control = Launch(speed=9.0, roll_rate=2.0, height=0.2), Control(C_L=0.01)
gusty = Wind(mean=(1., 2., 0.), turbulence=8., seed=3, roughness_length=0.03)
flown = {}
for disc in disc_file.disc_names()[:: 5 if 'hide' in sys.argv else 1]:
    numbers = flown[disc] = []
    for model in MODELS:
        setup = Setup(disc=disc_file.load_disc(disc), model=model, step=0.03, wind=gusty)
        one = fly(launch, setup, control=control, sample_rate=10)
        numbers += [one.time, *one.end, one.apex, *one.trajectory.rows.ravel().tolist()]
        sim = simulator.FlightSimulator(setup, launch.state())
        sim.control = control
        sim.advance(20)
        numbers += [*sim.state, *sim.observe()]
numbers = flown['many'] = []
many = {'speed': [14.0, 15.0, 16.0], 'roll_rate': 2.0, 'height': 1.0}
for wind in (Wind(), gusty):
    setup = Setup(disc=disc_file.load_disc('frisbee'), step=0.02, wind=wind)
    landings = ensemble.fly_many(many, setup, control=control)
    numbers += [*landings.time.tolist(), *landings.states.ravel().tolist()]
note = flight.first_call_note()
print(json.dumps({'compiled': jit.COMPILED, 'note': note, 'flown': flown}))
"""


def flights(*words, **environment):
    """Fly in a process of its own, in which a warning is an error."""
    done = subprocess.run(
        [sys.executable, '-W', 'error', '-c', FLIGHTS, *words],
        env={**os.environ, **environment},
        capture_output=True, text=True, check=True, timeout=300,
    )  # fmt: skip
    assert done.stderr == ''
    return json.loads(done.stdout)


@pytest.fixture(scope='module')
def compiled_flights():
    result = flights(NUMBA_DISABLE_JIT='0')
    assert result['compiled']
    assert result['note'] == ''
    return result['flown']


def test_plain_python_flies_the_same_flights(compiled_flights):
    """One source of the equations: compiled and plain differ in the last bits of libm alone."""
    plain = flights(NUMBA_DISABLE_JIT='1')
    assert not plain['compiled']
    assert plain['note'] == ''  # the user asked for it
    for name, numbers in plain['flown'].items():
        assert_allclose(numbers, compiled_flights[name], rtol=1e-9, atol=1e-9)


def test_without_numba_the_same_flights_run_and_a_note_says_what_to_install(compiled_flights):
    plain = flights('hide', NUMBA_DISABLE_JIT='0')
    assert not plain['compiled']
    assert 'numba' in plain['note']
    assert 'pip install numba' in plain['note']
    assert '\n' not in plain['note']
    for name, numbers in plain['flown'].items():
        assert_allclose(numbers, compiled_flights[name], rtol=1e-9, atol=1e-9)


def test_without_numba_a_flight_beyond_finite_numbers_is_an_error_and_no_warning():
    program = (
        "import sys; sys.modules['numba'] = None\n"
        'from dataclasses import replace\n'
        'from disc_sim_ros.errors import IntegrationError\n'
        'from disc_sim_ros.physics import disc_file, flight\n'
        'from disc_sim_ros.physics.launch import Launch\n'
        "disc = disc_file.load_disc('frisbee')\n"
        "disc = replace(disc, linear=replace(disc.linear, CD_0=1e300), aero='linear')\n"
        'launch = Launch(speed=200.0, angle_of_attack=90.0)\n'
        'try:\n'
        '    flight.fly(launch, flight.Setup(disc=disc), duration=1.0)\n'
        'except IntegrationError as error:\n'
        '    print(error)\n'
    )
    done = subprocess.run(
        [sys.executable, '-W', 'error', '-c', program],
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    assert 'shorter step' in done.stdout


def test_a_numba_that_does_not_fit_is_named_and_not_used(tmp_path):
    """As with a numba of another year beside a newer numpy, whose import fails in many ways."""
    fault = "raise SystemError('initialization of _internal failed without raising an exception')"
    (tmp_path / 'numba.py').write_text(f'{fault}\n', encoding='utf-8')
    program = (
        'from disc_sim_ros.physics import disc_file, flight\n'
        'from disc_sim_ros.physics.launch import Launch\n'
        "setup = flight.Setup(disc=disc_file.load_disc('frisbee'), step=0.02)\n"
        'print(flight.first_call_note(), flight.fly(Launch(), setup).landed)\n'
    )
    done = subprocess.run(
        [sys.executable, '-c', program], env={**os.environ, 'PYTHONPATH': str(tmp_path)},
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    assert 'initialization of _internal failed' in done.stdout
    assert done.stdout.endswith(' True\n')


def test_the_fly_command_without_numba_prints_one_note():
    program = (
        "import sys; sys.modules['numba'] = None\n"
        'from disc_sim_ros.cli import fly\n'
        "sys.exit(fly.main(['--step', '0.02', '--json']))"
    )
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, check=True, timeout=120
    )
    assert json.loads(done.stdout)['landed']
    assert done.stderr.startswith('fly: note: ')
    assert 'pip install numba' in done.stderr
    assert done.stderr.count('\n') == 1


@thorough(60)
@given(launches(), setups(), winds(), CONTROLS)
def test_compiled_derivatives_are_the_plain_ones(launch, setup, wind, control):
    """At every state: `observe` is compiled, `derivative` called from Python is not."""
    setup = Setup(disc=setup.disc, model=setup.model, aero=setup.aero,
                  moment_axes=setup.moment_axes, wind=wind, step=1e-6)  # fmt: skip
    sim = FlightSimulator(setup, launch.state(), ground=False)
    sim.control = control
    plain = derivative(sim.state, sim.wind, setup.plant, control)
    assume(all(map(math.isfinite, plain)))
    observation = sim.observe()
    for rates, expected in ((observation[:3], plain[3:6]), (observation[3:6], plain[10:13])):
        # Only sin and cos may round differently; sums may cancel.
        largest = max(map(abs, (*observation[6:12], *expected, 1e-300)))
        assert_allclose(rates, expected, rtol=1e-12, atol=1e-12 * largest)


def test_only_the_compiler_files_import_numba():
    """All other modules work without numba."""
    importers = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob('*.py')
        if any(name.split('.')[0] in {'numba', 'llvmlite'} for name in imports(path))
    }
    names = {path.stem for path in map(Path, importers) if PACKAGE / path.parent == KERNELS}
    assert len(names) == len(importers)
    assert names == {
        'code_cache', 'compiler', 'jit', 'machine_code', 'native_numba', 'simd_numba'
    }  # fmt: skip


def test_kernels_import_nothing_of_the_package_but_array_types():
    """So a change of any other module cannot change what is compiled."""
    for path in KERNELS.glob('*.py'):
        own = {name for name in imports(path) if name.split('.')[0] == PACKAGE.name}
        inside = f'{PACKAGE.name}.physics.kernels'
        assert {x for x in own if not x.startswith(inside)} <= {f'{PACKAGE.name}.arrays'}, path


def imports(path):
    """Return the modules that a file imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0  # this package has no relative imports
            yield node.module


@compiled
def test_only_a_change_of_a_kernel_changes_the_cache(tmp_path):
    """Machine code of old equations must not be used; other edits must not cost a compilation."""
    copy = tmp_path / PACKAGE.name
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns('__pycache__'))
    kernels = copy / KERNELS.relative_to(PACKAGE)

    def digest():
        program = 'from disc_sim_ros.physics.kernels import code_cache as c; print(c.__file__, '
        done = subprocess.run(
            [sys.executable, '-c', f'{program}c.SOURCE_DIGEST)'],
            cwd=tmp_path, env={**os.environ, 'PYTHONPATH': str(tmp_path)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        file, value = done.stdout.split()
        assert Path(file).parent == kernels
        return value

    before = digest()
    assert before == code_cache.SOURCE_DIGEST
    others = [path for path in copy.rglob('*') if path.is_file() and path.parent != kernels]
    assert len(others) > 100
    for path in others:
        with path.open('a', encoding='utf-8') as file:
            file.write('\n')
    assert digest() == before
    for path in sorted(kernels.glob('*.py')):
        text = path.read_text(encoding='utf-8')
        path.write_text(f'{text}\n', encoding='utf-8')
        assert code_cache.source_digest(kernels) != before, path
        path.write_text(text, encoding='utf-8')
    with (kernels / 'equations.py').open('a', encoding='utf-8') as file:
        file.write('\n')
    assert digest() != before


def triple(x):
    """A kernel that compiles in a moment."""
    return 3.0 * x


def code_file(folder):
    """Return the file of the machine code of `triple`."""
    (file,) = folder.rglob('*.triple-*.code')
    return file


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache of its own that holds the machine code of `triple`."""
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
    assert jit.entry(triple)(2.0) == 6.0
    return tmp_path


@compiled
def test_machine_code_is_taken_from_disk(cache, caplog):
    again = jit.entry(triple)
    assert jit.is_compiled(again)
    assert again(2.0) == 6.0
    assert again.hits == 1
    assert caplog.messages == []


def torn(data):
    return data[: len(data) // 2]


def changed(data):
    """One bit in the middle, in the machine code itself."""
    i = len(data) // 2
    return data[:i] + bytes([data[i] ^ 1]) + data[i + 1 :]


@compiled
@pytest.mark.parametrize(
    'damage',
    [lambda _: b'', torn, lambda _: b'not machine code', changed],
    ids=['empty', 'torn', 'foreign', 'changed'],
)
def test_damaged_machine_code_is_discarded_and_compiled_again(cache, caplog, damage):
    path = code_file(cache)
    path.write_bytes(damage(path.read_bytes()))
    again = jit.entry(triple)
    assert again(2.0) == 6.0
    (line,) = caplog.messages
    assert str(path.parent) in line
    assert 'damaged machine code' in line
    assert '\n' not in line

    caplog.clear()
    repaired = jit.entry(triple)
    assert repaired(2.0) == 6.0
    assert repaired.hits == 1
    assert caplog.messages == []


@compiled
def test_a_command_reports_damaged_machine_code_in_one_line(tmp_path, monkeypatch):
    """Without a log handler, as in every command, the line goes to stderr."""
    script = tmp_path / 'script.py'
    script.write_text(
        'from disc_sim_ros.physics.kernels.jit import entry\n'
        '@entry\n'
        'def triple(x):\n'
        '    return 3.0 * x\n'
        'print(triple(2.0))\n',
        encoding='utf-8',
    )

    def run():
        return subprocess.run(
            [sys.executable, '-W', 'error', script],
            env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path / 'other')},
            capture_output=True, text=True, check=True,
        )  # fmt: skip

    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path / 'other'))
    runpy.run_path(str(script), run_name='__main__')
    code_file(tmp_path / 'other').write_bytes(b'')
    done = run()
    assert done.stdout == '6.0\n'
    assert done.stderr.count('\n') == 1
    assert 'damaged machine code' in done.stderr
    assert run().stderr == ''


@compiled
def test_a_flight_needs_no_place_for_its_machine_code(cache, caplog):
    """The folder vanishes after the start: the machine code is then used from memory."""
    again = jit.entry(triple)
    folder = code_file(cache).parent
    shutil.rmtree(folder)
    folder.write_text('a file where the folder was', encoding='utf-8')
    assert again(2.0) == 6.0
    assert any('cannot keep machine code' in line for line in caplog.messages)


@compiled
def test_a_kernel_that_allocates_is_refused():
    """Kernels count no references to arrays, so they must not make any."""

    @jit.entry
    def allocates(n):
        return np.empty(n)[0]

    with pytest.raises(numba.core.errors.NumbaError, match='array'):
        allocates(3)
