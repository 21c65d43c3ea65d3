"""Plots of simulated and of recorded flights: two views to scale, and time histories."""

from io import BytesIO
from typing import TYPE_CHECKING
import warnings

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
import numpy as np
from PIL import Image

from disc_sim_ros import topics
from disc_sim_ros.analysis.flight_report import columns
from disc_sim_ros.errors import printable
from disc_sim_ros.palette import COLOURS
from disc_sim_ros.plot_axes import label
from disc_sim_ros.units import METRIC, System

if TYPE_CHECKING:  # the analysis of bags imports scipy, which the plot of `fly` does without
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from disc_sim_ros.analysis.bag_analysis import Analysis
    from disc_sim_ros.analysis.recording import Change
    from disc_sim_ros.physics.flight import Flight

BLUE, ORANGE = COLOURS[:2]
_HISTORIES = (
    ('airspeed_m_s', 'airspeed, m/s'),
    ('alpha_deg', 'angle of attack, °'),
    ('roll_deg', 'roll, °'),
    ('pitch_deg', 'pitch, °'),
    ('absolute_attitude_deg', 'absolute attitude, °'),
    ('spin_rad_s', 'spin, rad/s'),
)
_INPUT_LABELS = {
    topics.APPLIED_COEFFICIENTS: (('C_L', 'C_M', 'C_N'), 'control coefficients'),
    topics.APPLIED_MOMENT: (('x', 'y', 'z'), 'control moment, N m'),
}
_STYLES = ('-', '--', ':')
_LEGEND_LIMIT = 8  # flights in a legend, at most


