"""What an ensemble says: spread, landing ellipses, sensitivities, and the best grid point."""

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
ANSWERS = ('range_m', 'drift_m', 'time_s')  # whose sensitivities are told
PERCENTS = (5.0, 25.0, 50.0, 75.0, 95.0)
ELLIPSES = (50, 90, 95)  # per cent
MOST_POINTS = 2_000_000  # grid points of which each is remembered
_LEAST_FOR_BINS = 500  # flights

Chunks = Callable[[list[str]], Iterable[tables.Columns]]


@dataclass(frozen=True)
class Spread:
    """How one result spreads over the flights that ended as they should."""

    mean: float
    sd: float
    least: float
    greatest: float
    percentiles: dict[float, float]


@dataclass(frozen=True)
class Ellipse:
    """Landing ellipses of a normal law with the mean and covariance of the landings.

    Attributes:
        centre: Mean x, y [m].
        covariance: Of x, y [m^2], shape (2, 2).
        inside: Share of the landings that each ellipse of `ELLIPSES` really holds.
    """

    centre: tuple[float, float]
    covariance: FloatArray
    inside: dict[int, float]

    def semi_axes(self, percent: float) -> tuple[float, float, float]:
        """Return the long and the short half axis [m], and the angle left of x [degrees]."""
        values, vectors = np.linalg.eigh(self.covariance)
        short, long = np.sqrt(radius2(percent) * np.maximum(values, 0.0))
        angle = math.degrees(math.atan2(vectors[1, 1], vectors[0, 1]))
        return float(long), float(short), (angle + 90.0) % 180.0 - 90.0


@dataclass(frozen=True)
class Sensitivity:
    """How much one result follows one scattered quantity.

    Attributes:
        slope: Change of the result per unit of the quantity, of the linear regression.
        correlation: Slope in standard deviations of both: the standardised regression
            coefficient.
        first_order: First-order Sobol index, the share of the variance that the quantity explains
            alone; None where quantities are correlated or flights are few.
    """

    quantity: str
    answer: str
    slope: float
    correlation: float
    first_order: float | None


@dataclass(frozen=True)
class Best:
    """The grid point with the greatest mean of one result."""

    answer: str
    values: dict[str, float]
    mean: float
    sd: float
    point: int


@dataclass(frozen=True)
class Summary:
    """What an ensemble says. Results are of the flights that ended as they should.

    Those landed, or with `ground=False` those whose time was up; never those that were lost.

    Attributes:
        counts: Flights by their end, keys as in `quantities.STATUS`.
        spreads: By the column of the result.
        ellipse: Of the landings, or None for less than three.
        sensitivities: Of scatter without a grid.
        explained: Share of the variance of each result that the regression explains (R^2).
        best: For grids: the greatest range and time.
        grid: For grids of up to `MOST_POINTS`: number, mean and variance of `ANSWERS` at each
            point.
    """

    question: Study
    counts: dict[str, int]
    spreads: dict[str, Spread]
    ellipse: Ellipse | None
    sensitivities: tuple[Sensitivity, ...]
    explained: dict[str, float]
    best: tuple[Best, ...]
    grid: GroupMeans | None


def summarise(flights: Path | tables.Columns, question: Study) -> Summary:
    """Return the summary of a file of `run.sweep` or of the columns of `run.collect`.

    A file is read twice in pieces; percentiles are exact to 1 / 65536 of the whole span.
    """

    def chunks(names: list[str]) -> Iterable[tables.Columns]:
        if isinstance(flights, Path):
            return tables.chunks(flights, names)
        return iter([{name: flights[name] for name in names}])

    return _second_pass(chunks, question, _FirstPass(chunks, question))


def radius2(percent: float) -> float:
    """Return the squared radius, in standard deviations, of the ellipse that holds `percent`."""
    return -2.0 * math.log1p(-percent / 100.0)


