"""Measure the error over the step, in axes that do not spin and in axes fixed in the disc.

Each launch flies for the time of flight of the independent integration of test/reference
(tolerance 1e-12), and its end is compared with that landing. The three kinds of axes of
benchmarks/spinning.py run in the same compiled loop. Before that, the loop in despun axes is
checked against `flight.fly`, and the two with axes that spin against scipy's DOP853 with a
tolerance of 1e-12.

usage: benchmarks/steps.py [--write]   (--write: docs/steps.csv and docs/steps.png)
"""

import argparse
import csv
from dataclasses import asdict, dataclass, replace
from itertools import takewhile
import math
from pathlib import Path
import sys
import time

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

import numpy as np
from scipy.integrate import solve_ivp

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from lines import Line, number, print_lines
from reference.cases import FRISBEE
from reference.reference_flight import reference_flight
from spinning import DESPUN, PRINTED, SPINNING, flown, rates, released

DOCS = Path(__file__).parents[1] / 'docs'
LAUNCHES = {
    'Fig. 5, 31 rad/s': Launch(),
    'slow spin, 10 rad/s': Launch(spin=10.0),
    'wobbling, 31 rad/s': Launch(roll_rate=3.0, pitch_rate=-2.0),
    'drive, 25 m/s, 90 rad/s': Launch(speed=25.0, pitch=8.0, spin=90.0, height=1.5),
}
AXES = {DESPUN: 'despun', SPINNING: 'spinning', PRINTED: 'spinning_uvw'}
STEPS = tuple(
    m * 10.0**e
    for e in (-4, -3, -2)
    for m in (1.0, 1.4, 2.0, 3.0, 5.0, 7.0)
    if m * 10.0**e < 0.0501
)  # s
FINE = np.geomspace(5e-4, 5e-2, 241)  # s, searched for the longest step within ALLOWED
ALLOWED = 1e-3  # m
ROUNDS = 3
ROUND_S = 0.02  # CPU seconds a round
OFF = 1.0  # m: a larger error has nothing to do with the throw


@dataclass(frozen=True)
class Point:
    """One flight in one kind of axes."""

    launch: str
    axes: str
    step: float  # s
    error: float  # m at the landing; infinite if it diverges or the step is refused
    evaluations: int  # of the equations of motion
    seconds: float  # CPU time


@dataclass(frozen=True)
class Throw:
    """A launch and where it lands."""

    name: str
    launch: Launch
    time: float  # s
    landing: tuple[float, float, float]  # m, earth axes 1


def main() -> None:
    """Measure, print, and with --write also write the table and the picture."""
    parser = argparse.ArgumentParser(description=__doc__.partition('\n')[0])
    parser.add_argument('--write', action='store_true', help='write docs/steps.csv and .png')
    print_lines(lines(write=parser.parse_args().write))


def lines(*, write: bool = False) -> tuple[Line, ...]:
    """Measure and print every flight; return the savings of despun axes."""
    setup = Setup(disc=disc_file.load_disc('frisbee_as_printed'), step=1e-3)
    throws = [landed(name, launch) for name, launch in LAUNCHES.items()]
    for throw in throws:
        check(throw, setup)
    points = [point(throw, axes, step, setup) for throw in throws for step in STEPS
              for axes in AXES]  # fmt: skip
    print_table(points)
    if write:
        write_csv(DOCS / 'steps.csv', points)
        (DOCS / 'steps.png').write_bytes(picture(points))
    return tuple(savings(throw, setup) for throw in throws)


def landed(name: str, launch: Launch) -> Throw:
    """Return a launch with its landing by the independent integration."""
    thrown = asdict(launch)
    thrown['alpha'] = thrown.pop('angle_of_attack')
    flight = reference_flight(FRISBEE, thrown)
    x, y, z = map(float, flight['landing_position_m'])
    return Throw(name, launch, flight['flight_time_s'], (x, -y, -z))


def off(throw: Throw, axes: int, step: float, setup: Setup) -> float:
    """Return the distance of the end of a flight from the landing [m].

    Infinite if the flight diverges, or if `fly` refuses the step.
    """
    if axes == DESPUN:
        try:
            replace(setup, step=step).check_step(throw.launch.spin, throw.launch.speed)
        except ConfigError:
            return math.inf
    state = released(throw.launch.state(), axes)
    end = flown(state, axes, step, throw.time, setup.plant)
    error = math.dist(end[:3], throw.landing)
    return error if error < math.inf else math.inf  # no nan


def check(throw: Throw, setup: Setup) -> None:
    """Print the differences between the ways to compute one flight.

    Raises:
        SystemExit: A difference is too large, so that measurements would be meaningless.
    """
    state = throw.launch.state()
    by_fly = fly(throw.launch, setup, duration=throw.time, ground=False).end
    same = math.dist(by_fly[:3], flown(state, DESPUN, setup.step, throw.time, setup.plant)[:3])
    differences = {'despun loop from flight.fly': (same, 1e-12)}
    for axes in (SPINNING, PRINTED):
        solution = solve_ivp(
            lambda _, y, axes=axes: rates(y, axes, setup.plant),
            (0.0, throw.time),
            released(state, axes),
            method='DOP853',
            rtol=1e-12,
            atol=1e-12,
        )
        error = math.dist(solution.y[:3, -1], throw.landing)
        differences[f'DOP853 of {AXES[axes]} from the reference'] = (error, 1e-7)
    differences['despun at 0.02 ms from the reference'] = (off(throw, DESPUN, 2e-5, setup), 1e-7)
    print(
        f'{throw.name}: ' + ', '.join(f'{name} {d:.0e} m' for name, (d, _) in differences.items())
    )
    if not all(difference <= most for difference, most in differences.values()):
        raise SystemExit('steps: the ways to compute this flight differ by more than allowed')


