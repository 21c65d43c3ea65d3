"""One measured throw: its instruments, and what is believed of its release beforehand."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.observations import (
    ATTITUDE,
    CAMERA,
    GYRO,
    POSITION,
    Attitudes,
    Camera,
    Gyro,
    Observation,
    Positions,
)
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.launch import Launch

RELEASE_SIZE = local.SIZE + 1  # local coordinates of the first state, and the spin angle
# Standard deviations of the first state where only measurements tell it; wide beside instruments.
WIDE = np.array([2.0, 2.0, 2.0, 5.0, 5.0, 5.0, 0.5, 0.5, 5.0, 5.0, 20.0, 10.0])
_SPEED, _SPEED_DEVIATION = 17.0, 4.0  # m/s, where neither a path nor a release is known
_HEIGHT = 1.3  # m, of a release by hand
_GAUGE = 1e-3  # deviation of what no instrument of the throw can tell
_ADVANCE_RATIO = 0.5  # of an ordinary throw
_RELEASE_FIELDS = (
    'speed',
    'pitch',
    'roll',
    'yaw',
    'angle_of_attack',
    'sideslip',
    'spin',
    'roll_rate',
    'pitch_rate',
)
_FIRST = 0.25  # s of a path from which position and velocity are guessed


@dataclass(frozen=True, eq=False)
class Throw:
    """One measured throw.

    Attributes:
        name: Its name in reports.
        observations: Its instruments.
        start: First state from which changes are counted, paper's axes, shape (14,).
        information: Root of the inverse covariance of that state, in local coordinates and the
            spin angle, shape (12, 12).
        believed: Mean of that belief, from `start` on in the same coordinates, shape (12,).
        gauges: What is fixed because no instrument tells it, for people.
        spin_known: Whether the sense of the spin is known.
    """

    name: str
    observations: tuple[Observation, ...]
    start: FloatArray
    information: FloatArray
    believed: FloatArray = field(default_factory=lambda: np.zeros(RELEASE_SIZE))
    gauges: tuple[str, ...] = ()
    spin_known: bool = True

    @cached_property
    def times(self) -> FloatArray:
        """Return when a state is needed, ascending, each once [s]."""
        return np.unique(np.concatenate([o.sample_times for o in self.observations]))

    @cached_property
    def places(self) -> list[IntArray]:
        """Return the places in `times` of the sample times of each instrument."""
        return [np.searchsorted(self.times, o.sample_times) for o in self.observations]

    def has(self, kind: str) -> bool:
        """Return True if an instrument of this kind measured it."""
        return any(o.kind == kind for o in self.observations)

    def starting_at(self, start: FloatArray) -> 'Throw':
        """Return the throw with changes counted from another state; the belief stays the same."""
        before = local.moved(self.start, self.believed[: local.SIZE])
        before[13] += self.believed[local.SIZE]
        start = np.asarray(start, dtype=float)
        delta, turn = local.difference(start, before)
        return replace(self, start=start, believed=np.array([*delta, turn]))


def throw_of(
    name: str,
    observations: Sequence[Observation],
    disc: Disc,
    *,
    release: Launch | None = None,
    deviations: FloatArray | None = None,
    spin: float | None = None,
) -> Throw:
    """Return a throw whose first state is guessed from its measurements.

    Args:
        name: Its name in reports.
        observations: Its instruments.
        disc: Gives the size for a guess of the spin.
        release: The measured release, if there is one; its position is the origin of `map`.
        deviations: Standard deviations of the fields of `release`, see `release_information`.
        spin: Spin rate at the first state [rad/s]; None where only the measurements tell it.

    Raises:
        ConfigError: There are no measurements from which a release can be guessed.
    """
    of = {o.kind: o for o in observations}
    if release is not None:
        start = np.array(release.state())
        information = (
            np.diag(1.0 / WIDE) if deviations is None else release_information(release, deviations)
        )
        return Throw(name, tuple(observations), start, information)
    state = np.array(Launch(speed=_SPEED, pitch=8.0, spin=0.0, height=_HEIGHT).state())
    wide = WIDE.copy()
    gauges: list[str] = []
    match of.get(POSITION), of.get(CAMERA):
        case Positions() as path, _:
            state[0:3], state[3:6] = _first_motion(path.t, path.XYZ)
        case _, Camera() as path:
            xy, v = _first_motion(path.t, path.XY)
            state[0:2], state[3:5] = xy, v
            wide[2], wide[5] = 0.5, 3.0
        case _:
            if GYRO not in of:
                kinds = f'{POSITION}, {CAMERA} or {GYRO}'
                raise ConfigError(name, ', '.join(of) or 'nothing', f'measure {kinds}')
            wide[0:3], wide[3:6] = _GAUGE, [_SPEED_DEVIATION, _GAUGE, 2.0]
            gauges.append('position and heading of the release are fixed: a gyro cannot tell them')
    speed = float(np.linalg.norm(state[3:6]))
    if isinstance(attitude := of.get(ATTITUDE), Attitudes):
        state[6:10] = attitude_with(attitude.axis[0], state[3:6])
    else:
        state[6:10] = tilted(state[3:6], math.radians(5.0), 0.0)
    known = spin is not None
    if isinstance(gyro := of.get(GYRO), Gyro):
        state[10:13] = gyro.pqr[0]  # for a spin angle of 0; `fitting` tries others
        wide[8:12] = [5.0, 5.0, 2.0, 10.0]
        known = True
    else:
        guess = _ADVANCE_RATIO * 2.0 * speed / disc.diameter
        state[12] = guess if spin is None else spin
        wide[10] = 0.4 * guess if spin is None else max(0.05 * abs(spin), 1.0)
        wide[11] = _GAUGE
    return Throw(
        name,
        tuple(observations),
        state,
        np.diag(1.0 / wide),
        gauges=tuple(gauges),
        spin_known=known,
    )


def _first_motion(t: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity at time 0 by a parabola through the first quarter second."""
    n = max(int(np.searchsorted(t, t[0] + _FIRST)), min(len(t), 5))
    fitted = np.polynomial.polynomial.polyfit(t[:n], x[:n], min(2, n - 1))
    return fitted[0], fitted[1]


