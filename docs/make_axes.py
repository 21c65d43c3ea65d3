"""Draw the axes of docs/axes.md: `python docs/make_axes.py [FOLDER]`, by default this folder.

Every arrow and arc follows from disc_sim_ros.physics.frames: vectors are given in the axes that
define them, rotated by its matrices and then projected. Nothing is placed by hand but labels.
"""
# ruff: noqa: N803, N806 - R and V are the paper's letters

from collections.abc import Callable
from pathlib import Path
import sys
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
import numpy as np
from numpy.typing import ArrayLike

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.kernels import rotation

# Okabe and Ito: safe for colour-blind readers. Line styles tell the same without colour.
PAPER, MESSAGE, TURN, ANGLE = '#d55e00', '#0072b2', '#009e73', '#cc79a7'
SHARED, REFERENCE, GROUND = 'black', '0.45', '0.85'
TOP, RIM = '#fdeed0', '#e69f00'  # the disc: its lighter upper side, its rim
HEAD = 0.24  # length of an arrow's head, in the unit of the drawing
FONT = 12.0  # points; the figures are 8 inches wide, 800 px at 100 dots per inch
DPI = 200
STYLE: dict[Any, Any] = {
    'font.size': FONT,
    'mathtext.fontset': 'dejavusans',
    'svg.hashsalt': 'disc_sim_ros',
}

X, Y, Z = np.eye(3)
SIGMA = 45.0  # degrees, the drawn spin angle
Projection = Callable[[ArrayLike], FloatArray]


def columns(phi: float = 0.0, theta: float = 0.0, psi: float = 0.0) -> FloatArray:
    """Return x, y, z of axes turned by yaw, pitch, roll [degrees], as columns in the old axes."""
    return frames.rotation_matrix(frames.quaternion_from_euler(phi, theta, psi))


def axes_3(beta: float) -> FloatArray:
    """Return axes 3 as columns in axes 2: turned right by the sideslip [degrees]."""
    return columns(psi=beta)


def axes_4(alpha: float) -> FloatArray:
    """Return axes 4 as columns in axes 3: nose down by the angle of attack [degrees]."""
    return columns(theta=-alpha)


def message_axes(paper: FloatArray) -> FloatArray:
    """Return REP-103 axes beside the given ones, columns in the same old axes."""
    return paper @ frames.map_from_paper(np.eye(3))


def onto(right: ArrayLike, up: ArrayLike) -> Projection:
    """Return the projection whose page has `right` to the right and `up` up, unit vectors."""
    page = np.array([right, up], dtype=float)
    return lambda points: np.asarray(points, dtype=float) @ page.T


def seen_from(azimuth: float, elevation: float) -> Projection:
    """Return the projection for an eye in this direction in `map` [degrees], z up on the page."""
    c_a, s_a = rotation.cos_sin_degrees(azimuth)
    c_e, s_e = rotation.cos_sin_degrees(elevation)
    page = onto((-s_a, c_a, 0.0), (-s_e * c_a, -s_e * s_a, c_e))
    return lambda points: page(frames.map_from_paper(points))


def circle(first: ArrayLike, second: ArrayLike, start: float, end: float) -> FloatArray:
    """Return points from `start` to `end` degrees, 0 along `first` and 90 along `second`."""
    angle = np.radians(np.linspace(start, end, 91))[:, None]
    return np.cos(angle) * np.asarray(first) + np.sin(angle) * np.asarray(second)


