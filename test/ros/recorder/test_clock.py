"""Log times are those of the wall clock without its jumps."""

import time

import pytest

from disc_sim_ros.ros.recorder.clock import LogClock

SECOND = 1_000_000_000


@pytest.fixture
def machine(monkeypatch):
    """The clocks of a machine, which the test advances and sets."""

    class Machine:
        wall, steady = 1_700_000_000 * SECOND, 5 * SECOND

        def passes(self, seconds, rate=1.0):
            self.steady += round(seconds * SECOND)
            self.wall += round(seconds * rate * SECOND)

    machine = Machine()
    monkeypatch.setattr(time, 'time_ns', lambda: machine.wall)
    monkeypatch.setattr(time, 'monotonic_ns', lambda: machine.steady)
    return machine


def test_it_follows_a_wall_clock_whose_rate_is_corrected(machine):
    clock = LogClock()
    for _ in range(10_000):
        machine.passes(0.01, rate=1.0005)  # as fast as NTP slews
    assert clock.now() == machine.wall
    assert clock.shift == 0


@pytest.mark.parametrize('jump', [3600, -3600, 1_700_000_000, -2])
def test_a_jump_of_the_wall_clock_is_left_out(machine, jump):
    clock = LogClock()
    machine.passes(1.0)
    before = clock.now()
    received = machine.wall
    machine.wall += jump * SECOND
    machine.passes(0.01)
    assert clock.now() == before + SECOND // 100
    assert clock.shift == jump * SECOND
    assert clock.at(machine.wall - 5_000_000) == before + 5_000_000
    assert clock.at(received) == before  # it arrived before the jump


def test_a_message_that_waited_keeps_its_time_of_arrival(machine):
    clock = LogClock()
    received = machine.wall
    machine.passes(3.0)
    clock.now()
    assert clock.at(received) == received


def test_an_impossible_time_of_arrival_becomes_now(machine):
    clock = LogClock()
    machine.passes(1.0)
    now = clock.now()
    assert [clock.at(now + SECOND), clock.at(0)] == [now, now]
