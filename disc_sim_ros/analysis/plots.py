"""Plots of one flight: the two views and the time histories of the paper's Fig. 5."""

from io import BytesIO
import warnings

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from disc_sim_ros.analysis.flight_report import columns
from disc_sim_ros.physics.flight import Flight

BLUE, ORANGE = '#0072b2', '#d55e00'  # Okabe and Ito: safe for colour-blind readers
_HISTORIES = (
    ('airspeed_m_s', 'airspeed, m/s'),
    ('alpha_deg', 'angle of attack, °'),
    ('roll_deg', 'roll, °'),
    ('pitch_deg', 'pitch, °'),
    ('absolute_attitude_deg', 'absolute attitude, °'),
    ('spin_rad_s', 'spin, rad/s'),
)


def flight_figure(flight: Flight) -> Figure:
    """Return a figure of a sampled flight: side and top view to scale, and its time histories."""
    found = columns(flight.trajectory)
    x, y, z = found['position_m'].T
    figure = Figure(figsize=(11, 9), layout='constrained')
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(4, 2, height_ratios=(1.2, 1, 1, 1))
    side = figure.add_subplot(grid[0, 0])
    top = figure.add_subplot(grid[0, 1])
    for axis, across, label in ((side, z, 'height z, m'), (top, y, 'left y, m')):
        axis.plot(x, across, color=BLUE)
        axis.plot(x[0], across[0], 'o', color='black', label='release')
        axis.set(xlabel='forward x, m', ylabel=label)
        axis.set_aspect('equal', adjustable='datalim')
    if flight.landed:
        for axis, across in ((side, 0.0), (top, flight.position[1])):
            axis.plot(flight.position[0], across, 'x', color=ORANGE, ms=9, mew=2, label='landing')
        side.axhline(0.0, color='0.6', lw=0.8)
    side.legend(loc='best')
    for i, (name, label) in enumerate(_HISTORIES):
        axis = figure.add_subplot(grid[1 + i // 2, i % 2])
        axis.plot(found['t_s'], found[name], color=BLUE)
        axis.set(xlabel='time, s', ylabel=label)
    ratio = axis.twinx()
    ratio.plot(found['t_s'], found['advance_ratio'], color=ORANGE, ls='--')
    ratio.set_ylabel('advance ratio (dashed)')
    for axis in figure.axes:
        axis.grid(alpha=0.3)
    launch = flight.launch
    figure.suptitle(
        f'{flight.setup.disc.name}, {flight.setup.model} model: {launch.speed:g} m/s, '
        f'pitch {launch.pitch:g}°, roll {launch.roll:g}°, spin {launch.spin:g} rad/s; '
        f'{flight.range:.1f} m in {flight.time:.2f} s',
        parse_math=False,  # a file may have dollars in its name
    )
    return figure


def image(figure: Figure, kind: str) -> bytes:
    """Return a figure as the bytes of a file of the `kind` 'png', 'svg' or 'pdf'."""
    buffer = BytesIO()
    with warnings.catch_warnings():
        # The name of a disc in a script that the font lacks shows as boxes, and that is enough.
        warnings.filterwarnings('ignore', message='Glyph .* missing from font')
        figure.savefig(buffer, format=kind, dpi=120)
    return buffer.getvalue()
