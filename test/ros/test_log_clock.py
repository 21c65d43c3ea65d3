"""Log times: those of the wall clock, whoever sets it."""

import pytest

from disc_sim_ros.ros.recorder import clock as recorder_clock
from disc_sim_ros.ros.recorder.clock import LogClock

SECOND = 1_000_000_000


@pytest.fixture
def machine(monkeypatch):
    """The clocks of a machine, and what they show."""

    class Machine:
        wall, steady = 1_700_000_000 * SECOND, 5 * SECOND

        def passes(self, seconds, rate=1.0):
            self.steady += round(seconds * SECOND)
            self.wall += round(seconds * rate * SECOND)

    machine = Machine()
    monkeypatch.setattr(recorder_clock.time, 'time_ns', lambda: machine.wall)
    monkeypatch.setattr(recorder_clock.time, 'monotonic_ns', lambda: machine.steady)
    return machine


def test_it_follows_a_wall_clock_that_is_corrected_slowly(machine):
    clock = LogClock()
    for _ in range(10_000):
        machine.passes(0.01, rate=1.0005)  # as fast as NTP slews
    assert clock.now() == machine.wall
    assert clock.shift == 0


@pytest.mark.parametrize('jump', [3600, -3600, 1_700_000_000, -2])
def test_it_goes_on_where_the_wall_clock_is_set(machine, jump):
    clock = LogClock()
    machine.passes(1.0)
    before = clock.now()
    received = machine.wall
    machine.wall += jump * SECOND
    machine.passes(0.01)
    assert clock.now() == before + SECOND // 100
    assert clock.shift == jump * SECOND
    assert clock.of(machine.wall - 5_000_000) == before + 5_000_000
    assert clock.of(received) == before  # it came before the jump


def test_what_waited_keeps_the_time_of_its_arrival(machine):
    clock = LogClock()
    arrived = machine.wall
    machine.passes(3.0)
    clock.now()
    assert clock.of(arrived) == arrived


def test_a_time_that_cannot_be_is_now(machine):
    clock = LogClock()
    machine.passes(1.0)
    now = clock.now()
    assert [clock.of(now + SECOND), clock.of(0)] == [now, now]
