"""What a bag holds of a flight besides its motion: written here, and read here.

- `configuration` (std_msgs/String): a YAML document with all that a re-simulation needs besides
  commands and changes of the wind. `configuration_text` writes it; `document_of` and
  `from_document` read it. A flight comes back equal to the last bit.
- `flight_events` (diagnostic_msgs/DiagnosticStatus): the values are text. Their keys are those of
  `EventKey` and, for a landing, the fields of `Landing`.

The names of the topics and of the events are in `disc_sim_ros.topics`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
import math
import re
from typing import Any, NamedTuple

import yaml

from disc_sim_ros import __version__, validation
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.units import NANOSECONDS

# ---- configuration ----


class Key:
    """Keys of the document, in the order in which they are written."""

    VERSION = 'version'
    FLIGHT = 'flight'
    DISC = 'disc'
    DISC_FILE = 'disc_file'
    MODEL = 'model'
    AERO = 'aero'
    MOMENT_AXES = 'moment_axes'
    PHYSICS_RATE = 'physics_rate'
    PUBLISH_RATE = 'publish_rate'
    GROUND = 'ground'
    RELEASE = 'release'
    COMMAND_TIMEOUT = 'command_timeout'
    AIR_DENSITY = 'air_density'
    GRAVITY = 'gravity'
    WIND = 'wind'
    GROUND_CONTACT = 'ground_contact'  # only where it is not the disc's own


_REQUIRED = {Key.DISC, Key.MODEL, Key.PHYSICS_RATE, Key.PUBLISH_RATE, Key.GROUND}
_AXES = ('x', 'y', 'z')  # keys of the mean wind, in `map`


@dataclass(frozen=True, kw_only=True)
class FlightConfig:
    """One flight of sim_node.

    Attributes:
        setup: What flies, with the wind at release, the seed of this flight and the step
            1 / `physics_rate`.
        release: The exact state at release; the message `release` has it to rounding.
        flight: Number of the flight, from 1.
        physics_rate: Integration steps per second [Hz].
        publish_rate: Published states per second [Hz].
        ground: True if the flight ends on the ground.
        command_timeout: Time after which a command falls to zero [s]; None if it was not recorded.
        version: Version of this package that flew it.
    """

    setup: Setup
    release: State
    flight: int
    physics_rate: float
    publish_rate: float
    ground: bool
    command_timeout: float | None
    version: str = __version__


def configuration_text(config: FlightConfig) -> str:
    """Return the YAML document of a flight."""
    setup = config.setup
    disc = setup.disc
    mean = (frames.map_from_paper(setup.wind.mean) + 0.0).tolist()
    document: dict[str, Any] = {
        Key.VERSION: config.version,
        Key.FLIGHT: config.flight,
        Key.DISC: disc.name,
        Key.DISC_FILE: disc_file.disc_document(disc),
        Key.MODEL: setup.model,
        Key.AERO: setup.aero or disc.aero,
        Key.MOMENT_AXES: setup.moment_axes,
        Key.PHYSICS_RATE: config.physics_rate,
        Key.PUBLISH_RATE: config.publish_rate,
        Key.GROUND: config.ground,
        Key.RELEASE: {name: float(x) for name, x in config.release._asdict().items()},
        Key.COMMAND_TIMEOUT: config.command_timeout,
        Key.AIR_DENSITY: setup.air.density,
        Key.GRAVITY: setup.air.gravity,
        Key.WIND: {
            **dict(zip(_AXES, mean, strict=True)),
            **{name: x for name, x in asdict(setup.wind).items() if name != 'mean'},
        },
    }
    if setup.ground_contact is not None:
        document[Key.GROUND_CONTACT] = setup.ground_contact
    text: str = yaml.dump(document, Dumper=_Dumper, sort_keys=False, width=10_000)
    return text


def document_of(text: str) -> Mapping[str, Any] | None:
    """Return the document of a recorded configuration; None if the text is something else.

    A document has the required keys, a complete `release` and a mean wind; other values are not
    checked.
    """
    try:
        document = yaml.load(text, Loader=_Loader)  # noqa: S506 - one of the safe ones
    except yaml.YAMLError:
        return None
    if not isinstance(document, dict) or not document.keys() >= _REQUIRED:
        return None
    if not _are_numbers(document.get(Key.RELEASE), State._fields):
        return None
    if not _are_numbers(document.get(Key.WIND), _AXES):
        return None
    return document


def from_document(document: Mapping[str, Any]) -> FlightConfig:
    """Return the flight that a document describes.

    Raises:
        ConfigError: The document lacks something, or a value is not allowed.
    """
    try:
        return _from_document(document)
    except ConfigError:
        raise
    except (KeyError, TypeError, ValueError, ZeroDivisionError, OverflowError) as error:
        allowed = 'it is not a configuration of sim_node'
        raise ConfigError('configuration', str(error), allowed) from None


def _from_document(document: Mapping[str, Any]) -> FlightConfig:
    wind = dict(document[Key.WIND])
    x, y, z = (float(wind.pop(axis)) for axis in _AXES)
    rate = float(document[Key.PHYSICS_RATE])
    setup = Setup(
        disc=disc_file.disc_from_document(document[Key.DISC], document[Key.DISC_FILE]),
        model=document[Key.MODEL],
        aero=document[Key.AERO],
        moment_axes=document[Key.MOMENT_AXES],
        air=Air(density=document[Key.AIR_DENSITY], gravity=document[Key.GRAVITY]),
        wind=Wind(mean=frames.flip_yz((x, y, z)), **wind),
        step=1.0 / rate,
        ground_contact=document.get(Key.GROUND_CONTACT),
    )
    publish_rate = document[Key.PUBLISH_RATE]
    timeout = document.get(Key.COMMAND_TIMEOUT)
    return FlightConfig(
        setup=setup,
        release=release_of(document),
        flight=int(document.get(Key.FLIGHT, 0)),
        physics_rate=rate,
        publish_rate=validation.number(Key.PUBLISH_RATE, publish_rate, above=0.0, unit='Hz'),
        ground=bool(document[Key.GROUND]),
        command_timeout=None if timeout is None else float(timeout),
        version=str(document.get(Key.VERSION)),
    )


def release_of(document: Mapping[str, Any]) -> State:
    """Return the exact state at release.

    Raises:
        KeyError, TypeError, ValueError, OverflowError: A field is missing or not a number.
    """
    return State(*(float(document[Key.RELEASE][name]) for name in State._fields))


def _are_numbers(values: Any, names: Iterable[str]) -> bool:
    return isinstance(values, dict) and all(_is_number(values.get(name)) for name in names)


def _is_number(value: Any) -> bool:
    if not isinstance(value, int | float):
        return False
    try:
        float(value)
    except OverflowError:  # a whole number above all floats
        return False
    return True


# The C ones are fifty times faster; not every build of PyYAML has them.
_Dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
_Loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


# ---- flight events ----


class EventKey:
    """Keys of the values of an event, beside the fields of `Landing`."""

    STAMP = 'stamp_s'  # when it happened, see `exact_seconds`
    FLIGHT = 'flight'  # number of the flight, from 1
    SOURCE = 'from'  # of a throw: 'launch' or the topic that commanded it
    SPEED = 'speed_m_s'
    SPIN = 'spin_rad_s'
    REPLACED = 'replaced_flight'  # number of the flight that a throw ended in the air
    JUMP = 'jump_s'  # by how much later the present step is stamped from now on, `exact_seconds`
    CAUSE = 'cause'  # of a jump: see `ros.sim.events`


class Landing(NamedTuple):
    """Where and when a flight landed; the names are keys of its event."""

    flight_time_s: float
    range_m: float  # distance over the ground from the release
    landing_x_m: float  # in `map`
    landing_y_m: float
    spin_rad_s: float  # clockwise from above positive


def landing_of(sim: FlightSimulator) -> Landing:
    """Return the landing of a simulator that has landed."""
    touch, release = sim.touch, sim.release
    x, y, _ = frames.flip_yz(touch[:3])
    distance = math.hypot(touch.X - release.X, touch.Y - release.Y)
    return Landing(sim.touch_time, distance, x, y, touch.r)


def landing_from(values: Mapping[str, str]) -> Landing | None:
    """Return the landing in the values of a recorded event; None if a number is missing."""
    try:
        return Landing(*(float(values[name]) for name in Landing._fields))
    except (KeyError, ValueError):
        return None


def exact_seconds(nanoseconds: int) -> str:
    """Return a time in seconds as text, exact: a float of today's time has steps of 240 ns."""
    return f'{nanoseconds // NANOSECONDS}.{nanoseconds % NANOSECONDS:09d}'


def nanoseconds_of(text: str) -> int | None:
    """Return the nanoseconds of `exact_seconds`; None if the text is something else."""
    match = re.fullmatch(r'(\d+)\.(\d{9})', text)
    return int(match[1]) * NANOSECONDS + int(match[2]) if match else None
