"""The exact, constant-spin and precession models: their differences and their run times.

The paper's 3 minutes (constant spin) and 10 minutes (exact) for a 5 s flight were measured on a
233 MHz Pentium with ode23s of Matlab. Here the run time is that of one flight whose end is
accurate to 1 mm.
"""

from dataclasses import dataclass, replace
import sys
import time
from typing import Any

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.fig05_typical_flight import LAUNCH
from disc_sim_ros.paper.figure_files import PaperFigure
from disc_sim_ros.physics.flight import MODELS, Setup, fly
from disc_sim_ros.physics.launch import Launch

TITLE = 'Rigid-body models: how far apart, and how long they take'
CONDITIONS = (
    'Launch of Fig. 5 for 5 s, in a, b with a wobble of p = 5 rad/s at 10 % damping, in c, d '
    'without. Table aerodynamics, moments in axes 3 (body).\nd: damping as printed, CPU time of '
    'one flight that ends within 1 mm.'
)
DURATION = 5.0  # s
WOBBLE = 5.0  # rad/s
STEPS = (0.05, 0.04, 0.03, 0.02, 0.015, 0.01, 7e-3, 5e-3, 3e-3, 2e-3, 1e-3, 5e-4)  # s, candidates
CLOSE = 1e-3  # m
RATIOS = (0.29, 0.6, 1.1, 2.2)
PAPER_SECONDS = {'exact': 600.0, 'constant_spin': 180.0}
BLOCKS, FLIGHTS = 12, 10  # timed blocks, and flights per block


@dataclass(frozen=True)
class Data:
    """Flights of 5 s with each model, and run times.

    Attributes:
        curves: Flights without a wobble, one damping after the other.
        wobbling: Flights with a wobble, 10 % damping.
        step: Longest step with an error below 1 mm [s], rows `MODELS`, columns `RATIOS`.
        seconds: CPU time of one flight at that step [s], likewise.
    """

    curves: tuple[Curve, ...]
    wobbling: tuple[Curve, ...]
    step: FloatArray
    seconds: FloatArray

    def of(self, share: float) -> dict[str, Curve]:
        """Return the flights with a share of the printed damping, by model."""
        return {c.flight.setup.model: c for c in self.curves if c.share == share}

    def apart(self, model: str, share: float) -> FloatArray:
        """Return the distance of a model from the exact one at each sample [m]."""
        curves = self.of(share)
        distance: FloatArray = np.linalg.norm(
            curves[model].t.position - curves['exact'].t.position, axis=1
        )
        return distance


def compute() -> Data:
    """Fly the launches and time those without a wobble."""

    def curve(launch: Launch, share: float, model: str, rate: float) -> Curve:
        flight = conditions.flown(launch, share, duration=DURATION, model=model, rate=rate)
        return Curve(f'{model}, {conditions.percent(share)}', share, flight)

    calm = tuple(curve(LAUNCH, s, m, conditions.RATE) for s in conditions.SHARES for m in MODELS)
    release = replace(LAUNCH, roll_rate=WOBBLE)
    wobbling = tuple(curve(release, conditions.TENTH, model, 500.0) for model in MODELS)
    step = [[longest_step(model, ratio) for ratio in RATIOS] for model in MODELS]
    return Data(calm, wobbling, np.array(step), _seconds(step))


def _timed_launch(ratio: float) -> Launch:
    return conditions.level(ratio, speed=LAUNCH.speed, pitch=LAUNCH.pitch)


def _end(launch: Launch, setup: Setup) -> FloatArray:
    return np.array(fly(launch, setup, duration=DURATION, ground=False).end[:3])


def longest_step(model: str, ratio: float) -> float:
    """Return the longest of `STEPS` with which the end of a flight is accurate to 1 mm [s]."""
    launch = _timed_launch(ratio)
    disc = conditions.frisbee()
    finest = _end(launch, Setup(disc=disc, model=model, step=1e-4))
    for step in STEPS:
        try:
            end = _end(launch, Setup(disc=disc, model=model, step=step))
        except DiscSimError:  # refused, or lost: the step is too long for this launch
            continue
        if np.linalg.norm(end - finest) < CLOSE:
            return step
    return STEPS[-1]


