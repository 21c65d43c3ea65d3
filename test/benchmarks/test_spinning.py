"""The loops that benchmarks/steps.py compares integrate the same motion in different axes."""

import cmath
import json
import os
from pathlib import Path
import subprocess
import sys

import pytest

SCRIPT = """
import json, sys
sys.path.insert(0, sys.argv[1])
from spinning import flown, released
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch

setup = Setup(disc=disc_file.load_disc('frisbee'), step=1e-3)
launch = Launch(roll=20.0, spin=25.0, roll_rate=2.0, pitch_rate=-1.0, height=1.0)
ends = [flown(released(launch.state(), axes), axes, 1e-3, 0.2, setup.plant) for axes in range(3)]
ends.append(fly(launch, setup, duration=0.2, ground=False).end)
print(json.dumps([end._asdict() for end in ends]))
"""


@pytest.fixture(scope='module')
def ends():
    """Return the ends of one flight with a wobble, in plain Python: compiling takes longer."""
    done = subprocess.run(
        [sys.executable, '-c', SCRIPT, str(Path(__file__).parents[2] / 'benchmarks')],
        env={**os.environ, 'NUMBA_DISABLE_JIT': '1'}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(done.stdout)


def normal(end):
    """Return the z axis of the disc in earth axes."""
    e0, e1, e2, e3 = (end[name] for name in ('e0', 'e1', 'e2', 'e3'))
    return [2 * (e1 * e3 + e0 * e2), 2 * (e2 * e3 - e0 * e1), 1 - 2 * (e1**2 + e2**2)]


def test_the_despun_loop_gives_the_flight_of_fly(ends):
    despun, _, _, of_fly = ends
    assert despun == pytest.approx(of_fly, abs=1e-13)


# RK4 error in axes that turn at 25 rad/s: 0.025^5 / 120 of 15 m/s in each of 200 steps of 1 ms.
@pytest.mark.parametrize('axes', [1, 2])
def test_axes_fixed_in_the_disc_give_the_same_motion(ends, axes):
    despun, spinning = ends[0], ends[axes]
    for name in 'XYZ':
        assert spinning[name] == pytest.approx(despun[name], abs=1e-6)
    assert normal(spinning) == pytest.approx(normal(despun), abs=1e-6)
    assert spinning['r'] == pytest.approx(despun['r'], rel=1e-9)
    turned = (despun['p'] + 1j * despun['q']) * cmath.exp(-1j * despun['sigma'])
    assert abs(spinning['p'] + 1j * spinning['q'] - turned) < 1e-5
    assert abs(turned - (despun['p'] + 1j * despun['q'])) > abs(turned)  # the axes have turned


def test_the_printed_equations_have_the_velocity_in_axes_of_the_disc(ends):
    despun, _, printed, _ = ends
    speed = [sum(end[name] ** 2 for name in ('VX', 'VY', 'VZ')) for end in (despun, printed)]
    assert speed[1] == pytest.approx(speed[0], rel=1e-7)
    assert abs(printed['VX'] - despun['VX']) > 1.0
