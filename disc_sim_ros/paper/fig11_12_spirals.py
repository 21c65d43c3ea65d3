"""Figs. 11 and 12: a spiral turn and a spiral roll, each steered by a constant control input.

Fig. 11 has a rolling moment coefficient, Fig. 12 a pitching moment coefficient. Fig. 12 was drawn
without gravity (docs/deviations.md); here it is drawn without and with gravity.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import sys
from typing import Any

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.figure_files import PaperFigure
from disc_sim_ros.physics.flight import Flight
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch

HISTORIES = (
    ('V_m_s', 'speed V, m/s'),
    ('alpha_deg', 'angle of attack α, °'),
    ('lambda_deg', 'absolute attitude λ, °'),
    ('AdvR', 'advance ratio'),
)

# ---- Fig. 11: spiral turn ----

TURN_TITLE = 'Fig. 11: spiral turn, C_L = 0.1'
TURN_CONDITIONS = (
    'Table aerodynamics, moments in axes 3 or 4 and damping as named; constant-spin model, but '
    'for the thin line, which is exact.\n'
    'Discs every 0.2 s, enlarged 4 times.'
)
TURN_LAUNCH = Launch(
    speed=13.5,
    roll=-45.0,
    pitch=-30.0,
    angle_of_attack=5.0,
    spin=conditions.spin_of(0.5, 13.5),
)
TURN_CONTROL = Control(C_L=0.1)
TURN_DURATION = 7.0  # s
SETTLED = (2.0, 4.0)  # s, time span of the mean values that the text states
TURN_STATED = {'alpha_deg': 15.0, 'lambda_deg': 30.0, 'V_m_s': 7.0}

# ---- Fig. 12: spiral roll ----

ROLL_TITLE = 'Fig. 12: spiral roll, C_M = 0.2'
ROLL_CONDITIONS = (
    'Constant-spin model, table aerodynamics, moments in axes 3 (body); damping as printed and '
    "10 % of it.\nDiscs every 0.2 s, enlarged 4 times. The paper's figure ends about 12 m down."
)
ROLL_LAUNCH = Launch(
    speed=19.0, pitch=-20.0, angle_of_attack=-3.0, spin=conditions.spin_of(0.34, 19.0)
)
ROLL_CONTROL = Control(C_M=0.2)
ROLL_DURATION = 4.0  # s
ROLL_STATED = {'alpha_deg': -3.0}
GRAVITIES = (0.0, 9.81)  # m/s^2


@dataclass(frozen=True)
class Data:
    """The flights of one figure.

    Of Fig. 11: moments in axes 3 with both dampings, moments in axes 4, and the exact model with
    moments in axes 3. Of Fig. 12: without and with gravity, each with both dampings.
    """

    curves: tuple[Curve, ...]


def compute_turn() -> Data:
    """Fly the turn without ground: it continues below the launch."""

    def turn(label: str, share: float, **options: str) -> Curve:
        flight = conditions.flown(
            TURN_LAUNCH, share, duration=TURN_DURATION, control=TURN_CONTROL, **options
        )
        return Curve(label, share, flight)

    return Data(
        (
            *(turn(f'axes 3, {conditions.percent(share)}', share) for share in conditions.SHARES),
            turn('axes 4, damping as printed', conditions.PRINTED, moment_axes='wind'),
            turn('axes 3, damping as printed, exact', conditions.PRINTED, model='exact'),
        )
    )


def compute_roll() -> Data:
    """Fly the roll without ground, without and with gravity."""

    def roll(gravity: float, share: float) -> Curve:
        flight = conditions.flown(
            ROLL_LAUNCH, share, duration=ROLL_DURATION, control=ROLL_CONTROL, gravity=gravity
        )
        name = 'with gravity' if gravity else 'no gravity'
        return Curve(f'{name}, {conditions.percent(share)}', share, flight, gravity)

    return Data(tuple(roll(g, share) for g in GRAVITIES for share in conditions.SHARES))


def exact_roll(gravity: float, share: float) -> Flight:
    """Fly the roll in the exact model."""
    return conditions.flown(
        ROLL_LAUNCH,
        share,
        duration=ROLL_DURATION,
        control=ROLL_CONTROL,
        gravity=gravity,
        model='exact',
    )


def mean(curve: Curve, name: str, span: tuple[float, float] = SETTLED) -> float:
    """Return the mean of a history over a span of time [unit of the history]."""
    chosen = (curve.t.t >= span[0] - 1e-9) & (curve.t.t <= span[1] + 1e-9)
    return float(np.mean(conditions.quantities(curve.t)[name][chosen]))


def descent_angle(curve: Curve) -> tuple[float, float]:
    """Return least and greatest angle of the path below the horizon, means over 0.5 s [degrees].

    Means, because the disc rolls about its path and the angle swings with it.
    """
    window = round(0.5 * conditions.RATE)
    velocity = curve.t.velocity[: len(curve.t) // window * window].reshape(-1, window, 3)
    X, Y, Z = velocity.mean(axis=1).T
    angle = np.degrees(np.arctan2(Z, np.hypot(X, Y)))
    return float(angle.min()), float(angle.max())


@style.styled
def plot_turn(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw both views and the histories of Fig. 11."""
    lines = (
        {'color': look.printed},
        {'color': look.tenth, 'ls': (0, (4, 1.6))},
        {'color': look.third, 'ls': ':'},
        {'color': look.fourth, 'lw': 0.9},
    )
    return _draw(data.curves, lines, (TURN_TITLE, TURN_CONDITIONS), TURN_STATED, look)


