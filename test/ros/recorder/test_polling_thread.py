"""The thread that takes messages: when it sleeps, and how it ends."""

import time

import pytest

pytest.importorskip('rclpy')

from disc_sim_ros.ros.recorder.polling_thread import PollingThread


def test_it_sleeps_only_if_no_more_messages_wait_and_reports_why_it_ended():
    rounds = []

    def take() -> bool:
        rounds.append(time.monotonic())
        if len(rounds) == 30:
            raise ValueError('no such reader')
        return len(rounds) < 20

    thread = PollingThread(take, 0.05)
    thread.start()
    thread.join(60.0)
    assert 'no such reader' in str(thread.failure)
    assert rounds[29] - rounds[20] >= 9 * 0.05
    thread.end()


def test_it_ends_when_asked():
    thread = PollingThread(lambda: False, 0.001)
    thread.start()
    thread.end()
    assert not thread.is_alive()
    assert thread.failure is None
