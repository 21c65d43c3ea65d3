"""Style of the figures: light and dark, colours for the colour-blind, discs along the path."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from io import BytesIO
from typing import Any, Literal, TypeVar

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
import numpy as np
from PIL import Image

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.trajectory import Trajectory

DPI = 130
WIDTH = 10.5  # inches: 1365 pixels
SIDE, TOP = 'side', 'top'


@dataclass(frozen=True)
class Look:
    """Colours for one background; those of curves are safe for the colour-blind (Okabe, Ito)."""

    name: str
    face: str
    ink: str
    faint: str
    printed: str  # damping as printed
    tenth: str  # 10 % of it
    third: str
    fourth: str
    ramp: tuple[float, float]  # part of the colour map used for a family of curves


LIGHT = Look('light', '#ffffff', '#1a1a1a', '#c4c4c4', '#0072b2', '#d55e00', '#009e73', '#8a5a83',
             (0.0, 0.75))  # fmt: skip
DARK = Look('dark', '#0d1117', '#e8e8e8', '#454b54', '#56b4e9', '#e69f00', '#2fc79a', '#e3a0c8',
            (0.35, 1.0))  # fmt: skip
LOOKS = {look.name: look for look in (LIGHT, DARK)}

Data = TypeVar('Data')


@contextmanager
def style(look: Look) -> Iterator[None]:
    """Use the fonts and colours of `look` in this block."""
    with mpl.rc_context(
        {
            'font.size': 11,
            'axes.titlesize': 11,
            'axes.titlelocation': 'left',
            'legend.fontsize': 9.5,
            'legend.frameon': False,
            'lines.linewidth': 1.7,
            'figure.facecolor': look.face,
            'savefig.facecolor': look.face,
            'axes.facecolor': look.face,
            'axes.edgecolor': look.ink,
            'axes.labelcolor': look.ink,
            'axes.axisbelow': True,
            'axes.grid': True,
            'grid.color': look.faint,
            'grid.linewidth': 0.5,
            'axes.spines.top': False,
            'axes.spines.right': False,
            'text.color': look.ink,
            'xtick.color': look.ink,
            'ytick.color': look.ink,
            'svg.hashsalt': 'disc_sim_ros',
        }
    ):
        yield


def styled(plot: Callable[[Data, Look], Figure]) -> Callable[[Data, Look], Figure]:
    """Decorate a plot function to draw in the style of its look."""

    @wraps(plot)
    def within(data: Data, look: Look = LIGHT) -> Figure:
        with style(look):
            return plot(data, look)

    return within


def sheet(height: float, title: str, conditions: str) -> Figure:
    """Return an empty figure with a title above and conditions below it; height in inches."""
    layout = ConstrainedLayoutEngine(w_pad=0.1, h_pad=0.06)  # inches
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.012, ha='left', fontsize=13, fontweight='bold')
    figure.supxlabel(conditions, x=0.012, ha='left', fontsize=9.5)
    return figure


def image(figure: Figure, kind: str, look: Look) -> bytes:
    """Return a figure as the bytes of a PNG (256 colours) or SVG; the same in every run."""
    buffer = BytesIO()
    with style(look):
        if kind == 'svg':
            figure.savefig(buffer, format='svg', metadata={'Date': None})
        else:
            canvas = FigureCanvasAgg(figure)
            canvas.draw()  # type: ignore[no-untyped-call]
            pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
            picture = Image.fromarray(pixels).convert('RGB')
            few = picture.quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
            few.save(buffer, format='png', compress_level=9, dpi=(DPI, DPI))
    figure.set_layout_engine('none')  # keep the layout for the next format
    return buffer.getvalue()


def family(values: Sequence[float], look: Look) -> list[Any]:
    """Return colours for an ordered family of curves, in the order of their brightness."""
    viridis = mpl.colormaps['viridis']
    return [viridis(x) for x in np.linspace(*look.ramp, len(values))]


def view(points: FloatArray, side: str) -> FloatArray:
    """Return X and height, or X and Y, of points in axes 1; shape (..., 3) to (..., 2)."""
    across = frames.flip(points[..., 2]) if side == SIDE else points[..., 1]
    return np.stack([points[..., 0], across], axis=-1)


def views(axis: Axes, side: str, *, equal: Literal['box', 'datalim', 'no'] = 'datalim') -> None:
    """Label a side view (height up) or a view from above (Y to the right of the flight, down).

    Args:
        axis: The panel.
        side: `SIDE` or `TOP`.
        equal: What changes to make the scales equal: 'datalim' or 'box'; 'no' for unequal scales.
    """
    axis.set_xlabel('X forward, m')
    axis.set_ylabel('height −Z, m' if side == SIDE else 'Y right, m')
    if side == TOP:
        axis.yaxis.set_inverted(True)
    if equal != 'no':
        axis.set_aspect('equal', adjustable=equal)


def path(axis: Axes, t: Trajectory, side: str, *, scale: float = 1.0, **line: Any) -> None:
    """Draw the path of a flight; lengths are multiplied by `scale`."""
    axis.plot(*view(scale * t.position, side).T, **line)


def discs(
    axis: Axes,
    t: Trajectory,
    side: str,
    *,
    every: float,
    size: float,
    colour: Any,
    scale: float = 1.0,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Draw projected discs along a path, `size` times enlarged.

    A disc that shows its upper side is filled more strongly than one that shows its underside.

    Args:
        axis: A view made with `views`.
        t: The flight.
        side: `SIDE` or `TOP`.
        every: Time between discs [s].
        size: Enlargement.
        colour: Colour of the path.
        scale: Factor of all lengths.
        start: Offset of all positions, axes 1 [m].
    """
    rate = 1.0 / (t.t[1] - t.t[0])
    chosen = np.arange(0, len(t), max(1, round(every * rate)))
    outlines = scale * view(disc_rims(t, size)[chosen] + start, side)
    n = t.normal[chosen]  # points out of the underside
    upper = n[:, 2] > 0.0 if side == TOP else n[:, 1] < 0.0
    for shown, alpha in ((upper, 0.45), (~upper, 0.15)):
        fill = mpl.colors.to_rgba(colour, alpha)
        axis.add_collection(
            PolyCollection(list(outlines[shown]), facecolor=fill, edgecolor=colour, lw=0.7)
        )


def disc_rims(t: Trajectory, size: float) -> FloatArray:
    """Return points on the rim of the disc, enlarged, in axes 1 [m], shape (n, 33, 3)."""
    n = t.normal
    across = np.cross(n, np.where(np.abs(n[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]]))
    across /= np.linalg.norm(across, axis=1)[:, None]
    other = np.cross(n, across)
    angle = np.linspace(0.0, 2 * np.pi, 33)[None, :, None]
    rim = across[:, None] * np.cos(angle) + other[:, None] * np.sin(angle)
    points: FloatArray = t.position[:, None] + 0.5 * size * t.diameter * rim
    return points


def letter(axis: Axes, name: str, title: str) -> None:
    """Write the letter of a panel, and a title, above it."""
    axis.set_title(f'({name}) {title}')
