"""Measurements as throws: checked, cut to the time in the air, in the paper's axes."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.identification.observations import (
    Accelerations,
    Attitudes,
    Camera,
    Gyro,
    Observation,
    Positions,
)
from disc_sim_ros.estimation.identification.releases import ReleaseErrors
from disc_sim_ros.estimation.identification.throws import Throw, throw_of
from disc_sim_ros.estimation.throw_csv import CAMERA_COLUMNS, GROUPS, Columns
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.frames import paper_from_map
from disc_sim_ros.physics.thrower import Release
from disc_sim_ros.quantities import LAUNCH

_COLUMNS = {**GROUPS, 'camera': CAMERA_COLUMNS}
_FEWEST = 8  # samples of an instrument
_FASTEST = 60.0  # m/s; the longest throws are released at 40
_SLOWEST, _SHORTEST_PATH = 3.0, 2.0  # m/s, m: below, nothing was thrown
_LEAST_SPIN = 3.0  # rad/s; below, a gyro was in no spinning disc
_FLATTEST = 0.02  # m: what stays nearer to one height for a second is no disc in the air


@dataclass(frozen=True)
class Instruments:
    """What is known of the instruments.

    Attributes:
        gravity: g [m/s^2].
        camera_height: Of a camera straight above the field [m]; None without one.
        largest_acceleration: Range of the accelerometer [m/s^2].
        spin: Spin rate at the release of all throws [rad/s], where no gyro measures it.
    """

    gravity: float
    camera_height: float | None = None
    largest_acceleration: float = float('inf')
    spin: float | None = None


def check_different(measured: Mapping[str, Columns]) -> None:
    """Refuse a throw that is given twice: it would count as two, and as its own check.

    Args:
        measured: The measurements of each throw by its name.

    Raises:
        ConfigError: An instrument has the same values in two throws.
    """
    for (a, first), (b, second) in combinations(measured.items(), 2):
        same = [k for k in first if k in second and np.array_equal(first[k][1], second[k][1])]
        if same:
            allowed = f'their {same[0]} is the same; give each throw once'
            raise ConfigError('throws', f'{a} and {b}', allowed)


def throw_from(
    name: str,
    columns: Columns,
    disc: Disc,
    instruments: Instruments,
    release: tuple[Release, ReleaseErrors] | None = None,
) -> Throw:
    """Return a throw from what its instruments measured.

    Args:
        name: Its name in reports and errors.
        columns: Times [s] and values in axes of messages, as `throw_csv.read` returns them.
        disc: The base disc.
        instruments: What is known of the instruments.
        release: The measured release with its errors, if there is one.

    Raises:
        ConfigError: Shapes do not fit, there are too few samples, times do not increase, units
            look wrong, or what was measured is no throw of a disc.
    """
    if not columns:
        raise ConfigError('throws', name, 'no row has a measurement')
    for kind, (t, values) in columns.items():
        _check_columns(name, kind, np.asarray(t), np.asarray(values))
    start = min(float(t[0]) for t, _ in columns.values())
    observations: list[Observation] = []
    for kind, (t, values) in columns.items():
        _check_times(name, kind, t)
        observations.append(_observation(name, kind, t - start, values, instruments))
    for o in observations:
        _check_motion(name, o)
    return throw_of(name, observations, disc, spin=instruments.spin, release=release)


def _observation(
    name: str, kind: str, t: FloatArray, values: FloatArray, instruments: Instruments
) -> Observation:
    """Return the measurements of an instrument in the paper's axes."""
    match kind:
        case 'position':
            return Positions(t, paper_from_map(values))
        case 'camera':
            if instruments.camera_height is None:
                allowed = f'{name} has no z_m, so a camera drew it: give the height of the camera'
                raise ConfigError('camera_height', None, allowed, 'camera_height')
            points = paper_from_map(np.pad(values, ((0, 0), (0, 1))))[:, :2]
            return Camera(t, points, instruments.camera_height)
        case 'attitude':
            norm = np.linalg.norm(values, axis=1)
            if (np.abs(norm - 1.0) > 0.01).any():
                worst = float(norm[np.argmax(np.abs(norm - 1.0))])
                raise ConfigError(name, f'length {worst:.3g}', 'give quaternions of length 1')
            unit = values / norm[:, np.newaxis]
            state = np.zeros((len(t), 14))
            state[:, 6], state[:, 7:10] = unit[:, 3], paper_from_map(unit[:, :3])
            return Attitudes(t, local.disc_axis(state))
        case 'gyro':
            return Gyro(t, values)
    return Accelerations(t, values, instruments.gravity, instruments.largest_acceleration)


