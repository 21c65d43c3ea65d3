"""Plots of an identification: measured and fitted paths, residuals over time, correlations."""

from typing import TYPE_CHECKING, Any

import numpy as np

from disc_sim_ros import plot_axes
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.identify import Identification
from disc_sim_ros.estimation.identification.observations import UNITS, Camera, Positions
from disc_sim_ros.palette import COLOURS
from disc_sim_ros.physics.frames import map_from_paper
from disc_sim_ros.units import METRIC, System

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_NAMES = 8  # throws in a legend


def paths(result: Identification, system: System = METRIC) -> 'Figure | None':
    """Return measured and fitted paths from above and from the side; None without positions."""
    drawn = []
    for k, throw in enumerate(result.problem.throws):
        residuals = result.residuals(k)
        for o in throw.observations:
            if isinstance(o, Positions | Camera):
                measured = o.XYZ if isinstance(o, Positions) else o.XY
                fitted = measured + residuals[o.kind]
                drawn.append((throw.name, _in_map(measured), _in_map(fitted)))
    if not drawn:
        return None
    views = [(1, 'y (left), m', 'from above: dots measured, lines fitted')]
    if any(measured.shape[1] > 2 for _, measured, _ in drawn):
        views.append((2, 'z (up), m', 'from the side'))
    figure, axes = _figure(len(views), 4.5 * len(views))
    for ax, (column, label, title) in zip(np.atleast_1d(axes), views, strict=True):
        for i, (name, measured, fitted) in enumerate(drawn):
            if measured.shape[1] > column:
                (line,) = ax.plot(fitted[:, 0], fitted[:, column], color=_colour(i), label=name)
                dots = measured[:, 0], measured[:, column]
                ax.plot(*dots, '.', ms=3, color=line.get_color(), alpha=0.5)
        ax.set_title(title)
        plot_axes.label(ax.xaxis, 'x, m', system)
        plot_axes.label(ax.yaxis, label, system)
        ax.set_aspect('equal', adjustable='datalim')
        ax.grid(color='0.9')
        _legend(ax, len(drawn))
    return figure


def _in_map(points: FloatArray) -> FloatArray:
    """Return points of two or three components in `map`."""
    d = points.shape[1]
    return map_from_paper(np.pad(points, ((0, 0), (0, 3 - d))))[:, :d]


def residuals(result: Identification, system: System = METRIC) -> 'Figure':
    """Return the residuals of each instrument over time."""
    kinds = sorted({o.kind for throw in result.problem.throws for o in throw.observations})
    figure, axes = _figure(len(kinds), 3.0 * len(kinds))
    for ax, kind in zip(np.atleast_1d(axes), kinds, strict=True):
        for k, throw in enumerate(result.problem.throws):
            for o in throw.observations:
                if o.kind == kind:
                    r = result.residuals(k)[kind]
                    rms = np.sqrt((r**2).mean(axis=1))
                    ax.plot(o.t, rms, lw=0.8, color=_colour(k), label=throw.name)
        ax.axhline(result.problem.noise[kind], color='0.5', ls='--', lw=1.0, label='noise')
        ax.set(xlabel='time, s', ylim=(0.0, None))
        plot_axes.label(ax.yaxis, f'residual, {UNITS[kind]}', system)
        ax.set_title(f'{kind}: fitted less measured, rms of the components')
        _legend(ax, len(result.problem.throws))
    return figure


def correlations(result: Identification) -> 'Figure':
    """Return the correlations of the shared parameters as a map."""
    figure, ax = _figure(1, 4.5)
    names = result.problem.names
    image = ax.imshow(result.correlation, cmap='RdBu_r', vmin=-1.0, vmax=1.0)
    ax.set_xticks(range(len(names)), names, rotation=60, ha='right')
    ax.set_yticks(range(len(names)), names)
    figure.colorbar(image, ax=ax)
    ax.set_title('correlations of the fitted parameters')
    return figure


def _colour(i: int) -> str:
    return COLOURS[i % len(COLOURS)]


def _legend(ax: 'Axes', throws: int) -> None:
    """Add a legend, unless it has more throws than can be told apart."""
    if throws <= _MOST_NAMES:
        ax.legend(fontsize='small')


def _figure(rows: int, height: float) -> tuple['Figure', Any]:
    from matplotlib.figure import Figure  # noqa: PLC0415 - slow to import

    figure = Figure(figsize=(8.0, height), layout='constrained')
    return figure, figure.subplots(rows)
