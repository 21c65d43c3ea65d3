"""`analyse_bag --verify` on damaged bags of real flights: an answer or one line, no traceback."""

from contextlib import redirect_stderr, redirect_stdout
import io
import json
from pathlib import Path
import random
import sys

import mcap_bytes
import scratch

sys.path.insert(0, str(Path(__file__).parents[2] / 'test' / 'analysis'))
import bags as flights
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.cli import analyse_bag

NAME = 'flight_bags'
WORDS = (
    '/odom', '/release', '/configuration', '/applied_moment', 'nav_msgs/msg/Odometry', 'landed',
)  # fmt: skip
_PLACE = scratch.folder()
_NEEDED = {
    'odom', 'release', 'configuration', 'flight_events', 'applied_moment', 'applied_coefficients',
    'applied_wind',
}  # fmt: skip
_SMALL = {'publish_rate': 20.0, 'physics_rate': 1000.0, 'path_rate': 0.0}
_CODES = {0, 1, 2, 3}


def seeds() -> list[bytes]:
    """Return steered flights at 20 messages a second of what an analysis reads."""
    files = []
    for number, changes in enumerate(({}, {'disc': 'frisbee', 'model': 'precession'})):
        whole = flights.steered_bag(_PLACE / f'{number}', **_SMALL, **changes)
        thin = _thinned(whole, _PLACE / f'thin_{number}')
        files.append(next(thin.glob('*.mcap')).read_bytes())
    return files


def _thinned(source: Path, target: Path) -> Path:
    """Copy the topics that an analysis reads, and no others."""
    bag = open_bag(source)
    with BagWriter(target, custom_data=bag.custom_data) as writer:
        ids = {
            info.topic.name: writer.add(info.topic)
            for info in bag.topics
            if info.topic.name.strip('/') in _NEEDED
        }
        for m in bag.raw(ids):
            writer.write(ids[m.topic], m.data, m.log_time, m.publish_time)
    return target


def one(data: bytes) -> None:
    """Analyse and verify one bag, as text or as JSON."""
    path = _PLACE / 'x.mcap'
    path.write_bytes(data)
    flags = ['--json'] if len(data) % 2 else []
    out, err = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(out), redirect_stderr(err):
            code = analyse_bag.main([str(path), '--verify', *flags])
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    if code not in _CODES:
        raise AssertionError(f'exit code {code}: {err.getvalue()}')
    if flags and out.getvalue():
        json.loads(out.getvalue())


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Change records of the file."""
    return mcap_bytes.mutate(data, rng)
