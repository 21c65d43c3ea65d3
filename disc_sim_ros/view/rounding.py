"""Numbers as a page holds them."""

import numpy as np

from disc_sim_ros.arrays import FloatArray


def plain(values: FloatArray, places: int) -> list[float | None]:
    """Return numbers of any shape in one flat list that JSON knows.

    Args:
        values: The numbers.
        places: Digits behind the point; fewer keep the page small.

    Returns:
        The rounded numbers; None in place of NaN and infinity.
    """
    rounded = np.round(values, places).ravel() + 0.0
    return [x if np.isfinite(x) else None for x in rounded.tolist()]
