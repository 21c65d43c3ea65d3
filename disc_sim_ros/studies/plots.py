"""Plots of studies: landings with their ellipses, curves, maps and sensitivities."""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.plot_axes import label
from disc_sim_ros.studies import report, tables
from disc_sim_ros.studies.columns import RESULTS, quantity
from disc_sim_ros.studies.summary import (
    ELLIPSES,
    MAIN_RESULTS,
    Ellipse,
    Summary,
    expected_status,
    radius2,
)
from disc_sim_ros.units import METRIC, System

BLUE, ORANGE, GREEN = '#0072b2', '#d55e00', '#009e73'  # Okabe and Ito: safe for every eye
_COLOURS = {'range_m': BLUE, 'drift_m': ORANGE, 'time_s': GREEN}
_MOST_DOTS = 5000  # landings drawn one by one; more are drawn as a density
_CELLS = 120  # of the density, along its longer side
_MOST_BARS = 12


def figure(flights: Path | tables.Columns, summary: Summary, system: System = METRIC) -> Figure:
    """Return the plot of a study.

    Without a grid: landings and sensitivities. With a grid of one quantity: curves; of two: maps;
    of more: for each quantity the best result over all others.

    Args:
        flights: File of `runner.sweep`, or columns of `runner.collect`.
        summary: Summary of the flights.
        system: Units of the numbers.
    """
    dimensions = len(summary.study.vary)
    page = Figure(figsize=(12, 6.5), layout='constrained')
    FigureCanvasAgg(page)
    if dimensions == 0 or summary.grid is None:
        if summary.sensitivities:
            left, right = page.subplots(1, 2, width_ratios=(1.5, 1))
            _sensitivities(right, summary)
        else:
            left = page.subplots()
        _landings(left, flights, summary, system)
    elif dimensions == 1:
        _curves(page, summary, system)
    elif dimensions == 2:
        _maps(page, summary, system)
    else:
        _best_curves(page, summary, system)
    page.suptitle(
        f'{report.headline(summary)}\n{report.study_text(summary.study, system)}',
        fontsize=11,
        parse_math=False,  # the name of a disc file may contain dollars
    )
    return page


def _landings(
    axis: Axes, flights: Path | tables.Columns, summary: Summary, system: System
) -> None:
    label(axis.xaxis, RESULTS['x_m'], system)
    label(axis.yaxis, RESULTS['y_m'], system)
    axis.set_aspect('equal', adjustable='datalim')
    axis.grid(alpha=0.3)
    axis.plot(0, 0, 'k^', label='release')
    expected = expected_status(summary.study)
    chunks = (
        tables.chunks(flights, ['status', 'x_m', 'y_m'])
        if isinstance(flights, Path)
        else iter([flights])
    )
    landed = summary.counts['landed' if summary.study.ground else 'flying']
    if landed <= _MOST_DOTS:
        for chunk in chunks:
            chosen = chunk['status'] == expected
            axis.plot(chunk['x_m'][chosen], chunk['y_m'][chosen], '.', color=BLUE, ms=3, alpha=0.5)
    else:
        x, y = summary.spreads['x_m'], summary.spreads['y_m']
        size = max(x.greatest - x.least, y.greatest - y.least) / _CELLS or 1.0
        x_edges = np.arange(x.least, x.greatest + 2 * size, size)
        y_edges = np.arange(y.least, y.greatest + 2 * size, size)
        density = np.zeros((len(x_edges) - 1, len(y_edges) - 1))
        for chunk in chunks:
            chosen = chunk['status'] == expected
            density += np.histogram2d(
                chunk['x_m'][chosen], chunk['y_m'][chosen], (x_edges, y_edges)
            )[0]
        shown = np.ma.masked_equal(density.T / system.number(size, 'm') ** 2, 0.0)
        mesh = axis.pcolormesh(x_edges, y_edges, shown, cmap='Blues', norm=LogNorm())
        axis.figure.colorbar(mesh, ax=axis, label=f'landings per {system.length}²', shrink=0.8)
    if summary.ellipse is not None and summary.study.count > 1:
        _ellipses(axis, summary.ellipse)
    axis.legend(loc='best', fontsize=9)


def _ellipses(axis: Axes, ellipse: Ellipse) -> None:
    turn = np.linspace(0.0, 2 * np.pi, 200)
    values, vectors = np.linalg.eigh(ellipse.covariance)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    shape = vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * circle)
    for percent, line in zip(ELLIPSES, ('-', '--', ':'), strict=True):
        x, y = np.array(ellipse.centre)[:, None] + np.sqrt(radius2(percent)) * shape
        share = f'{percent} % ellipse, {ellipse.inside[percent]:.1%} inside'
        axis.plot(x, y, color=ORANGE, ls=line, lw=1.6, label=share)
    axis.plot(*ellipse.centre, '+', color=ORANGE, ms=10, mew=2)


