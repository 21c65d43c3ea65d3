"""The spin of a throw from its nutation, which the flown model does not have.

A disc that is released with a turn about a diameter nutates: its axis goes round a slow mean with
the rate r I_z / I_x, and its amplitude falls with the damping (the free motion of eqn 11; see
`physics/kernels/nutation.py`). Measured axes tell that rate, and so the spin, which the precession
tells less exactly. Several spins may fit alike: each has a weight.
"""

from dataclasses import dataclass
import math

import numpy as np

from disc_sim_ros.arrays import ComplexArray, FloatArray
from disc_sim_ros.estimation.prediction.prior import Gaussian
from disc_sim_ros.estimation.prediction.throw_fit import Measurements, Model
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import State

LEAST_TIME = 0.3  # s of measurements, from which spins are weighed
_STEP = 0.5  # rad/s between spins
_REACH, _FARTHEST = 4.0, 100.0  # to both sides: standard deviations of the spin, and rad/s
_SLOWEST = 5.0  # rad/s; a slower disc goes round less than once before its nutation is gone
_PEAK = 2.0  # rad/s to both sides of the likeliest spin that tell how exactly it is known
_LEAST_SIGMA = 0.3  # rad/s
_LEAST_SHARE = 0.5  # of the probability near the likeliest spin, if it is to be followed
_SLOW = 4  # powers of the time, from 0 on, that axes may be off by without a nutation
_VX, SPIN = State._fields.index('VX'), State._fields.index('r')


@dataclass(frozen=True, slots=True)
class SpinBelief:
    """How likely each spin is.

    Attributes:
        spins: Spin rates at the first measurement [rad/s], ascending, shape (n,).
        weights: Their probabilities, shape (n,).
    """

    spins: FloatArray
    weights: FloatArray

    @property
    def estimate(self) -> Gaussian:
        """Return the likeliest spin, and how exactly it is known if it is the right one.

        Where less than half of the probability is near it, the mean of all spins: a throw that
        follows one of several peaks lands metres off if it is the wrong one.
        """
        best = float(self.spins[int(np.argmax(self.weights))])
        near = np.abs(self.spins - best) <= _PEAK
        if float(self.weights[near].sum()) < _LEAST_SHARE:
            near, best = np.full(len(near), fill_value=True), float(self.weights @ self.spins)
        squares = float(self.weights[near] @ (self.spins[near] - best) ** 2)
        variance = squares / float(self.weights[near].sum())
        return Gaussian(best, max(math.sqrt(variance), _LEAST_SIGMA))

    def drawn(self, shares: FloatArray) -> FloatArray:
        """Return the spins below which these shares of the probability lie [rad/s]."""
        middle = np.cumsum(self.weights) - 0.5 * self.weights
        return np.asarray(np.interp(shares, middle, self.spins))


