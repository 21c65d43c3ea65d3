"""How far predicted landings are from the true ones, beside the Cramer-Rao bound and two peers.

    .venv/bin/python benchmarks/predictor.py --throws 40
    .venv/bin/python benchmarks/predictor.py --throws 400 --cell default --cell '5 % outliers'

Each cell is a set of seeded throws, drawn from the prior that the predictor is given, flown by the
exact model, and measured, 60 times a second if its name says nothing else, with noise: positions
to 2 cm and, where the cell has attitude, the disc's axis to 2 degrees. The bound is that of the
exact model with the same prior, linear at the true throw. The own bound is that of the model that
the predictor flies, if throws were so: it has no nutation, from which the exact one learns the
spin. `in` is the share of the landings inside the predictor's 90 % ellipse.
A throw counts at a time of watching while it is in the air. Every measurement is an update, as in
`predictor_node`, with the ellipse 20 times a second.
"""

import argparse
from dataclasses import dataclass, replace
import math
from pathlib import Path
import sys
import time

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.prediction.predictor import STEP, Predictor, PredictorConfig
from disc_sim_ros.estimation.prediction.prior import Gaussian, ThrowPrior, disc_offsets, disc_shape
from disc_sim_ros.estimation.prediction.throw_fit import (
    POSITION,
    Estimate,
    Measurements,
    Model,
    linearised,
)
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import SLOWING, Setup
from disc_sim_ros.physics.frames import paper_from_map
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.sampled import fly_sampled

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from estimation.synthetic_throws import FINE, Throw, throw

PERIOD = 0.05 - 1e-6  # s between two ellipses
MARKS = (0.5, 1.0, 1.5)  # s of watching
SIGMA, AXIS_SIGMA = 0.02, math.radians(2.0)
INSIDE = 4.605  # of 90 %
G = 9.81
JERK = 20.0  # m/s^3, of the Kalman filter's acceleration
KNOWN = Gaussian(0.0, 0.0)


@dataclass(frozen=True)
class Cell:
    """A set of throws, and what the predictor is told of them.

    Attributes:
        flown: The disc.
        assumed: The disc of the predictor.
        uncertainty: Its `disc_uncertainty`.
        wind_known: The wind is told.
        outliers: Share of the positions that are wrong by 5 m in each coordinate.
        rate: Measurements a second [Hz].
        late: Time after the release at which the first measurement is made [s].
        forehand: They spin the other way round, which the predictor is not told.
    """

    flown: str = 'ultrastar'
    assumed: str = 'ultrastar'
    uncertainty: float = 1.0
    wind_known: bool = False
    outliers: float = 0.0
    rate: float = 60.0
    late: float = 0.0
    forehand: bool = False


CELLS = {
    'default': Cell(),
    'disc known': Cell(uncertainty=0.0),
    'frisbee': Cell('frisbee', 'frisbee'),
    'frisbee known': Cell('frisbee', 'frisbee', uncertainty=0.0),
    'frisbee taken for ultrastar': Cell('frisbee', 'ultrastar', uncertainty=2.0),
    'ultrastar taken for frisbee': Cell('ultrastar', 'frisbee', uncertainty=2.0),
    '5 % outliers': Cell(outliers=0.05),
    '20 % outliers': Cell(outliers=0.2),
    'wind known': Cell(wind_known=True),
    '30 Hz': Cell(rate=30.0),
    '120 Hz': Cell(rate=120.0),
    '240 Hz': Cell(rate=240.0),
    'first seen after 0.3 s': Cell(late=0.3),
    'forehand': Cell(forehand=True),
}


def main() -> int:
    """Print a row of each cell, kind of measurement and time of watching."""
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument('--throws', type=int, default=40)
    p.add_argument('--first', type=int, default=0, help='seed of the first throw')
    p.add_argument('--cell', action='append', choices=tuple(CELLS), help='default: all')
    p.add_argument('--kind', default='both', choices=['both', 'position', 'attitude'])
    p.add_argument('--whole', action='store_true', help='time updates up to the landing')
    o = p.parse_args()
    print(
        '| cell | measured | watched s | throws | bound m | own bound m | ours m | ratio | in % |'
        ' parabola m | Kalman m |\n|---|---|---|---|---|---|---|---|---|---|---|'
    )
    times: list[list[float]] = [[], []]
    for name in o.cell or CELLS:
        for kind in ('position', 'attitude') if o.kind == 'both' else [o.kind]:
            rows(
                name, kind == 'attitude', range(o.first, o.first + o.throws), times, whole=o.whole
            )
    for what, values in zip(('landing', 'landing and ellipse'), times, strict=True):
        ms = 1e3 * np.array(values)
        print(f'{what}: {np.median(ms):.1f} ms, p99 {np.quantile(ms, 0.99):.1f} ms of CPU')
    return 0