@style.styled
def plot_roll(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw both views and the histories of Fig. 12."""
    dashed = {'ls': (0, (4, 1.6)), 'lw': 1.2}
    lines = (
        {'color': look.printed},
        {'color': look.printed} | dashed,
        {'color': look.tenth},
        {'color': look.tenth} | dashed,
    )
    words = (ROLL_TITLE, ROLL_CONDITIONS)
    return _draw(data.curves, lines, words, ROLL_STATED, look, with_discs=(0, 2))


def _draw(
    curves: Sequence[Curve],
    lines: Sequence[dict[str, Any]],
    words: tuple[str, str],
    stated: dict[str, float],
    look: style.Look,
    *,
    with_discs: Sequence[int] = (0,),
) -> Figure:
    """Draw two views and four time histories.

    Args:
        curves: The flights.
        lines: Line style of each flight.
        words: Title and conditions.
        stated: Values that the text states for a history, by its name; drawn as dotted lines.
        look: Colours.
        with_discs: Indices of the flights along which discs are drawn.
    """
    figure = style.sheet(9.4, *words)
    grid = figure.add_gridspec(3, 2, height_ratios=(1.9, 1, 1))
    for column, (side, title) in enumerate(
        ((style.TOP, 'view from above'), (style.SIDE, 'view from the right'))
    ):
        axis = figure.add_subplot(grid[0, column])
        for i, (curve, line) in enumerate(zip(curves, lines, strict=True)):
            style.path(axis, curve.t, side, label=curve.label, **line)
            if i in with_discs:
                colour = line['color']
                style.discs(axis, curve.t, side, every=0.2, size=4.0, colour=colour)
        style.views(axis, side)
        axis.set_title(title)
        if column == 0:
            handles = axis.get_legend_handles_labels()
    figure.legend(*handles, loc='outside upper right', ncols=min(len(curves), 2))
    for i, (name, label) in enumerate(HISTORIES):
        axis = figure.add_subplot(grid[1 + i // 2, i % 2])
        for curve, line in zip(curves, lines, strict=True):
            axis.plot(curve.t.t, conditions.quantities(curve.t)[name], **line)
        if name in stated:
            axis.axhline(stated[name], color=look.ink, ls=':', lw=1.3)
            axis.annotate(
                f'paper: {stated[name]:g}',
                (1.0, stated[name]),
                xycoords=('axes fraction', 'data'),
                ha='right',
                va='bottom',
                fontsize=9,
            )
        axis.set(xlabel='time, s', ylabel=label)
    return figure


def turn_findings(data: Data) -> list[str]:
    """Return the mean values of the settled turn, and the spin."""
    lines = []
    for curve in data.curves:
        spin = curve.t.spin
        means = ', '.join(
            f'{symbol} {mean(curve, name):.1f}{unit}'
            for symbol, name, unit in (
                ('α', 'alpha_deg', '°'),
                ('λ', 'lambda_deg', '°'),
                ('V', 'V_m_s', ' m/s'),
            )
        )
        lines.append(
            f'{curve.label}: mean over {SETTLED[0]:g} to {SETTLED[1]:g} s {means}; spin '
            f'{spin[0]:.1f} to {spin[-1]:.1f} rad/s.'
        )
    exact = conditions.flown(
        TURN_LAUNCH,
        duration=TURN_DURATION,
        control=TURN_CONTROL,
        moment_axes='wind',
        model='exact',
    )
    lines.append(
        'The path does not distinguish axes 3 from axes 4, but the spin does: in the exact model '
        f'with axes 4 the control input drives the spin to {exact.end.r:.1f} rad/s.'
    )
    return lines


def roll_findings(data: Data) -> list[str]:
    """Return the depth, and the ranges of the angle of attack and of the path angle."""
    lines = []
    for curve in data.curves:
        alpha = np.degrees(curve.t.alpha)
        lowest, highest = descent_angle(curve)
        lines.append(
            f'{curve.label}: {curve.flight.end.Z:.1f} m down after {ROLL_DURATION:g} s; angle of '
            f'attack from {alpha.min():.1f}° to {alpha.max():.1f}°, path {lowest:.0f}° to '
            f'{highest:.0f}° below the horizon (means over 0.5 s).'
        )
    exact = ', '.join(
        f'{flight.end.Z:.1f} m {"with" if gravity else "without"} gravity at '
        f'{conditions.percent(share)}'
        for gravity in GRAVITIES
        for share in conditions.SHARES
        for flight in [exact_roll(gravity, share)]
    )
    return [*lines, f'The exact model, which loses spin: {exact}.']


def table(data: Data) -> str:
    """Return the samples as CSV."""
    return conditions.csv_of_curves(data.curves, {})


TURN = PaperFigure(
    key='11',
    title=TURN_TITLE,
    conditions=TURN_CONDITIONS,
    compute=compute_turn,
    plot=plot_turn,
    findings=turn_findings,
    table=table,
    example=lambda data: data.curves[3],
)
ROLL = PaperFigure(
    key='12',
    title=ROLL_TITLE,
    conditions=ROLL_CONDITIONS,
    compute=compute_roll,
    plot=plot_roll,
    findings=roll_findings,
    table=table,
    example=lambda data: data.curves[0],
)


if __name__ == '__main__':
    sys.exit(figure_files.main(TURN, ROLL))
