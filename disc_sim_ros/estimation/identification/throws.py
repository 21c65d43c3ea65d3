"""One measured throw: its instruments, and what is believed of its release beforehand."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.identification.observations import (
    ATTITUDE,
    CAMERA,
    GYRO,
    POSITION,
    Attitudes,
    Camera,
    Gyro,
    Observation,
    Positions,
    until,
)
from disc_sim_ros.estimation.identification.releases import (
    ReleaseErrors,
    release_covariance,
    release_state,
)
from disc_sim_ros.estimation.lift_coordinates import axis_in_flow
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.thrower import Release

RELEASE_SIZE = local.SIZE + 1  # local coordinates of the first state, and the spin angle
# Standard deviations of the first state where only measurements tell it; wide beside instruments.
WIDE = np.array([2.0, 2.0, 2.0, 5.0, 5.0, 5.0, 0.5, 0.5, 5.0, 5.0, 20.0, 10.0])
_SPEED, _SPEED_DEVIATION = 17.0, 4.0  # m/s, where neither a path nor a release is known
_HEIGHT = 1.3  # m, of a release by hand
_GAUGE = 1e-3  # deviation of what no instrument of the throw can tell
_ADVANCE_RATIO, _ANGLE_OF_ATTACK = 0.5, math.radians(5.0)  # of an ordinary throw
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
        has_release: Whether the release was measured.
    """

    name: str
    observations: tuple[Observation, ...]
    start: FloatArray
    information: FloatArray
    believed: FloatArray = field(default_factory=lambda: np.zeros(RELEASE_SIZE))
    gauges: tuple[str, ...] = ()
    spin_known: bool = True
    has_release: bool = False

    @cached_property
    def times(self) -> FloatArray:
        """Return when a state is needed, ascending, each once [s]."""
        return np.unique(np.concatenate([o.sample_times for o in self.observations]))

    @cached_property
    def places(self) -> list[IntArray]:
        """Return the places in `times` of the sample times of each instrument."""
        return [np.searchsorted(self.times, o.sample_times) for o in self.observations]

    @cached_property
    def guess(self) -> FloatArray:
        """Return the first state that is believed before a fit, shape (14,)."""
        state = local.moved(self.start, self.believed[: local.SIZE])
        state[13] += self.believed[local.SIZE]
        return state

    @property
    def turns_only(self) -> bool:
        """Return True if only the turning was measured: no path, attitude or release."""
        return not (self.has_release or any(map(self.has, (POSITION, CAMERA, ATTITUDE))))

    def has(self, kind: str) -> bool:
        """Return True if an instrument of this kind measured it."""
        return any(o.kind == kind for o in self.observations)

    def starting_at(self, start: FloatArray) -> 'Throw':
        """Return the throw with changes counted from another state; the belief stays the same."""
        start = np.asarray(start, dtype=float)
        delta, turn = local.difference(start, self.guess)
        return replace(self, start=start, believed=np.array([*delta, turn]))

    def until(self, end: float) -> 'Throw':
        """Return the throw with its measurements up to a time [s]."""
        return replace(self, observations=tuple(until(o, end) for o in self.observations))


def throw_of(
    name: str,
    observations: Sequence[Observation],
    disc: Disc,
    *,
    spin: float | None = None,
    release: tuple[Release, ReleaseErrors] | None = None,
) -> Throw:
    """Return a throw whose first state is guessed from its measurements.

    Args:
        name: Its name in reports.
        observations: Its instruments.
        disc: Gives the size for a guess of the spin.
        spin: Spin rate at the first state [rad/s]; None where only the measurements tell it.
        release: The measured release with its errors, if there is one; its heading and its
            position are those of the path.

    Raises:
        ConfigError: There are no measurements from which a release can be guessed.
    """
    of = {o.kind: o for o in observations}
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
        state[6:10] = local.attitude(attitude.axis[0])
    else:
        state[6:10] = local.attitude(axis_in_flow(state[3:6], _ANGLE_OF_ATTACK, 0.0))
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
    root: FloatArray = np.diag(1.0 / wide)
    if release is not None:
        measured, errors = release
        measured, state = release_state(measured, disc, state[:3], state[3:6])
        covariance = np.diag(wide**2)
        covariance[: local.SIZE, : local.SIZE] = release_covariance(
            measured, disc, errors, wide[:3]
        )
        root = np.asarray(np.linalg.cholesky(np.linalg.inv(covariance)).T, dtype=float)
        known = True
    return Throw(
        name,
        tuple(observations),
        state,
        root,
        gauges=tuple(gauges),
        spin_known=known,
        has_release=release is not None,
    )


def _first_motion(t: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity at time 0 by a parabola through the first quarter second."""
    n = max(int(np.searchsorted(t, t[0] + _FIRST)), min(len(t), 5))
    fitted = np.polynomial.polynomial.polyfit(t[:n], x[:n], min(2, n - 1))
    return fitted[0], fitted[1]
