"""Flights without a given step: landings within 0.01 mm of far shorter steps, the same bits."""

from dataclasses import replace
import math

import numpy as np
import pytest

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import MODELS, Setup, fly
from disc_sim_ros.physics.kernels import dopri5
from disc_sim_ros.physics.kernels.aerodynamics import row_of, table_coefficients
from disc_sim_ros.physics.kernels.dopri5 import with_table
from disc_sim_ros.physics.kernels.equations import Control, Velocity
from disc_sim_ros.physics.kernels.jit import COMPILED
from disc_sim_ros.physics.kernels.stages import SPACE
from disc_sim_ros.physics.launch import Launch

PROMISED = 1e-5  # m
# s; RK4 is off by up to 1.4e-6 m in such steps, by the order 2 of a corner of the table: that lies
# between it and steps of 0.01 ms. Where the disc nutates ten times as fast it is off by 5e-8 m.
FINE = 5e-5
pytestmark = pytest.mark.skipif(not COMPILED, reason='fine steps take minutes in plain Python')


def drawn(name, number):
    """A flight of the disc, drawn from usual and fast throws, winds, gusts and commands.

    Each eighth spins ten times as fast, up to the greatest spin that is allowed.
    """
    rng = np.random.default_rng([number, *name.encode()])
    disc = disc_file.load_disc(name)
    wobble = rng.choice([0.0, 1.0, 3.0])
    faster = 10.0 if number % 8 == 7 else 1.0
    launch = Launch(
        speed=rng.uniform(5.0, 30.0),
        pitch=rng.uniform(-10.0, 40.0),
        roll=rng.uniform(-45.0, 45.0),
        spin=rng.choice([-1.0, 1.0]) * faster * rng.uniform(15.0, 130.0),
        roll_rate=rng.uniform(-wobble, wobble),
        pitch_rate=rng.uniform(-wobble, wobble),
        height=rng.uniform(0.2, 2.0),
    )
    windy = number % 2 * rng.uniform(-6.0, 6.0, 3) * (1.0, 1.0, 0.1)
    setup = Setup(
        disc=disc,
        model=str(rng.choice(list(MODELS))),
        aero=str(rng.choice([aero for aero in ('table', 'linear') if disc.has(aero)])),
        moment_axes=str(rng.choice(['body', 'wind'])),
        ground_contact=str(rng.choice(['rim', 'centre'])),
        wind=Wind(
            mean=tuple(windy),
            roughness_length=0.03 * (number % 2),
            turbulence=5.0 * (number % 4 == 3),
            seed=number,
        ),
    )
    command = Control(*rng.uniform(-0.02, 0.02, 3), *rng.uniform(-2e-3, 2e-3, 3), number % 3)
    return launch, setup, command if rng.random() < 0.4 else Control()


@pytest.mark.parametrize('name', disc_file.disc_names())
def test_a_landing_is_that_of_fine_steps(name):
    for number in (0, 1, 2, 3, 7):
        launch, setup, control = drawn(name, number)
        landed = fly(launch, setup, control=control)
        fine = fly(launch, replace(setup, step=FINE), control=control)
        assert landed.landed == fine.landed
        assert math.dist(landed.position, fine.position) < PROMISED, (number, launch, setup)
        assert landed.apex == pytest.approx(fine.apex, abs=5e-5)  # on a cubic within a step


@pytest.mark.parametrize(
    ('name', 'number'),
    [
        ('frisbee_roll_moment', 25),  # the advance ratio passes rows of the spin table
        ('frisbee_roll_moment', 196),
        ('firebird', 240),  # released at a corner of the table, and leaves it at once
        ('wraith', 22),  # 9 s
        ('ultrastar', 244),
        ('teebird', 265),  # nutates slowly, for 7 s
        ('frisbee', 164),
    ],
)
def test_the_worst_of_a_few_thousand_keep_the_promise(name, number):
    launch, setup, control = drawn(name, number)
    fine = fly(launch, replace(setup, step=2e-5), control=control)
    assert math.dist(fly(launch, setup, control=control).position, fine.position) < PROMISED


@pytest.mark.parametrize('wh', [0.3, 1.0, 2.0, 5.0])
def test_a_step_of_any_length_follows_the_nutation_of_a_free_disc(wh):
    disc = disc_file.load_disc('frisbee')
    setup = Setup(disc=disc, air=Air(density=0.0))
    s = Launch(height=50.0, spin=30.0, roll_rate=0.02, pitch_rate=0.01).state()
    h = wh / (30.0 * setup.plant.I_z / setup.plant.I_x)
    row = row_of(setup.corner_plant.table, 0)
    plant, calm = with_table(setup.corner_plant, row), Velocity(0.0, 0.0, 0.0)
    K = np.zeros(SPACE)
    dopri5.start(s, calm, plant, setup.calm_inputs, K)
    end = dopri5.step(s, h, calm, calm, plant, setup.calm_inputs, K)
    fine = fly(
        Launch(height=50.0, spin=30.0, roll_rate=0.02, pitch_rate=0.01),
        replace(setup, step=h / 500),
        duration=h,
    ).end
    # The motion that is taken out is that of small angles, to the square of the tilt.
    tilt = math.hypot(0.02, 0.01) * h / wh
    assert end.p == pytest.approx(fine.p, abs=1e-10)
    assert end.q == pytest.approx(fine.q, abs=1e-10)
    assert end[6:10] == pytest.approx(fine[6:10], abs=tilt**2)


