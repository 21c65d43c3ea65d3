"""Fig. 5: the typical flight, with the wind tunnel table and with the fitted lines."""

from dataclasses import dataclass
import sys
from typing import Any

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.figure_files import PaperFigure
from disc_sim_ros.physics.launch import Launch

TITLE = 'Fig. 5: a typical flight, table and linear aerodynamics'
CONDITIONS = (
    'Constant-spin model, moments in axes 3 (body), damping as named. Discs every 0.2 s, '
    'enlarged 8 times. Paper: points read off.'
)
LAUNCH = Launch(speed=15.0, pitch=15.0, spin=10 * np.pi)  # 5 rev/s
DURATION = 4.0  # s
HISTORIES = (  # letter, column of the paper's points, column of ours, label
    ('c', 'phi', 'phi_deg', 'roll φ, °'),
    ('d', 'V', 'V_m_s', 'speed V, m/s'),
    ('e', 'alpha', 'alpha_deg', 'angle of attack α, °'),
    ('f', 'lambda', 'lambda_deg', 'absolute attitude λ, °'),
    ('g', 'theta', 'theta_deg', 'pitch θ, °'),
    ('h', 'AdvR', 'AdvR', 'advance ratio'),
)
NAMES = {name: column for _, name, column, _ in HISTORIES}
UNITS = {'V': 'm/s', 'AdvR': ''}  # all others are in degrees


@dataclass(frozen=True)
class Data:
    """The flights with the table and with lines, and points read off the paper's curves."""

    curves: tuple[Curve, ...]
    linear: tuple[Curve, ...]
    read: dict[str, FloatArray]


def compute() -> Data:
    """Fly the launch without ground, as drawn: it starts at Z = 0 and continues below."""

    def flight(aero: str, share: float) -> Curve:
        flown = conditions.flown(LAUNCH, share, duration=DURATION, aero=aero)
        return Curve(f'{aero}, {conditions.percent(share)}', share, flown)

    shares = (*conditions.SHARES, conditions.HUNDREDTH)
    return Data(
        tuple(flight('table', share) for share in shares),
        tuple(flight('linear', share) for share in conditions.SHARES),
        conditions.read('fig5_time_histories.csv'),
    )


def rms(curve: Curve, read: dict[str, FloatArray], suffix: str = '') -> dict[str, float]:
    """Return the rms distance of each history from all 21 points read off [its unit]."""
    at_points = np.searchsorted(curve.t.t, read['t_s'] - 1e-6)
    ours = conditions.quantities(curve.t)
    return {
        name: float(np.sqrt(np.mean((ours[column][at_points] - read[name + suffix]) ** 2)))
        for name, column in NAMES.items()
        if name + suffix in read
    }


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw all eight panels."""
    figure = style.sheet(12.4, TITLE, CONDITIONS)
    grid = figure.add_gridspec(5, 2, height_ratios=(1.75, 1.0, 1, 1, 1))
    top, side = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, :])
    shown: tuple[tuple[Curve, dict[str, Any]], ...] = (
        (data.curves[0], {'color': look.printed}),
        (data.curves[1], {'color': look.tenth, 'ls': (0, (4, 1.6))}),
        (data.linear[0], {'color': look.third, 'lw': 1.2}),
    )
    for axis, which in ((top, style.TOP), (side, style.SIDE)):
        style.views(axis, which, equal='box')
        axis.set_xlim(-2.0, 30.0)
        for i, (curve, line) in enumerate(shown):
            style.path(axis, curve.t, which, label=curve.label, **line)
            if i != 1:
                style.discs(axis, curve.t, which, every=0.2, size=8.0, colour=line['color'])
    style.letter(top, 'a', 'view from above')
    style.letter(side, 'b', 'view from the right')
    for i, (name, column, ours, label) in enumerate(HISTORIES):
        axis = figure.add_subplot(grid[2 + i // 2, i % 2])
        for curve, line in shown:
            axis.plot(curve.t.t, conditions.quantities(curve.t)[ours], **line)
        mark: dict[str, Any] = {'ls': '', 'ms': 4.5, 'color': look.ink}
        axis.plot(data.read['t_s'], data.read[column], marker='o', label='paper, table', **mark)
        if f'{column}_lin' in data.read:
            mark |= {'mfc': 'none', 'mew': 0.9}
            points = data.read[f'{column}_lin']
            axis.plot(data.read['t_s'], points, marker='s', label='paper, linear', **mark)
        axis.set(xlabel='time, s', ylabel=label)
        style.letter(axis, name, '')
        if name == 'd':
            axis.legend(loc='upper right')
    top.set_ylim(7.6, -1.8)
    side.set_ylim(-2.4, 3.4)
    top.legend(loc='lower left')
    return figure


def findings(data: Data) -> list[str]:
    """Return the rms distance of each flight from the curves of the paper."""
    lines = [
        _distance(curve, rms(curve, data.read)) + ' from the black curves' for curve in data.curves
    ]
    lines += [
        _distance(curve, rms(curve, data.read, '_lin')) + ' from the grey curves: the lines '
        'of Fig. 3 do not reproduce them, least of all the roll'
        for curve in data.linear
    ]
    return [f'{line}.' for line in lines]


def _distance(curve: Curve, rms: dict[str, float]) -> str:
    parts = (f'{name} {value:.2f} {UNITS.get(name, "°")}'.strip() for name, value in rms.items())
    return f'{curve.label}: rms ' + ', '.join(parts)


def table(data: Data) -> str:
    """Return the samples and the points read off as CSV."""
    black = {NAMES[name]: data.read[name] for name in NAMES} | {'t_s': data.read['t_s']}
    grey = {NAMES[n]: data.read[f'{n}_lin'] for n in NAMES if f'{n}_lin' in data.read}
    points = {'paper, black, read off': black}
    points['paper, grey, read off'] = grey | {'t_s': data.read['t_s']}
    return conditions.csv_of_curves(data.curves + data.linear, points)


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    return data.curves[1]


FIGURE = PaperFigure(
    key='5',
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
