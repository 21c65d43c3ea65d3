"""The message of `path`, whose points are serialised once each."""

from collections.abc import Sequence
import struct

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path

from disc_sim_ros.ros import messages
from disc_sim_ros.ros.cdr_template import CdrTemplate

_DOUBLES = 7
_STAMP = 8  # bytes of a time


class PathBytes:
    """The serialised nav_msgs/Path through the last points.

    To serialise a path of 2000 points anew for each point would take 7 ms.
    """

    def __init__(self, frame: str, most: int) -> None:
        """Begin without points.

        Args:
            frame: Name of the frame of path and points.
            most: Number of points from which on the oldest is removed.
        """
        path = Path(poses=[PoseStamped(), PoseStamped()])
        for message in (path, *path.poses):
            message.header.frame_id = frame
        floats = tuple(f'poses.{i}.{field}' for i in range(2) for field in messages.POSE_FIELDS)
        stamps = ('header.stamp', 'poses.0.header.stamp', 'poses.1.header.stamp')
        template = CdrTemplate(path, floats, stamps)
        own, first, second = template.stamp_offsets
        # Behind the floats of a point everything is aligned to 8 bytes, so that all points but
        # the first have one form.
        names = [
            template.template[stamp + _STAMP : template.float_offsets[i * _DOUBLES]]
            for i, stamp in enumerate((first, second))
        ]
        self._own, self._count = own, first - 4
        self._start = bytearray(template.template[:first])
        self._first, self._other = (struct.Struct(f'<iI{len(name)}s{_DOUBLES}d') for name in names)
        self._first_name, self._name = names
        self._most = most
        self._points = bytearray()  # in the form of all but the first

    def clear(self) -> None:
        """Remove all points."""
        self._points = bytearray()

    def extend(self, seconds: int, nanoseconds: int, pose: Sequence[float]) -> None:
        """Add a point, with its stamp, and remove the oldest if there are too many."""
        self._points += self._other.pack(seconds, nanoseconds, self._name, *pose)
        del self._points[: -self._most * self._other.size]

    def message(self) -> bytes:
        """Return the serialised message, stamped as its last point; there is at least one."""
        size, points = self._other.size, self._points
        seconds, nanoseconds, _, *pose = self._other.unpack_from(points)
        newest = struct.unpack_from('<iI', points, len(points) - size)
        struct.pack_into('<iI', self._start, self._own, *newest)
        struct.pack_into('<I', self._start, self._count, len(points) // size)
        first = self._first.pack(seconds, nanoseconds, self._first_name, *pose)
        return b''.join((self._start, first, memoryview(points)[size:]))
