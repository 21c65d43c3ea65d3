"""What tests hear of a simulator: stamps, flights, diagnostics; and throws."""

import math
import os
import re
import struct
import time

from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool

SECOND = 1_000_000_000  # ns
PERIOD = 5_000_000  # ns, from message to message by default
HELD = {'auto_throw': False, 'start_time': 0.0}
LONG = HELD | {'launch.height': 1000.0}  # a flight that outlasts a test


def patience(seconds: float) -> float:
    """A time limit [s], longer on a machine that has more to do than it can."""
    return seconds * max(1.0, os.getloadavg()[0] / os.cpu_count())


def ns(cdr: bytes) -> int:
    """The stamp of a serialised message that begins with a header."""
    seconds, nanoseconds = struct.unpack_from('<iI', cdr, 4)
    return seconds * SECOND + nanoseconds


def stamp(message) -> int:
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def told(response, pattern: str) -> int:
    """A time in seconds that a service's answer tells, in ns."""
    assert response.success, response.message
    found = re.fullmatch(pattern.replace('TIME', r'(\d+\.\d{9}) s'), response.message)
    assert found, response.message
    return round(float(found[1]) * SECOND)


def throw(ros, sim, flight: int) -> int:
    """Throw; return the stamp of the release."""
    return told(ros.call(sim, 'throw'), f'flight {flight}, released at TIME')


def since(odom: list[bytes], release: int, until: float = math.inf) -> dict[int, bytes]:
    """All but the stamps of a flight's messages, by time since the release [ns]."""
    return {ns(m) - release: m[12:] for m in odom if release <= ns(m) <= until}


def names(events) -> list[str]:
    return [event.name.partition(': ')[2] for event in events]


def fly_until(ros, odom, time_: float) -> None:
    """Take messages until one has a stamp [ns] at least so late."""
    ros.spin_until(lambda: odom and ns(odom[-1]) >= time_, f'odom at {time_ / SECOND} s')


def time_of(ros, sim) -> tuple[int, float]:
    """The present stamp [ns], and the wall time of asking [s]."""
    response = ros.call(sim, 'pause', SetBool, data=True)
    ros.pause(sim, still=False)
    return told(response, 'time stands still at TIME'), time.monotonic()


def wall(seconds: float):
    """A condition that holds once a wall time has passed."""
    end = time.monotonic() + seconds
    return lambda: time.monotonic() >= end


def diagnostics_of(heard) -> dict[str, str]:
    """The newest values of /diagnostics."""
    return {pair.key: pair.value for pair in heard[-1].status[0].values} if heard else {}


def accepted(diagnostics, topic: str) -> int:
    return int(diagnostics_of(diagnostics).get(f'{topic} accepted', 0))


def release_of(x=0.0, z=100.0, spin=-30.0) -> Odometry:
    message = Odometry()
    message.pose.pose.position.x = x
    message.pose.pose.position.z = z
    message.pose.pose.orientation.w = 1.0
    message.twist.twist.linear.x = 12.0
    message.twist.twist.angular.z = spin
    return message
