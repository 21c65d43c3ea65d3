"""The nutation of measured axes tells the spin, and a predictor uses it."""

from dataclasses import replace
import math

import numpy as np
import pytest

from disc_sim_ros.estimation.prediction import nutation
from disc_sim_ros.estimation.prediction.disc_choice import DiscChoice
from disc_sim_ros.estimation.prediction.predictor import PredictorConfig
from disc_sim_ros.estimation.prediction.prior import Gaussian, ThrowPrior
from disc_sim_ros.estimation.prediction.throw_estimator import ThrowEstimator
from disc_sim_ros.estimation.prediction.throw_fit import Fitted, Measurements
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.frames import paper_from_map
from disc_sim_ros.physics.launch import Launch
from estimation.synthetic_throws import Throw, throw

SETUP = Setup(disc=load_disc('ultrastar'))
WOBBLY = ThrowPrior(rate=Gaussian(2.5, 0.2))  # rad/s about each diameter: 2 degrees of nutation
EXACT_AXIS, FINE_AXIS = math.radians(0.2), math.radians(0.5)


def measured(t: Throw, axis_sigma: float, duration: float = 1.0) -> Measurements:
    k = int(np.searchsorted(t.time, duration))
    time, axis = t.time[:k], -paper_from_map(t.axis[:k])
    position = paper_from_map(t.position[:k])
    return Measurements(time, position, np.full(k, 0.02), axis, np.full(k, axis_sigma))


def beliefs(
    prior: ThrowPrior, axis_sigma: float, count: int = 6
) -> list[tuple[float, nutation.SpinBelief]]:
    """Return the true spins of some throws, and what is believed of each after 1 s."""
    (model,) = PredictorConfig(setup=SETUP, prior=ThrowPrior()).models
    out = []
    for seed in range(count):
        t = throw(SETUP, prior, seed, axis_sigma=axis_sigma)
        estimator = ThrowEstimator(model)
        estimator.update(measured(t, axis_sigma))
        belief = estimator.spins()
        assert belief is not None
        out.append((t.state[nutation.SPIN], belief))
    return out


def test_exact_axes_tell_the_spin():
    """A nutation of 2 degrees, axes to 0.2 degrees: each spin is likeliest."""
    for spin, belief in beliefs(WOBBLY, EXACT_AXIS):
        likeliest = belief.estimate
        # Half of it is the grid, the rest the corners of the table, which shift the rate a little.
        assert likeliest.mean == pytest.approx(spin, abs=1.0)
        assert likeliest.sigma < 1.0
        assert belief.weights.sum() == pytest.approx(1.0)
        assert belief.drawn(np.array([0.1, 0.9])) == pytest.approx(spin, abs=1.5)


def test_the_mean_is_followed_where_several_spins_fit_alike():
    """The miss jumped to 6 m for 0.1 s, when the likeliest of several peaks was another one."""
    spins = np.arange(40.0, 81.0, 0.5)

    def belief(*shares: float) -> nutation.SpinBelief:
        """Return one with peaks at 45, 60 and 75 rad/s."""
        peaks = [np.exp(-2.0 * (spins - spin) ** 2) for spin in (45.0, 60.0, 75.0)]
        weights = np.array(shares) @ np.array(peaks)
        return nutation.SpinBelief(spins, weights / weights.sum())

    one, several = belief(0.8, 0.1, 0.1).estimate, belief(0.4, 0.3, 0.3).estimate
    assert one.mean == pytest.approx(45.0)
    assert one.sigma == pytest.approx(0.5, rel=0.01)
    assert several.mean == pytest.approx(0.4 * 45.0 + 0.3 * 60.0 + 0.3 * 75.0, abs=0.01)
    variance = 0.4 * 13.5**2 + 0.3 * 1.5**2 + 0.3 * 16.5**2 + 0.5**2
    assert several.sigma == pytest.approx(math.sqrt(variance), rel=0.01)