class _FirstPass:
    """Counts, moments, grid points and bins."""

    def __init__(self, chunks: Chunks, question: Study) -> None:
        scattered = [] if question.vary else list(question.scatter)
        self.inputs = [q for q in question.varied if q.name in scattered]
        columns = [q.key for q in self.inputs] + list(SPREADS)
        self.counts = np.zeros(len(STATUS), dtype=np.int64)
        self.moments = Moments(len(columns))
        gridded = question.vary and question.points <= MOST_POINTS
        self.grid = GroupMeans(question.points, len(ANSWERS)) if gridded else None
        self.bins = self._bins(question)
        for chunk in chunks(['index', 'status', *columns]):
            self.counts += np.bincount(chunk['status'], minlength=len(STATUS))
            good = chunk['status'] == good_status(question)
            rows = np.column_stack([chunk[name][good] for name in columns])
            self.moments.add(rows)
            answers = np.column_stack([chunk[name][good] for name in ANSWERS])
            if self.grid is not None:
                self.grid.add(chunk['index'][good] // question.count, answers)
            for j, groups in enumerate(self.bins):
                groups.add(self._place(question, j, rows[:, j], len(groups.n)), answers)

    def _bins(self, question: Study) -> list[GroupMeans]:
        if question.correlations or question.count < _LEAST_FOR_BINS:
            return []
        count = min(64, round(math.sqrt(question.count)))
        return [GroupMeans(count, len(ANSWERS)) for _ in self.inputs]

    def _place(self, question: Study, j: int, values: FloatArray, bins: int) -> NDArray[np.int64]:
        name = self.inputs[j].name
        law = question.scatter[name]
        share = probabilities(law, values, question.fixed(name), *question.bounds(name))
        return np.clip((share * bins).astype(np.int64), 0, bins - 1)


def good_status(question: Study) -> int:
    """Return the end that flights should have, an index of `STATUS`."""
    return STATUS.index('landed' if question.ground else 'flying')


def _second_pass(chunks: Chunks, question: Study, first: _FirstPass) -> Summary:
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
            good = chunk['status'] == good_status(question)
            for name, found in zip(SPREADS, percentiles, strict=True):
                found.add(chunk[name][good])
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
        question=question,
        counts={name: int(n) for name, n in zip(STATUS, first.counts, strict=True)},
        spreads=spreads,
        ellipse=ellipse,
        sensitivities=sensitivities,
        explained=explained,
        best=() if first.grid is None else _best(question, first.grid),
        grid=first.grid,
    )


def _sensitivities(first: _FirstPass) -> tuple[tuple[Sensitivity, ...], dict[str, float]]:
    """Return the linear regression of each answer on all inputs, and first-order indices."""
    k, m = len(first.inputs), first.moments
    if not k or m.n < 3 * (k + 1):
        return (), {}
    covariance = m.covariance
    sd = np.sqrt(np.diag(covariance))
    safe = np.where(sd > 0.0, sd, 1.0)
    correlation = covariance / np.outer(safe, safe)
    found, explained = [], {}
    shares = [between_share(groups) for groups in first.bins]
    for a, answer in enumerate(ANSWERS):
        j = k + SPREADS.index(answer)
        if sd[j] <= 0.0:
            continue
        slopes = np.linalg.lstsq(correlation[:k, :k], correlation[:k, j], rcond=None)[0]
        explained[answer] = float(min(slopes @ correlation[:k, j], 1.0))
        for i, q in enumerate(first.inputs):
            found.append(
                Sensitivity(
                    quantity=q.name,
                    answer=answer,
                    slope=float(slopes[i] * sd[j] / safe[i]),
                    correlation=float(slopes[i]),
                    first_order=float(shares[i][a]) if shares else None,
                )
            )
    return tuple(found), explained


def _best(question: Study, grid: GroupMeans) -> tuple[Best, ...]:
    if not grid.n.any():
        return ()
    mean, variance = grid.mean, grid.variance
    found = []
    for answer in ('range_m', 'time_s'):
        j = ANSWERS.index(answer)
        point = int(np.nanargmax(mean[:, j]))
        places = np.unravel_index(point, question.shape)
        values = {
            name: float(values[int(place)])
            for (name, values), place in zip(question.vary.items(), places, strict=True)
        }
        sd = float(np.sqrt(np.nan_to_num(variance[point, j])))
        found.append(Best(answer, values, float(mean[point, j]), sd, point))
    return tuple(found)
