"""Statistics of flights that arrive in chunks: the memory does not grow with their number."""

import math

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.arrays import FloatArray

_HISTOGRAM = 2**16  # bins; percentiles are accurate to 1 / 65536 of the range


class Moments:
    """Mean, covariance, least and greatest value of columns.

    Chunks are merged as in Chan, Golub & LeVeque, American Statistician 37 (1983) 242-247.

    Args:
        width: Number of columns.
    """

    def __init__(self, width: int) -> None:
        self.n = 0
        self.mean = np.zeros(width)
        self._products = np.zeros((width, width))
        self.least = np.full(width, math.inf)
        self.greatest = np.full(width, -math.inf)

    def add(self, rows: FloatArray) -> None:
        """Add rows, shape (n, width)."""
        n = len(rows)
        if n == 0:
            return
        mean = rows.mean(axis=0)
        centred = rows - mean
        shift = mean - self.mean
        total = self.n + n
        self._products += centred.T @ centred + np.outer(shift, shift) * (self.n * n / total)
        self.mean += shift * (n / total)
        self.n = total
        self.least = np.minimum(self.least, rows.min(axis=0))
        self.greatest = np.maximum(self.greatest, rows.max(axis=0))

    @property
    def covariance(self) -> FloatArray:
        """Return the covariance matrix, shape (width, width); zero for less than two rows."""
        covariance: FloatArray = self._products / max(self.n - 1, 1)
        return covariance


class Percentiles:
    """Percentiles of one column of known range, accurate to 1 / 65536 of it."""

    def __init__(self, least: float, greatest: float) -> None:
        self._least = least
        self._width = max(greatest - least, 1e-300) / _HISTOGRAM
        self._counts = np.zeros(_HISTOGRAM, dtype=np.int64)

    def add(self, values: FloatArray) -> None:
        """Add values, shape (n,)."""
        place = ((values - self._least) / self._width).astype(np.int64)
        self._counts += np.bincount(np.clip(place, 0, _HISTOGRAM - 1), minlength=_HISTOGRAM)

    def at(self, percent: float) -> float:
        """Return the value below which `percent` of the values lie."""
        cumulative = np.cumsum(self._counts)
        rank = percent / 100.0 * cumulative[-1]
        place = min(int(np.searchsorted(cumulative, rank)), _HISTOGRAM - 1)
        before = cumulative[place - 1] if place else 0
        inside = (rank - before) / max(int(self._counts[place]), 1)
        return float(self._least + self._width * (place + inside))


class GroupMeans:
    """Count, mean and variance of columns in groups: grid points, or bins of an input.

    Args:
        groups: Number of groups.
        width: Number of columns.
    """

    def __init__(self, groups: int, width: int) -> None:
        self.n = np.zeros(groups, dtype=np.int64)
        self._sum = np.zeros((groups, width))
        self._squares = np.zeros((groups, width))
        self._shift: FloatArray | None = None  # against cancellation in the sums of squares

    def add(self, group: NDArray[np.int64], rows: FloatArray) -> None:
        """Add rows, shape (n, width), to the groups `group`, shape (n,)."""
        if len(rows) == 0:
            return
        if self._shift is None:
            self._shift = rows.mean(axis=0)
        first, last = int(group.min()), int(group.max()) + 1
        place, part = group - first, slice(first, last)
        self.n[part] += np.bincount(place, minlength=last - first)
        for j, column in enumerate((rows - self._shift).T):
            self._sum[part, j] += np.bincount(place, column, last - first)
            self._squares[part, j] += np.bincount(place, column * column, last - first)

    @property
    def mean(self) -> FloatArray:
        """Return the mean of each group, shape (groups, width); NaN for an empty group."""
        with np.errstate(invalid='ignore'):
            shift = 0.0 if self._shift is None else self._shift
            mean: FloatArray = shift + self._sum / self.n[:, None]
        return mean

    @property
    def variance(self) -> FloatArray:
        """Return the variance in each group, shape (groups, width); NaN for less than two rows."""
        with np.errstate(invalid='ignore', divide='ignore'):
            n = self.n[:, None]
            variance: FloatArray = np.maximum(self._squares - self._sum**2 / n, 0.0) / (n - 1.0)
        return variance


def between_share(groups: GroupMeans) -> FloatArray:
    """Return the share of the variance that the groups explain, shape (width,), from 0 to 1.

    The part of the variance between groups that comes from the finite number of flights in each
    group is subtracted. If the groups are equally probable bins of one independent input, the
    result is the first-order Sobol index of that input: Plischke, Borgonovo & Smith, European J.
    of Operational Research 226 (2013) 536-550.
    """
    filled = groups.n > 1
    n = groups.n[filled][:, None].astype(float)
    mean, within = groups.mean[filled], groups.variance[filled]
    total = n.sum()
    overall = (n * mean).sum(axis=0) / total
    noise = within.sum(axis=0) / total  # sum over groups of n / total times within / n
    between = (n * (mean - overall) ** 2).sum(axis=0) / total - noise
    everything = between + noise + (n * within).sum(axis=0) / total
    with np.errstate(invalid='ignore', divide='ignore'):
        share: FloatArray = np.clip(between / everything, 0.0, 1.0)
    return share
