"""Recorded configurations: any text is refused in one line, or flies again."""

import random

import disc_files
import flown
import numpy as np

from disc_sim_ros import topics
from disc_sim_ros.analysis import recording, resimulate
from disc_sim_ros.analysis.odometry import Motion
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.physics.flight_config import FlightConfig, configuration_text, document_of
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros.sim.config import configuration

NAME = 'configurations'
WORDS = (
    *disc_files.WORDS, 'release:', 'wind:', 'physics_rate: ', 'disc_file:', 'roughness_length: ',
)  # fmt: skip
_START = 1_700_000_000_000_000_000  # ns
_SECOND = 1_000_000_000
_CHANGES = (
    recording.Change(topics.APPLIED_MOMENT, _START + 20_000_000, (0.01, 0.0, 0.0), 'disc_body'),
    recording.Change(
        topics.APPLIED_COEFFICIENTS, _START + 30_000_000, (0.0, 0.01, 0.0), 'disc_air'
    ),
    recording.Change(topics.APPLIED_WIND, _START + 40_000_000, (3.0, 1.0, 0.0), 'map'),
)


def seeds() -> list[bytes]:
    """Return configurations as `sim_node` publishes them."""
    documents = []
    for disc, model in (('frisbee', 'exact'), ('wraith', 'precession'), ('flat_plate', 'exact')):
        config = configuration({'disc': disc, 'model': model, 'wind.turbulence': 5.0})
        flight = FlightConfig(
            setup=config.setup,
            release=Launch().state(),
            flight=1,
            physics_rate=config.physics_rate,
            publish_rate=config.publish_rate,
            ground=config.ground,
            command_timeout=config.command_timeout,
        )
        documents.append(configuration_text(flight).encode())
    return documents


def one(data: bytes) -> None:
    """Read one configuration as `analyse_bag --verify` reads it, and fly 100 steps with it."""
    document = document_of(data.decode(errors='replace'))
    if document is None:
        return
    stamps = _START + np.arange(0, 11) * 10_000_000
    motion = Motion('/odom', 'map', 'disc', stamps, stamps, np.zeros((11, 13)))
    disc = recording.Disc(motion, changes=_CHANGES)
    release = recording.Release(_START, document)
    flight = recording.Flight(disc, 1, _START, slice(0, 11), release)
    if _is_slow(document):
        return
    try:
        again = resimulate.fly_again(flight)
    except DiscSimError as error:
        if '\n' in str(error):
            raise AssertionError(f'not one line: {error}') from None
        return
    resimulate.compare(flight, again)
    if not again.lost:
        for state in again.states:
            flown.require_sound(State(*state.tolist()))


def _is_slow(document: object) -> bool:
    """Return True if it needs more steps than a fuzz target has time for."""
    rate = document.get('physics_rate') if isinstance(document, dict) else None
    try:
        return float(rate) > 1e5  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return False


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Change values of the document."""
    return disc_files.mutate(data, rng)
