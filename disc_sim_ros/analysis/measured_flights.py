"""What a bag holds of throws as measurements: positions, attitudes, gyro, accelerometer."""

import numpy as np

from disc_sim_ros import topics
from disc_sim_ros.analysis import flights, recording
from disc_sim_ros.analysis.odometry import usable
from disc_sim_ros.analysis.recording import Flight
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.bags.reader import Bag
from disc_sim_ros.bags.topic import full_type
from disc_sim_ros.errors import BagError
from disc_sim_ros.physics.frames import paper_from_map
from disc_sim_ros.units import NANOSECONDS

_RATE = 120.0  # Hz, the most of an instrument that is used: a fit gains little from more
_COLUMNS = 7  # of the IMU: stamp, angular velocity, specific force
_IN_AIR = 0.2  # s, of a flight that counts

Columns = dict[str, tuple[FloatArray, FloatArray]]


def measured(bag: Bag, topic: str | None = None) -> dict[str, Columns]:
    """Return the measurements of each flight in a bag, by the name of disc and flight.

    Args:
        bag: The bag.
        topic: The only topic to read the motion from; None for every Odometry and PoseStamped.

    Returns:
        For each flight the times since its start [s] and values of each instrument: 'position'
        and 'attitude' in axes of messages, 'gyro' [rad/s] and 'acceleration' [m/s^2] in the
        paper's axes fixed in the disc, from the topic `imu` of the same namespace.

    Raises:
        BagError: The bag holds no motion, or no flight.
    """
    by_flight: dict[str, Columns] = {}
    for disc in recording.discs(bag, topic):
        imu = _imu(bag, f'{disc.namespace}/{topics.IMU}')
        for flight in flights.flights(disc):
            columns = _of_flight(flight, imu)
            if columns:
                by_flight[f'{disc.name} {flight.number}'] = columns
    if not by_flight:
        raise BagError(f'{bag.path}: there is no flight in it')
    return by_flight


def _of_flight(flight: Flight, imu: FloatArray) -> Columns:
    """Return the measurements of a flight up to its landing; nothing if it is too short."""
    motion, t = flight.motion, flight.time
    end = float(t[-1])
    if flight.landing is not None:
        end = flight.time_of(flight.landing.stamp)
    if end < _IN_AIR:
        return {}
    good = (t >= 0.0) & (t <= end)
    columns: Columns = {'position': _thinned(t[good], motion.position[good])}
    if motion.has_attitude:
        good &= usable(motion.quaternion)
        columns['attitude'] = _thinned(t[good], motion.quaternion[good])
    if len(imu):
        stamps = imu[:, 0].astype(np.int64)
        since = flight.elapsed(stamps) / NANOSECONDS
        rows = (since >= 0.0) & (since <= end)
        if rows.any():
            columns['gyro'] = _thinned(since[rows], paper_from_map(imu[rows, 1:4]))
            columns['acceleration'] = _thinned(since[rows], paper_from_map(imu[rows, 4:7]))
    return columns


def _thinned(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return samples at most at the rate that is used, in order, each time once."""
    t, first = np.unique(t, return_index=True)
    values = values[first]
    if len(t) < 2:
        return t, values
    stride = max(round((len(t) - 1) / (t[-1] - t[0]) / _RATE), 1)
    return t[::stride], values[::stride]


def _imu(bag: Bag, name: str) -> FloatArray:
    """Return stamps [ns], angular velocities and specific forces of a topic, shape (n, 7)."""
    kind = topics.MessageType.IMU
    if not any(i.name == name and full_type(i.type) == kind for i in bag.topics):
        return np.empty((0, _COLUMNS))
    rows = [
        (
            m.value.header.stamp.sec * NANOSECONDS + m.value.header.stamp.nanosec,
            *_xyz(m.value.angular_velocity),
            *_xyz(m.value.linear_acceleration),
        )
        for m in bag.messages([name], {kind})
    ]
    return np.array(rows, dtype=float).reshape(-1, _COLUMNS)


def _xyz(vector: object) -> tuple[float, float, float]:
    return tuple(float(getattr(vector, axis)) for axis in 'xyz')  # type: ignore[return-value]
