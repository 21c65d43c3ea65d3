"""`fly` as a command: run in this process or in one of its own, and its results."""

from dataclasses import dataclass
import math
import os
from pathlib import Path
import re
import subprocess
import sys

import numpy as np
from scipy.spatial.transform import Rotation

EXECUTABLE = Path(sys.executable).with_name('fly')
ARRAYS = {
    't_s': (),
    'position_m': (3,),
    'velocity_m_s': (3,),
    'airspeed_m_s': (),
    'alpha_deg': (),
    'roll_deg': (),
    'pitch_deg': (),
    'yaw_deg': (),
    'absolute_attitude_deg': (),
    'spin_rad_s': (),
    'advance_ratio': (),
}
DIAMETER = 0.275  # m, of the default disc
# Differences of sums and products of doubles of the size of these flights (1e2): 1e-14 each.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Result:
    """Exit code, stdout and stderr of a run of `fly`."""

    code: int
    out: str
    err: str


def start(*arguments: object, **options) -> subprocess.CompletedProcess:
    """Run the installed program."""
    command = [EXECUTABLE, *map(str, arguments)]
    options = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE} | options
    return subprocess.run(command, text=True, timeout=120, check=False, **options)


def environment(**changes: str | None) -> dict[str, str]:
    """Return the environment with changes; None removes a variable."""
    merged = {**os.environ, **changes}
    return {name: value for name, value in merged.items() if value is not None}


def refused(result: Result, *fragments: str) -> None:
    """Check that the run ended with code 2 and one line with the fragments."""
    assert result.code == 2
    assert result.out == ''
    assert re.fullmatch(r'fly: error: [^\n]+\n', result.err)
    for fragment in fragments:
        assert fragment in result.err


def paper_velocity(launch: dict) -> np.ndarray:
    """Return the velocity at release in the paper's earth axes, from scipy's rotations."""
    alpha = math.radians(launch['angle_of_attack_deg'])
    beta = math.radians(launch['sideslip_deg'])
    uvw = [math.cos(alpha) * math.cos(beta), math.cos(alpha) * math.sin(beta), math.sin(alpha)]
    angles = [launch['yaw_deg'], launch['pitch_deg'], launch['roll_deg']]
    return launch['speed_m_s'] * Rotation.from_euler('ZYX', angles, degrees=True).apply(uvw)


def table_of(path: Path) -> tuple[list[str], list[list[float | None]]]:
    head, *rows = path.read_text(encoding='utf-8').splitlines()
    parsed = [[float(cell) if cell else None for cell in row.split(',')] for row in rows]
    return head.split(','), parsed
