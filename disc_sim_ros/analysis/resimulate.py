"""A recorded flight flown again from its configuration, commands and wind, and compared."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
import math
from typing import Any

import numpy as np

from disc_sim_ros import __version__, validation
from disc_sim_ros.analysis.odometry import COMPONENTS
from disc_sim_ros.analysis.recording import APPLIED, NANOSECONDS, Change, Flight
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError, DiscSimError, IntegrationError
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import DISC, DISC_AIR, DISC_BODY, State
from disc_sim_ros.physics.simulator import FlightSimulator

_AXES = {'disc': DISC, 'disc_body': DISC_BODY, 'disc_air': DISC_AIR}
_ROUNDED = 2  # ns by which a stamp may miss its step: stamps are rounded down
_LANDING = ('flight_time_s', 'landing_x_m', 'landing_y_m', 'range_m', 'spin_rad_s')


@dataclass(frozen=True, eq=False)
class Reflight:
    """A flight, flown again up to its last message.

    Attributes:
        setup: What flew, with the wind at release.
        release: The exact state at release.
        states: At each message, shape (n, 14); not a number where the flight was lost before.
        winds: At the disc, gusts included, earth axes 1 [m/s], shape (n, 3).
        landing: As the values of the event; empty without a landing.
        changes: What was applied on the way.
        off_grid: Messages whose stamps are not at a step.
        lost: Why the flight could not be flown to the end, or ''.
    """

    setup: Setup
    release: State
    states: FloatArray
    winds: FloatArray
    landing: Mapping[str, float]
    changes: tuple[Change, ...]
    off_grid: int
    lost: str


@dataclass(frozen=True)
class Verdict:
    """How a re-flight compares with what was recorded.

    Attributes:
        compared: Messages compared.
        identical: Those whose 13 numbers are the same to the last bit.
        largest: Largest difference of each of COMPONENTS and of what the landing told.
        first: Time of the first message that differs, since the release [s]; None if none does.
        doubts: Why the bag may not hold all that a re-flight needs.
    """

    compared: int
    identical: int
    largest: Mapping[str, float]
    first: float | None
    doubts: tuple[str, ...]

    @property
    def exact(self) -> bool:
        """Say whether nothing differs."""
        return self.identical == self.compared and not any(self.largest.values())


def setup_of(configuration: Mapping[str, Any]) -> Setup:
    """Return what a recorded configuration describes.

    Raises:
        ConfigError: It lacks something, or a value is not allowed.
    """
    told = dict(configuration)
    try:
        wind = dict(told['wind'])
        mean = frames.flip_yz((float(wind.pop('x')), float(wind.pop('y')), float(wind.pop('z'))))
        return Setup(
            disc=disc_file.disc_from_document(told['disc'], told['disc_file']),
            model=told['model'],
            aero=told['aero'],
            moment_axes=told['moment_axes'],
            air=Air(density=told['air_density'], gravity=told['gravity']),
            wind=Wind(mean=mean, **wind),
            step=1.0 / float(told['physics_rate']),
        )
    except _NOT_ONE as error:
        raise _refused(error) from None


_NOT_ONE = (KeyError, TypeError, ValueError, ZeroDivisionError, OverflowError)


def _refused(error: Exception) -> ConfigError:
    """Return the error of a configuration that cannot be flown, for what reading it raised."""
    if isinstance(error, ConfigError):
        return error
    return ConfigError('configuration', str(error), 'it is not one of sim_node')


def fly_again(flight: Flight) -> Reflight:
    """Fly a recorded flight again.

    Raises:
        DiscSimError: Its configuration was not recorded, or cannot be understood.
    """
    if flight.release is None or flight.release.configuration is None:
        raise DiscSimError('the bag has no configuration of this flight')
    told = flight.release.configuration
    setup = setup_of(told)
    try:
        rate = float(told['physics_rate'])
        validation.number('publish_rate', told['publish_rate'], above=0.0, unit='Hz')
        release = State(*(float(told['release'][name]) for name in State._fields))
        ground = bool(told['ground'])
    except _NOT_ONE as error:
        raise _refused(error) from None
    sim = FlightSimulator(setup, release, ground=ground)
    stamps = flight.motion.stamps
    steps = np.rint((stamps - flight.start) * rate / NANOSECONDS).astype(np.int64)
    off = np.abs(steps * NANOSECONDS / rate - (stamps - flight.start)) > _ROUNDED
    end = _landing_step(flight, rate, float(told['publish_rate']), int(steps[-1]))
    last = max(int(stamps[-1]), flight.start + math.floor(end * NANOSECONDS / rate))
    waiting = [
        (round((c.stamp - flight.start) * rate / NANOSECONDS), c, given_in)
        for c in flight.disc.changes
        if flight.start <= c.stamp < last and (given_in := _axes_of(c, flight)) is not None
    ]
    changes = tuple(c for _, c, _ in waiting)
    states, winds = np.full((len(steps), 14), np.nan), np.full((len(steps), 3), np.nan)
    lost = ''
    try:
        for row, step in enumerate([*steps.tolist(), end]):
            # A message tells of a step before what changes there.
            while waiting and waiting[0][0] < step:
                at, change, given_in = waiting.pop(0)
                _advance(sim, at)
                _apply(sim, change, given_in)
            _advance(sim, step)
            if row < len(steps):
                states[row], winds[row] = sim.state, sim.wind
    except IntegrationError as error:
        lost = str(error)
    return Reflight(setup, release, states, winds, _landing(sim), changes, int(off.sum()), lost)


def _landing_step(flight: Flight, rate: float, publish_rate: float, last: int) -> int:
    """Return the step of a landing that the message after the last would show, or the last one.

    The event comes when the disc lands, that message only when it is due: a bag may end between.
    """
    if flight.landing is None:
        return last
    try:
        landed = float(flight.landing.values['flight_time_s']) * rate
    except (KeyError, ValueError):
        return last
    return math.ceil(landed) if last < landed < last + rate / publish_rate else last


def compare(flight: Flight, again: Reflight, bag_doubts: tuple[str, ...] = ()) -> Verdict:
    """Return how a recorded flight and its re-flight differ.

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
    for name in _LANDING:
        told = flight.landing.values.get(name) if flight.landing else None
        if told is not None:
            largest[f'landed.{name}'] = _apart(told, again.landing.get(name, np.inf))
    differing = np.flatnonzero(~same)
    return Verdict(
        compared=len(recorded),
        identical=int(same.sum()),
        largest=largest,
        first=float(flight.time[differing[0]]) if len(differing) else None,
        doubts=(*bag_doubts, *_doubts(flight, again)),
    )


