"""Many flights that step together: each has the bits of a `FlightSimulator` of its own."""

from dataclasses import replace

import numpy as np
import pytest

from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.batch_simulator import BatchSimulator
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import MODELS, Setup
from disc_sim_ros.physics.kernels import jit, step_batch
from disc_sim_ros.physics.kernels.equations import Control, State
from disc_sim_ros.physics.kernels.simd import WIDTH
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.quantities import LAUNCH
from sample_discs import FRISBEE

PROFILE = Wind(roughness_length=0.03, reference_height=2.0)


def launches(rng: np.random.Generator, n: int) -> np.ndarray:
    """Throws of all kinds, also ones that land within few steps; columns as in Launch."""
    rows = np.tile([quantity.default for quantity in LAUNCH.values()], (n, 1))
    ranges = [(5, 22), (-10, 25), (-40, 40), (-60, 60), (-8, 8), (-8, 8), (-40, 60)]
    ranges += [(-2, 2), (-2, 2), (0.0, 2.0)]
    for j, (low, high) in enumerate(ranges):
        rows[:, j] = rng.uniform(low, high, n)
    return rows


def fly_alone(
    setup: Setup, launch: np.ndarray, wind: np.ndarray, controls: np.ndarray, steps: int
) -> tuple[np.ndarray, FlightSimulator]:
    """Return the states after each environment step until the landing, and the simulator."""
    mean = tuple(frames.paper_from_map(wind).tolist())
    own = replace(setup, wind=replace(setup.wind, mean=mean))
    sim = FlightSimulator(own, Launch(**dict(zip(LAUNCH, launch.tolist(), strict=True))).state())
    states = [sim.state]
    for control in controls:
        sim.control = Control(*control.tolist())
        sim.advance(steps)
        if sim.landed:
            break
        states.append(sim.state)
    return np.array(states), sim


@pytest.mark.parametrize(
    ('model', 'disc', 'wind'),
    [*((model, 'frisbee', Wind()) for model in MODELS), ('exact', 'ultrastar', PROFILE)],
)
def test_each_flight_has_the_bits_of_a_simulator_of_its_own(model, disc, wind):
    n, steps, most = 2 * WIDTH + 3, 5, 120
    setup = Setup(disc=disc_file.load_disc(disc), model=model, wind=wind, step=0.004)
    rng = np.random.default_rng(7)
    throws, winds = launches(rng, n), rng.uniform(-4, 4, (n, 3))
    controls = rng.uniform(-0.03, 0.03, (most, n, 3))
    batch = BatchSimulator(setup, n)
    batch.release(np.arange(n), throws, winds)
    history = [batch.columns.T.copy()]
    for control in controls:
        batch.set_control(control)
        batch.advance(steps)
        history.append(batch.columns.T.copy())
    assert batch.landed.sum() > n // 2
    for i in range(n):
        states, sim = fly_alone(setup, throws[i], winds[i], controls[:, i], steps)
        assert np.array_equal(np.array([h[i] for h in history[: len(states)]]), states)
        assert batch.landed[i] == sim.landed
        if sim.landed:
            assert tuple(batch.end_columns[:, i]) == sim.touch
            assert batch.end_times[i] == sim.touch_time


def test_a_flight_is_released_again_among_others():
    """Lanes keep their own time: the second flight of one lane has the bits of a first."""
    n = WIDTH + 1
    setup = Setup(disc=FRISBEE, step=0.01)
    rng = np.random.default_rng(1)
    throws, calm = launches(rng, n), np.zeros((n, 3))
    batch = BatchSimulator(setup, n)
    batch.release(np.arange(n), throws, calm)
    batch.set_control(np.full((n, 3), 0.02))
    batch.advance(7)
    others = np.delete(batch.columns, 3, axis=1)
    batch.release([3], throws[:1], [[1.0, -2.0, 0.0]])
    assert np.array_equal(np.delete(batch.columns, 3, axis=1), others)
    batch.advance(9)  # with control inputs 0 in lane 3
    states, _ = fly_alone(setup, throws[0], np.array([1.0, -2.0, 0.0]), np.zeros((1, 3)), 9)
    assert np.array_equal(batch.columns[:, 3], states[-1])
    assert batch.steps[3] == 9
    assert (batch.steps[batch.flying] == np.where(np.arange(n) == 3, 9, 16)[batch.flying]).all()
    assert batch.flying.sum() > 1


def test_threads_and_the_order_in_the_batch_do_not_matter():
    n = 64 * WIDTH * 2
    setup = Setup(disc=FRISBEE, step=0.01)
    rng = np.random.default_rng(2)
    throws, winds = launches(rng, n), rng.uniform(-4, 4, (n, 3))
    control = rng.uniform(-0.03, 0.03, (n, 3))
    ends = []
    for threads in (1, 2):
        batch = BatchSimulator(setup, n, threads=threads)
        batch.release(np.arange(n)[::-1], throws, winds)
        batch.set_control(control)
        batch.advance(400)
        ends.append((batch.columns, batch.end_columns, batch.end_times.copy()))
        batch.close()
    for one, two in zip(*ends, strict=True):
        assert np.array_equal(one, two)


