"""The pilot of one disc: odometry in, control coefficients out, at the times of Steer-v0."""

from collections.abc import Sequence

import numpy as np

from disc_sim_ros.arrays import FloatArray, Vector
from disc_sim_ros.envs import steering
from disc_sim_ros.envs.policy import Policy

_PERIOD = round(steering.PERIOD * 1e9)  # ns


class Pilot:
    """Flies a policy with the bits of the environment.

    Attributes:
        policy: The policy.
        target: Point on the ground in `map` [m].
        last: Stamp of the last action [ns]; None before the release.
    """

    def __init__(self, policy: Policy, target: tuple[float, float]) -> None:
        """Take a policy and the point to land at."""
        self.policy = policy
        self.target = target
        self._targets = np.array(target)[:, np.newaxis]
        self.last: int | None = None
        self._velocity: FloatArray = np.zeros((3, 1))

    def release(self, stamp: int, numbers: Sequence[float]) -> Vector:
        """Return C_L, C_M, C_N for a disc at its release.

        Args:
            stamp: Time [ns].
            numbers: The release in the order of `frames.odometry`.
        """
        self._velocity = steering.velocity(_columns(numbers))
        return self._act(stamp, numbers)

    def update(self, stamp: int, numbers: Sequence[float]) -> Vector | None:
        """Return the next C_L, C_M, C_N; None where the last ones still hold.

        Args:
            stamp: Time [ns].
            numbers: The disc in the order of `frames.odometry`.
        """
        if self.last is None or stamp < self.last + _PERIOD:
            return None
        return self._act(stamp, numbers)

    def land(self) -> None:
        """Wait for the next release."""
        self.last = None

    def _act(self, stamp: int, numbers: Sequence[float]) -> Vector:
        self.last = stamp
        observed, self._velocity = steering.observations(
            _columns(numbers), self._velocity, self._targets
        )
        roll, pitch, spin = steering.controls(self.policy(observed))[0].tolist()
        return roll, pitch, spin


def _columns(numbers: Sequence[float]) -> tuple[FloatArray, ...]:
    return tuple(np.array([x]) for x in numbers)
