"""Throws drawn from a prior, flown by the exact model, and measured with noise."""

from dataclasses import dataclass
import math

import numpy as np

from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.prediction.predictor import Measurement, up_axis
from disc_sim_ros.estimation.prediction.prior import ThrowPrior
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import map_from_paper
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.sampled import default_row, fly_sampled

FINE = 2e-3  # s; within 1 mm of a far finer flight at these spins


@dataclass(frozen=True)
class Throw:
    """A throw with its landing (x, y and time) and its measurements."""

    landing: np.ndarray
    time: np.ndarray
    position: np.ndarray  # in map, with noise
    axis: np.ndarray
    state: np.ndarray  # at the release, paper's axes
    row: np.ndarray  # constants of the flight
    exact: np.ndarray  # positions without noise, in map
    setup: Setup  # in which it flew

    def measurements(self, *, axis: bool = False) -> list[Measurement]:
        return [
            Measurement(float(t), tuple(x), tuple(a) if axis else None)
            for t, x, a in zip(self.time, self.position, self.axis, strict=True)
        ]


def throw(
    setup: Setup,
    prior: ThrowPrior,
    seed: int,
    *,
    rate: float = 60.0,
    sigma: float = 0.02,
    axis_sigma: float = math.radians(2.0),
    least: float = 1.7,
) -> Throw:
    """Return a throw that flies for at least `least` seconds."""
    rng = np.random.default_rng(seed)
    while True:
        state, row = _release(setup, prior, rng)
        times = np.arange(0.0, 7.0, 1.0 / rate)
        flown = fly_sampled(state[None], row[None], setup, times, step=FINE, duration=15.0)
        if least < flown.time[0] < times[-1]:
            break
    position = map_from_paper(flown.states[0, :, :3]) + rng.normal(0.0, sigma, (len(times), 3))
    axis = up_axis(flown.states[0]) + rng.normal(0.0, axis_sigma, (len(times), 3))
    x, y, _ = map_from_paper(flown.ends[0, :3])
    aloft = times < flown.time[0]
    return Throw(
        np.array([x, y, flown.time[0]]),
        times[aloft],
        position[aloft],
        axis[aloft],
        state,
        row,
        map_from_paper(flown.states[0, aloft, :3]),
        setup,
    )


def _release(
    setup: Setup, prior: ThrowPrior, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    def drawn(g):
        return rng.normal(g.mean, g.sigma)

    speed, climb, nose, bank = map(drawn, (prior.speed, prior.climb, prior.nose, prior.bank))
    heading = rng.uniform(-math.pi, math.pi)
    c, s = math.cos(heading), math.sin(heading)
    forward = np.array([math.cos(climb) * c, math.cos(climb) * s, -math.sin(climb)])
    right = np.array([-s, c, 0.0])
    down = np.cross(forward, right) * math.cos(nose) * math.cos(bank)
    down = down + forward * math.sin(nose) - right * math.sin(bank)
    rates = [drawn(prior.rate), drawn(prior.rate), drawn(prior.spin)]
    state = [0.0, 0.0, -1.3, *(speed * forward), *local.attitude(down), *rates, 0.0]
    row = default_row(setup)
    for name, g in prior.every_constant.items():
        row[AT[name]] = drawn(g)
    return np.array(state), row
