"""The configuration of a flight as YAML: all that a re-flight needs besides what is published."""

from dataclasses import asdict
from typing import Any

import yaml

from disc_sim_ros import __version__
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import State


def configuration_text(
    setup: Setup,
    release: State,
    flight: int,
    *,
    physics_rate: float,
    publish_rate: float,
    ground: bool,
    command_timeout: float,
) -> str:
    """Return the configuration of one flight.

    Args:
        setup: What flies in fact: with the wind at release and the seed of this flight.
        release: The exact state at release; the message `release` has it to rounding.
        flight: Its number, from 1.
        physics_rate: Steps per second [1/s].
        publish_rate: States published per second [1/s].
        ground: Whether the flight ends on the ground.
        command_timeout: Time after which a command falls to zero [s].
    """
    disc = setup.disc
    found: dict[str, Any] = {
        'version': __version__,
        'flight': flight,
        'disc': disc.name,
        'disc_file': disc_file.disc_document(disc),
        'model': setup.model,
        'aero': setup.aero or disc.aero,
        'moment_axes': setup.moment_axes,
        'physics_rate': physics_rate,
        'publish_rate': publish_rate,
        'ground': ground,
        'release': {name: float(x) for name, x in release._asdict().items()},
        'command_timeout': command_timeout,
        'air_density': setup.air.density,
        'gravity': setup.air.gravity,
        'wind': {
            **dict(
                zip('xyz', (frames.map_from_paper(setup.wind.mean) + 0.0).tolist(), strict=True)
            ),
            **{name: x for name, x in asdict(setup.wind).items() if name != 'mean'},
        },
    }
    text: str = yaml.dump(found, Dumper=_Dumper, sort_keys=False, width=10_000)
    return text


# The C one is fifty times faster; not every build of PyYAML has it.
_Dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
