"""The Gymnasium environments: the API, the seeds, and the flights of the simulator to the bit."""

from dataclasses import replace
import math
import re
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip('gymnasium')

import gymnasium
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from disc_sim_ros.envs import steering, throw
from disc_sim_ros.envs.steer import SteerVectorEnv
from disc_sim_ros.envs.throw import ThrowVectorEnv
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from sample_discs import FRISBEE

IDS = ('disc_sim/Throw-v0', 'disc_sim/Steer-v0')
LAUNCH = {'speed': 15.2, 'pitch': 14.0, 'roll': -3.0, 'yaw': 4.0, 'spin': 33.0, 'height': 1.2}
WIND = (1.5, -2.5, 0.0)
TARGET = (24.0, 1.0)
FIXED = {'launch': LAUNCH, 'wind': WIND, 'target': TARGET}


def actions(count: int, n: int, size: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, n, size)).astype(np.float32)


@pytest.mark.parametrize('name', IDS)
def test_gymnasium_finds_no_fault(name):
    """A warning of the checker is an error here."""
    env = gymnasium.make(name)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize('name', IDS)
def test_make_vec_gives_the_native_vector(name):
    vector = gymnasium.make_vec(name, num_envs=3)
    assert isinstance(vector.unwrapped, SteerVectorEnv | ThrowVectorEnv)
    assert vector.metadata['autoreset_mode'] is AutoresetMode.SAME_STEP
    observed, infos = vector.reset(seed=1)
    assert observed in vector.observation_space
    assert infos['target'].shape == (3, 2)
    vector.close()


@pytest.mark.parametrize(('kind', 'size'), [(SteerVectorEnv, 3), (ThrowVectorEnv, 5)])
def test_seeds_repeat_and_differ(kind, size):
    def run(seed):
        vector = kind(6)
        rows = [vector.reset(seed=seed)[0]]
        for action in actions(150, 6, size):
            observed, rewards, *_ = vector.step(action)
            rows += [observed, rewards]
        return np.concatenate([x.ravel() for x in rows])

    first = run(3)
    assert np.array_equal(first, run(3))
    assert not np.array_equal(first, run(4))


def test_a_steered_flight_has_the_bits_of_the_simulator():
    env = gymnasium.make('disc_sim/Steer-v0', disable_env_checker=True)
    observed, info = env.reset(options=FIXED)
    setup = Setup(disc=FRISBEE, step=steering.STEP, wind=Wind(mean=(1.5, 2.5, 0.0)))
    sim = FlightSimulator(setup, Launch(**LAUNCH).state())
    before = steering.velocity(tuple(np.array([x]) for x in frames.odometry(sim.state)))
    targets = np.array(TARGET)[:, np.newaxis]
    ended, total, path = False, 0.0, []
    for action in actions(400, 1, 3)[:, 0]:
        numbers = tuple(np.array([x]) for x in frames.odometry(sim.state))
        expected, before = steering.observations(numbers, before, targets)
        assert np.array_equal(observed, expected[0])
        path.append(tuple(sim.state[:3]))
        observed, reward, ended, truncated, info = env.step(action)
        total += reward
        sim.take(Control(*steering.controls(action).tolist()))
        sim.advance(steering.STEPS)
        assert ended == sim.landed
        assert not truncated
        if ended:
            break
    assert len(set(path)) > 40
    x, y = sim.touch.X, frames.flip(sim.touch.Y)
    assert tuple(info['landing']) == (x, y)
    assert info['flight_time'] == sim.touch_time
    assert tuple(info['wind']) == WIND
    assert total == -info['miss'] == pytest.approx(-math.dist((x, y), TARGET), rel=1e-15)


def test_a_throw_lands_where_fly_computes():
    env = gymnasium.make('disc_sim/Throw-v0', disable_env_checker=True)
    observed, _ = env.reset(options={'wind': WIND, 'target': TARGET})
    assert observed.tolist() == [*TARGET, *WIND[:2]]
    shares = np.array([0.25, -0.5, 0.125, -0.25, 0.5])
    _, reward, ended, truncated, info = env.step(shares.astype(np.float32))
    values = {
        c.name: c.lowest + (0.5 + 0.5 * share) * (c.highest - c.lowest)
        for c, share in zip(throw.LAUNCHES, shares.tolist(), strict=True)
    }
    setup = Setup(disc=FRISBEE, step=throw.STEP, wind=Wind(mean=(1.5, 2.5, 0.0)))
    flight = fly(Launch(**values, height=throw.HEIGHT), setup)
    assert (ended, truncated) == (True, False)
    assert info['landing'].tolist() == flight.position[:2].tolist()
    assert reward == -info['miss']
    assert info['flight_time'] == flight.time


def episodes(mode: AutoresetMode, n: int = 5) -> dict[int, list[float]]:
    """Return misses of each disc; in a fixed throw, target and wind all depends on actions."""
    vector = SteerVectorEnv(n, autoreset_mode=mode)
    vector.reset(seed=0, options=FIXED)
    plan, age = actions(200, n, 3), np.zeros(n, dtype=int)
    misses = {i: [] for i in range(n)}
    waiting = np.zeros(n, dtype=bool)
    while min(map(len, misses.values())) < 2:
        act = plan[age, np.arange(n)]
        _, rewards, terminated, _, infos = vector.step(act)
        info = infos.get('final_info', infos)
        age += 1
        for i in np.flatnonzero(terminated):
            misses[i].append(info['miss'][i])
            assert rewards[i] == -info['miss'][i]
        assert (rewards[~terminated] == 0.0).all()
        if mode is AutoresetMode.NEXT_STEP:
            age[waiting] = 0  # that step only threw the disc again
            waiting = terminated
        else:
            age[terminated] = 0
        if mode is AutoresetMode.DISABLED and terminated.any():
            vector.reset(options=FIXED | {'reset_mask': terminated})
    return {i: misses[:2] for i, misses in misses.items()}


