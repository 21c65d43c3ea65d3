"""The drawing that Figs. 11 and 12 share: two views and the time histories of a few flights."""

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from disc_sim_ros.paper import conditions, style
from disc_sim_ros.paper.conditions import Curve

HISTORIES = (
    ('V_m_s', 'speed V, m/s'),
    ('alpha_deg', 'angle of attack α, °'),
    ('lambda_deg', 'absolute attitude λ, °'),
    ('AdvR', 'advance ratio'),
)


def draw(
    curves: Sequence[Curve],
    lines: Sequence[dict[str, Any]],
    words: tuple[str, str],
    stated: dict[str, float],
    look: style.Look,
    *,
    with_discs: Sequence[int] = (0,),
    height: float = 9.4,
) -> Figure:
    """Draw flights that a control input steers.

    Args:
        curves: The flights.
        lines: Line style of each.
        words: Title and conditions.
        stated: What the text states of a history, by its name, drawn as a dotted line.
        look: Colours.
        with_discs: Which flights get discs.
        height: Of the figure, inches.
    """
    figure = style.sheet(height, *words)
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
