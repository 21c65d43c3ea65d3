"""What instruments measure of a flight: predictions from states, one class for each instrument.

Each class holds the measurements of one throw in the paper's axes and predicts them from states at
its sample times. `residuals` takes many flights at once.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import local
from disc_sim_ros.physics import frames

_DT = 1e-3  # s; an acceleration is the difference of velocities this long before and after
POSITION, ATTITUDE, GYRO, ACCELERATION, CAMERA = (
    'position',
    'attitude',
    'gyro',
    'acceleration',
    'camera',
)
UNITS = {POSITION: 'm', ATTITUDE: 'rad', GYRO: 'rad/s', ACCELERATION: 'm/s^2', CAMERA: 'm'}
NOISE = {POSITION: 0.02, ATTITUDE: 0.035, GYRO: 0.02, ACCELERATION: 0.5, CAMERA: 0.3}

FEWEST = 6  # samples that the beginning of a throw keeps


class Observation(Protocol):
    """Measurements of one instrument during one throw."""

    @property
    def kind(self) -> str:
        """Return the instrument, a key of UNITS."""

    @property
    def t(self) -> FloatArray:
        """Return when it measured, since the first state [s], shape (n,)."""

    @property
    def sample_times(self) -> FloatArray:
        """Return when it needs the state [s], shape (k,)."""

    def residuals(self, states: FloatArray, foot: FloatArray) -> FloatArray:
        """Return predictions minus measurements.

        Args:
            states: States at the sample times of m flights, shape (m, k, 14).
            foot: Point under a camera of each flight, earth axes 1 [m], shape (m, 2).

        Returns:
            Residuals in the unit of the instrument, shape (m, n, d).
        """


@dataclass(frozen=True, eq=False)
class Positions:
    """Positions of the centre, as of a motion-capture system.

    Attributes:
        t: Times [s], shape (n,).
        XYZ: Positions in earth axes 1 [m], shape (n, 3).
    """

    t: FloatArray
    XYZ: FloatArray
    kind: str = POSITION

    @property
    def sample_times(self) -> FloatArray:
        """Return when it needs the state [s]."""
        return self.t

    def residuals(self, states: FloatArray, _foot: FloatArray) -> FloatArray:
        """Return predicted minus measured positions [m], shape (m, n, 3)."""
        difference: FloatArray = states[:, :, 0:3] - self.XYZ
        return difference


@dataclass(frozen=True, eq=False)
class Attitudes:
    """Directions of the disc's axis: the part of an attitude that the spin does not hide.

    Attributes:
        t: Times [s], shape (n,).
        axis: Unit vectors through the underside, earth axes 1, shape (n, 3).
    """

    t: FloatArray
    axis: FloatArray
    kind: str = ATTITUDE

    @property
    def sample_times(self) -> FloatArray:
        """Return when it needs the state [s]."""
        return self.t

    def residuals(self, states: FloatArray, _foot: FloatArray) -> FloatArray:
        """Return the predicted axis in two directions across the measured one, shape (m, n, 2)."""
        across = _across(self.axis)
        difference: FloatArray = np.einsum('mni,nki->mnk', local.disc_axis(states), across)
        return difference


@dataclass(frozen=True, eq=False)
class Gyro:
    """Angular velocities in axes fixed in the disc.

    Attributes:
        t: Times [s], shape (n,).
        pqr: About x, y, z of the paper's body axes 2 [rad/s], shape (n, 3).
    """

    t: FloatArray
    pqr: FloatArray
    kind: str = GYRO

    @property
    def sample_times(self) -> FloatArray:
        """Return when it needs the state [s]."""
        return self.t

    def residuals(self, states: FloatArray, _foot: FloatArray) -> FloatArray:
        """Return predicted minus measured rates [rad/s], shape (m, n, 3)."""
        return _in_disc(states, states[:, :, 10:13]) - self.pqr


@dataclass(frozen=True, eq=False)
class Accelerations:
    """Specific forces at the centre, in axes fixed in the disc.

    Attributes:
        t: Times [s], shape (n,).
        f: Along x, y, z of the paper's body axes 2 [m/s^2], shape (n, 3).
        gravity: g [m/s^2].
        largest: Range of the instrument [m/s^2]; measurements at its end are not used.
    """

    t: FloatArray
    f: FloatArray
    gravity: float
    largest: float = np.inf
    kind: str = ACCELERATION

    @property
    def sample_times(self) -> FloatArray:
        """Return when it needs the state [s]: before, at and after each measurement."""
        before = np.maximum(self.t - _DT, 0.0)
        return np.concatenate([before, self.t, self.t + _DT])

    def residuals(self, states: FloatArray, _foot: FloatArray) -> FloatArray:
        """Return predicted minus measured specific forces [m/s^2], shape (m, n, 3)."""
        n = len(self.t)
        before, now, after = states[:, :n], states[:, n : 2 * n], states[:, 2 * n :]
        span = (self.t + _DT) - np.maximum(self.t - _DT, 0.0)
        a = (after[..., 3:6] - before[..., 3:6]) / span[:, np.newaxis]
        a[..., 2] -= self.gravity
        despun = np.einsum('mnji,mnj->mni', frames.rotation_matrix(now[..., 6:10]), a)
        in_range = (np.abs(self.f) < self.largest * (1.0 - 1e-6)).astype(float)
        difference: FloatArray = (_in_disc(now, despun) - self.f) * in_range
        return difference


@dataclass(frozen=True, eq=False)
class Camera:
    """Points on the ground as a camera straight above draws the disc.

    A disc that is z above the ground is drawn H / (H - z) times too far from the point under the
    camera, H its height.

    Attributes:
        t: Times [s], shape (n,).
        XY: Drawn points in earth axes 1 [m], shape (n, 2).
        height: H [m].
    """

    t: FloatArray
    XY: FloatArray
    height: float
    kind: str = CAMERA

    @property
    def sample_times(self) -> FloatArray:
        """Return when it needs the state [s]."""
        return self.t

    def residuals(self, states: FloatArray, foot: FloatArray) -> FloatArray:
        """Return predicted minus drawn points [m], shape (m, n, 2)."""
        z = np.clip(frames.flip(states[:, :, 2]), 0.0, 0.9 * self.height)
        foot = foot[:, np.newaxis]
        scale = (self.height / (self.height - z))[..., np.newaxis]
        drawn: FloatArray = foot + (states[:, :, 0:2] - foot) * scale
        difference: FloatArray = drawn - self.XY
        return difference


def _in_disc(states: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors of despun axes 2 in the axes fixed in the disc, shape (..., 3)."""
    sigma = states[..., 13]
    c, s = np.cos(sigma), np.sin(sigma)
    x, y, z = (vectors[..., k] for k in range(3))
    return np.stack([c * x + s * y, c * y - s * x, z], axis=-1)


def _across(axis: FloatArray) -> FloatArray:
    """Return two unit vectors at right angles to each axis, shape (n, 2, 3)."""
    least = np.argmin(np.abs(axis), axis=-1)
    e = np.eye(3)[least]
    one = np.cross(axis, e)
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    return np.stack([one, np.cross(axis, one)], axis=-2)


def until(o: Observation, end: float) -> Observation:
    """Return the measurements up to a time [s], at least FEWEST."""
    n = max(int(np.searchsorted(o.t, end, side='right')), FEWEST)
    values = {
        name: value[:n]
        for name, value in vars(o).items()
        if isinstance(value, np.ndarray) and len(value) == len(o.t)
    }
    return replace(o, **values)  # type: ignore[type-var]
