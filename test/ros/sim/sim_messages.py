"""Stamps, events, diagnostics and service responses of a simulator, as tests read them."""

import math
import os
import re
import struct
import time

from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool

SECOND = 1_000_000_000  # ns
PERIOD = 5_000_000  # ns, from message to message by default
AT_LAUNCH = {'auto_throw': False, 'start_time': 0.0}
LONG = AT_LAUNCH | {'launch.height': 1000.0}  # a flight that lasts longer than a test


def patience(seconds: float) -> float:
    """Return a time limit [s], longer on a machine with more processes than cores."""
    return seconds * max(1.0, os.getloadavg()[0] / os.cpu_count())


def ns(cdr: bytes) -> int:
    """Return the stamp of a serialised message that begins with a header [ns]."""
    seconds, nanoseconds = struct.unpack_from('<iI', cdr, 4)
    return seconds * SECOND + nanoseconds


def stamp(message) -> int:
    """Return the stamp of a message [ns]."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def time_in(response, pattern: str) -> int:
    """Return the time in the message of a service response [ns]; `pattern` has TIME for it."""
    assert response.success, response.message
    match = re.fullmatch(pattern.replace('TIME', r'(\d+\.\d{9}) s'), response.message)
    assert match, response.message
    return round(float(match[1]) * SECOND)


def throw(ros, sim, flight: int, *, replaced: int = 0) -> int:
    """Throw, which ends a flight in the air where `replaced`; return the stamp of it [ns]."""
    end = f'; flight {replaced} ended in the air' if replaced else ''
    return time_in(ros.call(sim, 'throw'), f'flight {flight}, released at TIME{end}')


def since(odom: list[bytes], release: int, until: float = math.inf) -> dict[int, bytes]:
    """Return the messages of a flight without their stamps, by time since the release [ns]."""
    return {ns(m) - release: m[12:] for m in odom if release <= ns(m) <= until}


def names(events) -> list[str]:
    return [event.name.partition(': ')[2] for event in events]


def fly_until(ros, odom, time_: float) -> None:
    """Take messages until one has a stamp of at least `time_` [ns]."""
    ros.spin_until(lambda: odom and ns(odom[-1]) >= time_, f'odom at {time_ / SECOND} s')


def time_of(ros, sim) -> tuple[int, float]:
    """Return the present stamp [ns], and the wall time of asking [s]."""
    response = ros.call(sim, 'pause', SetBool, data=True)
    ros.resume(sim)
    return time_in(response, 'paused at TIME'), time.monotonic()


def wall(seconds: float):
    """Return a condition that holds once a wall time has passed."""
    end = time.monotonic() + seconds
    return lambda: time.monotonic() >= end


def diagnostics_of(arrays) -> dict[str, str]:
    """Return the newest values of /diagnostics."""
    return {pair.key: pair.value for pair in arrays[-1].status[0].values} if arrays else {}


def accepted(arrays, topic: str) -> int:
    """Return the number of accepted commands of a topic in the newest of /diagnostics."""
    return int(diagnostics_of(arrays).get(f'{topic} accepted', 0))


def release_of(x=0.0, z=100.0, spin=-30.0) -> Odometry:
    message = Odometry()
    message.pose.pose.position.x = x
    message.pose.pose.position.z = z
    message.pose.pose.orientation.w = 1.0
    message.twist.twist.linear.x = 12.0
    message.twist.twist.angular.z = spin
    return message