class Drawing:
    """Draws points of three dimensions on one Axes through one projection."""

    def __init__(self, page: Axes, projection: Projection, title: str = '') -> None:
        self.page, self.projection = page, projection
        page.set_aspect('equal', anchor='N')
        page.axis('off')
        page.text(0.5, 1.0, title, ha='center', va='top', transform=page.transAxes)

    def line(self, points: ArrayLike, color: str, **kwargs: Any) -> None:
        """Draw a line through points of shape (n, 3)."""
        self.page.plot(*self.projection(points).T, color=color, **kwargs)

    def patch(self, points: ArrayLike, **kwargs: Any) -> None:
        """Fill the outline through points of shape (n, 3)."""
        self.page.fill(*self.projection(points).T, **kwargs)

    def arrow(
        self,
        start: ArrayLike,
        vector: ArrayLike,
        color: str,
        label: str = '',
        *,
        style: str = '-',
        width: float = 2.0,
        zorder: float = 5.0,
        gap: float = 0.22,
    ) -> None:
        """Draw an arrow, its label `gap` beyond the head."""
        start = np.asarray(start, dtype=float)
        tail, head = self.projection(start), self.projection(start + vector)
        self._head(tail, head, color, style=style, width=width, zorder=zorder)
        if label:
            along = (head - tail) / np.linalg.norm(head - tail)
            self.text(head + gap * along, label, color)

    def arc(
        self,
        points: FloatArray,
        color: str,
        label: str = '',
        *,
        shift: tuple[float, float] = (0.0, 0.0),
        width: float = 2.0,
        zorder: float = 6.0,
    ) -> None:
        """Draw a curved arrow through points of shape (n, 3), its label beside its middle."""
        page = self.projection(points)
        shaft = page[np.linalg.norm(page - page[-1], axis=1) > HEAD]
        self.page.plot(*shaft.T, color=color, lw=width, zorder=zorder)
        self._head(shaft[-1], page[-1], color, width=width, zorder=zorder)
        if label:
            written = SHARED if color == ANGLE else color  # pale letters are hard to read
            self.text(page[len(page) // 2], label, written, shift)

    def text(
        self, place: ArrayLike, label: str, color: str, shift: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Write a label centred `shift` from a place on the page, its letters seamed in white."""
        seam = [withStroke(linewidth=3, foreground='white')]
        x, y = np.add(place, shift)
        self.page.text(
            x, y, label, color=color, ha='center', va='center', zorder=9, path_effects=seam
        )

    def _head(
        self,
        tail: FloatArray,
        head: FloatArray,
        color: str,
        *,
        style: str = '-',
        width: float,
        zorder: float,
    ) -> None:
        """Draw a shaft in its line style and a solid head."""
        along = (head - tail) / np.linalg.norm(head - tail)
        across = HEAD * 0.36 * np.array([-along[1], along[0]])
        neck = head - HEAD * along
        self.page.plot(
            *np.array([tail, neck]).T, color=color, lw=width, ls=style, zorder=zorder,
            solid_capstyle='butt',
        )  # fmt: skip
        tip = np.array([head, neck + across, neck - across])
        self.page.fill(*tip.T, color=color, lw=0, zorder=zorder)


def disc(drawing: Drawing, centre: ArrayLike, R: FloatArray, radius: float, depth: float) -> None:
    """Draw a disc with its upper side visible, in the axes whose columns are `R`."""
    rim = np.asarray(centre) + radius * circle(R[:, 0], R[:, 1], 0.0, 360.0)
    for share in np.linspace(1.0, 0.0, 12):
        drawing.patch(rim + share * depth * R[:, 2], facecolor=RIM, edgecolor=RIM, zorder=2)
    drawing.patch(rim, facecolor=TOP, edgecolor='0.3', lw=1.2, alpha=0.93, zorder=3)


def edge_on(drawing: Drawing, R: FloatArray, across: FloatArray, radius: float) -> None:
    """Draw a disc seen from its edge, along `across` wide, its rim turned down."""
    z = R[:, 2]
    top, bottom = -0.09 * radius * z, 0.13 * radius * z
    outline = [
        -radius * across + bottom,
        -radius * across,
        -0.82 * radius * across + top,
        0.82 * radius * across + top,
        radius * across,
        radius * across + bottom,
    ]
    drawing.patch(outline, facecolor=TOP, edgecolor='0.3', lw=1.2, zorder=3)


def earth_and_map() -> Figure:
    """Return the drawing of axes 1 and 2 beside the frames `map` and `disc`, and of the angles."""
    figure = Figure(figsize=(8.0, 8.4), facecolor='white')
    FigureCanvasAgg(figure)
    scene(figure.add_axes((0.01, 0.36, 0.98, 0.63)))
    for i, angle in enumerate((yaw, pitch, roll)):
        angle(figure.add_axes((0.01 + 0.33 * i, 0.0, 0.32, 0.36)))
    return figure


def scene(page: Axes) -> None:
    """Draw the ground with axes 1 and `map`, and the tilted disc with axes 2 and `disc`."""
    d = Drawing(page, seen_from(azimuth=-128.0, elevation=24.0))
    for k in np.arange(-2.0, 6.1):
        if k <= 2.0:
            d.line([(-1.0, k, 0.0), (6.0, k, 0.0)], GROUND, lw=0.8, zorder=0)
        if k >= -1.0:
            d.line([(k, -2.0, 0.0), (k, 2.0, 0.0)], GROUND, lw=0.8, zorder=0)

    triad(d, np.zeros(3), np.eye(3), long=1.6, paper=('$X_1 = x$', '$Y_1$', '$Z_1$'))
    d.text((-1.0, -0.5), 'earth axes 1', PAPER)
    d.text((-0.6, 1.2), '$\\mathtt{map}$', MESSAGE)

    centre = np.array([4.1, 1.5, -1.9])
    R = columns(phi=18.0, theta=14.0, psi=12.0)
    disc(d, centre, R, 1.5, 0.18)
    foot = centre * (1.0, 1.0, 0.0)
    d.line([np.zeros(3), foot, centre], REFERENCE, lw=1.0, ls=':', zorder=1)
    triad(d, centre, R, long=2.2, paper=('$x_2 = x$', '$y_2$', '$z_2$'), beneath=True)
    d.text(d.projection(centre + 2.2 * R[:, 1]), 'axes 2', PAPER, (0.75, 0.15))
    d.text(d.projection(centre - 2.2 * R[:, 2]), '$\\mathtt{disc}$', MESSAGE, (0.65, 0.0))

    plastic = R @ columns(psi=SIGMA)  # axes fixed in the plastic
    mark = centre + 1.5 * plastic[:, 0]
    d.line([centre, mark], TURN, lw=1.4, zorder=5)
    d.line([mark], TURN, marker='o', ms=8, zorder=6)
    d.arc(
        centre + 1.1 * circle(R[:, 0], R[:, 1], 0.0, SIGMA), TURN, '$\\sigma$', shift=(-0.2, 0.1)
    )
    d.text(d.projection(mark), '$\\mathtt{disc\\_body}$', TURN, (0.68, 0.12))
    turn = centre + 1.1 * circle(R[:, 0], R[:, 1], 120.0, 250.0)
    d.arc(turn, TURN, '$r > 0$', shift=(0.5, 0.1), width=2.8)

    kinds = [
        Line2D([], [], color=PAPER, lw=2, label="the paper's axes"),
        Line2D([], [], color=MESSAGE, lw=2, ls='--', label='axes of messages (REP-103)'),
        Line2D([], [], color=SHARED, lw=2, label='both'),
    ]
    page.legend(handles=kinds, loc='upper left', frameon=False, handlelength=2.6)
    page.set(xlim=(-2.3, 7.0), ylim=(-2.0, 4.35))


def triad(
    d: Drawing,
    origin: ArrayLike,
    R: FloatArray,
    *,
    long: float,
    paper: tuple[str, str, str],
    message: tuple[str, str] = ('$y$', '$z$'),
    beneath: bool = False,
) -> None:
    """Draw three axes of the paper and the two of REP-103 that point the other way.

    `beneath` puts the paper's z axis under what is drawn already, longer so that it shows.
    """
    M = message_axes(R)
    if not np.allclose(M[:, 0], R[:, 0]):
        raise ValueError('x is drawn once for both kinds of axes')
    depth = 1.25 * long if beneath else long
    d.arrow(origin, long * R[:, 1], PAPER, paper[1])
    d.arrow(origin, depth * R[:, 2], PAPER, paper[2], zorder=1.5 if beneath else 5.0)
    d.arrow(origin, long * M[:, 1], MESSAGE, message[0], style='--')
    d.arrow(origin, long * M[:, 2], MESSAGE, message[1], style='--')
    d.arrow(origin, long * R[:, 0], SHARED, paper[0], gap=0.5)


def yaw(page: Axes) -> None:
    """Draw a positive yaw from above."""
    d = Drawing(page, onto(Y, X), 'yaw $\\psi > 0$\nfrom above: nose right')
    R = columns(psi=30.0)
    d.patch(circle(R[:, 0], R[:, 1], 0.0, 360.0), facecolor=TOP, edgecolor='0.3', lw=1.2, zorder=3)
    turned(d, (X, '$X_1$'), (Y, '$Y_1$'), (R[:, 0], '$x_2$'), (R[:, 1], '$y_2$'))
    d.arc(1.3 * circle(X, Y, 0.0, 30.0), ANGLE, '$\\psi$', shift=(0.07, 0.22))
    frame(page, 'about $z$ up: $-\\psi$')


def pitch(page: Axes) -> None:
    """Draw a positive pitch from the right."""
    d = Drawing(page, onto(X, -Z), 'pitch $\\theta > 0$\nfrom the right: nose up')
    R = columns(theta=25.0)
    edge_on(d, R, R[:, 0], 1.0)
    turned(d, (X, '$X_1$'), (Z, '$Z_1$'), (R[:, 0], '$x_2$'), (R[:, 2], '$z_2$'))
    d.arc(1.3 * circle(X, -Z, 0.0, 25.0), ANGLE, '$\\theta$', shift=(0.22, 0.05))
    frame(page, 'about $y$ left: $-\\theta$')


def roll(page: Axes) -> None:
    """Draw a positive roll from behind."""
    d = Drawing(page, onto(Y, -Z), 'roll $\\phi > 0$\nfrom behind: right edge down')
    R = columns(phi=25.0)
    edge_on(d, R, R[:, 1], 1.0)
    turned(d, (Y, '$Y_1$'), (Z, '$Z_1$'), (R[:, 1], '$y_2$'), (R[:, 2], '$z_2$'))
    d.arc(1.3 * circle(Y, Z, 0.0, 25.0), ANGLE, '$\\phi$', shift=(0.22, -0.05))
    frame(page, 'about $x$: $+\\phi$')


def turned(d: Drawing, *pairs: tuple[FloatArray, str]) -> None:
    """Draw two axes before the turn, grey and dashed, and the same two after it."""
    for axis, label in pairs[:2]:
        d.arrow(np.zeros(3), 1.7 * axis, REFERENCE, label, style='--', width=1.4)
    for axis, label in pairs[2:]:
        d.arrow(np.zeros(3), 1.7 * axis, PAPER, label)


def frame(page: Axes, caption: str) -> None:
    """Fix the extent of a small drawing and write what the angle is in messages under it."""
    page.set(xlim=(-2.1, 2.3), ylim=(-2.75, 2.95))
    page.text(
        0.5, 0.03, caption, color=MESSAGE, ha='center', va='bottom', transform=page.transAxes
    )


def flow() -> Figure:
    """Return the drawing of axes 3 from above and of axes 4 from the side."""
    figure = Figure(figsize=(8.0, 4.0), facecolor='white')
    FigureCanvasAgg(figure)
    from_above(figure.add_axes((0.01, 0.02, 0.47, 0.96)))
    from_the_right(figure.add_axes((0.5, 0.02, 0.49, 0.96)))
    return figure


def from_above(page: Axes) -> None:
    """Draw sideslip and axes 3 in axes 2, forward up on the page."""
    d = Drawing(page, onto(Y, X), 'from above: axes 2, 3 and $\\mathtt{disc\\_air}$')
    origin, beta = np.zeros(3), 35.0
    R = axes_3(beta)
    d.patch(circle(X, Y, 0.0, 360.0), facecolor=TOP, edgecolor='0.3', lw=1.2, zorder=1)
    for axis, label in ((X, '$x_2$'), (Y, '$y_2$')):
        d.arrow(origin, 2.0 * axis, REFERENCE, label, width=1.4, zorder=3)
    d.arrow(origin, 2.2 * R[:, 0], PAPER, '$x_3 = x$', gap=0.3)
    d.arrow(origin, 1.6 * R[:, 1], PAPER, '$y_3$')
    d.text(d.projection(1.6 * R[:, 1]), '$C_{Side}$', TURN, (0.62, -0.14))
    d.arrow(origin, 1.6 * message_axes(R)[:, 1], MESSAGE, '$y$', style='--')

    u3 = 1.6 * R[:, 0]
    u, v = u3 * X, u3 * Y
    d.line([u, u3, v], REFERENCE, lw=1.0, ls=':')
    for part in (u, v):
        d.arrow(origin, part, SHARED, zorder=6)
    d.arrow(origin, u3, SHARED, zorder=6, width=2.8)
    d.text(d.projection(u3), '$u_3$', SHARED, (0.28, -0.1))
    d.text(d.projection(u), '$u$', SHARED, (-0.22, -0.2))
    d.text(d.projection(v), '$v$', SHARED, (-0.12, 0.2))
    d.arc(0.72 * circle(X, Y, 0.0, beta), ANGLE, '$\\beta$', shift=(-0.03, -0.2))
    turn = 0.8 * circle(X, Y, 175.0, 265.0)
    d.arc(turn, TURN, '$r, C_N$', shift=(0.26, 0.2), width=2.8)
    page.set(xlim=(-1.85, 2.4), ylim=(-1.55, 2.85))


def from_the_right(page: Axes) -> None:
    """Draw the angle of attack, axes 4, forces and pitching moment; the disc flies right."""
    d = Drawing(page, onto(X, -Z), 'from the right: axes 3 and 4')
    origin, alpha = np.zeros(3), 25.0
    R3 = columns(theta=12.0)  # axes 3 in axes whose x is level
    R4 = R3 @ axes_4(alpha)
    edge_on(d, R3, R3[:, 0], 1.0)
    for R, number, style, long in ((R3, 3, '-', 2.1), (R4, 4, '-.', 2.35)):
        d.arrow(origin, long * R[:, 0], PAPER, f'$x_{number}$', style=style)
        d.arrow(origin, 1.3 * R[:, 2], PAPER, f'$z_{number}$', style=style)
    V = 1.8 * R4[:, 0]
    d.arrow(origin, V, SHARED, zorder=6, width=2.8)
    d.text(d.projection(V), '$V$', SHARED, (-0.2, -0.24))
    d.arrow(origin, -2.1 * R4[:, 2], TURN, '$C_{Lift}$', gap=0.25, width=2.8)
    d.arrow(origin, -1.35 * R4[:, 0], TURN, '$C_{Drag}$', gap=0.42, width=2.8)
    d.arc(1.4 * circle(R3[:, 0], R3[:, 2], 0.0, alpha), ANGLE, '$\\alpha$', shift=(0.2, 0.0))
    turn = 0.75 * circle(R3[:, 0], -R3[:, 2], 25.0, 140.0)
    d.arc(turn, TURN, '$C_M$', shift=(0.68, 0.03), width=2.8)
    page.set(xlim=(-2.1, 2.65), ylim=(-1.7, 2.75))


DRAWINGS = {'axes_earth_and_map': earth_and_map, 'axes_of_the_flow': flow}


def main(folder: Path) -> None:
    """Write each drawing as SVG and PNG; the same input gives the same bytes."""
    with rc_context(STYLE):
        for name, draw in DRAWINGS.items():
            figure = draw()
            figure.savefig(folder / f'{name}.svg', metadata={'Date': None})
            figure.savefig(folder / f'{name}.png', dpi=DPI)


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
