"""A recorded flight flown again from its configuration, commands and wind, and compared."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
import math

import numpy as np

from disc_sim_ros import __version__, topics
from disc_sim_ros.analysis.odometry import COMPONENTS
from disc_sim_ros.analysis.recording import Change, Flight
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import DiscSimError, IntegrationError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.flight_config import (
    FlightConfig,
    Landing,
    from_document,
    landing_from,
    landing_of,
)
from disc_sim_ros.physics.kernels.equations import DISC_AIR
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.topics import Frames
from disc_sim_ros.units import NANOSECONDS

_LANDED = 'landed.'  # begins the names of the differences of a landing
_LONGEST_UNSEEN = 600.0  # s of a flight without messages up to its landing
_ROUNDED = 2  # ns by which a stamp may miss its step: stamps are rounded down


@dataclass(frozen=True, eq=False)
class Reflight:
    """A flight, flown again up to its last message.

    Attributes:
        config: What flew.
        states: At each message, shape (n, 14); not a number where the flight was lost before.
        winds: At the disc, gusts included, earth axes 1 [m/s], shape (n, 3).
        landing: The landing; None if the disc is in the air at the end.
        changes: What was applied on the way.
        off_grid: Messages whose stamps are not at a step.
        lost: Why the flight could not be flown to the end, or ''.
    """

    config: FlightConfig
    states: FloatArray
    winds: FloatArray
    landing: Landing | None
    changes: tuple[Change, ...]
    off_grid: int
    lost: str


@dataclass(frozen=True)
class Verdict:
    """The difference of a re-flight and the recording.

    Attributes:
        compared: Messages compared.
        identical: Those whose 13 numbers are the same to the last bit.
        largest: Largest difference of each of COMPONENTS and of each number of the landing.
        first: Time of the first message that differs, since the release [s]; None if none does.
        doubts: Reasons why the bag may not hold all that a re-flight needs.
    """

    compared: int
    identical: int
    largest: Mapping[str, float]
    first: float | None
    doubts: tuple[str, ...]

    @property
    def whole_landing(self) -> bool:
        """Return True if every number of the landing was compared."""
        return all(f'{_LANDED}{name}' in self.largest for name in Landing._fields)

    @property
    def exact(self) -> bool:
        """Return True if nothing differs."""
        return self.identical == self.compared and not any(self.largest.values())


def fly_again(flight: Flight) -> Reflight:
    """Fly a recorded flight again.

    Raises:
        DiscSimError: Its configuration was not recorded, or cannot be flown.
    """
    if flight.configuration is None:
        raise DiscSimError('the bag has no configuration of this flight')
    config = from_document(flight.configuration)
    sim = FlightSimulator(config.setup, config.release, ground=config.ground)
    stamps, rate = flight.motion.stamps, config.physics_rate
    elapsed = flight.elapsed(stamps)
    steps = np.rint(elapsed * rate / NANOSECONDS).astype(np.int64)
    off = np.abs(steps * NANOSECONDS / rate - elapsed) > _ROUNDED
    end = _last_step(flight, config, int(steps[-1]))
    last = max(int(elapsed[-1]), math.floor(end * NANOSECONDS / rate))
    begins = flight.elapsed(np.array([c.stamp for c in flight.disc.changes], dtype=np.int64))
    waiting = [
        (round(at * rate / NANOSECONDS), c, axes)
        for c, at in zip(flight.disc.changes, begins.tolist(), strict=True)
        if flight.start <= c.stamp and at < last and (axes := _axes_of(c, flight)) is not None
    ]
    changes = tuple(c for _, c, _ in waiting)
    states, winds = np.full((len(steps), 14), np.nan), np.full((len(steps), 3), np.nan)
    lost = ''
    try:
        for row, step in enumerate([*steps.tolist(), end]):
            # A message has the state of a step before the changes at that step.
            while waiting and waiting[0][0] < step:
                at, change, axes = waiting.pop(0)
                _advance(sim, at)
                _apply(sim, change, axes)
            _advance(sim, step)
            if row < len(steps):
                states[row], winds[row] = sim.state, sim.wind
    except IntegrationError as error:
        lost = str(error)
    landing = landing_of(sim) if sim.landed else None
    return Reflight(config, states, winds, landing, changes, int(off.sum()), lost)


def _last_step(flight: Flight, config: FlightConfig, last: int) -> int:
    """Return the step of the landing if the bag has its event, or the step `last`.

    The event is published when the disc lands, the message when it is due: a bag may end between,
    and messages may be missing before.
    """
    landing = None if flight.landing is None else landing_from(flight.landing.values)
    if landing is None:
        return last
    landed = landing.flight_time_s * config.physics_rate
    longest = _LONGEST_UNSEEN * config.physics_rate
    return math.ceil(landed) if last < landed < last + longest else last


def compare(flight: Flight, again: Reflight, bag_doubts: tuple[str, ...] = ()) -> Verdict:
    """Return the difference of a recorded flight and its re-flight.

    Args:
        flight: What was recorded.
        again: Its re-flight.
        bag_doubts: What the bag as a whole may lack.
    """
    recorded, flown = flight.motion.numbers, frames.odometry_array(again.states)
    if recorded.shape[1] == 7:
        flown = flown[:, :7]
    apart = np.abs(recorded - flown)
    apart = np.where(np.isnan(apart) & ~(np.isnan(recorded) & np.isnan(flown)), np.inf, apart)
    same = (recorded.view(np.int64) == np.ascontiguousarray(flown).view(np.int64)).all(axis=1)
    largest = dict(zip(COMPONENTS, apart.max(axis=0).tolist(), strict=False))
    largest |= _landing_differences(flight, again)
    differing = np.flatnonzero(~same)
    return Verdict(
        compared=len(recorded),
        identical=int(same.sum()),
        largest=largest,
        first=float(flight.time[differing[0]]) if len(differing) else None,
        doubts=(*bag_doubts, *_doubts(flight, again)),
    )


def _landing_differences(flight: Flight, again: Reflight) -> dict[str, float]:
    """Return the differences of the numbers of a recorded landing; infinite without a number."""
    recorded = flight.landing.values if flight.landing else {}
    return {
        f'{_LANDED}{name}': _difference(
            recorded[name], math.inf if again.landing is None else again.landing[i]
        )
        for i, name in enumerate(Landing._fields)
        if name in recorded
    }


def _difference(text: str, number: float) -> float:
    """Return the difference of a number in a text; infinite if the text is not a number."""
    try:
        return abs(float(text) - number)
    except ValueError:
        return math.inf


def _doubts(flight: Flight, again: Reflight) -> list[str]:
    """Return reasons why a re-flight may differ."""
    doubts = []
    if flight.starts_late > 1.5 / again.config.publish_rate:
        doubts.append(
            f'its first message is {flight.starts_late:.3f} s after the release: commands and '
            'changes of the wind before that may be missing too'
        )
    missing = [name for name in topics.APPLIED if name not in flight.disc.topics]
    if missing:
        doubts.append(f'not recorded: {", ".join(missing)}')
    first, last = flight.motion.log[0], flight.motion.log[-1]
    if any(first <= at <= last for at in flight.disc.profile_changes):
        doubts.append('the profile of the wind was changed in flight, and no stamp records when')
    if topics.FLIGHT_EVENTS not in flight.disc.topics:
        reports = 'landings, resets and jumps of time'
        doubts.append(f'not recorded: {topics.FLIGHT_EVENTS}, which reports {reports}')
    else:
        doubts += _missing_events(flight, again)
    unknown = {c.frame for c in flight.disc.changes if _axes_of(c, flight) is None}
    if unknown:
        doubts.append(f'moments in {", ".join(map(repr, sorted(unknown)))}: no frame of the disc')
    if back := int((np.diff(flight.motion.stamps) < 0).sum()):
        doubts.append(f'stamps go back {back} times: the log times are out of order')
    if again.off_grid:
        doubts.append(f'{again.off_grid} messages have stamps that are not at a step')
    if again.config.version != __version__:
        doubts.append(f'version {again.config.version} flew it, this is {__version__}')
    if again.lost:
        doubts.append(f'the re-flight ended: {again.lost}')
    return doubts


def _missing_events(flight: Flight, again: Reflight) -> Iterator[str]:
    """Yield which events are not in a bag that has the topic of events."""
    thrown = (e.stamp for e in flight.disc.events if e.name == topics.FlightEvent.THROWN)
    if flight.start not in thrown:
        yield 'the event of the throw is missing, and so may be others, such as a reset'
    if again.landing is None or flight.time[-1] <= again.landing.flight_time_s:
        return
    if flight.landing is None:
        yield 'the event of the landing is missing'
    elif lacks := [name for name in Landing._fields if name not in flight.landing.values]:
        yield f'the event of the landing has no {", ".join(lacks)}'


def _advance(sim: FlightSimulator, step: int) -> None:
    if step > sim.steps:
        sim.advance(step - sim.steps)


def _axes_of(change: Change, flight: Flight) -> int | None:
    """Return the axes of a change; None for a moment in a frame that is not of the disc."""
    if change.topic != topics.APPLIED_MOMENT or not change.frame:
        return DISC_AIR
    return frames.moment_axes(Frames.of_disc(flight.disc.motion.child)).get(change.frame)


def _apply(sim: FlightSimulator, change: Change, axes: int) -> None:
    x, y, z = change.values
    if change.topic == topics.APPLIED_WIND:
        sim.set_wind(replace(sim.setup.wind, mean=frames.flip_yz((x, y, z))))
    elif change.topic == topics.APPLIED_COEFFICIENTS:
        sim.take(sim.control._replace(C_L=x, C_M=y, C_N=z))
    else:
        L, M, N = frames.flip_yz((x, y, z))  # noqa: N806 - the paper's
        sim.take(sim.control._replace(L=L, M=M, N=N, axes=axes))
