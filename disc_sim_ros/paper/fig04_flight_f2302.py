"""Fig. 4: Hummel's flight f2302, from the launch as printed and as corrected.

The printed state treats Hummel's angles, which are of the sequence 1-2-3, as yaw, pitch and roll
(docs/deviations.md). The measured positions are the symbols of the figure, read off.
"""

from dataclasses import dataclass
import math
import sys
from typing import Any

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.figure_files import PaperFigure
from disc_sim_ros.physics import frames, theory
from disc_sim_ros.physics.launch import Launch

TITLE = 'Fig. 4: flight f2302, launch as printed and as corrected'
CONDITIONS = (
    conditions.CONDITIONS + " Paper's disc, table aerodynamics, flown to the ground.\n"
    'Discs every 0.2 s at 10 % damping, enlarged 3 times. Circles: measured, read off the figure.'
)

RELEASE = (-0.90, -0.63, -0.91)  # X, Y, Z, m
ANGLES = (-0.07, 0.21, 5.03)  # phi, theta, psi, rad
UVW = (4.48, 12.52, 1.84)  # m/s
PQR = (-26.25, -5.19, 52.85)  # rad/s
# Hummel 2003, Table 3-3: the same angles as a sequence 1-2-3, the velocity in earth axes, and the
# rates of the angles.
VELOCITY = (13.42, -0.41, 0.001)  # m/s
ANGLE_RATES = (-14.94, -1.48, 54.25)  # rad/s
FIRST_WOBBLE = 0.2  # s, time span in which it is measured


@dataclass(frozen=True)
class Data:
    """The flights of both launches, each with both dampings, and the measured positions."""

    printed: tuple[Curve, ...]
    corrected: tuple[Curve, ...]
    read: dict[str, FloatArray]

    @property
    def measured(self) -> FloatArray:
        """Return the measured positions, X, Y, Z [m], shape (n, 3)."""
        return np.column_stack([self.read[n] for n in ('X_forward_m', 'Y_right_m', 'Z_down_m')])

    @property
    def curves(self) -> tuple[Curve, ...]:
        """Return all flights."""
        return self.printed + self.corrected


def printed_launch() -> Launch:
    """Return the launch of the table below Fig. 4 of the paper."""
    phi, theta, psi = (math.degrees(angle) for angle in ANGLES)
    return _launch((phi, theta, psi), UVW, PQR)


def corrected_launch() -> Launch:
    """Return the same launch with Hummel's angles in her own sequence, roll first."""
    phi, theta, gamma = ANGLES
    attitude = _about(0, phi) @ _about(1, theta) @ _about(2, gamma)  # body to earth
    uvw = attitude.T @ VELOCITY
    spin_last = _about(2, gamma).T
    before = _about(1, theta).T @ (ANGLE_RATES[0], 0, 0) + (0, ANGLE_RATES[1], 0)
    p, q, r = spin_last @ before
    roll = math.atan2(attitude[2, 1], attitude[2, 2])
    pitch = math.asin(-attitude[2, 0])
    yaw = math.atan2(attitude[1, 0], attitude[0, 0])
    angles = (math.degrees(roll), math.degrees(pitch), math.degrees(yaw))
    return _launch(angles, tuple(uvw), (p, q, r + ANGLE_RATES[2]))


def compute() -> Data:
    """Fly both launches to the ground."""

    def flights(name: str, launch: Launch) -> tuple[Curve, ...]:
        return tuple(
            Curve(name, share, conditions.flown(launch, share, ground=True, rate=500.0))
            for share in conditions.SHARES
        )

    return Data(
        flights('launch as printed', printed_launch()),
        flights('launch as corrected', corrected_launch()),
        conditions.read('fig4_positions.csv'),
    )


def wobble(curve: Curve) -> float:
    """Return the amplitude of the angle of attack in the first 0.2 s [degrees]."""
    first = np.degrees(curve.t.alpha)[curve.t.t <= FIRST_WOBBLE]
    return float(np.ptp(first) / 2)