@pytest.mark.skipif(not jit.COMPILED, reason='plain Python has one loop')
def test_lanes_give_the_bits_of_single_flights(monkeypatch):
    """The loop that plain Python runs, compiled here: a third way to the same numbers."""
    n = 2 * WIDTH
    setup = Setup(disc=FRISBEE, step=0.01, ground_contact='rim')
    rng = np.random.default_rng(3)
    throws, winds = launches(rng, n), rng.uniform(-4, 4, (n, 3))
    ends = []
    for advance in (step_batch.advance_batch, step_batch.advance_singly):
        monkeypatch.setattr(step_batch, 'advance_batch', advance)
        batch = BatchSimulator(setup, n)
        batch.release(np.arange(n), throws, winds)
        for _ in range(60):
            batch.advance(10)
        assert batch.landed.sum() > n // 2
        ends.append((batch.columns, batch.end_columns, batch.end_times.copy(), batch.steps.copy()))
    for one, two in zip(*ends, strict=True):
        assert np.array_equal(one, two)


def test_a_flight_that_the_step_cannot_follow_is_lost_alone():
    setup = Setup(disc=FRISBEE, step=0.02)
    n = WIDTH
    launch = np.array([quantity.default for quantity in LAUNCH.values()])
    batch = BatchSimulator(setup, n, ground=False)
    batch.release(np.arange(n), np.tile(launch, (n, 1)), np.zeros((n, 3)))
    control = np.zeros((n, 3))
    control[2] = 0.0, 0.0, 10.0  # spins it up
    batch.set_control(control)
    batch.advance(2000)
    assert batch.lost.tolist() == [i == 2 for i in range(n)]
    assert np.isfinite(batch.columns).all()
    sim = FlightSimulator(setup, Launch().state(), ground=False)
    sim.control = Control(C_N=10.0)
    with pytest.raises(IntegrationError):
        sim.advance(2000)
    assert tuple(batch.columns[:, 2]) == sim.state


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        (lambda b: b.set_control(np.full((4, 3), np.nan)), 'control_CL: nan'),
        (
            lambda b: b.set_control(np.array([[0, 0, 0], [0, -11, 0]] * 2, float)),
            'control_CM: -11',
        ),
        (lambda b: b.set_control(np.zeros((3, 3))), r'control: \(3, 3\)'),
        (lambda b: b.set_wind(np.full((4, 3), 101.0)), 'wind_x: 101'),
        (lambda b: b.release([4], [[15.0] + [0.0] * 9], [[0.0] * 3]), 'below 4'),
        (lambda b: b.release([0], [[np.inf] + [0.0] * 9], [[0.0] * 3]), 'speed: inf'),
        (lambda b: b.release([0], [[15.0] + [0.0] * 8 + [-1.0]], [[0.0] * 3]), 'height: -1'),
        (
            lambda b: b.release([0], [[15.0] + [0.0] * 5 + [900.0] + [0.0] * 3], [[0.0] * 3]),
            'step',
        ),
    ],
)
def test_bad_values_are_refused_in_one_line(change, message):
    batch = BatchSimulator(Setup(disc=FRISBEE, step=0.01), 4)
    with pytest.raises(ConfigError, match=message):
        change(batch)


def test_turbulence_is_refused():
    with pytest.raises(ConfigError, match='turbulence'):
        BatchSimulator(Setup(disc=FRISBEE, wind=Wind(turbulence=8.0)), 4)


@pytest.mark.parametrize('count', [1, WIDTH, 3 * WIDTH])
def test_states_are_copies_that_later_steps_leave_alone(count):
    batch = BatchSimulator(Setup(disc=FRISBEE, step=0.01), count)
    rows = launches(np.random.default_rng(4), count)
    batch.release(np.arange(count), rows, np.zeros((count, 3)))
    before = batch.columns
    kept = before.copy()
    batch.advance(3)
    assert np.array_equal(before, kept)
    assert not np.array_equal(batch.columns, kept)


@pytest.mark.parametrize('model', ['exact', 'precession'])
def test_placed_states_fly_on_as_a_simulator_does(model):
    setup, n = Setup(disc=FRISBEE, model=model, step=0.01), WIDTH + 2
    batch = BatchSimulator(setup, n)
    batch.release(np.arange(n), launches(np.random.default_rng(5), n), np.zeros((n, 3)))
    batch.advance(20)
    states, flying = batch.columns, batch.flying
    batch.place(np.arange(n), states, np.zeros((n, 3)))
    batch.advance(30)
    for i in np.flatnonzero(flying):
        sim = FlightSimulator(setup, State(*states[:, i].tolist()))
        sim.advance(30)
        end = sim.touch if sim.landed else sim.state
        assert tuple(batch.present([i])[:, 0]) == end
    with pytest.raises(ConfigError, match=r'states: .* finite'):
        batch.place([0], np.full((14, 1), np.nan), np.zeros((1, 3)))
