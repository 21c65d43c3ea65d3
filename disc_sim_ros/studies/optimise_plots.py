"""Plot of an optimum: its flight, and the result along each free quantity."""

import math

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.physics.frames import map_from_paper
from disc_sim_ros.plot_axes import label
from disc_sim_ros.studies.columns import quantity
from disc_sim_ros.studies.optimise import Optimum, lines
from disc_sim_ros.studies.optimise_report import WHAT, named_value, statistic_of, still_flight
from disc_sim_ros.units import METRIC, System

BLUE, ORANGE = '#0072b2', '#d55e00'  # Okabe and Ito: safe for every eye


def figure(optimum: Optimum, system: System = METRIC) -> Figure:
    """Return a plot of the flight of an optimum, and of the result along each free quantity.

    Numbers are in the units of a system.
    """
    problem = optimum.problem
    what, unit = WHAT[problem.goal]
    curves = lines(problem, optimum.launch)
    columns = max(2, min(3, len(curves)))
    rows = 1 + math.ceil(len(curves) / columns)
    page = Figure(figsize=(12, 3.6 * rows), layout='constrained')
    FigureCanvasAgg(page)
    grid = page.add_gridspec(rows, 2 * columns)
    flight = still_flight(optimum, 100.0)
    x, y, z = map_from_paper(flight.trajectory.position).T
    for side, across, text in ((0, z, 'height z, m'), (1, y, 'left y, m')):
        axis = page.add_subplot(grid[0, side * columns : (side + 1) * columns])
        axis.plot(x, across, color=BLUE)
        axis.plot(0.0, across[0], 'k^', label='release')
        if problem.target and side:
            axis.plot(*problem.target, 'x', color=ORANGE, ms=10, mew=2.5, label='target')
        if problem.scatters and side:
            landed = problem.landings(np.array([list(optimum.launch.values())]), _dots(optimum))
            axis.plot(landed.x, landed.y, '.', color=BLUE, ms=3, alpha=0.5, label='landings')
        label(axis.xaxis, 'forward x, m', system)
        label(axis.yaxis, text, system)
        axis.set_aspect('equal', adjustable='datalim')
        axis.grid(alpha=0.3)
        axis.legend(loc='best', fontsize=9)
    for k, (name, (at, values)) in enumerate(curves.items()):
        column = 2 * (k % columns)
        axis = page.add_subplot(grid[1 + k // columns, column : column + 2])
        axis.plot(at, values, color=BLUE)
        axis.axvspan(*optimum.flat[name], color=ORANGE, alpha=0.2,
                     label=f'within {system.text(optimum.slack, unit, ".2g")}')  # fmt: skip
        best = values[int(np.searchsorted(at, optimum.launch[name]))]
        axis.plot(optimum.launch[name], best, '*', color=ORANGE, ms=13, label='optimum')
        label(axis.xaxis, quantity('', name).label, system)
        label(axis.yaxis, f'{statistic_of(optimum)}{what}, {unit}', system)
        axis.grid(alpha=0.3)
        axis.legend(loc='best', fontsize=9)
    target = [system.number(value, 'm') for value in problem.target or ()]
    aim = ' at {:.4g}, {:.4g} '.format(*target) + system.length if target else ''
    launch = ', '.join(named_value(name, value, system) for name, value in optimum.launch.items())
    page.suptitle(
        f'{problem.study.setup.disc.name}, best {problem.goal}{aim}: {launch}',
        fontsize=11,
        parse_math=False,  # the name of a disc file may contain dollars
    )
    return page


def _dots(optimum: Optimum) -> int:
    return min(optimum.problem.study.count, 2000)