def rows(
    name: str,
    attitude: bool,  # noqa: FBT001
    seeds: range,
    times: list[list[float]],
    *,
    whole: bool,
) -> None:
    """Print the rows of a cell."""
    cell = CELLS[name]
    base = ThrowPrior()
    if cell.wind_known:
        base = replace(base, wind_x=KNOWN, wind_y=KNOWN)
    offsets = disc_offsets(load_disc(cell.assumed), cell.uncertainty)
    prior = replace(base, offsets=offsets, shape=disc_shape(cell.uncertainty))
    drawn = prior if cell.flown == cell.assumed else base
    if cell.forehand:
        drawn = drawn.with_opposite_spin()
    setup = Setup(disc=load_disc(cell.flown))
    config = PredictorConfig(setup=Setup(disc=load_disc(cell.assumed)), prior=prior)
    exact = Model(setup, drawn, 1.0 / 120.0, 15.0)
    own = Model(replace(setup, model=SLOWING), drawn, STEP, 15.0)
    results_of: dict[float, list[tuple[float, ...]]] = {mark: [] for mark in MARKS}
    for seed in seeds:
        t = throw(
            setup, drawn, seed, rate=cell.rate, sigma=SIGMA, axis_sigma=AXIS_SIGMA, least=0.9
        )
        t = seen_from(t, cell.late)
        spoiled = with_outliers(t, cell.outliers, seed)
        follow(t, spoiled, attitude, config, (exact, own), seed, results_of, times, whole=whole)
    for mark, results in results_of.items():
        miss, inside, bound, own, parabola, kalman = np.array(results).T
        middle = [float(np.median(x)) for x in (bound, miss)]
        print(
            f'| {name} | {"attitude" if attitude else "position"} | {mark} | {len(results)} | '
            f'{middle[0]:.2f} | {np.median(own):.2f} | {middle[1]:.2f} | '
            f'{middle[1] / middle[0]:.2f} | '
            f'{100 * np.mean(inside):.0f} | {np.median(parabola):.1f} | {np.median(kalman):.1f} |',
            flush=True,
        )


def seen_from(t: Throw, late: float) -> Throw:
    """Return a throw whose first measurement is made some time after the release [s].

    Its time, state and bound begin there. The prior of the release is then that of a disc in
    flight, which the predictor does not know.
    """
    if late <= 0.0:
        return t
    k = int(np.searchsorted(t.time, late))
    start = t.time[k]
    flown = fly_sampled(
        t.state[None], t.row[None], t.setup, t.time[k : k + 1], step=FINE, duration=0.0
    )
    return replace(
        t,
        landing=t.landing - np.array([0.0, 0.0, start]),
        time=t.time[k:] - start,
        position=t.position[k:],
        axis=t.axis[k:],
        state=flown.states[0, 0],
        exact=t.exact[k:],
    )


def with_outliers(t: Throw, share: float, seed: int) -> Throw:
    """Return a throw, a share of whose positions is wrong by 5 m."""
    rng = np.random.default_rng([seed, 1])
    position = t.position.copy()
    bad = rng.random(len(position)) < share
    position[bad] += rng.normal(0.0, 5.0, (int(bad.sum()), 3))
    return replace(t, position=position)