def _seconds(steps: list[list[float]]) -> FloatArray:
    """Return the CPU time of one flight, least of several interleaved blocks [s]."""
    least = np.full((len(MODELS), len(RATIOS)), np.inf)
    for _ in range(BLOCKS):
        for j, ratio in enumerate(RATIOS):
            launch = _timed_launch(ratio)
            for i, model in enumerate(MODELS):
                setup = Setup(disc=conditions.frisbee(), model=model, step=steps[i][j])
                started = time.process_time()
                for _ in range(FLIGHTS):
                    _end(launch, setup)
                least[i, j] = min(least[i, j], (time.process_time() - started) / FLIGHTS)
    return least


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw the paths, the wobble, the distances and the run times."""
    figure = style.sheet(7.6, TITLE, CONDITIONS)
    grid = figure.add_gridspec(2, 2)
    paths, wobble, apart, cost = (figure.add_subplot(grid[i // 2, i % 2]) for i in range(4))
    lines: dict[str, dict[str, Any]] = {
        'exact': {'color': look.ink, 'lw': 1.2},
        'constant_spin': {'color': look.printed, 'ls': (0, (4, 1.6))},
        'precession': {'color': look.tenth, 'ls': ':', 'lw': 2.4},
    }
    for model, curve in zip(MODELS, data.wobbling, strict=True):
        style.path(paths, curve.t, style.SIDE, label=model, **lines[model])
        shown = curve.t.t <= 1.0
        alpha = np.degrees(curve.t.alpha[shown])
        wobble.plot(curve.t.t[shown], alpha, label=model, **lines[model])
    for share, width in zip(conditions.SHARES, (2.0, 1.0), strict=True):
        for model in ('constant_spin', 'precession'):
            t = data.of(share)[model].t.t
            line = lines[model] | {'lw': width}
            label = f'{model}, {conditions.percent(share)}'
            apart.plot(t, data.apart(model, share), label=label, **line)
    for i, model in enumerate(MODELS):
        cost.plot(RATIOS, data.seconds[i], marker='o', label=model, **lines[model])
    for model, seconds in PAPER_SECONDS.items():
        line = {'color': lines[model]['color'], 'marker': 's', 'ls': '', 'ms': 7}
        cost.plot([0.29], [seconds], label=f'{model}, paper 2007', **line)
    style.views(paths, style.SIDE, equal='no')
    wobble.set(xlabel='time, s (the first second)', ylabel='angle of attack, °')
    apart.set(xlabel='time, s', ylabel='distance from exact, m')
    cost.set(xlabel='advance ratio at launch', ylabel='time for a 5 s flight, s', yscale='log')
    cost.set_ylim(3e-5, 3e7)
    for axis, name, title in (
        (paths, 'a', 'path with a wobble (heights stretched)'),
        (wobble, 'b', 'the wobble'),
        (apart, 'c', 'distance without a wobble'),
        (cost, 'd', 'run time'),
    ):
        style.letter(axis, name, title)
    wobble.legend(loc='best')
    apart.legend(loc='best')
    cost.legend(loc='upper right', ncols=2)
    return figure


def findings(data: Data) -> list[str]:
    """Return the distances between the models, and the run time of each."""
    lines = []
    for share in conditions.SHARES:
        for model in ('constant_spin', 'precession'):
            apart = data.apart(model, share)
            at_4 = apart[round(4.0 * conditions.RATE)]
            lines.append(
                f'{model}, {conditions.percent(share)}, without a wobble: {at_4:.3f} m from exact '
                f'after 4 s, {apart[-1]:.3f} m after 5 s.'
            )
    exact = data.wobbling[0].t.position
    for curve in data.wobbling[1:]:
        apart = np.linalg.norm(curve.t.position - exact, axis=1)
        lines.append(
            f'{curve.label}, with the wobble: {apart[round(4.0 * 500)]:.3f} m from exact after '
            '4 s. The precession model has no wobble.'
            if 'precession' in curve.label
            else f'{curve.label}, with the wobble: {apart[round(4.0 * 500)]:.3f} m from exact '
            'after 4 s.'
        )
    for i, model in enumerate(MODELS):
        costs = ', '.join(
            f'{1e3 * step:g} ms and {1e6 * seconds:.0f} µs at AdvR {ratio:g}'
            for step, seconds, ratio in zip(data.step[i], data.seconds[i], RATIOS, strict=True)
        )
        lines.append(f'{model}: step and CPU time for 1 mm {costs}.')
    ratio = data.seconds[0, 0] / data.seconds[1, 0]
    lines.append(
        f'exact takes {ratio:.1f} times as long as constant_spin (paper: 3.3 times), because in '
        'axes that do not spin neither model has to resolve the spin.'
    )
    return lines


def table(data: Data) -> str:
    """Return steps and run times as CSV; run times differ from run to run."""
    rows = [
        [model, ratio, data.step[i, j], data.seconds[i, j]]
        for i, model in enumerate(MODELS)
        for j, ratio in enumerate(RATIOS)
    ]
    return conditions.csv_text(['model', 'AdvR', 'step_s', 'cpu_time_s'], rows)


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    return data.wobbling[0]


FIGURE = PaperFigure(
    key='models',
    title=TITLE,
    conditions=CONDITIONS,
    compute=compute,
    plot=plot,
    findings=findings,
    table=table,
    example=example,
)


if __name__ == '__main__':
    sys.exit(figure_files.main(FIGURE))
