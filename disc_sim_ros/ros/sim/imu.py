"""Errors of a real IMU as a data sheet states them, repeatable by a seed."""

import math

import numpy as np

from disc_sim_ros.arrays import FloatArray, Vector
from disc_sim_ros.ros.messages import Six
from disc_sim_ros.ros.sim.config import ImuConfig

_BLOCK = 1024  # samples drawn at once
_WHITE, _WALK = range(2)  # kinds of noise, each with random numbers of its own


class ImuErrors:
    """Errors of the readings of one flight; sample n of flight m always has the same noise.

    A reading passes the low-pass filter; then bias, random walk and white noise are added; then it
    is clipped to the range. The noise of a data sheet is that at the output.

    Attributes:
        offset: Position of the IMU from the centre of the disc, in `disc_body` [m].
        is_exact: True if there are no errors.
    """

    def __init__(self, config: ImuConfig, flight: int, period: float) -> None:
        """Prepare the errors of a flight.

        Args:
            config: The IMU.
            flight: Number of the flight, from 0.
            period: Time from sample to sample [s].
        """
        x, y, z = config.offset
        self.offset: Vector = (x, y, z)
        c = config
        cut_off = np.repeat([c.gyroscope_bandwidth, c.accelerometer_bandwidth], 3)
        density = np.array([*c.gyroscope_noise_density, *c.accelerometer_noise_density])
        walk = np.array([*c.gyroscope_bias_walk, *c.accelerometer_bias_walk])
        limits = np.array([*c.gyroscope_range, *c.accelerometer_range])
        sample = np.repeat([c.gyroscope_noise, c.accelerometer_noise], 3)
        # White noise reaches up to half the sample rate, or to pi / 2 of the cut-off: the
        # bandwidth of white noise behind a filter of first order.
        half_rate = 0.5 / period
        band = np.minimum(np.where(cut_off > 0.0, 0.5 * np.pi * cut_off, math.inf), half_rate)
        self._bias = np.array([*c.gyroscope_bias, *c.accelerometer_bias])
        self._deviation = np.sqrt(sample**2 + density**2 * band)
        self._walk = walk * math.sqrt(period)
        self._limits = np.where(limits > 0.0, limits, math.inf)
        self._follow = np.where(cut_off > 0.0, -np.expm1(-2.0 * np.pi * cut_off * period), 1.0)
        self._key = (c.seed + flight) % 2**63
        errors = (self._bias, self._deviation, self._walk, cut_off)
        self.is_exact = not any(e.any() for e in errors) and bool(np.isinf(self._limits).all())
        self._walks = bool(self._walk.any())
        self._block = -1
        self._noise: FloatArray = np.empty((0, 6))
        self._walked: FloatArray = np.zeros((_BLOCK, 6))  # sums of the random walk
        self._last = -1
        self._filtered: FloatArray = np.zeros(6)

    def add_to(self, reading: Six, sample: int) -> Six:
        """Return a reading (rad/s, then m/s^2) with the errors of its sample.

        The filter begins anew with a sample that does not follow the one before.
        """
        if self.is_exact:
            return reading
        block, row = divmod(sample, _BLOCK)
        if block != self._block:
            self._begin(block)
        if sample == self._last + 1 and sample:
            self._filtered = self._filtered + self._follow * (reading - self._filtered)
        else:
            self._filtered = np.array(reading)
        self._last = sample
        error = self._bias + self._deviation * self._noise[row]
        if self._walks:
            error = error + self._walk * self._walked[row]
        x, y, z, u, v, w = np.clip(self._filtered + error, -self._limits, self._limits).tolist()
        return x, y, z, u, v, w

    def _begin(self, block: int) -> None:
        """Draw the noise of a block, which has its own seed: skipping one changes no other."""
        self._noise = self._normal(_WHITE, block)
        if self._walks:
            first = self._block + 1 if block > self._block else 0
            base = self._walked[-1] if block > self._block >= 0 else np.zeros(6)
            for number in range(first, block + 1):
                self._walked = base + np.cumsum(self._normal(_WALK, number), axis=0)
                base = self._walked[-1]
        self._block = block

    def _normal(self, kind: int, block: int) -> FloatArray:
        bits = np.random.Philox(key=self._key, counter=[0, 0, kind, block % 2**63])
        return np.random.Generator(bits).standard_normal((_BLOCK, 6))