def test_every_way_of_reset_gives_the_same_episodes():
    same = episodes(AutoresetMode.SAME_STEP)
    assert same == episodes(AutoresetMode.NEXT_STEP)
    assert same == episodes(AutoresetMode.DISABLED)
    assert all(first == second for first, second in same.values())
    assert len({misses[0] for misses in same.values()}) == len(same)


def test_the_last_observation_and_that_of_the_next_throw_are_told_apart():
    vector = SteerVectorEnv(4)
    vector.reset(seed=0)
    for action in actions(300, 4, 3):
        observed, _, terminated, _, infos = vector.step(action)
        if terminated.any():
            break
    i = int(np.argmax(terminated))
    assert infos['_final_obs'].tolist() == terminated.tolist()
    assert infos['final_obs'][i][2] == pytest.approx(0.0, abs=1e-6)  # it lies on the ground
    low, high = 1.0, 1.5  # m, heights of the release
    assert low <= -observed[i][2] <= high
    assert (observed[i][6:9] == 0.0).all()
    assert all(x is None for x in infos['final_obs'][~terminated])


def test_observations_stay_within_their_bounds():
    vector = SteerVectorEnv(64, largest_wind=20.0)
    observed, _ = vector.reset(seed=5)
    rng = np.random.default_rng(5)
    for _ in range(120):
        observed, *_ = vector.step(rng.choice([-9.0, 9.0], (64, 3)))  # beyond the bounds, too
        assert observed in vector.observation_space


def test_a_partial_reset_leaves_the_others():
    vector = SteerVectorEnv(3, autoreset_mode=AutoresetMode.DISABLED)
    vector.reset(seed=0)
    before, *_ = vector.step(actions(1, 3, 3)[0])
    after, _ = vector.reset(options={'reset_mask': np.array([False, True, False])})
    assert np.array_equal(after[[0, 2]], before[[0, 2]])
    assert not np.array_equal(after[1], before[1])


def test_a_flight_that_stays_up_is_truncated():
    """Thrown from 1000 m, the disc is in the air after the longest episode."""
    env = gymnasium.make('disc_sim/Steer-v0', disable_env_checker=True)
    env.reset(options={'launch': LAUNCH | {'height': 1000.0}})
    truncated, steps = False, 0
    while not truncated:
        _, reward, terminated, truncated, info = env.step(np.zeros(3, np.float32))
        assert not terminated
        steps += 1
    assert steps == 400
    assert (info['landed'], info['flight_time']) == (False, 20.0)
    assert reward == -info['miss']


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        (lambda v: v.step(np.full((2, 3), np.nan)), 'actions: .* finite'),
        (lambda v: v.step(np.zeros((3, 3))), r'actions: \(3, 3\) .* \(2, 3\)'),
        (lambda v: v.reset(options={'wnd': WIND}), 'options: .wnd'),
        (lambda v: v.reset(options={'wind': (1.0, 2.0)}), 'wind: .* 3 numbers'),
        (lambda v: v.reset(options={'wind': (math.inf, 0.0, 0.0)}), 'wind_x: inf'),
        (lambda v: v.reset(options={'target': (math.nan, 0.0)}), 'target: nan'),
        (lambda v: v.reset(options={'launch': {'speed': -1.0}}), 'speed: -1'),
        (lambda v: v.reset(options={'launch': {'sped': 1.0}}), 'launch: .sped'),
        (lambda v: v.reset(options={'reset_mask': np.zeros(2)}), 'reset_mask'),
        (lambda _: SteerVectorEnv(2, largest_wind=21.0), 'largest_wind: 21'),
        (lambda _: SteerVectorEnv(2, disc='frisby'), 'disc: .frisby'),
        (lambda _: SteerVectorEnv(0), 'count: 0'),
    ],
)
def test_bad_values_are_refused_in_one_line(change, message):
    vector = SteerVectorEnv(2)
    vector.reset(seed=0)
    with pytest.raises(ConfigError, match=message) as refusal:
        change(vector)
    assert '\n' not in str(refusal.value)


def test_other_discs_fly():
    calm = {'wind': (0.0, 0.0, 0.0), 'target': TARGET, 'launch': LAUNCH}
    landings = {}
    for disc in ('frisbee', 'ultrastar'):
        env = gymnasium.make('disc_sim/Steer-v0', disc=disc, disable_env_checker=True)
        env.reset(options=calm)
        ended = False
        while not ended:
            *_, ended, _, info = env.step(np.zeros(3, np.float32))
        setup = replace(Setup(disc=env.unwrapped.vector.simulator.setup.disc), step=steering.STEP)
        assert info['landing'].tolist() == fly(Launch(**LAUNCH), setup).position[:2].tolist()
        landings[disc] = info['landing'][0]
    assert landings['frisbee'] != landings['ultrastar']


@pytest.mark.parametrize(
    ('statement', 'imported'),
    [
        ('import disc_sim_ros; disc_sim_ros.BatchSimulator', False),
        ('import disc_sim_ros.envs', True),
    ],
)
def test_only_the_environments_import_gymnasium(statement, imported):
    code = f'import sys; {statement}; print("gymnasium" in sys.modules)'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(imported)


def test_without_gymnasium_the_policy_still_works():
    code = (
        'import sys; sys.modules["gymnasium"] = None\n'
        'from disc_sim_ros.envs import policy, steering; print(len(steering.OBSERVATION))'
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert re.fullmatch(r'16\n', done.stdout)
