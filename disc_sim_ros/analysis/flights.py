"""Where flights begin and end in a recorded motion."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.analysis.odometry import Motion
from disc_sim_ros.analysis.recording import (
    END_OF_BAG,
    THROWN_AGAIN,
    Began,
    Disc,
    Event,
    Flight,
    Release,
)
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.topics import FlightEvent
from disc_sim_ros.units import NANOSECONDS

GAP = 0.5  # s without a message, or ten times the usual distance of messages where that is more
JUMP = 1.0  # m between two messages beyond what the velocity explains
MOVING = 0.5  # m/s; slower is at rest
SHORTEST = 0.1  # s
ENDING = (FlightEvent.RESET, FlightEvent.FAILED)  # events that end a flight in the air


def flights(disc: Disc) -> list[Flight]:
    """Return the flights of a disc.

    They begin with the throws that sim_node reports. In a bag without throws, a flight is a time
    in which the body moves, without a gap in time or a jump in place.
    """
    if disc.releases:
        return [flight for _, flight in _thrown(disc) if flight is not None]
    return list(_moving(disc))


def unseen_throws(disc: Disc) -> list[Release]:
    """Return the throws of which the bag holds no message of the motion."""
    return [release for release, flight in _thrown(disc) if flight is None]


def _thrown(disc: Disc) -> Iterator[tuple[Release, Flight | None]]:
    """Yield each throw with its flight, None where the bag has no message of its motion."""
    stamps = disc.motion.stamps
    ends: list[int | None] = [release.stamp for release in disc.releases[1:]]
    number = 0
    for release, following in zip(disc.releases, [*ends, None], strict=False):
        end, ended = following, THROWN_AGAIN if following else END_OF_BAG
        ending = _first(disc, ENDING, release.stamp, following)
        if ending is not None:
            end, ended = ending.stamp, ending.name
        landing = _first(disc, (FlightEvent.LANDED,), release.stamp, end)
        # If time stood still, the release has the stamp of a message of the disc at rest.
        first = max(int(np.searchsorted(stamps, release.stamp, 'right')) - 1, 0)
        twist = disc.motion.numbers[first, 7:]
        if stamps[first] < release.stamp or (len(twist) and not twist.any()):
            first += 1
        last = len(stamps) if end is None else int(np.searchsorted(stamps, end, 'left'))
        if last <= first and end == release.stamp:
            continue  # while time stood still, or the same throw, recorded twice
        number += 1
        if last <= first:
            yield release, None
            continue
        yield (
            release,
            Flight(
                disc,
                number,
                release.stamp,
                slice(first, last),
                release,
                landing,
                ended=FlightEvent.LANDED if landing else ended,
                until=landing.stamp if landing else end,
            ),
        )


def _first(disc: Disc, names: tuple[str, ...], start: int, end: int | None) -> Event | None:
    """Return the first event of these names from a throw on, before the next throw.

    Args:
        disc: The disc.
        names: Names of events.
        start: Stamp of the throw [ns]; where time stood still, an event of the same stamp that
            came before is of the flight before.
        end: Stamp of the next throw or end [ns], or None.
    """
    first, last = _throw_at(disc, start), _throw_at(disc, end)
    for i, event in enumerate(disc.events):
        if event.name not in names or event.stamp < start or i < first:
            continue
        if end is None or event.stamp < end or (event.stamp == end and i < last):
            return event
    return None


def _throw_at(disc: Disc, stamp: int | None) -> int:
    """Return the place of the last throw with a stamp [ns] among the events, or -1."""
    places = [
        i
        for i, event in enumerate(disc.events)
        if event.name == FlightEvent.THROWN and event.stamp == stamp
    ]
    return places[-1] if places else -1


def _moving(disc: Disc) -> Iterator[Flight]:
    motion = disc.motion
    number = 0
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(motion.numbers).all(axis=1))
    for begin, end, why in _pieces(motion):
        speed = speeds(motion.part(slice(begin, end)))
        for first, last in _runs((speed > MOVING) & finite[begin:end]):
            a, b = begin + first, begin + last
            b += b < end and finite[b]  # the first message at rest shows where
            if motion.stamps[b - 1] - motion.stamps[a] < SHORTEST * NANOSECONDS:
                continue
            number += 1
            began = Began.MOVED if first else Began.IN_FLIGHT
            ended = why if begin + last == end else 'rest'
            start, rows = int(motion.stamps[a]), slice(a, b)
            yield Flight(disc, number, start, rows, began=began, ended=ended)


def _pieces(motion: Motion) -> Iterator[tuple[int, int, str]]:
    """Yield the parts of a motion between gaps and jumps: begin, end, and what ended it."""
    if len(motion) < 2:
        return
    steps = np.diff(motion.stamps)
    usual = float(np.median(steps))
    gap = (steps > max(GAP * NANOSECONDS, 10.0 * usual)) | (steps <= 0)
    speed = speeds(motion)
    moved = np.linalg.norm(np.diff(motion.position, axis=0), axis=1)
    explained = np.maximum(speed[1:], speed[:-1]) * steps / NANOSECONDS if motion.has_twist else 0
    jump = moved - explained > JUMP
    if not motion.has_twist:  # faster than a disc can fly
        jump &= moved > 200.0 * steps / NANOSECONDS
    breaks = np.flatnonzero(gap | jump) + 1
    for begin, end in pairwise([0, *breaks.tolist(), len(motion)]):
        why = END_OF_BAG
        if end < len(motion):
            why = 'gap' if gap[end - 1] else 'jump'
        if end - begin > 1:
            yield begin, end, why


def _runs(flags: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield begin and end of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def speeds(motion: Motion) -> FloatArray:
    """Return the speed at each message [m/s], from the twist or the differences of position."""
    if motion.has_twist:
        speed: FloatArray = np.linalg.norm(motion.numbers[:, 7:10], axis=1)
        return speed
    differences: FloatArray = np.linalg.norm(velocities(motion), axis=1)
    return differences


def velocities(motion: Motion) -> FloatArray:
    """Return the velocity in `frame` by differences of the position [m/s], shape (n, 3).

    A message with the stamp of the one before counts as one nanosecond later.
    """
    if len(motion) < 2:
        return np.zeros((len(motion), 3))
    t = (motion.stamps - motion.stamps[0]).astype(float)
    t = np.maximum.accumulate(t + np.arange(len(t)) * 1e-3) / NANOSECONDS
    slope: FloatArray = (
        np.gradient(motion.position, t, axis=0, edge_order=2)
        if len(motion) > 2
        else np.gradient(motion.position, t, axis=0)
    )
    return slope