def tilted(velocity: FloatArray, angle_of_attack: float, roll: float) -> FloatArray:
    """Return the attitude of a disc with an angle of attack and a roll about its path.

    Args:
        velocity: In earth axes 1 [m/s], shape (3,).
        angle_of_attack: Air on the underside positive [rad].
        roll: About the path, right edge down positive [rad].

    Returns:
        Quaternion of the despun axes 2, x axis in the plane of path and disc axis, shape (4,).
    """
    x = velocity / max(float(np.linalg.norm(velocity)), 1e-9)
    right = np.cross([0.0, 0.0, 1.0], x)
    right /= max(float(np.linalg.norm(right)), 1e-9)
    down = np.cross(x, right)
    z = math.cos(roll) * down - math.sin(roll) * right
    axis = math.cos(angle_of_attack) * z + math.sin(angle_of_attack) * x
    return attitude_with(axis, velocity)


def attitude_with(axis: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return an attitude whose z axis is given and whose x axis lies along the velocity, (4,)."""
    z = axis / np.linalg.norm(axis)
    x = velocity - (velocity @ z) * z
    if np.linalg.norm(x) < 1e-6:
        x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return _quaternion(np.stack([x, np.cross(z, x), z], axis=1))


def _quaternion(matrix: FloatArray) -> FloatArray:
    """Return the unit quaternion, scalar first, of a rotation matrix from body to earth."""
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 - slow to import

    x, y, z, w = Rotation.from_matrix(matrix).as_quat()
    return np.array([w, x, y, z])


def release_information(release: Launch, deviations: FloatArray) -> FloatArray:
    """Return the root of the inverse covariance of a measured release, shape (12, 12).

    Args:
        release: The release.
        deviations: Standard deviations of speed [m/s], pitch, roll, yaw, angle of attack, sideslip
            [degrees], spin, roll rate, pitch rate [rad/s] and of x, y, height [m]; shape (12,).
    """
    centre = np.array(release.state())
    slopes = np.zeros((RELEASE_SIZE, 12))
    for j, name in enumerate(_RELEASE_FIELDS):
        h = 1e-4
        moved = replace(release, **{name: getattr(release, name) + h})
        slopes[: local.SIZE, j] = local.difference(centre, np.array(moved.state()))[0] / h
    slopes[0, 9] = slopes[1, 10] = slopes[2, 11] = 1.0
    covariance = (slopes * deviations**2) @ slopes.T
    covariance += np.diag(np.full(RELEASE_SIZE, _GAUGE**2))  # spin angle, and what is not spanned
    root: FloatArray = np.linalg.cholesky(np.linalg.inv(covariance)).T
    return root
