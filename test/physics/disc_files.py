"""Helpers for the tests of disc files: files of the package and of measurements."""

from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.testing import assert_array_equal

from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch

DATA = Path(__file__).parents[1] / 'data'
NAMES = (
    'aviar',
    'buzzz',
    'firebird',
    'flat_plate',
    'frisbee',
    'frisbee_as_printed',
    'frisbee_linear',
    'frisbee_roll_moment',
    'roadrunner',
    'roc',
    'teebird',
    'ultrastar',
    'wraith',
    'wraith_tunnel',
)
COLUMNS = ('CL', 'CD', 'CM')


def yaml_of(name: str) -> str:
    return (files('disc_sim_ros.physics') / 'discs' / f'{name}.yaml').read_text(encoding='utf-8')


def published(name: str) -> tuple[list[str], np.ndarray]:
    """Return the header and the rows of a file of measurements."""
    text = (DATA / name).read_text(encoding='utf-8')
    head, *rows = [line.split(',') for line in text.splitlines() if not line.startswith('#')]
    return head, np.array(rows, dtype=float)


def end_of(disc: Disc) -> tuple[float, ...]:
    return fly(Launch(), Setup(disc=disc)).end


def assert_same_disc(a: Disc, b: Disc, *, but: tuple[str, ...] = ()) -> None:
    """Assert that every number of two discs is the same; names and descriptions may differ."""
    for field in vars(a).keys() - {'name', 'description', *but}:
        mine, other = getattr(a, field), getattr(b, field)
        if hasattr(mine, '__slots__') and field != 'linear':
            for slot in mine.__slots__:
                assert_array_equal(getattr(mine, slot), getattr(other, slot), err_msg=field)
        else:
            assert mine == other, field