@pytest.mark.parametrize(
    ('name', 'launch'),
    [
        ('frisbee', Launch(speed=22.0, spin=60.0, roll_rate=2.0, pitch_rate=-2.0, height=1.0)),
        ('wraith', Launch(speed=30.0, pitch=8.0, spin=130.0, pitch_rate=1.0, height=1.5)),
        ('ultrastar', Launch(speed=25.0, pitch=8.0, spin=90.0, roll_rate=3.0, height=1.5)),
        ('frisbee', Launch(speed=12.0, pitch=20.0, spin=2.0)),
        # Comes in flat, on a rim that nutates.
        ('ultrastar', Launch(speed=23.74, pitch=0.55, roll=10.14, spin=-792.0)),
        ('ultrastar', Launch(speed=21.93, pitch=2.55, roll=-11.1, spin=-818.0)),
    ],
)
def test_the_hard_throws_keep_the_promise(name, launch):
    setup = Setup(disc=disc_file.load_disc(name))
    fine = fly(launch, replace(setup, step=FINE))
    assert math.dist(fly(launch, setup).position, fine.position) < PROMISED


@pytest.mark.parametrize('wind', [Wind(), Wind(mean=(2.0, 1.0, 0.0), turbulence=5.0, seed=3)])
@pytest.mark.parametrize('name', ['frisbee', 'ultrastar'])
def test_many_flights_have_the_bits_of_single_ones(name, wind):
    rng = np.random.default_rng(2)
    thrown = {
        'speed': rng.uniform(8.0, 30.0, 21),
        'spin': rng.uniform(-100.0, 100.0, 21),
        'pitch': rng.uniform(-10.0, 60.0, 21),
        'roll_rate': rng.uniform(-2.0, 2.0, 21),
        'height': rng.uniform(0.0, 2.0, 21),
    }
    setup = Setup(disc=disc_file.load_disc(name), wind=wind)
    many = fly_many(thrown, setup, threads=2)
    for i in range(21):
        one = fly(Launch(**{name: float(x[i]) for name, x in thrown.items()}), setup)
        assert tuple(many.states[i].tolist()) == one.end
        assert (many.time[i], many.apex[i]) == (one.time, one.apex)


def test_samples_are_even_and_as_exact_as_the_landing():
    launch, setup, control = drawn('frisbee', 3)
    sampled = fly(launch, setup, control=control, sample_rate=200.0)
    fine = fly(launch, replace(setup, step=FINE), control=control, sample_rate=200.0)
    t = sampled.trajectory
    assert np.array_equal(t.t, np.arange(len(t.t)) / 200.0)
    assert np.abs(t.position - fine.trajectory.position).max() < PROMISED
    assert np.abs(t.velocity - fine.trajectory.velocity).max() < 1e-4
    assert sampled.end == fly(launch, setup, control=control).end  # samples change no bit


def test_the_time_of_flight_is_met_and_the_landing_lies_on_the_ground():
    setup = Setup(disc=disc_file.load_disc('frisbee'))
    assert fly(Launch(height=5.0), setup, duration=0.7071).time == 0.7071
    for name in ('frisbee', 'wraith'):
        landed = fly(Launch(height=1.0), Setup(disc=disc_file.load_disc(name)))
        assert landed.landed
        speed = abs(landed.end.VZ) + 1.0
        rim = 0.5 * landed.setup.disc.diameter * (landed.setup.lands_on == 'rim')
        e = landed.end
        tilt = math.hypot(2 * (e.e1 * e.e3 - e.e0 * e.e2), 2 * (e.e2 * e.e3 + e.e0 * e.e1))
        assert abs(e.Z + rim * tilt) < 1e-9 * speed


@pytest.mark.parametrize('name', ['ultrastar', 'frisbee_roll_moment', 'frisbee'])
def test_rows_at_corners_change_no_coefficient(name):
    disc = disc_file.load_disc(name)
    rows = disc.corner_rows
    assert np.all(np.diff(rows[:, 0]) > 0.0)
    for alpha in np.linspace(-1.7, 1.7, 400):
        now, before = (table_coefficients(alpha, table) for table in (rows, disc.table_rows))
        assert now == pytest.approx(before, abs=1e-14)
