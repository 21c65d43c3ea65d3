"""The compiled loops of an estimator against their definitions."""

import numpy as np
import pytest

from disc_sim_ros.estimation import lift_coordinates, local
from disc_sim_ros.estimation.prediction import lanes
from disc_sim_ros.estimation.prediction.prior import ThrowPrior
from disc_sim_ros.estimation.prediction.throw_fit import Estimate, Model
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.sampled import default_row, fly_sampled

SETUP = Setup(disc=load_disc('frisbee'), model='precession')
MODEL = Model(SETUP, ThrowPrior(), 0.02, 15.0)
STATE = np.array(Launch(speed=16.0, pitch=12.0, roll=-8.0, spin=60.0, height=1.3).state())
NAMES = lift_coordinates.NAMES


def moved(changes: dict[str, float], wind: float = 0.0) -> np.ndarray:
    delta = np.zeros((1, len(NAMES)))
    for name, value in changes.items():
        delta[0, NAMES.index(name)] = value
    rows = default_row(SETUP)[None].copy()
    rows[0, AT['wind_x']] = wind
    out = np.empty((1, STATE_SIZE))
    lanes.move(STATE, default_row(SETUP), delta, rows, MODEL.curve, out)
    return out[0]


def acceleration(state: np.ndarray, wind: float = 0.0) -> np.ndarray:
    """Return the acceleration by a difference over 1 us."""
    row = default_row(SETUP)[None].copy()
    row[0, AT['wind_x']] = wind
    h = 1e-6
    flown = fly_sampled(state[None], row, SETUP, np.array([0.0, h]), step=h, duration=0.0)
    return np.diff(flown.states[0, :, 3:6], axis=0)[0] / h


def test_no_move_changes_nothing():
    assert moved({}) == pytest.approx(STATE, abs=1e-12)


def test_lift_coordinate_is_an_acceleration_across_the_flow():
    """Its drag changes too, along the flow, which the coordinate leaves alone."""
    flow = STATE[3:6] / np.linalg.norm(STATE[3:6])
    change = acceleration(moved({'lift': 1.0})) - acceleration(STATE)
    across = change - (change @ flow) * flow
    assert np.linalg.norm(across) == pytest.approx(1.0, rel=1e-4)


def test_head_wind_turns_the_disc_so_that_the_lift_stays():
    wind = -3.0
    flow = STATE[3:6] - np.array([wind, 0.0, 0.0])
    turned = moved({}, wind)
    lifts = []
    for state, w, v in ((STATE, 0.0, STATE[3:6]), (turned, wind, flow)):
        a = acceleration(state, w) - np.array([0.0, 0.0, 9.81])
        unit = v / np.linalg.norm(v)
        lifts.append(np.linalg.norm(a - (a @ unit) * unit))
    assert lifts[1] == pytest.approx(lifts[0], rel=1e-4)
    assert local.disc_axis(turned) != pytest.approx(local.disc_axis(STATE), abs=0.01)


def test_normal_equations_are_those_of_least_squares():
    rng = np.random.default_rng(0)
    free, k, c = 4, 5, 3
    sights = rng.normal(size=(2, k, lanes.SEEN, lanes.WIDTH))
    base, prior = rng.normal(size=(k, lanes.SEEN)), rng.normal(size=(1 + 2 * free, c))
    roots = rng.uniform(size=(k, lanes.SEEN)) * (rng.random((k, lanes.SEEN)) < 0.7)
    out = lanes.equations(3 + free)
    lanes.normal_equations(sights, base, roots, prior, free, np.empty(3 + free), out)
    every = np.moveaxis(sights, 3, 1).reshape(-1, k, lanes.SEEN)
    slopes = np.zeros((k, lanes.SEEN, 3 + free))
    slopes[:, :3, :3] = np.eye(3)
    slopes[:, :, 3:] = np.moveaxis(0.5 * (every[1:5] - every[5:9]), 0, -1)
    design = np.concatenate([(slopes * roots[:, :, None]).reshape(-1, 7), np.zeros((c, 7))])
    design[-c:, 3:] = 0.5 * (prior[1:5] - prior[5:9]).T
    residuals = np.concatenate([(base * roots).ravel(), prior[0]])
    assert out.normal == pytest.approx(design.T @ design, abs=1e-12)
    assert out.gradient == pytest.approx(design.T @ residuals, abs=1e-12)


def test_cost_of_an_outlier_is_bounded():
    """Squared residuals beyond the gate g count as 2 g - g^2 / x: at most twice the gate."""
    sights = np.zeros((1, 2, lanes.SEEN, lanes.WIDTH))
    measured = np.zeros((2, lanes.SEEN))
    measured[1, 0] = 1e6
    per_sigma = np.zeros((2, lanes.SEEN))
    per_sigma[:, :3] = 1.0
    out = np.empty(1)
    lanes.costs(sights, measured, per_sigma, np.array([[2.0]]), 14.0, out)
    assert out[0] == pytest.approx(0.5 * (28.0 + 4.0), rel=1e-9)


def test_manner_of_a_level_throw():
    state = np.array(Launch(speed=15.0, pitch=0.0, spin=60.0).state())
    out = np.empty((1, lanes.MANNER))
    lanes.manners(state[None], out)
    assert out[0] == pytest.approx([15.0, 0.0, 0.0, 0.0, 0.0, 0.0, 60.0], abs=1e-12)


def test_moved_throws_keep_the_estimate():
    estimate = Estimate(STATE, MODEL.means)
    throws = MODEL.moved(estimate, np.zeros((2, MODEL.unknowns)))
    assert throws.states == pytest.approx(np.tile(STATE, (2, 1)), abs=1e-12)