def weighed(
    model: Model,
    state: FloatArray,
    last: FloatArray,
    plain: Gaussian,
    data: Measurements,
    axes: FloatArray,
    scale: float,
) -> SpinBelief | None:
    """Weigh the spins of a throw by the nutation that is left in the measured axes.

    For each spin the nutation is a decaying turn of known rate with two unknown amplitudes, of
    which the prior of the transverse rates is known: its evidence is in closed form.

    Args:
        model: The model that was fitted; it has no nutation.
        state: The fitted throw at the first measurement, paper's axes, shape (14,).
        last: The same at the newest measurement, shape (14,).
        plain: Spin by that fit [rad/s].
        data: The measurements, some with axes.
        axes: Axes of the fit at their times, shape (k, 3).
        scale: Of the residuals of axes.

    Returns:
        The belief; None of a disc that hardly spins. The other way round is another model.
    """
    if not abs(plain.mean) > _SLOWEST:
        return None
    reach = min(_REACH * plain.sigma, _FARTHEST)
    spins = np.arange(plain.mean - reach, plain.mean + reach + _STEP, _STEP)
    spins = spins[spins * math.copysign(1.0, plain.mean) > _SLOWEST]
    known = data.per_sigma[:, 3] > 0.0
    time = data.time[known]
    per_sigma = data.per_sigma[known, 3] / scale
    off = _off_the_axis(data.axis[known], axes[known])
    duration = float(data.time[-1])
    speeds = [float(np.linalg.norm(each[_VX : _VX + 3])) for each in (state, last)]
    slowing = float(last[SPIN] / state[SPIN]) - 1.0
    part = 0.5 * time / duration  # spin and speed change nearly linearly
    rate = model.setup.plant.I_z / model.setup.plant.I_x
    turns = rate * time * (1.0 + slowing * part)
    decayed = damping(model.setup, speeds[0]) * time * (1.0 + (speeds[1] / speeds[0] - 1.0) * part)
    sizes = per_sigma * np.exp(-decayed)
    swing = sizes[:, None] * _turned(turns, spins)
    # What changes slowly is of the fit: another disc than the assumed one, or a search under way.
    slow, _ = np.linalg.qr(per_sigma[:, None] * time[:, None] ** np.arange(_SLOW))
    off = per_sigma * off
    off -= slow @ _products(slow, off[:, None])[:, 0]
    amplitude = model.prior.rate.sigma / (rate * np.abs(spins))  # rad, prior of each component
    normal = float(sizes @ sizes) - np.sum(np.abs(_products(slow, swing)) ** 2, axis=0)
    of_x, of_y = _products(np.column_stack([off.real, off.imag]), swing)
    projected = np.abs(of_x - 1j * of_y)
    gain = 0.5 * projected**2 / (normal + amplitude**-2) - np.log1p(normal * amplitude**2)
    logarithms = gain - 0.5 * ((spins - plain.mean) / plain.sigma) ** 2
    weights = np.exp(logarithms - logarithms.max())
    return SpinBelief(spins, weights / weights.sum())


def _turned(turns: FloatArray, spins: FloatArray) -> ComplexArray:
    """Return turns of a length of 1 by each of evenly spaced spins, shape (k, n).

    Each is the one before, turned by the same angle again: fifteen times as fast as exponentials.
    """
    turned = np.empty((len(turns), len(spins)), dtype=complex)
    turned[:, 1:] = np.exp(1j * _STEP * turns)[:, None]
    turned[:, :1] = np.exp(1j * spins[0] * turns)[:, None]
    return np.asarray(np.cumprod(turned, axis=1), dtype=complex)


def _products(columns: FloatArray, swing: ComplexArray) -> ComplexArray:
    """Return products of real columns, shape (k, m), with complex ones, shape (k, n): (m, n)."""
    parts = np.ascontiguousarray(swing).view(float)
    product = np.einsum('km,kn->mn', columns, parts)  # not by BLAS, whose threads take longer
    return np.asarray(product).view(complex)


def _off_the_axis(measured: FloatArray, fitted: FloatArray) -> ComplexArray:
    """Return how far measured axes are from fitted ones, as complex numbers, shape (k,).

    The real part is along x of the earth across the fitted axis, and a turn about that axis goes
    from it towards the imaginary part.
    """
    first = np.array([1.0, 0.0, 0.0]) - fitted * fitted[:, :1]
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(fitted, first)
    off = measured - fitted
    turned: ComplexArray = np.einsum('ij,ij->i', off, first) + 1j * np.einsum(
        'ij,ij->i', off, second
    )
    return turned


def damping(setup: Setup, speed: float) -> float:
    """Return how fast a nutation dies at an airspeed [1/s]: by the mean of C_Lp and C_Mq."""
    disc, plant = setup.disc, setup.plant
    per_rate = 0.25 * plant.rho * speed * plant.S * disc.diameter**2  # q S c c / (2 V)
    return -0.5 * (disc.C_Lp + disc.C_Mq) * per_rate / plant.I_x
