"""The markers: the disc in its true size, and the field with an enlarged disc."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
import math

from geometry_msgs.msg import Point
from rclpy.serialization import serialize_message
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from disc_sim_ros.topics import Frames

SECTORS = 24
RIM_HEIGHT = 0.12  # of the diameter
ENLARGEMENT = 6.0  # of the disc over the field, where its true size would be a dot
FIELD_SPACING = 10.0  # between the lines of the field [m]
FIELD_AHEAD = 120.0  # how far the lines reach along +x [m]
FIELD_BEHIND = 20.0  # along -x [m]
FIELD_ASIDE = 40.0  # along +y and -y [m]
_TEXT_HEIGHT = 0.6  # [m]
_TEXT_ASIDE = -3.0  # of the distances along y, out of the way of the disc [m]
_RESULT_HEIGHT = 3.0  # of its text above the landing [m]
_LINE_WIDTH = 0.06  # [m]
_BLUE = ColorRGBA(r=0.0, g=0.447, b=0.698, a=1.0)
_WHITE = ColorRGBA(r=0.95, g=0.95, b=0.95, a=1.0)
_ORANGE = ColorRGBA(r=0.835, g=0.369, b=0.0, a=1.0)
_GREY = ColorRGBA(r=0.62, g=0.66, b=0.64, a=1.0)


_CACHED = 8  # releases; serialising takes a millisecond, too long for the step of a throw


@lru_cache(_CACHED)
def disc_bytes(frame: str, diameter: float) -> bytes:
    """Return `disc_markers`, serialised."""
    return bytes(serialize_message(disc_markers(frame, diameter)))


@lru_cache(_CACHED)
def field_bytes(frames: Frames, diameter: float, release: tuple[float, float, float]) -> bytes:
    """Return the `field_markers` of a flight that has not landed, serialised."""
    return bytes(serialize_message(field_markers(frames, diameter, release)))


def disc_markers(frame: str, diameter: float) -> MarkerArray:
    """Return the disc in its true size, see `_disc`.

    Args:
        frame: The frame that spins with the disc.
        diameter: Diameter of the disc [m].
    """
    return MarkerArray(markers=[_disc(frame, diameter, 'disc')])


def field_markers(
    frames: Frames,
    diameter: float,
    release: Sequence[float],
    landing: Sequence[float] | None = None,
    result: str = '',
) -> MarkerArray:
    """Return the markers that show a flight from afar: lines with distances and a larger disc.

    Namespaces: 'disc_enlarged' in `disc_body`; 'lines', 'distances', 'release' and, once landed,
    'landing' and 'result' in `map`. Without a landing those of the last flight are deleted.

    Args:
        frames: Names of the frames.
        diameter: Diameter of the disc [m].
        release: Position of the release, x, y, z in `map` [m].
        landing: Position of the landing, x, y, z in `map` [m]; None before it.
        result: Text above the landing.
    """
    markers = [*_constant_markers(frames, diameter), _spot(frames.map, release, 'release', _BLUE)]
    if landing is None:
        markers += [Marker(action=Marker.DELETE, ns=name) for name in ('landing', 'result')]
    else:
        markers.append(_spot(frames.map, landing, 'landing', _ORANGE))
        markers.append(_text(frames.map, landing, result, 'result', _RESULT_HEIGHT))
    return MarkerArray(markers=markers)


@lru_cache(_CACHED)
def _constant_markers(frames: Frames, diameter: float) -> tuple[Marker, ...]:
    """Return the markers that are the same in all flights of a disc."""
    disc = _disc(frames.disc_body, ENLARGEMENT * diameter, 'disc_enlarged')
    return disc, _lines(frames.map), *_distances(frames.map)


def _disc(frame: str, diameter: float, namespace: str) -> Marker:
    """Return a disc as coloured sectors with a rim, so that its spin is visible."""
    r, h = 0.5 * diameter, 0.5 * RIM_HEIGHT * diameter
    marker = _marker(frame, Marker.TRIANGLE_LIST, namespace)
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    marker.color.a = 1.0
    for i in range(SECTORS):
        a, b = (2 * math.pi * j / SECTORS for j in (i, i + 1))
        colour = _ORANGE if i == 0 else (_BLUE, _WHITE)[i * 4 // SECTORS % 2]
        top = [Point(x=0.0, y=0.0, z=h)]
        top += [Point(x=r * math.cos(t), y=r * math.sin(t), z=h) for t in (a, b)]
        low = [Point(x=p.x, y=p.y, z=-h) for p in top[1:]]
        under = [top[0], top[2], top[1]]  # visible from below, where the disc is hollow
        rim = [low[0], low[1], top[2], low[0], top[2], top[1]]
        for triangle in (top, under, rim):
            marker.points += triangle
            marker.colors += [colour] * len(triangle)
    return marker


def _lines(frame: str) -> Marker:
    """Return lines on the ground, FIELD_SPACING apart, those through the origin brighter."""
    marker = _marker(frame, Marker.LINE_LIST, 'lines')
    marker.scale.x = _LINE_WIDTH
    marker.color.a = 1.0
    for x in _steps(-FIELD_BEHIND, FIELD_AHEAD):
        marker.points += [Point(x=x, y=y) for y in (-FIELD_ASIDE, FIELD_ASIDE)]
        marker.colors += 2 * [_WHITE if x == 0.0 else _GREY]
    for y in _steps(-FIELD_ASIDE, FIELD_ASIDE):
        marker.points += [Point(x=x, y=y) for x in (-FIELD_BEHIND, FIELD_AHEAD)]
        marker.colors += 2 * [_WHITE if y == 0.0 else _GREY]
    return marker


def _distances(frame: str) -> Iterator[Marker]:
    """Yield the distance along x at each line across the field."""
    for number, x in enumerate(_steps(0.0, FIELD_AHEAD)):
        marker = _text(frame, (x, _TEXT_ASIDE), f'{x:.0f} m', 'distances', 0.5 * _TEXT_HEIGHT)
        marker.id = number
        yield marker


def _text(frame: str, at: Sequence[float], text: str, namespace: str, above: float) -> Marker:
    """Return a text that faces the viewer, at a height `above` [m] a place on the ground [m]."""
    marker = _marker(frame, Marker.TEXT_VIEW_FACING, namespace)
    marker.text = text
    marker.pose.position.x, marker.pose.position.y = float(at[0]), float(at[1])
    marker.pose.position.z = above
    marker.scale.z = _TEXT_HEIGHT
    marker.color = _WHITE
    return marker


def _spot(frame: str, at: Sequence[float], namespace: str, colour: ColorRGBA) -> Marker:
    """Return a flat round spot on the ground below a position."""
    marker = _marker(frame, Marker.CYLINDER, namespace)
    marker.pose.position.x, marker.pose.position.y = float(at[0]), float(at[1])
    marker.scale.x = marker.scale.y = 0.8
    marker.scale.z = 0.02
    marker.color = colour
    return marker


def _marker(frame: str, shape: int, namespace: str) -> Marker:
    """Return a marker that moves with its frame."""
    marker = Marker(type=shape, action=Marker.ADD, ns=namespace, frame_locked=True)
    marker.header.frame_id = frame
    marker.pose.orientation.w = 1.0
    return marker


def _steps(first: float, last: float) -> list[float]:
    """Return the multiples of FIELD_SPACING from a first to a last one [m]."""
    low, high = (round(end / FIELD_SPACING) for end in (first, last))
    return [FIELD_SPACING * k for k in range(low, high + 1)]
