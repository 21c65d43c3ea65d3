"""Many flights at once are equal to the same flights one by one."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, ensemble
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import DISC_AIR, DISC_BODY, Control
from disc_sim_ros.physics.kernels.integrator import FLYING, LANDED, LOST
from disc_sim_ros.physics.launch import Launch

FRISBEE = disc_file.load_disc('frisbee')
STEP = 0.01
N = 60


def launches(n=N, seed=1):
    """Throws of every attitude, some left-handed, some wobbling."""
    rng = np.random.default_rng(seed)
    return {
        'speed': rng.uniform(0.0, 30.0, n),
        'pitch': rng.uniform(-90.0, 90.0, n),
        'roll': rng.uniform(-180.0, 180.0, n),
        'yaw': rng.uniform(-360.0, 360.0, n),
        'angle_of_attack': rng.uniform(-180.0, 180.0, n),
        'sideslip': rng.uniform(-180.0, 180.0, n),
        'spin': rng.uniform(-80.0, 80.0, n),
        'roll_rate': rng.uniform(-5.0, 5.0, n),
        'pitch_rate': rng.uniform(-5.0, 5.0, n),
        'height': rng.uniform(0.0, 5.0, n),
    }


def one(thrown, i, setup, **more):
    return fly(Launch(**{name: float(x[i]) for name, x in thrown.items()}), setup, **more)


@pytest.mark.parametrize(
    ('disc', 'model', 'aero'),
    [
        ('frisbee', 'exact', 'table'),
        ('frisbee', 'constant_spin', 'linear'),
        ('frisbee', 'precession', 'table'),
        ('frisbee_roll_moment', 'exact', 'table'),
        ('wraith', 'exact', 'table'),
    ],
)
@pytest.mark.parametrize('wind', [Wind(), Wind(mean=(2.0, -3.0, 0.5), turbulence=8.0, seed=5)])
def test_each_flight_is_that_of_fly_to_the_last_bit(disc, model, aero, wind):
    setup = Setup(disc=disc_file.load_disc(disc), model=model, aero=aero, wind=wind, step=STEP)
    control = Control(C_L=0.01, C_M=-0.005, C_N=0.001)
    thrown = launches()
    landings = fly_many(thrown, setup, control=control)
    for i in range(N):
        expected = one(thrown, i, setup, control=control)
        assert tuple(landings.states[i].tolist()) == expected.end
        assert (landings.time[i], landings.apex[i]) == (expected.time, expected.apex)
        assert landings.drift[i] == expected.drift
        assert landings.status[i] == (LANDED if expected.landed else FLYING)
        position = landings.x[i], landings.y[i], landings.z[i]
        assert position == tuple(expected.position.tolist())
        assert landings.range[i] == pytest.approx(expected.range, rel=1e-15)


@pytest.mark.parametrize(
    'changes',
    [
        {'moment_axes': 'wind'},
        {'wind': Wind(mean=(3.0, 1.0, 0.0), roughness_length=0.05)},
        {'model': 'precession', 'wind': Wind(mean=(0.0, 0.0, 2.0))},
        {'air': Air(density=0.0)},
    ],
    ids=['wind axes', 'log profile', 'updraught', 'vacuum'],
)
@pytest.mark.parametrize('axes', [DISC_BODY, DISC_AIR])
def test_simd_flights_are_scalar_flights_in_rarely_used_setups(changes, axes):
    setup = Setup(disc=FRISBEE, step=STEP, **changes)
    control = Control(L=0.002, M=-0.001, N=0.0005, axes=axes)
    assert_same_bits(launches(20, seed=3), setup, control=control)


@pytest.mark.parametrize('n', [1, 7, 8, 9, 33])
def test_any_number_of_flights_fits_the_simd_width(n):
    assert_same_bits(launches(n, seed=n), Setup(disc=disc_file.load_disc('wraith'), step=STEP))


@pytest.mark.parametrize('duration', [0.004, STEP, 0.995, 1.0, 1.0 + 1e-12, 1.234])
@pytest.mark.parametrize('ground', [True, False])
def test_the_last_step_is_as_long_as_that_of_fly(duration, ground):
    thrown = launches(12, seed=4)
    assert_same_bits(thrown, Setup(disc=FRISBEE, step=STEP), duration=duration, ground=ground)


def test_a_release_on_the_ground_downwards_lands_at_once_and_upwards_does_not():
    thrown = {'height': np.zeros(3), 'pitch': np.array([-20.0, 0.0, 20.0])}
    setup = Setup(disc=FRISBEE, step=STEP)
    assert_same_bits(thrown, setup)
    assert fly_many(thrown, setup).time[0] == 0.0
    assert fly_many(thrown, setup).time[2] > 1.0


def assert_same_bits(thrown, setup, **more):
    landings = fly_many(thrown, setup, **more)
    for i, state in enumerate(landings.states):
        expected = one(thrown, i, setup, **more)
        assert tuple(state.tolist()) == expected.end
        assert (landings.time[i], landings.apex[i]) == (expected.time, expected.apex)
        assert landings.status[i] == (LANDED if expected.landed else FLYING)


def test_seeds_are_those_of_the_gusts():
    thrown = launches(4)
    setups = [Setup(disc=FRISBEE, wind=Wind(turbulence=10.0, seed=s), step=STEP) for s in range(4)]
    landings = fly_many(thrown, setups[0], seeds=[0, 1, 2, 3])
    for i, setup in enumerate(setups):
        assert tuple(landings.states[i].tolist()) == one(thrown, i, setup).end


def test_a_flight_that_outlasts_the_first_gusts_goes_on_in_the_same_ones():
    setup = Setup(disc=FRISBEE, wind=Wind(turbulence=5.0, seed=2), step=STEP)
    thrown = {'height': np.array([0.0, 400.0])}
    landings = fly_many(thrown, setup)
    assert landings.time[1] > 12.0
    for i, height in enumerate(thrown['height']):
        assert tuple(landings.states[i].tolist()) == fly(Launch(height=float(height)), setup).end


@pytest.mark.parametrize('threads', [1, 2, 5])
def test_results_do_not_depend_on_threads_or_neighbours(threads):
    thrown = launches(1000)
    setup = Setup(disc=FRISBEE, step=STEP)
    landings = fly_many(thrown, setup, threads=threads)
    last = fly_many({name: x[700:] for name, x in thrown.items()}, setup, threads=1)
    np.testing.assert_array_equal(landings.states[700:], last.states)


def changed(name: str, value: float) -> Setup:
    """A setup with another value of one constant, made without an ensemble."""
    document = disc_file.disc_document(FRISBEE)
    keys = {
        'mass': ('mass_kg',),
        'inertia_axial': ('inertia_axial_kg_m2',),
        'inertia_diametral': ('inertia_diametral_kg_m2',),
        'C_Lp': ('damping', 'C_Lp'),
        'C_Mq': ('damping', 'C_Mq'),
        'C_Nr': ('damping', 'C_Nr'),
    }
    if name in keys:
        *parents, last = keys[name]
        place = document
        for parent in parents:
            place = place[parent]
        assert last in place
        place[last] = value
        return Setup(disc=disc_file.disc_from_document('changed', document), step=STEP)
    if name == 'air_density':
        return Setup(disc=FRISBEE, air=Air(density=value), step=STEP)
    if name == 'gravity':
        return Setup(disc=FRISBEE, air=Air(gravity=value), step=STEP)
    axis = 'xyz'.index(name[-1])
    mean = [0.0, 0.0, 0.0]
    mean[axis] = value if axis == 0 else -value  # `map` to the paper's axes
    return Setup(disc=FRISBEE, wind=Wind(mean=tuple(mean)), step=STEP)


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('mass', 0.2),
        ('inertia_axial', 2.1e-3),
        ('inertia_diametral', 1.4e-3),
        ('C_Lp', -0.5),
        ('C_Mq', -0.6),
        ('C_Nr', -0.005),
        ('air_density', 1.0),
        ('gravity', 3.7),
        ('wind_x', 3.0),
        ('wind_y', 2.0),
        ('wind_z', -1.0),
    ],
)
def test_a_constant_that_differs_between_flights_acts_as_in_a_setup(name, value):
    setup = Setup(disc=FRISBEE, step=STEP)
    default = ensemble.defaults(setup, Control())[name]
    landings = fly_many({name: [default, value]}, setup)
    plain, other = fly(Launch(), setup).end, fly(Launch(), changed(name, value)).end
    assert tuple(landings.states[0].tolist()) == plain
    assert tuple(landings.states[1].tolist()) == other
    assert other != plain


@pytest.mark.parametrize('disc', ['frisbee', 'frisbee_linear'])
@pytest.mark.parametrize('which', ['lift', 'drag', 'pitching'])
def test_factors_and_offsets_change_the_coefficients(disc, which):
    document = disc_file.disc_document(disc_file.load_disc(disc))
    table = document['aero'] == 'table'
    place = document['table'] if table else document['linear']
    columns = {'lift': ('CL',), 'drag': ('CD',), 'pitching': ('CM',)}[which]
    names = [k for k in place if k.split('_')[0] in columns]
    assert names
    for k in names:
        if table:
            place[k] = [1.1 * x + 0.01 for x in place[k]]
        else:
            place[k] = 1.1 * place[k] + (0.01 if '_0' in k else 0.0)
    expected = fly(
        Launch(), Setup(disc=disc_file.disc_from_document('changed', document), step=STEP)
    )
    setup = Setup(disc=disc_file.load_disc(disc), step=STEP)
    landings = fly_many({f'{which}_factor': 1.1, f'{which}_offset': 0.01}, setup)
    # The products are rounded in another order.
    np.testing.assert_allclose(landings.states[0, :3], expected.end[:3], rtol=0.0, atol=1e-10)
    assert abs(landings.x[0] - fly(Launch(), setup).end.X) > 0.01


def test_a_flight_that_the_step_cannot_follow_is_marked_and_the_others_continue():
    # A strong control moment spins the disc up.
    setup = Setup(disc=FRISBEE, step=STEP)
    thrown = {'control_CN': [0.0, 10.0], 'speed': [15.0, 40.0], 'height': [0.0, 2000.0]}
    landings = fly_many(thrown, setup)
    assert landings.status.tolist() == [LANDED, LOST]
    assert np.isfinite(landings.states).all()


def test_quantities_have_defaults_and_one_flight_needs_no_array():
    landings = fly_many({}, Setup(disc=FRISBEE))
    assert landings.states.shape == (1, 14)
    assert tuple(landings.states[0].tolist()) == fly(Launch(), Setup(disc=FRISBEE)).end


@pytest.mark.parametrize(
    ('thrown', 'says'),
    [
        ({'sped': 3.0}, 'sped'),
        ({'speed': [1.0, np.nan]}, 'speed of flight 1'),
        ({'speed': [1.0, 1e6]}, 'speed of flight 1'),
        ({'speed': [1.0, 2.0], 'spin': [1.0, 2.0, 3.0]}, 'speed'),
        ({'speed': [[1.0]]}, 'speed'),
        ({'height': [0.0, -1.0]}, 'height of flight 1'),
        ({'spin': [0.0, 900.0]}, 'flight 1'),
        ({'mass': 0.0}, 'mass of flight 0'),
        ({'speed': 'fast'}, 'speed'),
        ({'inertia_axial': [2.4e-3, 2.9e-3]}, 'inertia_axial of flight 1'),
    ],
)
def test_bad_input_names_the_flight(thrown, says):
    with pytest.raises(ConfigError, match=says):
        fly_many(thrown, Setup(disc=FRISBEE, step=STEP))


def test_a_step_is_checked_against_each_flight_alone():
    """The rate of damping is proportional to the airspeed: only the fast flight is refused."""
    setup = Setup(disc=FRISBEE, step=0.02)
    thrown = {'C_Lp': [-0.6, -10.0], 'speed': [20.0, 1.0]}
    landings = fly_many(thrown, setup)
    assert landings.status.tolist() == [LANDED, LANDED]
    with pytest.raises(ConfigError, match='flight 1'):
        fly_many({'C_Lp': [-0.6, -10.0], 'speed': [1.0, 20.0]}, setup)


def test_an_interrupt_stops_an_ensemble_soon():
    program = (
        'from disc_sim_ros.physics import disc_file\n'
        'from disc_sim_ros.physics.ensemble import fly_many\n'
        'from disc_sim_ros.physics.flight import Setup\n'
        'setup = Setup(disc=disc_file.load_disc("frisbee"), step=1e-3)\n'
        'fly_many({}, setup)\n'
        'print("ready", flush=True)\n'
        'fly_many({"pitch": [15.0] * 1_000_000}, setup)\n'
    )
    with subprocess.Popen(
        [sys.executable, '-c', program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as flown:
        assert flown.stdout.readline() == 'ready\n'
        time.sleep(0.5)  # during the flights, which take minutes
        flown.send_signal(signal.SIGINT)
        # A chunk takes about 0.1 s of one core; the rest is for a busy machine.
        _, errors = flown.communicate(timeout=60.0)
    assert 'KeyboardInterrupt' in errors


@pytest.mark.parametrize('turbulence', [0.0, 5.0])
def test_after_a_flight_the_next_needs_no_compilation(turbulence):
    setup = Setup(disc=FRISBEE, step=0.02, wind=Wind(turbulence=turbulence))
    fly_many({}, setup, duration=0.1)
    assert ensemble.first_call_note(setup) == ''
