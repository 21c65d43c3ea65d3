"""Plots of recorded flights: where they went, how they flew and how they were steered."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.analysis.bag_report import STILL, Analysis, document
from disc_sim_ros.analysis.flight_report import columns
from disc_sim_ros.analysis.recording import NANOSECONDS, Change

COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#000000')
_INPUTS = {
    'applied_coefficients': (('C_L', 'C_M', 'C_N'), 'control coefficients'),
    'applied_moment': (('x', 'y', 'z'), 'control moment, N m'),
}
_STYLES = ('-', '--', ':')
_MOST_NAMED = 8  # flights in a legend


def bag_figure(analyses: Sequence[Analysis], heading: str) -> Figure:
    """Return a figure of one or more recorded flights.

    Side and top view to scale, height, airspeed, angle of attack and spin over the time since
    each release, and the control inputs where there were any.
    """
    inputs = [topic for topic in _INPUTS if any(_of(a, topic) for a in analyses)]
    rows = 3 + bool(inputs)
    figure = Figure(figsize=(11, 2.0 + 2.4 * rows), layout='constrained')
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(rows, 2, height_ratios=(1.3, *[1.0] * (rows - 1)))
    side, top = (figure.add_subplot(grid[0, i]) for i in range(2))
    histories = [figure.add_subplot(grid[1 + i // 2, i % 2]) for i in range(4)]
    for i, a in enumerate(analyses):
        colour = COLOURS[i % len(COLOURS)]
        name = f'{a.flight.disc.name}, flight {a.flight.number}'
        _views(side, top, a, colour, name)
        _histories(histories, a, colour)
    for axis, across in ((side, 'height z, m'), (top, 'left y, m')):
        axis.set(xlabel='forward x, m', ylabel=across)
        axis.set_aspect('equal', adjustable='datalim')
    side.axhline(0.0, color='0.6', lw=0.8)
    if 1 < len(analyses) <= _MOST_NAMED:
        side.legend(loc='best')
    air = 'speed over the ground' if all(a.wind == STILL for a in analyses) else 'airspeed'
    labels = ('height, m', f'{air}, m/s', 'angle of attack, °', 'spin, rad/s')
    for axis, label in zip(histories, labels, strict=True):
        axis.set(xlabel='time, s', ylabel=label)
    for i, topic in enumerate(inputs):
        place = grid[3, :] if len(inputs) == 1 else grid[3, i]
        _steering(figure.add_subplot(place), analyses, topic)
    for axis in figure.axes:
        axis.grid(alpha=0.3)
    figure.suptitle(heading, parse_math=False)  # a path may have dollars in it
    return figure


def title(a: Analysis) -> str:
    """Return one line that says what flew and how far."""
    d = document(a)
    launch, told = d['launch'], d['setup']
    what = f'{told["disc"]}, {told["model"]} model' if told else a.flight.disc.name
    return (
        f'{what}: {launch["speed_m_s"]:.4g} m/s, pitch {launch["pitch_deg"]:.3g}°, '
        f'spin {launch["spin_rad_s"]:.4g} rad/s; {d["range_m"]:.1f} m '
        f'in {d["flight_time_s"]:.2f} s'
    )


def _views(side: Axes, top: Axes, a: Analysis, colour: str, name: str) -> None:
    x, y, z = columns(a.trajectory)['position_m'].T
    for axis, across in ((side, z), (top, y)):
        axis.plot(x, across, color=colour, label=name)
        axis.plot(x[0], across[0], 'o', color=colour)
    if a.landing is not None:
        place = a.landing['landing_x_m'], a.landing['landing_y_m']
        for axis, across in ((side, 0.0), (top, place[1])):
            axis.plot(place[0], across, 'x', color=colour, ms=9, mew=2)


def _histories(histories: Sequence[Axes], a: Analysis, colour: str) -> None:
    found = columns(a.trajectory)
    values = (
        found['position_m'][:, 2],
        found['airspeed_m_s'],
        found['alpha_deg'],
        found['spin_rad_s'],
    )
    for axis, history in zip(histories, values, strict=True):
        axis.plot(found['t_s'], history, color=colour)


def _steering(axis: Axes, analyses: Sequence[Analysis], topic: str) -> None:
    """Draw the inputs of a topic as the steps that they are."""
    names, label = _INPUTS[topic]
    steered = [(i, a, _of(a, topic)) for i, a in enumerate(analyses) if _of(a, topic)]
    for i, a, changes in steered:
        times = [(c.stamp - a.flight.start) / NANOSECONDS for c in changes]
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
    axis.set(xlabel='time, s', ylabel=label)
    axis.legend(loc='best')


def _of(a: Analysis, topic: str) -> list[Change]:
    """Return the changes of a topic during a flight, up to its landing."""
    end = a.flight.start + round(float(a.trajectory.t[-1]) * NANOSECONDS)
    return [
        c for c in a.flight.disc.changes if c.topic == topic and a.flight.start <= c.stamp <= end
    ]
