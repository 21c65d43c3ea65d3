"""Recorded measurements through the predictor, as if they came in now."""

from collections.abc import Iterable, Sequence
import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.predictor import Measurement, Prediction, Predictor, PredictorConfig
from disc_sim_ros.files import reason
from disc_sim_ros.physics.frames import paper_quaternion, rotation_matrix

POSITION_COLUMNS = ('t_s', 'x_m', 'y_m', 'z_m')
ATTITUDE_COLUMNS = ('qx', 'qy', 'qz', 'qw')
ELLIPSE_PERIOD = 0.05  # s of measurements between two profiled ellipses
_SHORTEST_QUATERNION = 1e-6


@dataclass(frozen=True, slots=True)
class FollowedThrow:
    """The predictions of one throw.

    Attributes:
        number: From 1.
        predictions: In the order of the measurements.
    """

    number: int
    predictions: tuple[Prediction, ...]

    @property
    def landing(self) -> FloatArray:
        """Return x, y [m] and time [s] of the landing of the last prediction, shape (3,)."""
        last = self.predictions[-1]
        return np.array([*last.landing, last.landing_time])

    @property
    def is_complete(self) -> bool:
        """Return True if at most a tenth of a second is left after the last measurement."""
        last = self.predictions[-1]
        return last.landing_time - last.time < 0.1

    @property
    def watched(self) -> FloatArray:
        """Return for how long the throw had been measured at each prediction [s]."""
        return np.array([p.time - p.reference_time for p in self.predictions])

    @property
    def misses(self) -> FloatArray:
        """Return how far each prediction is from the landing [m]."""
        return np.array(
            [np.hypot(*(p.landing - self.landing[:2])) for p in self.predictions], dtype=float
        )

    def at(self, watched: float) -> Prediction | None:
        """Return the last prediction up to a time of watching [s]; None if there is none."""
        known = np.flatnonzero(self.watched <= watched + 1e-9)
        return self.predictions[known[-1]] if len(known) else None


def replay(measurements: Iterable[Measurement], config: PredictorConfig) -> list[FollowedThrow]:
    """Return the predictions of every throw in a series of measurements."""
    predictor = Predictor(config)
    throws: dict[int, list[Prediction]] = {}
    last_profile = -np.inf
    for m in measurements:
        predictor.add(m)
        profiled = not last_profile <= m.time < last_profile + ELLIPSE_PERIOD
        prediction = predictor.update(profiled=profiled)
        if prediction is not None:
            last_profile = m.time if profiled else last_profile
            throws.setdefault(prediction.throw, []).append(prediction)
    return [FollowedThrow(number, tuple(of)) for number, of in throws.items()]


def measurements(
    time: FloatArray, position: FloatArray, quaternion: FloatArray | None = None
) -> list[Measurement]:
    """Return measurements from columns, in `map`; rows that are not finite are left out.

    Args:
        time: By any clock [s], shape (n,).
        position: x, y, z [m], shape (n, 3).
        quaternion: x, y, z, w of `disc` in `map`, shape (n, 4); those of length 0 are no attitude.
    """
    axes: Sequence[tuple[float, float, float] | None] = [None] * len(time)
    if quaternion is not None:
        axes = [_axis(q) for q in quaternion]
    return [
        Measurement(float(t), (float(x), float(y), float(z)), axis)
        for t, (x, y, z), axis in zip(time, position, axes, strict=True)
        if np.isfinite([t, x, y, z]).all()
    ]


def _axis(quaternion: FloatArray) -> tuple[float, float, float] | None:
    """Return the direction of z of `disc`, up, in `map`; None without an attitude."""
    norm = float(np.linalg.norm(quaternion))
    if not _SHORTEST_QUATERNION < norm < 1.0 / _SHORTEST_QUATERNION:
        return None
    down = rotation_matrix(paper_quaternion(quaternion / norm))[:, 2]
    return -float(down[0]), float(down[1]), float(down[2])


def read_csv(path: Path) -> list[Measurement]:
    """Return the measurements of a CSV file with the columns t_s, x_m, y_m, z_m.

    With the columns qx, qy, qz, qw there is an attitude; empty fields are none.

    Raises:
        ConfigError: The file cannot be read, or a column or a number is missing.
    """
    try:
        with path.open(newline='', encoding='utf-8-sig') as file:
            reader = csv.DictReader(line for line in file if not line.startswith('#'))
            names = reader.fieldnames or []
            rows = list(reader)
    except OSError as error:
        raise ConfigError('FILE', str(path), f'cannot read it ({reason(error)})') from None
    except (UnicodeDecodeError, csv.Error):
        raise ConfigError('FILE', str(path), 'not a text file with columns') from None
    missing = [name for name in POSITION_COLUMNS if name not in names]
    if missing:
        allowed = f'needs the columns {", ".join(POSITION_COLUMNS)}, not {", ".join(names)}'
        raise ConfigError('FILE', str(path), allowed)
    table = np.array(
        [[_number(path, i, row, n) for n in POSITION_COLUMNS] for i, row in enumerate(rows)]
    )
    quaternion = None
    if all(name in names for name in ATTITUDE_COLUMNS):
        quaternion = np.array([[float(row[n] or 0.0) for n in ATTITUDE_COLUMNS] for row in rows])
    if not len(table):
        raise ConfigError('FILE', str(path), 'it has no rows')
    return measurements(table[:, 0], table[:, 1:], quaternion)


def _number(path: Path, row: int, fields: dict[str, str], name: str) -> float:
    try:
        return float(fields[name])
    except (TypeError, ValueError):
        thing = f'{path}: row {row + 1}, {name}'
        raise ConfigError(thing, fields[name], 'give a number') from None
