"""Simulated time: stamps of steps, exact however long they are counted."""

from fractions import Fraction

import pytest

from disc_sim_ros.ros.sim.clock import SimClock

START = 1_700_000_000_123_456_789  # ns
YEAR = 365 * 24 * 3600  # s


@pytest.mark.parametrize('rate', [1000.0, 3000.0, 770.0, 0.1, 1e4 / 3])
def test_stamps_are_exact_after_a_year(rate):
    clock = SimClock(START, rate)
    exact = Fraction(rate).limit_denominator(1_000_000)
    steps = round(YEAR * rate)
    assert clock.at(steps) == START + steps * 1_000_000_000 // exact
    clock.steps = steps
    assert clock.now == clock.at(steps)


@pytest.mark.parametrize('rate', [1000.0, 3000.0, 770.0])
def test_a_stamp_belongs_to_the_first_step_not_before_it(rate):
    clock = SimClock(START, rate)
    for step in (0, 1, 2, 999, 12_345_678):
        assert clock.step_at(clock.at(step)) == step
        assert clock.step_at(clock.at(step) + 1) == step + 1
    clock.steps = 100
    assert clock.step_at(START) == 100  # a stamp in the past belongs to the present step


def test_another_rate_goes_on_from_the_present_stamp():
    clock = SimClock(0, 3000.0)
    clock.steps = 7
    now = clock.now
    clock.restart(770.0)
    assert (clock.steps, clock.now) == (0, now)
    clock.restart(1000.0)
    assert clock.at(1000) == now + 1_000_000_000
