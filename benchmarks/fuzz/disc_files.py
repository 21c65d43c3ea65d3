"""Disc files: any bytes are refused in one line, or make a disc that survives and flies."""

from pathlib import Path
import random
from typing import Any

import flown
import scratch
import yaml

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import MODELS, MOMENT_AXES, Setup
from disc_sim_ros.physics.launch import Launch

NAME = 'disc_files'
WORDS = (
    'based_on: ', 'frisbee', 'wraith', 'mass_kg: ', 'inertia_axial_kg_m2: ', 'table: ',
    'damping: ', 'spin_roll_moment: ', 'coefficient: ', 'advance_ratio: ', 'alpha_deg: ',
    'C_Lp: ', 'aero: ', 'linear', '<<: ', '&a ', '*a', '!!python/object ', '!!binary ', '!!set ',
    '.nan', '.inf', '1e308', '1e-308', '4.9e-324', '[[', ']]', '? ', '- ', '|', '>',
)  # fmt: skip
_NUMBERS = (
    0.0, -0.0, 1.0, -1.0, 1e308, -1e308, 1e-308, 5e-324, 1e154, 1e-154, float('nan'),
    float('inf'), 90.0, -90.0, 180.0, 89.999999999, 1e-9, 2**63, -(2**63), 10**400,
)  # fmt: skip
_THINGS = (None, True, '', 'table', 'frisbee', [], {}, [[]], [1.0], {'a': 1.0}, '1e-3', '\x00')
_FILE = scratch.folder() / 'disc.yaml'


def seeds() -> list[bytes]:
    """Return every disc of the catalogue, as its file and as a complete document."""
    documents = []
    for name in disc_file.disc_names():
        disc = disc_file.load_disc(name)
        documents.append(yaml.safe_dump(disc_file.disc_document(disc)).encode())
        documents.append(f'based_on: {name}\nmass_kg: 0.2\ndamping: {{C_Lp: -0.4}}\n'.encode())
        path = Path(disc_file.__file__).parent / 'discs' / f'{name}.yaml'
        documents.append(path.read_bytes())
    return documents


def one(data: bytes) -> None:
    """Load one file; what loads must survive its own document and fly."""
    _FILE.write_bytes(data)
    try:
        disc = disc_file.load_disc(str(_FILE))
    except ConfigError as error:
        if '\n' in str(error):
            raise AssertionError(f'not one line: {error}') from None
        return
    document = disc_file.disc_document(disc)
    again = disc_file.disc_from_document(disc.name, document)
    if disc_file.disc_document(again) != document:
        raise AssertionError('the document of a disc makes another disc')
    choice = len(data)
    setup = Setup(
        disc=disc,
        model=tuple(MODELS)[choice % 3],
        moment_axes=tuple(MOMENT_AXES)[choice % 2],
    )
    launch = Launch(angle_of_attack=(0.0, 85.0, -95.0)[choice % 3], roll_rate=2.0)
    flown.fly_on(setup, launch.state())


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Change the document of a file; None where it is none."""
    try:
        document = yaml.load(data, Loader=yaml.CSafeLoader)  # a safe one
    except (yaml.YAMLError, ValueError, RecursionError):
        return None
    if not isinstance(document, dict) or not document:
        return None
    for _ in range(rng.randint(1, 3)):
        _change(document, rng)
    try:
        return yaml.dump(document, Dumper=yaml.CSafeDumper).encode()
    except (yaml.YAMLError, ValueError, RecursionError, UnicodeEncodeError):
        return None


def _change(node: Any, rng: random.Random) -> None:
    """Change one value somewhere below a dict or a list."""
    while True:
        keys = list(node) if isinstance(node, dict) else list(range(len(node)))
        if not keys:
            return
        key = rng.choice(keys)
        inner = node[key]
        if isinstance(inner, dict | list) and inner and rng.random() < 0.85:
            node = inner
            continue
        break
    what = rng.random()
    if what < 0.5:
        node[key] = rng.choice(_NUMBERS)
    elif what < 0.7 and isinstance(inner, float):
        node[key] = inner * rng.choice((-1.0, 1e-9, 1e9, 1.0 + 1e-15, 10.0 ** rng.uniform(-9, 9)))
    elif what < 0.85:
        node[key] = rng.choice(_THINGS)
    elif isinstance(node, dict):
        del node[key]
    else:
        node.insert(key, inner)