def point(throw: Throw, axes: int, step: float, setup: Setup) -> Point:
    """Return error and cost of one flight."""
    error = off(throw, axes, step, setup)
    evaluations = 4 * math.ceil(throw.time / step)
    return Point(throw.name, AXES[axes], step, error, evaluations, cpu(throw, axes, step, setup))


def cpu(throw: Throw, axes: int, step: float, setup: Setup) -> float:
    """Return the CPU seconds of one flight, the best of a few rounds."""
    state = released(throw.launch.state(), axes)
    arguments = (state, axes, step, throw.time, setup.plant)
    best, count = math.inf, 1
    for _ in range(ROUNDS + 1):
        start = time.process_time()
        for _ in range(count):
            flown(*arguments)
        best = min(best, (time.process_time() - start) / count)
        count = max(1, round(ROUND_S / max(best, 1e-6)))
    return best


def longest_step(throw: Throw, axes: int, setup: Setup) -> float:
    """Return the longest step [s] up to which all errors are within ALLOWED."""
    good = takewhile(lambda h: off(throw, axes, float(h), setup) <= ALLOWED, FINE)
    return float(list(good)[-1])


def savings(throw: Throw, setup: Setup) -> Line:
    """Return the savings of despun axes at the same error."""
    step = {axes: longest_step(throw, axes, setup) for axes in AXES}
    rounds = [{axes: cpu(throw, axes, step[axes], setup) for axes in AXES} for _ in range(3)]
    cost = {axes: min(costs[axes] for costs in rounds) for axes in AXES}
    texts = {axes: f'{number(step[axes] * 1e3, 3)} ms steps, {number(cost[axes] * 1e6)} us'
            for axes in AXES}  # fmt: skip
    return Line(
        what=f'{throw.name}, {ALLOWED * 1e3:g} mm off',
        ours=f'{texts[DESPUN]} a flight',
        beside=f'attitude and rates in axes fixed in the disc {texts[SPINNING]}; '
        f'velocity too {texts[PRINTED]}',
        ratio=cost[SPINNING] / cost[DESPUN],
    )


def print_table(points: list[Point]) -> None:
    """Print all flights, a line for each launch and step."""
    names = list(AXES.values())
    by = {(p.launch, p.step, p.axes): p for p in points}
    for launch in LAUNCHES:
        print(f'\n{launch}: error [mm] and CPU time [us] of a flight in axes')
        print(f' step, ms  evaluations {"".join(f"{name:>24}" for name in names)}')
        for step in STEPS:
            row = [by[launch, step, name] for name in names]
            cells = ''.join(
                f'{p.error * 1e3:13.3g} {p.seconds * 1e6:10.0f}'
                if p.error < OFF
                else f'{"lost":>13} {p.seconds * 1e6:10.0f}'
                for p in row
            )
            print(f'{step * 1e3:9.2g} {row[0].evaluations:12d} {cells}')
    print()


def write_csv(path: Path, points: list[Point]) -> None:
    """Write all flights."""
    with path.open('w', encoding='utf-8', newline='') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(['launch', 'axes', 'step_s', 'error_m', 'evaluations', 'cpu_s'])
        for p in points:
            writer.writerow([p.launch, p.axes, f'{p.step:g}', f'{p.error:.4g}', p.evaluations,
                             f'{p.seconds:.3g}'])  # fmt: skip


def picture(points: list[Point]) -> bytes:
    """Return the PNG: a panel for each launch, a curve for each kind of axes."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - a second, for the picture alone

    from disc_sim_ros.paper.style import LIGHT, image, style  # noqa: PLC0415

    looks = {
        'despun': (LIGHT.printed, 'o', 'axes that do not spin (this package)'),
        'spinning': (LIGHT.tenth, 's', 'attitude and rates in axes fixed in the disc'),
        'spinning_uvw': (LIGHT.third, '^', 'and the velocity too, as eqns 10 and 11 are printed'),
    }
    with style(LIGHT):
        figure = Figure(figsize=(10.5, 7.4), dpi=130, layout='constrained')
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for panel, launch in zip(panels.flat, LAUNCHES, strict=True):
            for name, (colour, mark, label) in looks.items():
                row = [p for p in points if (p.launch, p.axes) == (launch, name)]
                panel.loglog(
                    [p.step * 1e3 for p in row],
                    [p.error * 1e3 if p.error < OFF else math.nan for p in row],
                    color=colour, marker=mark, markersize=4.5, label=label,
                )  # fmt: skip
            panel.axhline(ALLOWED * 1e3, color=LIGHT.ink, linewidth=0.9, linestyle='--')
            panel.set_title(launch)
        panels[0, 0].text(0.1, ALLOWED * 1.2e3, ' 1 mm', va='bottom')
        panels[0, 0].set_ylim(1e-7, OFF * 1e3)
        for panel in panels[1]:
            panel.set_xlabel('step [ms]')
            panel.xaxis.set_major_formatter('{x:g}')
        for panel in panels[:, 0]:
            panel.set_ylabel('error at the landing [mm]')
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc='outside lower center', ncols=3)
        figure.suptitle('Same equations, same RK4, different axes', x=0.012, ha='left',
                        fontsize=13, fontweight='bold')  # fmt: skip
        return image(figure, 'png', LIGHT)


if __name__ == '__main__':
    main()