def follow(
    clean: Throw,
    t: Throw,
    attitude: bool,  # noqa: FBT001
    config: PredictorConfig,
    models: tuple[Model, Model],
    seed: int,
    results_of: dict[float, list[tuple[float, ...]]],
    times: list[list[float]],
    *,
    whole: bool,
) -> None:
    """Follow one throw, and note its misses."""
    predictor = Predictor(config)
    prediction = None
    of_ellipse = -math.inf
    rate = 1.0 / float(t.time[1] - t.time[0])
    for k, m in enumerate(t.measurements(axis=attitude)):
        if m.time > MARKS[-1] + 0.5 / rate and not whole:
            break
        mark = next((x for x in MARKS if abs(m.time - x) < 0.4 / rate), None)
        predictor.add(m)
        ellipse = mark is not None or prediction is None or m.time > of_ellipse + PERIOD
        begin = time.process_time()
        new = predictor.update(ellipse=ellipse)
        if new is not None:
            times[ellipse].append(time.process_time() - begin)
            prediction = new
            of_ellipse = m.time if ellipse else of_ellipse
        if mark is None or prediction is None:
            continue
        off = prediction.landing - t.landing[:2]
        inside = off @ np.linalg.solve(prediction.covariance[:2, :2], off) < INSIDE
        data = measured(clean, attitude, k + 1)
        known = t.time[: k + 1]
        results_of[mark].append(
            (
                math.hypot(*off),
                float(inside),
                *(bound(model, clean, data, seed) for model in models),
                miss_of(parabola(known, t.position[: k + 1]), t),
                miss_of(kalman(known, t.position[: k + 1]), t),
            )
        )


def measured(t: Throw, attitude: bool, k: int) -> Measurements:  # noqa: FBT001
    """Return the first measurements in the paper's axes."""
    axis = -paper_from_map(t.axis[:k]) if attitude else np.full((k, 3), np.nan)
    return Measurements(
        t.time[:k],
        paper_from_map(t.position[:k]),
        np.full(k, SIGMA),
        axis,
        np.full(k, AXIS_SIGMA),
    )


def bound(model: Model, t: Throw, data: Measurements, seed: int) -> float:
    """Return the miss of one draw from the bound at the true throw [m].

    What is measured is what the model flies: else its own errors would be taken for larger noise.
    """
    true = Estimate(t.state, np.array([t.row[AT[name]] for name in model.prior.constants]))
    small = np.diag(np.full(model.unknowns - POSITION, 1e-3))
    flown = model.tracker.fly(t.state[None], t.row[None], data.time, 0.0).sights[0, :, :, 0]
    axis = np.where(np.isfinite(data.axis), flown[:, POSITION:], np.nan)
    exact = replace(data, position=flown[:, :POSITION], axis=axis)
    linear, _, _ = linearised(model, true, small, exact, to_landing=True)
    covariance = (linear.landing @ linear.covariance @ linear.landing.T)[:2, :2]
    rng = np.random.default_rng([seed, 2])
    draws = rng.multivariate_normal(np.zeros(2), covariance, 99)
    return float(np.median(np.hypot(*draws.T)))


def parabola(t: FloatArray, position: FloatArray) -> FloatArray:
    """Return the landing of a parabola in vacuum through all positions, x and y [m]."""
    design = np.column_stack([np.ones_like(t), t])
    fall = np.outer(0.5 * G * t**2, [0.0, 0.0, 1.0])
    x0, v0 = np.linalg.lstsq(design, position + fall, rcond=None)[0]
    return lands(x0, v0, np.array([0.0, 0.0, -G]))


def kalman(t: FloatArray, position: FloatArray) -> FloatArray:
    """Return the landing by a Kalman filter of constant acceleration, x and y [m]."""
    x, spread = np.zeros((3, 3)), np.diag([1e2, 4e2, 2e2])
    x[0] = position[0]
    measures = np.array([[1.0, 0.0, 0.0]])
    for i in range(len(t)):
        h = t[i] - t[i - 1] if i else 0.0
        fly = np.array([[1.0, h, 0.5 * h * h], [0.0, 1.0, h], [0.0, 0.0, 1.0]])
        x, spread = fly @ x, fly @ spread @ fly.T + np.diag([0.0, 0.0, JERK**2 * h])
        gain = spread @ measures.T / (measures @ spread @ measures.T + SIGMA**2)
        x, spread = (
            x + gain @ (position[i][None] - measures @ x),
            spread - gain @ measures @ spread,
        )
    return lands(x[0], x[1], x[2])


def lands(x: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """Return where a point with constant acceleration comes to the ground."""
    roots = np.roots([0.5 * a[2], v[2], x[2]])
    ahead = [float(r.real) for r in roots if abs(r.imag) < 1e-9 and r.real > 0.0]
    time_left = min(min(ahead, default=10.0), 10.0)
    return (x + v * time_left + 0.5 * a * time_left**2)[:2]


def miss_of(landing: FloatArray, t: Throw) -> float:
    """Return how far a landing is from the true one [m]."""
    return math.dist(landing, t.landing[:2])


if __name__ == '__main__':
    sys.exit(main())
