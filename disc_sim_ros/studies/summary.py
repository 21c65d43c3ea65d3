"""Summary of a study: spread, landing ellipses, sensitivities, and the best grid point."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.studies import tables
from disc_sim_ros.studies.columns import STATUS
from disc_sim_ros.studies.scatter import probabilities
from disc_sim_ros.studies.statistics import GroupMeans, Moments, Percentiles, between_share
from disc_sim_ros.studies.study import Study

SPREADS = ('range_m', 'drift_m', 'time_s', 'apex_m', 'x_m', 'y_m', 'end_speed_m_s',
           'end_spin_rad_s')  # fmt: skip
MAIN_RESULTS = ('range_m', 'drift_m', 'time_s')  # those with sensitivities and grid means
PERCENTS = (5.0, 25.0, 50.0, 75.0, 95.0)
ELLIPSES = (50, 90, 95)  # percent
MOST_POINTS = 2_000_000  # of a grid whose means are kept in memory
_LEAST_FOR_BINS = 500  # flights

Chunks = Callable[[list[str]], Iterable[tables.Columns]]


@dataclass(frozen=True)
class Spread:
    """The distribution of one result over the flights with the expected end."""

    mean: float
    sd: float
    least: float
    greatest: float
    percentiles: dict[float, float]


@dataclass(frozen=True)
class Ellipse:
    """Landing ellipses of a normal law with the mean and covariance of the landings.

    Attributes:
        centre: Mean of x, y [m].
        covariance: Covariance of x, y [m^2], shape (2, 2).
        inside: Share of the landings inside each ellipse of `ELLIPSES`.
    """

    centre: tuple[float, float]
    covariance: FloatArray
    inside: dict[int, float]

    def semi_axes(self, percent: float) -> tuple[float, float, float]:
        """Return both semi-axes, the long one first [m], and its angle left of x [degrees]."""
        values, vectors = np.linalg.eigh(self.covariance)
        short, long = np.sqrt(radius2(percent) * np.maximum(values, 0.0))
        angle = math.degrees(math.atan2(vectors[1, 1], vectors[0, 1]))
        return float(long), float(short), (angle + 90.0) % 180.0 - 90.0


@dataclass(frozen=True)
class Sensitivity:
    """The influence of one scattered quantity on one result.

    Attributes:
        quantity: Name of the quantity.
        result: Column of the result.
        slope: Regression coefficient: change of the result per unit of the quantity.
        correlation: Standardised regression coefficient: the slope in standard deviations of the
            result and of the quantity.
        first_order: First-order Sobol index: the share of the variance of the result that the
            quantity alone explains; None if quantities are correlated or there are too few
            flights.
    """

    quantity: str
    result: str
    slope: float
    correlation: float
    first_order: float | None


@dataclass(frozen=True)
class Best:
    """The grid point with the greatest mean of one result."""

    result: str
    values: dict[str, float]
    mean: float
    sd: float
    point: int


@dataclass(frozen=True)
class Summary:
    """Summary of a study, of the flights with the expected end.

    Expected are flights that landed or, with `ground=False`, that lasted for the whole duration.

    Attributes:
        study: The flights.
        counts: Number of flights by their end, keys as in `columns.STATUS`.
        spreads: Distribution of each result, by its column.
        ellipse: Landing ellipses, or None for less than three landings.
        sensitivities: Sensitivities, if quantities scatter without a grid.
        explained: Share of the variance of each result that the regression explains (R^2).
        best: With a grid: the points of the greatest mean range and time.
        grid: With a grid of up to `MOST_POINTS`: count, mean and variance of `MAIN_RESULTS` at
            each point.
    """

    study: Study
    counts: dict[str, int]
    spreads: dict[str, Spread]
    ellipse: Ellipse | None
    sensitivities: tuple[Sensitivity, ...]
    explained: dict[str, float]
    best: tuple[Best, ...]
    grid: GroupMeans | None


def summarise(flights: Path | tables.Columns, study: Study) -> Summary:
    """Return the summary of a file of `runner.sweep` or of the columns of `runner.collect`.

    A file is read twice, in chunks. Percentiles are accurate to 1 / 65536 of the range.
    """

    def chunks(names: list[str]) -> Iterable[tables.Columns]:
        if isinstance(flights, Path):
            return tables.chunks(flights, names)
        return iter([{name: flights[name] for name in names}])

    return _second_pass(chunks, study, _FirstPass(chunks, study))


def radius2(percent: float) -> float:
    """Return the squared radius, in standard deviations, of the ellipse of `percent`."""
    return -2.0 * math.log1p(-percent / 100.0)


class _FirstPass:
    """The first pass over the flights: counts, moments, means at grid points and in bins."""

    def __init__(self, chunks: Chunks, study: Study) -> None:
        scattered = [] if study.vary else list(study.scatter)
        self.inputs = [q for q in study.varied if q.name in scattered]
        columns = [q.key for q in self.inputs] + list(SPREADS)
        self.counts = np.zeros(len(STATUS), dtype=np.int64)
        self.moments = Moments(len(columns))
        gridded = study.vary and study.points <= MOST_POINTS
        self.grid = GroupMeans(study.points, len(MAIN_RESULTS)) if gridded else None
        self.bins = self._bins(study)
        for chunk in chunks(['index', 'status', *columns]):
            self.counts += np.bincount(chunk['status'], minlength=len(STATUS))
            good = chunk['status'] == expected_status(study)
            rows = np.column_stack([chunk[name][good] for name in columns])
            self.moments.add(rows)
            results = np.column_stack([chunk[name][good] for name in MAIN_RESULTS])
            if self.grid is not None:
                self.grid.add(chunk['index'][good] // study.count, results)
            for j, groups in enumerate(self.bins):
                groups.add(self._place(study, j, rows[:, j], len(groups.n)), results)

    def _bins(self, study: Study) -> list[GroupMeans]:
        if study.correlations or study.count < _LEAST_FOR_BINS:
            return []
        count = min(64, round(math.sqrt(study.count)))
        return [GroupMeans(count, len(MAIN_RESULTS)) for _ in self.inputs]

    def _place(self, study: Study, j: int, values: FloatArray, bins: int) -> NDArray[np.int64]:
        name = self.inputs[j].name
        law = study.scatter[name]
        share = probabilities(law, values, study.fixed(name), *study.bounds(name))
        return np.clip((share * bins).astype(np.int64), 0, bins - 1)


def expected_status(study: Study) -> int:
    """Return the expected end of a flight, an index of `STATUS`."""
    return STATUS.index('landed' if study.ground else 'flying')


def _second_pass(chunks: Chunks, study: Study, first: _FirstPass) -> Summary:
    m = first.moments
    offset = len(first.inputs)
    spreads: dict[str, Spread] = {}
    ellipse = None
    if m.n:
        percentiles = [
            Percentiles(m.least[offset + j], m.greatest[offset + j]) for j in range(len(SPREADS))
        ]
        x, y = (offset + SPREADS.index(name) for name in ('x_m', 'y_m'))
        covariance = m.covariance[np.ix_([x, y], [x, y])]
        inverse = np.linalg.pinv(covariance)
        inside = np.zeros(len(ELLIPSES), dtype=np.int64)
        for chunk in chunks(['status', *SPREADS]):
            good = chunk['status'] == expected_status(study)
            for name, percentile in zip(SPREADS, percentiles, strict=True):
                percentile.add(chunk[name][good])
            dx, dy = chunk['x_m'][good] - m.mean[x], chunk['y_m'][good] - m.mean[y]
            r2 = inverse[0, 0] * dx**2 + 2 * inverse[0, 1] * dx * dy + inverse[1, 1] * dy**2
            inside += [int(np.count_nonzero(r2 <= radius2(percent))) for percent in ELLIPSES]
        sd = np.sqrt(np.diag(m.covariance))
        for j, name in enumerate(SPREADS):
            i = offset + j
            at = {percent: percentiles[j].at(percent) for percent in PERCENTS}
            spreads[name] = Spread(
                float(m.mean[i]), float(sd[i]), float(m.least[i]), float(m.greatest[i]), at
            )
        if m.n > 2:
            shares = {p: float(k / m.n) for p, k in zip(ELLIPSES, inside, strict=True)}
            ellipse = Ellipse((float(m.mean[x]), float(m.mean[y])), covariance, shares)
    sensitivities, explained = _sensitivities(first)
    return Summary(
        study=study,
        counts={name: int(n) for name, n in zip(STATUS, first.counts, strict=True)},
        spreads=spreads,
        ellipse=ellipse,
        sensitivities=sensitivities,
        explained=explained,
        best=() if first.grid is None else _best(study, first.grid),
        grid=first.grid,
    )


def _sensitivities(first: _FirstPass) -> tuple[tuple[Sensitivity, ...], dict[str, float]]:
    """Return the regression of each result on all inputs, and their first-order indices."""
    k, m = len(first.inputs), first.moments
    if not k or m.n < 3 * (k + 1):
        return (), {}
    covariance = m.covariance
    sd = np.sqrt(np.diag(covariance))
    safe = np.where(sd > 0.0, sd, 1.0)
    correlation = covariance / np.outer(safe, safe)
    sensitivities, explained = [], {}
    shares = [between_share(groups) for groups in first.bins]
    for a, result in enumerate(MAIN_RESULTS):
        j = k + SPREADS.index(result)
        if sd[j] <= 0.0:
            continue
        slopes = np.linalg.lstsq(correlation[:k, :k], correlation[:k, j], rcond=None)[0]
        explained[result] = float(min(slopes @ correlation[:k, j], 1.0))
        for i, q in enumerate(first.inputs):
            sensitivities.append(
                Sensitivity(
                    quantity=q.name,
                    result=result,
                    slope=float(slopes[i] * sd[j] / safe[i]),
                    correlation=float(slopes[i]),
                    first_order=float(shares[i][a]) if shares else None,
                )
            )
    return tuple(sensitivities), explained


def _best(study: Study, grid: GroupMeans) -> tuple[Best, ...]:
    if not grid.n.any():
        return ()
    mean, variance = grid.mean, grid.variance
    best = []
    for result in ('range_m', 'time_s'):
        j = MAIN_RESULTS.index(result)
        point = int(np.nanargmax(mean[:, j]))
        places = np.unravel_index(point, study.shape)
        values = {
            name: float(values[int(place)])
            for (name, values), place in zip(study.vary.items(), places, strict=True)
        }
        sd = float(np.sqrt(np.nan_to_num(variance[point, j])))
        best.append(Best(result, values, float(mean[point, j]), sd, point))
    return tuple(best)
