"""The flight events: what each is called, its text for people and its values."""

from dataclasses import dataclass, field
import math

from disc_sim_ros.errors import IntegrationError
from disc_sim_ros.physics.flight_config import EventKey, exact_seconds, landing_of
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.topics import FlightEvent
from disc_sim_ros.units import NANOSECONDS


@dataclass(frozen=True, slots=True)
class Event:
    """One flight event.

    Attributes:
        name: Its name, behind that of the node.
        text: What happened, for people.
        values: Values by `EventKey`; a stamp only if it is not that of the present step.
        is_error: Whether the flight could not go on.
    """

    name: str
    text: str
    values: dict[str, object] = field(default_factory=dict)
    is_error: bool = False


@dataclass
class Counts:
    """Numbers of events so far, for /diagnostics."""

    throws: int = 0
    landings: int = 0
    failures: int = 0
    expired: int = 0
    jumps: int = 0
    jumped: int = 0  # ns


RESET = Event(FlightEvent.RESET, 'the disc is back at its launch, at rest')
COMMAND_EXPIRED = Event(FlightEvent.COMMAND_EXPIRED, 'a command was not renewed and fell to zero')


def thrown(state: State, flight: int, source: str, *, replaced: int = 0) -> Event:
    """Return the event of a release.

    Args:
        state: State at the release.
        flight: Number of the flight.
        source: What asked for the throw: 'launch' for the parameters, or the topic or service.
        replaced: Number of the flight that this throw ended in the air; 0 if there was none.
    """
    speed = math.hypot(*state[3:6])
    values: dict[str, object] = {
        EventKey.FLIGHT: flight,
        EventKey.SOURCE: source,
        EventKey.SPEED: speed,
        EventKey.SPIN: state.r,
    }
    text = f'{speed:.2f} m/s, spin {state.r:.2f} rad/s'
    if replaced:
        values[EventKey.REPLACED] = replaced
        text += f'; {replacement(replaced)}'
    return Event(FlightEvent.THROWN, text, values)


def replacement(flight: int) -> str:
    """Return a sentence about the flight that a throw ended in the air."""
    return f'flight {flight} ended in the air'


def landed(sim: FlightSimulator, flight: int, released: int) -> Event:
    """Return the event of a landing, stamped with the moment of touching the ground.

    Args:
        sim: A simulator whose disc has landed.
        flight: Number of the flight.
        released: Stamp of its release, later by the jumps of time since [ns].
    """
    landing = landing_of(sim)
    values = {
        EventKey.STAMP: exact_seconds(released + round(landing.flight_time_s * NANOSECONDS)),
        EventKey.FLIGHT: flight,
        **landing._asdict(),
    }
    text = f'{landing.range_m:.2f} m in {landing.flight_time_s:.3f} s'
    return Event(FlightEvent.LANDED, text, values)


def time_jumped(shift: int, cause: str) -> Event:
    """Return the event of a jump of simulated time to the wall clock.

    Args:
        shift: How far time jumped [ns].
        cause: Why it was behind: 'pause', 'slip' or 'change of real_time_factor'.
    """
    text = f'{shift / NANOSECONDS:.3f} s forward to the wall clock after a {cause}'
    values: dict[str, object] = {EventKey.JUMP: exact_seconds(shift), EventKey.CAUSE: cause}
    return Event(FlightEvent.TIME_JUMPED, text, values)


def failed(error: IntegrationError) -> Event:
    """Return the event of a flight that moves faster than its step can follow."""
    return Event(FlightEvent.FAILED, str(error), is_error=True)