def rms(curve: Curve, data: Data) -> float:
    """Return the root mean square of the distances of a flight from the measured points [m]."""
    start = (RELEASE[0], RELEASE[1], 0.0)  # the height is in the launch
    path = curve.t.position + start
    at = np.column_stack([np.interp(data.read['t_s'], curve.t.t, column) for column in path.T])
    return float(np.sqrt(np.mean(np.sum((at - data.measured) ** 2, axis=1))))


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw both views, the speed and the angle of attack."""
    figure = style.sheet(7.4, TITLE, CONDITIONS)
    grid = figure.add_gridspec(3, 2, height_ratios=(1.0, 1.0, 1.0))
    top, side = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, :])
    speed, alpha = figure.add_subplot(grid[2, 0]), figure.add_subplot(grid[2, 1])
    for curves, colour in ((data.printed, look.printed), (data.corrected, look.tenth)):
        for curve in curves:
            line: dict[str, Any] = {
                'color': colour,
                'ls': '-' if curve.share == conditions.PRINTED else (0, (4, 1.6)),
                'label': f'{curve.label}, {conditions.percent(curve.share)}',
            }
            for axis, which in ((top, style.TOP), (side, style.SIDE)):
                start = (RELEASE[0], RELEASE[1], 0.0)  # the height is in the launch
                axis.plot(*style.view(curve.t.position + start, which).T, **line)
                if curve.share == conditions.TENTH:
                    style.discs(
                        axis, curve.t, which, every=0.2, size=3.0, colour=colour, start=start
                    )
            speed.plot(curve.t.t, curve.t.airspeed, **line)
            shown = curve.t.t <= 1.0
            alpha.plot(curve.t.t[shown], np.degrees(curve.t.alpha)[shown], **line)
    for axis, which in ((top, style.TOP), (side, style.SIDE)):
        circles = style.view(data.measured, which)
        axis.plot(*circles.T, 'o', mfc='none', color=look.ink, ms=5, label='measured, read off')
    for axis, which, limits in (
        (top, style.TOP, (1.0, -3.6)),
        (side, style.SIDE, (-0.6, 2.6)),
    ):
        style.views(axis, which, equal='box')
        axis.set(xlim=(-1.6, 21.4), ylim=limits)
    speed.set(xlabel='time, s', ylabel='airspeed, m/s')
    alpha.set(xlabel='time, s (the first second)', ylabel='angle of attack, °')
    top.set_title('view from above')
    side.set_title('view from the right')
    side.legend(loc='upper right', ncols=2)
    return figure


def findings(data: Data) -> list[str]:
    """Return launch angle, rates and wobble of both launches, and the landing times."""
    lines = []
    for launch, curves in (
        (printed_launch(), data.printed),
        (corrected_launch(), data.corrected),
    ):
        transverse = math.hypot(launch.roll_rate, launch.pitch_rate)
        swing = ', '.join(f'{wobble(c):.1f}° with {conditions.percent(c.share)}' for c in curves)
        lines.append(
            f'{curves[0].label}: angle of attack {launch.angle_of_attack:.1f}°, transverse rate '
            f'{transverse:.2f} rad/s, spin {launch.spin:.2f} rad/s; angle of attack swings by '
            f'±{swing} in the first {FIRST_WOBBLE} s; lands after '
            + ', '.join(f'{c.flight.time:.2f} s' for c in curves)
            + '; distance from the measured points rms '
            + ', '.join(f'{rms(c, data):.2f} m' for c in curves)
            + '.'
        )
    return lines


def table(data: Data) -> str:
    """Return the samples as CSV; X and Y are relative to the release."""
    start = np.array((RELEASE[0], RELEASE[1], 0.0))
    read = {'t_s': data.read['t_s']}
    names = ('X_forward_m', 'Y_right_m', 'Z_down_m')
    read |= dict(zip(names, (data.measured - start).T, strict=True))
    return conditions.csv_of_curves(data.curves, {'measured, read off': read})


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    return data.corrected[1]


def _launch(angles: tuple[float, ...], uvw: tuple[float, ...], pqr: tuple[float, ...]) -> Launch:
    u, v, w = uvw
    return Launch(
        speed=math.hypot(u, v, w),
        roll=angles[0],
        pitch=angles[1],
        yaw=angles[2],
        angle_of_attack=math.degrees(theory.angle_of_attack(u, v, w)),
        sideslip=math.degrees(math.atan2(v, u)),
        spin=pqr[2],
        roll_rate=pqr[0],
        pitch_rate=pqr[1],
        height=frames.flip(RELEASE[2]),
    )


def _about(axis: int, angle: float) -> FloatArray:
    """Return the matrix of a rotation about x, y or z."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.zeros((3, 3))
    turn[axis, axis] = 1.0
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[i, i] = turn[j, j] = c
    turn[i, j], turn[j, i] = -s, s
    return turn


FIGURE = PaperFigure(
    key='4',
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