def _apart(told: str, flown: float) -> float:
    """Return the difference of a number that a message tells; infinite of what is no number."""
    try:
        return abs(float(told) - flown)
    except ValueError:
        return math.inf


def _doubts(flight: Flight, again: Reflight) -> list[str]:
    """Return why a re-flight may differ."""
    doubts = []
    told = flight.release.configuration if flight.release else None
    step = 1.0 / float(told['publish_rate']) if told else 0.0
    if flight.starts_late > 1.5 * step:
        doubts.append(
            f'the bag begins {flight.starts_late:.3f} s after the release: commands and changes '
            'of the wind before that are not in it'
        )
    missing = [name for name in APPLIED if name not in flight.disc.topics]
    if missing:
        doubts.append(f'not recorded: {", ".join(missing)}')
    first, last = flight.motion.log[0], flight.motion.log[-1]
    if any(first <= at <= last for at in flight.disc.profile_changes):
        doubts.append('the profile of the wind was changed in flight, which no stamp tells of')
    strange = {c.frame for c in flight.disc.changes if _axes_of(c, flight) is None}
    if strange:
        doubts.append(f'moments in {", ".join(map(repr, sorted(strange)))}: no frame of the disc')
    if again.off_grid:
        doubts.append(f'{again.off_grid} messages have stamps that are not at a step')
    if told and told.get('version') != __version__:
        doubts.append(f'version {told.get("version")} flew it, this is {__version__}')
    if again.lost:
        doubts.append(f'the re-flight ended: {again.lost}')
    return doubts


def _advance(sim: FlightSimulator, step: int) -> None:
    if step > sim.steps:
        sim.advance(step - sim.steps)


def _axes_of(change: Change, flight: Flight) -> int | None:
    """Return the axes that a change is given in; None for a frame that is not of the disc."""
    if change.topic != 'applied_moment' or not change.frame:
        return DISC_AIR
    prefix = flight.disc.motion.child.removesuffix('disc')
    return _AXES.get(change.frame.removeprefix(prefix))


def _apply(sim: FlightSimulator, change: Change, given_in: int) -> None:
    x, y, z = change.values
    if change.topic == 'applied_wind':
        sim.set_wind(replace(sim.setup.wind, mean=frames.flip_yz((x, y, z))))
    elif change.topic == 'applied_coefficients':
        sim.take(sim.control._replace(C_L=x, C_M=y, C_N=z))
    else:
        L, M, N = frames.flip_yz((x, y, z))  # noqa: N806 - the paper's
        sim.take(sim.control._replace(L=L, M=M, N=N, axes=given_in))


def _landing(sim: FlightSimulator) -> dict[str, float]:
    if not sim.landed:
        return {}
    x, y, _ = frames.flip_yz(sim.touch[:3])
    away = math.hypot(sim.touch.X - sim.release.X, sim.touch.Y - sim.release.Y)
    found = (sim.touch_time, x, y, away, sim.touch.r)
    return dict(zip(_LANDING, found, strict=True))
