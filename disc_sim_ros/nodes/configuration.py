"""The configuration of a flight as YAML: all that a re-flight needs besides what is published."""

from dataclasses import asdict
from typing import Any

import yaml

from disc_sim_ros import __version__
from disc_sim_ros.core import axes, catalogue
from disc_sim_ros.core.equations import State
from disc_sim_ros.core.flight import Setup
from disc_sim_ros.nodes.sim_config import SimConfig


def configuration_text(config: SimConfig, setup: Setup, release: State, flight: int) -> str:
    """Return the configuration of one flight.

    Args:
        config: The parameters of the node.
        setup: What flies in fact: with the wind at release and the seed of this flight.
        release: The exact state at release; the message `release` has it to rounding.
        flight: Its number, from 1.
    """
    disc = setup.disc
    found: dict[str, Any] = {
        'version': __version__,
        'flight': flight,
        'disc': disc.name,
        'disc_file': catalogue.document(disc),
        'model': setup.model,
        'aero': setup.aero or disc.aero,
        'moment_axes': setup.moment_axes,
        'physics_rate': config.physics_rate,
        'publish_rate': config.publish_rate,
        'ground': config.ground,
        'release': {name: float(x) for name, x in release._asdict().items()},
        'command_timeout': config.command_timeout,
        'air_density': setup.air.density,
        'gravity': setup.air.gravity,
        'wind': {
            **dict(zip('xyz', (axes.map_from_paper(setup.wind.mean) + 0.0).tolist(), strict=True)),
            **{name: x for name, x in asdict(setup.wind).items() if name != 'mean'},
        },
    }
    text: str = yaml.dump(found, Dumper=_Dumper, sort_keys=False, width=10_000)
    return text


# The C one is fifty times faster; not every build of PyYAML has it.
_Dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
