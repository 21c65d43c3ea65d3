"""The pacer: which steps are due, what a stall costs."""

import pytest

from disc_sim_ros.ros.sim.realtime import CATCH_UP, Pacer

STEP = 0.001


def run(pacer, times):
    """Count all steps that are due at each time; return how many each time."""
    counts = []
    for now in times:
        counts.append(pacer.due(now))
        pacer.count(counts[-1])
    return counts


@pytest.mark.parametrize('rate', [1.0, 0.5, 10.0])
def test_lateness_does_not_add_up(rate):
    pacer = Pacer(STEP, rate, 50.0)
    period = STEP / rate
    late = 0.3 * period
    assert run(pacer, [50.0 + k * period + late for k in range(1, 1001)]) == [1] * 1000
    assert pacer.missed == pacer.slips == 0
    assert pacer.worst == pytest.approx(late)
    assert pacer.quantile(0.5) == pytest.approx(late)
    assert pacer.wait(50.0 + 1000 * period, 1) == pytest.approx(period)


def test_lateness_counts_from_the_deadline_of_all_the_steps_that_it_slept_for():
    pacer = Pacer(STEP, 1.0, 0.0)
    assert pacer.due(0.0045, 5) == 0
    assert not pacer.recent
    assert pacer.due(0.0052, 5) == 5
    assert pacer.quantile(0.5) == pytest.approx(0.0002)
    assert pacer.missed == 0


def test_a_short_stall_is_caught_up_and_a_long_one_slips():
    pacer = Pacer(STEP, 1.0, 0.0)
    assert run(pacer, [0.0005, 0.001, 0.051]) == [0, 1, 50]
    assert (pacer.missed, pacer.slips) == (1, 0)
    (due,) = run(pacer, [1.0])
    assert pacer.slips == 1
    assert pacer.slipped == pytest.approx(1.0 - 0.052 - CATCH_UP)
    assert due == round(CATCH_UP / STEP) + 1
    assert pacer.take_worst() == pytest.approx(1.0 - 0.052)
    assert pacer.take_worst() == 0.0
    assert run(pacer, [1.0011]) == [1]  # one step later


def test_a_restart_forgets_the_deadlines_before_it():
    pacer = Pacer(STEP, 1.0, 0.0)
    pacer.restart(STEP, 2.0, 100.0)
    assert run(pacer, [100.0004, 100.0005, 100.002]) == [0, 1, 3]
    assert pacer.slips == 0
    assert pacer.restarts == 2