def test_true_spins_lie_where_they_are_believed_to():
    """Of 40 usual throws in usual noise 32 are expected between the shares of 10 and 90 %.

    A deviation of 2.5: fewer than 24 are 1 in 500, all 40 are 1 in 7,500.
    """
    inside = 0
    for spin, belief in beliefs(ThrowPrior(), math.radians(2.0), 40):
        low, high = belief.drawn(np.array([0.1, 0.9]))
        inside += low < spin < high
    assert 24 <= inside < 40


def test_the_damping_is_that_of_a_flight():
    """The transverse rate falls by it; the precession adds some per cent of the first rate."""
    launch = Launch(speed=15.0, spin=60.0, roll_rate=3.0, pitch_rate=3.0, height=50.0)
    t = fly(launch, SETUP, duration=0.4, ground=False, sample_rate=200.0).trajectory
    transverse = np.hypot(t.rates[:, 0], t.rates[:, 1])
    fallen = -float(np.polyfit(t.t, np.log(transverse), 1)[0])
    speed = float(np.mean(np.linalg.norm(t.velocity, axis=1)))
    assert nutation.damping(SETUP, speed) == pytest.approx(fallen, rel=0.15)


def test_a_throw_is_followed_with_the_spin_of_its_nutation():
    """Beside an estimator with the precession alone, which is off by 1 to 8 rad/s."""
    (model,) = PredictorConfig(setup=SETUP).models
    exact, precession = [], []
    for seed in range(6):
        t = throw(SETUP, WOBBLY, seed, axis_sigma=FINE_AXIS)
        plain, choice = ThrowEstimator(model), DiscChoice([model])
        for until in np.arange(0.5, 1.5, 0.1):
            data = measured(t, FINE_AXIS, float(until))
            precession.append(abs(off_by(plain.update(data), t)))
            exact.append(abs(off_by(choice.update(data), t)))
        assert np.isfinite(choice.landing_covariance()).all()
    assert np.median(exact) < 0.8
    assert np.median(precession) > 2.0 * np.median(exact)


def off_by(fitted: Fitted, t: Throw) -> float:
    """Return by how much the spin is off [rad/s]."""
    return float(fitted.estimate.state[nutation.SPIN] - t.state[nutation.SPIN])


def test_too_few_axes_tell_nothing():
    (model,) = PredictorConfig(setup=SETUP).models
    t = throw(SETUP, WOBBLY, 0)
    estimator = ThrowEstimator(model)
    estimator.update(measured(t, FINE_AXIS, nutation.LEAST_TIME - 0.05))
    assert estimator.spins() is None
    data = measured(t, FINE_AXIS)
    estimator.update(replace(data, axis=np.full_like(data.axis, np.nan)))
    assert estimator.spins() is None


def test_a_spin_with_which_no_flight_goes_on_is_lost_without_a_warning():
    (model,) = PredictorConfig(setup=SETUP).models
    t = throw(SETUP, WOBBLY, 0)
    plain = ThrowEstimator(model)
    plain.update(measured(t, FINE_AXIS))
    lost = plain.with_spin(Gaussian(1e9, 1.0))
    assert lost.update(measured(t, FINE_AXIS), 2, 0).gain == 0.0
    assert lost.is_lost


@pytest.mark.parametrize('spin', [Gaussian(0.0, 0.1), Gaussian(0.0, 1000.0)])
def test_spins_of_any_prior_are_weighed(spin: Gaussian):
    """A disc that hardly spins does not nutate; of a prior of 1,000 rad/s no more are weighed."""
    prior = replace(WOBBLY, spin=spin)
    (model,) = PredictorConfig(setup=SETUP, prior=prior).models
    t = throw(SETUP, WOBBLY, 0)
    slow = np.array([*t.state[: nutation.SPIN], spin.mean, 0.0])
    data = measured(t, FINE_AXIS)
    plain = Gaussian(spin.mean, spin.sigma)
    assert nutation.weighed(model, slow, slow, plain, data, data.axis, 1.0) is None
    belief = nutation.weighed(model, t.state, t.state, spin, data, data.axis, 1.0)
    assert belief is None or len(belief.spins) < 1000