def _check_columns(name: str, kind: str, t: FloatArray, values: FloatArray) -> None:
    validation.choice(f'{name}: instrument', kind, _COLUMNS)
    width = len(_COLUMNS[kind])
    if t.ndim != 1 or values.shape != (len(t), width):
        allowed = f'give times of shape (n,) and values of shape (n, {width})'
        raise ConfigError(f'{name}: {kind}', f'shapes {t.shape} and {values.shape}', allowed)
    if not (np.isfinite(t).all() and np.isfinite(values).all()):
        raise ConfigError(f'{name}: {kind}', 'nan or inf', 'give finite numbers')


def _check_times(name: str, kind: str, t: FloatArray) -> None:
    if len(t) < _FEWEST:
        raise ConfigError(f'{name}: {kind}', f'{len(t)} samples', f'give at least {_FEWEST}')
    steps = np.diff(t)
    if (steps <= 0.0).any():
        i = int(np.argmax(steps <= 0.0)) + 1
        where = f'{name}: {kind}: sample {i + 1}'
        allowed = f'time must increase, the sample before is at {t[i - 1]:g} s'
        if steps[i - 1] < 0.0:
            allowed += '; is it of another throw?'
        raise ConfigError(where, f't = {t[i]:g} s', allowed)
    if t[-1] - t[0] > 60.0:
        raise ConfigError(f'{name}: {kind}', f'{t[-1] - t[0]:g} s', 'a flight takes at most 60 s')


def _falls_up(o: Positions) -> bool:
    """Return True if the path curves upwards, to smaller Z."""
    return bool(np.polyfit(o.t, o.XYZ[:, 2], 2)[0] < 0.0)


def _check_motion(name: str, o: Observation) -> None:
    """Refuse what cannot be the flight of a disc.

    Raises:
        ConfigError: A unit looks wrong, or the thing does not move or spin as a thrown disc.
    """
    if isinstance(o, Positions | Camera):
        points = o.XYZ if isinstance(o, Positions) else o.XY
        speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(o.t)
        fast, length = float(np.median(speeds)), float(np.ptp(points, axis=0).max())
        if fast > _FASTEST:
            allowed = f'at most {_FASTEST:g} m/s; are the positions in m and the times in s?'
            raise ConfigError(f'{name}: {o.kind}', f'{fast:.3g} m/s', allowed)
        if fast < _SLOWEST or length < _SHORTEST_PATH:
            allowed = (
                f'a thrown disc flies faster than {_SLOWEST:g} m/s and {_SHORTEST_PATH:g} m far'
            )
            raise ConfigError(f'{name}: {o.kind}', f'{fast:.3g} m/s over {length:.3g} m', allowed)
        if isinstance(o, Positions) and np.ptp(o.XYZ[:, 2]) < _FLATTEST and o.t[-1] > 1.0:
            allowed = f'a disc in the air rises or falls by more than {_FLATTEST:g} m'
            raise ConfigError(f'{name}: {o.kind}', 'it stays at one height', allowed)
        if isinstance(o, Positions) and o.XYZ[:, 2].min() > 0.0 and _falls_up(o):
            allowed = 'z is up from the ground; is it down in these measurements?'
            raise ConfigError(f'{name}: {o.kind}', 'below the ground, and it falls up', allowed)
    if isinstance(o, Gyro):
        spin = float(np.median(np.abs(o.pqr[:, 2])))
        limit = LAUNCH['spin'].highest
        if spin > limit:
            allowed = f'at most {limit:g} rad/s; is the gyro in degrees/s?'
            raise ConfigError(f'{name}: {o.kind}', f'{spin:.4g} rad/s about z', allowed)
        if spin < _LEAST_SPIN:
            allowed = f'a thrown disc spins faster than {_LEAST_SPIN:g} rad/s: this is no disc'
            raise ConfigError(f'{name}: {o.kind}', f'{spin:.3g} rad/s about z', allowed)
