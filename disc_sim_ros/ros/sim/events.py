"""The flight events: what each is called, its text for people and its values."""

from dataclasses import dataclass, field
import math

from disc_sim_ros.errors import IntegrationError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros.sim.clock import NANOSECONDS


@dataclass(frozen=True, slots=True)
class Event:
    """One flight event.

    Attributes:
        name: Its name, behind that of the node.
        text: What happened, for people.
        values: Values by key; `stamp_s` only where it is not the stamp of the present step.
        is_error: Whether the flight could not go on.
    """

    name: str
    text: str
    values: dict[str, object] = field(default_factory=dict)
    is_error: bool = False


RESET = Event('reset', 'the disc is back at its launch, at rest')
COMMAND_EXPIRED = Event('command expired', 'a command was not renewed and fell to zero')


def thrown(state: State, flight: int, source: str) -> Event:
    """Return the event of a release.

    Args:
        state: State at the release.
        flight: Number of the flight.
        source: What asked for the throw: 'launch' for the parameters, or the topic.
    """
    speed = math.hypot(*state[3:6])
    values = {
        'flight': flight,
        'from': source,
        'speed_m_s': speed,
        'spin_rad_s': state.r,
    }
    return Event('thrown', f'{speed:.2f} m/s, spin {state.r:.2f} rad/s', values)


def landed(sim: FlightSimulator, flight: int, released: int) -> Event:
    """Return the event of a landing, stamped with the moment of touching the ground.

    Args:
        sim: A simulator whose disc has landed.
        flight: Number of the flight.
        released: Stamp of its release [ns].
    """
    touch, release = sim.touch, sim.release
    distance = math.hypot(touch.X - release.X, touch.Y - release.Y)
    x, y, _ = frames.flip_yz((touch.X, touch.Y, touch.Z))
    values = {
        'stamp_s': in_seconds(released + round(sim.touch_time * NANOSECONDS)),
        'flight': flight,
        'flight_time_s': sim.touch_time,
        'range_m': distance,
        'landing_x_m': x,
        'landing_y_m': y,
        'spin_rad_s': touch.r,
    }
    return Event('landed', f'{distance:.2f} m in {sim.touch_time:.3f} s', values)


def failed(error: IntegrationError) -> Event:
    """Return the event of a flight that moves faster than its step can follow."""
    return Event('failed', str(error), is_error=True)


def in_seconds(nanoseconds: int) -> str:
    """Return a time in seconds, exact: floats near the present date have steps of 240 ns."""
    return f'{nanoseconds // NANOSECONDS}.{nanoseconds % NANOSECONDS:09d}'
