"""Errors of a real IMU: bias and noise, repeatable by a seed."""

import numpy as np

from disc_sim_ros.arrays import FloatArray, Vector
from disc_sim_ros.ros.messages import Six
from disc_sim_ros.ros.sim.config import ImuConfig

_BLOCK = 1024  # samples drawn at once


class ImuErrors:
    """Errors of the readings of one flight; sample n of flight m always has the same error.

    Attributes:
        offset: Position of the IMU from the centre of the disc, in `disc_body` [m].
    """

    def __init__(self, config: ImuConfig, flight: int) -> None:
        """Prepare the errors of a flight, counted from 0."""
        x, y, z = config.offset
        self.offset: Vector = (x, y, z)
        self._bias = np.array([*config.gyroscope_bias, *config.accelerometer_bias])
        self._deviation = np.repeat([config.gyroscope_noise, config.accelerometer_noise], 3)
        self._key = (config.seed + flight) % 2**63
        self._is_exact = not (self._bias.any() or self._deviation.any())
        self._block = -1
        self._noise: FloatArray = np.empty((0, 6))

    def add_to(self, reading: Six, sample: int) -> Six:
        """Return a reading (rad/s, then m/s^2) with the errors of its sample."""
        if self._is_exact:
            return reading
        block, row = divmod(sample, _BLOCK)
        if block != self._block:  # each block has its own seed: skipping one changes no other
            bits = np.random.Philox(key=self._key, counter=[0, 0, 0, block % 2**63])
            self._noise = np.random.Generator(bits).standard_normal((_BLOCK, 6))
            self._block = block
        x, y, z, u, v, w = (reading + self._bias + self._deviation * self._noise[row]).tolist()
        return x, y, z, u, v, w
