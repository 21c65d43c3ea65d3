"""The analysis of one recorded flight: its trajectory, launch, landing, wind and verification."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
import math
from pathlib import Path
import re

import numpy as np

from disc_sim_ros import topics
from disc_sim_ros.analysis import flights, recording
from disc_sim_ros.analysis.checks import (
    Check,
    Stamps,
    checks,
    ground_crossing,
    stamps_of,
    with_twist,
)
from disc_sim_ros.analysis.recording import Flight
from disc_sim_ros.analysis.resimulate import Reflight, Verdict, compare, fly_again
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.bags.reader import Bag, open_bag
from disc_sim_ros.errors import DiscSimError, printable
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.flight_config import Key, landing_from
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.trajectory import Trajectory
from disc_sim_ros.topics import Loss
from disc_sim_ros.units import NANOSECONDS

# Those of recorder_node, and words that other recorders may use.
_LOSSES = re.compile('|'.join([*Loss, 'drop', 'loss', 'gap', 'missed']), re.IGNORECASE)


_SAME = 1e-3  # periods; stamps are rounded down to nanoseconds
_ATTITUDE_AND_RATES = slice(State._fields.index('e0'), State._fields.index('r') + 1)


class WindSource(StrEnum):
    """Where the wind in a recorded trajectory is from."""

    GUSTS = 'with gusts'  # of an exact re-flight
    MEAN = 'mean wind, without gusts'  # as recorded
    UNKNOWN = 'wind unknown, taken as 0'


@dataclass(frozen=True)
class Touchdown:
    """A landing: time since the release [s], place in `map` [m], and spin [rad/s] if known."""

    time: float
    x: float
    y: float
    spin: float | None
    z: float = 0.0  # of the centre, on a rim that touches the ground


@dataclass(frozen=True, eq=False)
class Analysis:
    """What is known of one recorded flight.

    Attributes:
        flight: What was recorded.
        again: Its re-flight; None if it cannot be flown again.
        verdict: The difference of the two.
        why_not: Why there is no re-flight, or ''.
        trajectory: The recorded motion up to the landing.
        wind: Where the wind in it is from.
        release: The exact state at release if it was recorded, else that of the first message.
        landing: The landing; None if there was none.
        stamps: How its messages follow each other.
        checks: Checks that need no model of the body.
    """

    flight: Flight
    again: Reflight | None
    verdict: Verdict | None
    why_not: str
    trajectory: Trajectory
    wind: WindSource
    release: State
    landing: Touchdown | None
    stamps: Stamps
    checks: tuple[Check, ...]

    @property
    def wind_is_known(self) -> bool:
        """Return True if the trajectory has the wind of the flight, gusts or mean."""
        return self.wind is not WindSource.UNKNOWN

    @property
    def passed(self) -> bool:
        """Return True if something can be verified, and all of it is as it should be."""
        if not self.flight.motion.is_stamped:
            return False
        if self.verdict is not None:
            return self.verdict.exact
        return all(check.passed for check in self.checks)


def analyse_bag(path: Path | str, topic: str | None = None) -> list[Analysis]:
    """Analyse every flight in a bag, disc by disc.

    Args:
        path: Folder of the bag, or one .mcap file.
        topic: The topic with the motion; None for every nav_msgs/Odometry.

    Raises:
        BagError: The bag cannot be read, or has no such topic.
    """
    bag = open_bag(path)
    doubts = doubts_of(bag)
    return [
        analyse(flight, doubts)
        for disc in recording.discs(bag, topic)
        for flight in flights.flights(disc)
    ]


def analyse(flight: Flight, bag_doubts: tuple[str, ...] = ()) -> Analysis:
    """Analyse a recorded flight.

    Args:
        flight: What was recorded.
        bag_doubts: What the bag as a whole may lack.
    """
    again, verdict, why_not = None, None, ''
    try:
        again = fly_again(flight)
        verdict = compare(flight, again, bag_doubts)
    except DiscSimError as error:
        why_not = str(error)
    exact = again if verdict is not None and verdict.exact else None
    states = frames.states_from_odometry(with_twist(flight.motion).numbers)
    if not flight.motion.has_attitude:
        states[:, _ATTITUDE_AND_RATES] = math.nan
    if exact is not None:
        winds = exact.winds
        wind = WindSource.GUSTS if exact.config.setup.wind.turbulence else WindSource.MEAN
    else:
        winds, wind = _mean_wind(flight, again)
    landing = _landing(flight, exact)
    flown = flight.time < (math.inf if landing is None else landing.time)
    flown[0] = True
    rows = np.column_stack([flight.time, states, winds])[flown]
    diameter = math.nan if again is None else again.config.setup.disc.diameter
    return Analysis(
        flight=flight,
        again=again,
        verdict=verdict,
        why_not=why_not,
        trajectory=Trajectory(rows, diameter),
        wind=wind,
        release=State(*states[0].tolist()) if again is None else again.config.release,
        landing=landing,
        stamps=_stamps(flight, again),
        checks=tuple(checks(flight.evened)),
    )


def _stamps(flight: Flight, again: Reflight | None) -> Stamps:
    """Return how the messages follow each other, from the release on and up to the end."""
    if again is None:
        return stamps_of(flight.evened)
    rate = again.config.publish_rate
    after = 0
    if flight.until is not None:
        last = int(flight.motion.stamps[-1])
        jumped = sum(shift for at, shift in flight.disc.jumps if last < at <= flight.until)
        periods = (flight.until - last - jumped) * rate / NANOSECONDS
        after = max(math.ceil(periods - _SAME) - 1, 0)
    before = max(round(flight.starts_late * rate), 0)
    return replace(stamps_of(flight.evened, rate), before=before, after=after)


def _mean_wind(flight: Flight, again: Reflight | None) -> tuple[FloatArray, WindSource]:
    """Return the mean wind at each message, earth axes 1 [m/s], and where it is from."""
    changes = [c for c in flight.disc.changes if c.topic == topics.APPLIED_WIND]
    stamps = flight.motion.stamps
    winds = np.zeros((len(stamps), 3))
    if again is not None:
        winds[:] = again.config.setup.wind.mean
    for change in changes:
        winds[stamps >= change.stamp] = frames.flip_yz(change.values)
    known = changes or again is not None
    return winds, WindSource.MEAN if known else WindSource.UNKNOWN


def _landing(flight: Flight, exact: Reflight | None) -> Touchdown | None:
    """Return the landing: as recorded, else of an exact re-flight, else where z = 0 is crossed."""
    landing = None if flight.landing is None else landing_from(flight.landing.values)
    if landing is None and exact is not None and exact.landing is not None:
        landing = exact.landing if exact.landing.flight_time_s <= flight.time[-1] else None
    if landing is not None:
        return Touchdown(
            landing.flight_time_s,
            landing.landing_x_m,
            landing.landing_y_m,
            landing.spin_rad_s,
            _height_at_rest(flight),
        )
    configuration = flight.configuration
    has_ground = configuration is None or configuration.get(Key.GROUND)
    crossing = ground_crossing(flight.evened) if has_ground else None
    if crossing is None:
        return None
    time, place = crossing
    time += flight.starts_late
    spin = None
    if flight.motion.has_twist:
        before = max(int(np.searchsorted(flight.time, time)) - 1, 0)
        spin = frames.flip(float(flight.motion.numbers[before, 12]))
    return Touchdown(time, float(place[0]), float(place[1]), spin)


def _height_at_rest(flight: Flight) -> float:
    """Return z of the centre after a landing on the rim [m]; 0 for one on the centre."""
    configuration = flight.configuration or {}
    of_disc = configuration.get(Key.DISC_FILE)
    contact = configuration.get(Key.GROUND_CONTACT)
    if contact is None and isinstance(of_disc, dict):
        contact = of_disc.get('ground')
    return float(flight.motion.position[-1, 2]) if contact == 'rim' else 0.0


def doubts_of(bag: Bag) -> tuple[str, ...]:
    """Return the reasons why messages may be missing from a bag."""
    doubts = [printable(f'{key}: {value}') for key, value in losses(bag.custom_data)]
    if not bag.complete:
        doubts.append('the bag was not closed or is damaged')
    return tuple(doubts)


def losses(custom_data: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return what a recorder noted of losses in the `custom_data` of a bag."""
    return [
        (key, value)
        for key, value in custom_data.items()
        if _LOSSES.search(key) and value.strip() not in {'', '0', '{}', '[]'}
    ]