def _sensitivities(axis: Axes, summary: Summary) -> None:
    """Draw standardised regression coefficients, the largest on top."""
    names = list(dict.fromkeys(s.quantity for s in summary.sensitivities))
    bars = {(s.quantity, s.result): s.correlation for s in summary.sensitivities}
    names.sort(key=lambda name: max(abs(bars.get((name, r), 0.0)) for r in MAIN_RESULTS))
    names = names[-_MOST_BARS:]
    place = np.arange(len(names))
    for k, result in enumerate(MAIN_RESULTS):
        lengths = [bars.get((name, result), 0.0) for name in names]
        text = f'{result.rpartition("_")[0]}, R² {summary.explained.get(result, 0.0):.2f}'
        axis.barh(place + 0.26 * (1 - k), lengths, 0.24, color=_COLOURS[result], label=text)
    axis.set_yticks(place, [name.replace('_', ' ') for name in names])
    axis.axvline(0.0, color='black', lw=0.8)
    axis.set(xlabel='sd of the result per sd of the quantity (linear regression)')
    axis.grid(alpha=0.3, axis='x')
    axis.legend(loc='best', fontsize=9)


def _curves(page: Figure, summary: Summary, system: System) -> None:
    ((name, values),) = summary.study.vary.items()
    mean, sd = _grid(summary)
    order = np.argsort(values)
    x = np.asarray(values, dtype=float)[order]
    for axis, (j, result) in zip(
        page.subplots(len(MAIN_RESULTS), 1, sharex=True), enumerate(MAIN_RESULTS), strict=True
    ):
        colour, y, width = _COLOURS[result], mean[order, j], sd[order, j]
        marker = '.' if len(x) <= 60 else ''
        axis.plot(x, y, marker=marker, color=colour, label='mean')
        if summary.study.count > 1:
            axis.fill_between(x, y - width, y + width, color=colour, alpha=0.25, label='± 1 sd')
            axis.legend(loc='best', fontsize=9)
        label(axis.yaxis, RESULTS[result], system)
        axis.grid(alpha=0.3)
    label(axis.xaxis, quantity('name', name).label, system)


def _maps(page: Figure, summary: Summary, system: System) -> None:
    (x_name, x), (y_name, y) = summary.study.vary.items()
    mean, _ = _grid(summary)
    x_order, y_order = np.argsort(x), np.argsort(y)
    for axis, result in zip(page.subplots(1, 2), ('range_m', 'time_s'), strict=True):
        column = mean[:, MAIN_RESULTS.index(result)].reshape(len(x), len(y))
        unit = result.rpartition('_')[2]
        values = system.number(column[np.ix_(x_order, y_order)].T, unit)
        x_line, y_line = np.asarray(x)[x_order], np.asarray(y)[y_order]
        mesh = axis.pcolormesh(x_line, y_line, values, cmap='viridis', shading='nearest')
        if min(values.shape) > 2 and np.nanmin(values) < np.nanmax(values):
            lines = axis.contour(x_line, y_line, values, 8, colors='white', linewidths=0.8)
            axis.clabel(lines, fontsize=8)
        what = RESULTS[result].rpartition(', ')[0]
        axis.figure.colorbar(mesh, ax=axis, label=f'{what}, {system.unit(unit)}')
        best = next(b for b in summary.best if b.result == result)
        axis.plot(
            best.values[x_name], best.values[y_name], '*', ms=14, mfc=ORANGE, mec='white',
            label=f'best, {system.text(best.mean, unit)}', clip_on=False,
        )  # fmt: skip
        axis.legend(loc='best', fontsize=9)
        label(axis.xaxis, quantity('name', x_name).label, system)
        label(axis.yaxis, quantity('name', y_name).label, system)


def _best_curves(page: Figure, summary: Summary, system: System) -> None:
    """Draw for each quantity the best mean result over all other quantities."""
    study = summary.study
    mean = _grid(summary)[0].reshape((*study.shape, len(MAIN_RESULTS)))
    axes = page.subplots(2, len(study.shape), squeeze=False, sharey='row')
    for row, result in zip(axes, ('range_m', 'time_s'), strict=True):
        best = next(b for b in summary.best if b.result == result)
        for i, (name, values) in enumerate(study.vary.items()):
            others = tuple(k for k in range(len(study.shape)) if k != i)
            top = np.nanmax(mean[..., MAIN_RESULTS.index(result)], axis=others)
            order = np.argsort(values)
            x = np.asarray(values)[order]
            row[i].plot(x, top[order], marker='.', color=_COLOURS[result])
            row[i].plot(best.values[name], best.mean, '*', ms=13, color=ORANGE, label='best')
            label(row[i].xaxis, quantity('name', name).label, system)
            row[i].grid(alpha=0.3)
        label(row[0].yaxis, f'greatest {RESULTS[result]}', system)
    axes[0, 0].legend(loc='best', fontsize=9)


def _grid(summary: Summary) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation of `MAIN_RESULTS` at each point, shape (points, 3)."""
    if summary.grid is None:
        raise ValueError('the summary has no grid')
    return summary.grid.mean, np.sqrt(np.nan_to_num(summary.grid.variance))