def flight_figure(flight: 'Flight', system: System = METRIC) -> Figure:
    """Return a figure of a sampled flight: side and top view to scale, and its time histories.

    Numbers are in the units of a system, also in the other figures.
    """
    samples = columns(flight.trajectory)
    x, y, z = samples['position_m'].T
    figure = Figure(figsize=(11, 9), layout='constrained')
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(4, 2, height_ratios=(1.2, 1, 1, 1))
    side = figure.add_subplot(grid[0, 0])
    top = figure.add_subplot(grid[0, 1])
    for axis, across in ((side, z), (top, y)):
        axis.plot(x, across, color=BLUE)
        axis.plot(x[0], across[0], 'o', color='black', label='release')
    _label_views(side, top, system)
    if flight.landed:
        for axis, across in ((side, 0.0), (top, flight.position[1])):
            axis.plot(flight.position[0], across, 'x', color=ORANGE, ms=9, mew=2, label='landing')
        side.axhline(0.0, color='0.6', lw=0.8)
    side.legend(loc='best')
    for i, (name, text) in enumerate(_HISTORIES):
        axis = figure.add_subplot(grid[1 + i // 2, i % 2])
        axis.plot(samples['t_s'], samples[name], color=BLUE)
        axis.set_xlabel('time, s')
        label(axis.yaxis, text, system)
    ratio = axis.twinx()
    ratio.plot(samples['t_s'], samples['advance_ratio'], color=ORANGE, ls='--')
    ratio.set_ylabel('advance ratio (dashed)')
    for axis in figure.axes:
        axis.grid(alpha=0.3)
    launch = flight.launch
    figure.suptitle(
        f'{printable(flight.setup.disc.name)}, {flight.setup.model} model: '
        f'{system.text(launch.speed, "m/s", ".4g")}, pitch {launch.pitch:g}°, '
        f'roll {launch.roll:g}°, spin {system.text(launch.spin, "rad/s", ".4g")}; '
        f'{system.text(flight.range, "m", ".1f")} in {flight.time:.2f} s',
        parse_math=False,  # a file may have dollars in its name
    )
    return figure


def comparison_figure(
    flights: 'Sequence[Flight]', names: 'Sequence[str]', system: System = METRIC
) -> Figure:
    """Return a figure of several sampled flights: side view and top view to scale."""
    figure = Figure(figsize=(11, 8), layout='constrained')
    FigureCanvasAgg(figure)
    side, top = figure.subplots(2, 1)
    for i, (flight, name) in enumerate(zip(flights, names, strict=True)):
        colour, style = COLOURS[i % len(COLOURS)], _STYLES[i // len(COLOURS) % len(_STYLES)]
        x, y, z = columns(flight.trajectory)['position_m'].T
        for axis, across, end in ((side, z, 0.0), (top, y, flight.position[1])):
            axis.plot(x, across, color=colour, ls=style, label=text_of(name))
            if flight.landed:
                axis.plot(flight.position[0], end, 'x', color=colour, ms=9, mew=2)
    _label_views(side, top, system)
    for axis in (side, top):
        axis.grid(alpha=0.3)
    side.axhline(0.0, color='0.6', lw=0.8)
    if any(flight.landed for flight in flights):
        side.plot([], [], 'x', color='0.4', ms=9, mew=2, label='landing')
    side.legend(loc='best')
    return figure


def bag_figure(analyses: 'Sequence[Analysis]', heading: str, system: System = METRIC) -> Figure:
    """Return a figure of one or more recorded flights.

    Side and top view to scale, height, airspeed, angle of attack and spin over the time since
    each release, and the control inputs where there were any.
    """
    inputs = [topic for topic in _INPUT_LABELS if any(_inputs(a, topic) for a in analyses)]
    rows = 3 + bool(inputs)
    figure = Figure(figsize=(11, 2.0 + 2.4 * rows), layout='constrained')
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(rows, 2, height_ratios=(1.3, *[1.0] * (rows - 1)))
    side, top = (figure.add_subplot(grid[0, i]) for i in range(2))
    histories = [figure.add_subplot(grid[1 + i // 2, i % 2]) for i in range(4)]
    for i, a in enumerate(analyses):
        colour = COLOURS[i % len(COLOURS)]
        name = text_of(f'{a.flight.disc.name}, flight {a.flight.number}')
        _views(side, top, a, colour, name)
        _histories(histories, a, colour)
    _label_views(side, top, system)
    side.axhline(0.0, color='0.6', lw=0.8)
    if 1 < len(analyses) <= _LEGEND_LIMIT:
        side.legend(loc='best')
    air = 'airspeed' if any(a.wind_is_known for a in analyses) else 'speed over the ground'
    labels = ('height, m', f'{air}, m/s', 'angle of attack, °', 'spin, rad/s')
    for axis, text in zip(histories, labels, strict=True):
        axis.set_xlabel('time, s')
        label(axis.yaxis, text, system)
    for i, topic in enumerate(inputs):
        place = grid[3, :] if len(inputs) == 1 else grid[3, i]
        _steering(figure.add_subplot(place), analyses, topic)
    for axis in figure.axes:
        axis.grid(alpha=0.3)
    figure.suptitle(printable(heading), parse_math=False)  # a path may have dollars in it
    return figure


def _label_views(side: 'Axes', top: 'Axes', system: System) -> None:
    for axis, across in ((side, 'height z, m'), (top, 'left y, m')):
        label(axis.xaxis, 'forward x, m', system)
        label(axis.yaxis, across, system)
        axis.set_aspect('equal', adjustable='datalim')


def text_of(name: str) -> str:
    """Return a name from a bag for a legend: no control characters, no mathematics."""
    return printable(name).replace('$', r'\$')


def _views(side: 'Axes', top: 'Axes', a: 'Analysis', colour: str, name: str) -> None:
    x, y, z = columns(a.trajectory)['position_m'].T
    for axis, across in ((side, z), (top, y)):
        axis.plot(x, across, color=colour, label=name)
        axis.plot(x[0], across[0], 'o', color=colour)
    if a.landing is not None:
        for axis, across in ((side, 0.0), (top, a.landing.y)):
            axis.plot(a.landing.x, across, 'x', color=colour, ms=9, mew=2)


def _histories(histories: 'Sequence[Axes]', a: 'Analysis', colour: str) -> None:
    samples = columns(a.trajectory)
    values = (
        samples['position_m'][:, 2],
        samples['airspeed_m_s'],
        samples['alpha_deg'],
        samples['spin_rad_s'],
    )
    for axis, history in zip(histories, values, strict=True):
        axis.plot(samples['t_s'], history, color=colour)


def _steering(axis: 'Axes', analyses: 'Sequence[Analysis]', topic: str) -> None:
    """Draw the inputs of a topic as steps."""
    names, text = _INPUT_LABELS[topic]
    steered = [(i, a, _inputs(a, topic)) for i, a in enumerate(analyses) if _inputs(a, topic)]
    for i, a, changes in steered:
        times = [a.flight.time_of(c.stamp) for c in changes]
        values = np.array([c.values for c in changes])
        end = float(a.trajectory.t[-1])
        rows = np.vstack([np.zeros(3), values, values[-1]])
        for j, name in enumerate(names):
            axis.step(
                [min(0.0, *times), *times, max(end, *times)],
                rows[:, j],
                where='post',
                color=COLOURS[i % len(COLOURS)] if len(analyses) > 1 else COLOURS[j],
                ls=_STYLES[j],
                label=name if a is steered[0][1] else None,
            )
    axis.set(xlabel='time, s', ylabel=text)
    axis.legend(loc='best')


def _inputs(a: 'Analysis', topic: str) -> 'list[Change]':
    """Return the changes of a topic during a flight, up to its landing."""
    start, end = a.flight.start, float(a.trajectory.t[-1])
    return [
        c
        for c in a.flight.disc.changes
        if c.topic == topic and start <= c.stamp and a.flight.time_of(c.stamp) <= end
    ]


def image(figure: Figure, kind: str, dpi: int = 120) -> bytes:
    """Return a figure as the bytes of a file of the `kind` 'png', 'svg' or 'pdf'."""
    buffer = BytesIO()
    with warnings.catch_warnings():
        # A disc name in a script that the font lacks is drawn as boxes, without a warning.
        warnings.filterwarnings('ignore', message='Glyph .* missing from font')
        if kind == 'png':  # `savefig` would draw it twice, first for the layout alone
            figure.set_dpi(dpi)
            canvas = FigureCanvasAgg(figure)
            canvas.draw()  # type: ignore[no-untyped-call]
            pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
            Image.fromarray(pixels).save(buffer, format='png', dpi=(dpi, dpi))
        else:
            figure.savefig(buffer, format=kind)
    return buffer.getvalue()
