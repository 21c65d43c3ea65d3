"""A disc from its flight numbers, speed/glide/turn/fade, as makers print them on golf discs.

No formula of the makers is public. Four straight lines are fitted through the discs of the
catalogue whose coefficients and numbers are known: least drag over the root of the speed (seven
discs), lift at 0 degrees over the glide, pitching moment at 0 degrees over the turn, and at 10
degrees over the fade (the four with tables by CFD: the wind tunnel finds other lifts). They shift
the mean of these four tables. What the lines leave over is the uncertainty of the disc.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
import re
from typing import Any

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.quantities import FLIGHT_NUMBERS

# Speed, glide, turn and fade that the makers give. The first four have tables of all three
# coefficients (CFD); of the others the least drag was measured, and lift in a wind tunnel.
TABLES: dict[str, tuple[float, ...]] = {
    'firebird': (9, 3, 0, 4),
    'roadrunner': (9, 5, -4, 1),
    'teebird': (7, 5, 0, 2),
    'wraith': (11, 5, -1, 3),
}
LINES: dict[str, tuple[float, ...]] = {
    'aviar': (2, 3, 0, 1),
    'buzzz': (5, 4, -1, 1),
    'roc': (4, 4, 0, 3),
}
MASS, DIAMETER = 0.175, 0.212  # kg, m: usual ones; the numbers tell neither
_LOW = 0.0  # degrees, where the turn shows in the pitching moment,
_HIGH = 10.0  # and where the fade does
_LINEAR_RANGE = (-10.0, 20.0)  # degrees; outside, shifts fade to 0 at +-90 degrees
_TEXT = re.compile(r'[-+]?\d+(?:\.\d+)?(?:/[-+]?\d+(?:\.\d+)?)+')

Keys = Callable[[str], dict[str, Any]]  # returns the keys of a disc of the catalogue


@dataclass(frozen=True)
class Line:
    """A straight line through a coefficient of discs over one of their numbers.

    Attributes:
        start: At 0.
        slope: Per unit.
        residual: Standard deviation of the discs about it, with n - 2 degrees of freedom.
    """

    start: float
    slope: float
    residual: float

    @classmethod
    def through(cls, numbers: list[float], coefficients: list[float]) -> 'Line':
        """Fit by least squares."""
        slope, start = np.polyfit(numbers, coefficients, 1)
        left = np.array(coefficients) - start - slope * np.array(numbers)
        return cls(float(start), float(slope), float(np.sqrt(left @ left / (len(left) - 2))))

    def at(self, number: float) -> float:
        """Return the coefficient at a number."""
        return self.start + self.slope * number


@dataclass(frozen=True, eq=False)
class Calibration:
    """The four lines, and the mean table that they shift; columns alpha [degrees], CL, CD, CM."""

    drag: Line  # least C_Drag over the root of the speed
    lift: Line  # C_Lift at 0 degrees over the glide
    turn: Line  # C_M at 0 degrees over the turn
    fade: Line  # C_M at 10 degrees over the fade
    table: FloatArray


def parse(text: str) -> tuple[float, ...] | None:
    """Return speed, glide, turn and fade of a text such as '11/5/-1/3'; None for another text.

    Raises:
        ConfigError: There are not four numbers, or one is out of range.
    """
    if not _TEXT.fullmatch(text):
        return None
    numbers = [float(part) for part in text.split('/')]
    if len(numbers) != len(FLIGHT_NUMBERS):
        allowed = 'flight numbers are speed/glide/turn/fade, such as 11/5/-1/3'
        raise ConfigError('disc', text, allowed)
    return tuple(
        quantity.check(number, f'{name.removesuffix("_number")} in {text}')
        for (name, quantity), number in zip(FLIGHT_NUMBERS.items(), numbers, strict=True)
    )


def calibration(keys_of: Keys) -> Calibration:
    """Fit the lines to the catalogue, of which `keys_of` returns the keys of a disc."""
    every = TABLES | LINES
    keys = {name: keys_of(name) for name in every}
    tables = {name: _columns(keys[name]) for name in every}

    def moments(alpha: float) -> list[float]:
        return [float(np.interp(alpha, tables[n][:, 0], tables[n][:, 3])) for n in TABLES]

    lifts = [float(np.interp(0.0, tables[n][:, 0], tables[n][:, 1])) for n in TABLES]
    drags = [float(tables[n][:, 2].min()) for n in every]
    return Calibration(
        drag=Line.through([every[n][0] ** 0.5 for n in every], drags),
        lift=Line.through([TABLES[n][1] for n in TABLES], lifts),
        turn=Line.through([TABLES[n][2] for n in TABLES], moments(_LOW)),
        fade=Line.through([TABLES[n][3] for n in TABLES], moments(_HIGH)),
        table=np.mean([tables[n] for n in TABLES], axis=0),
    )


def keys(numbers: tuple[float, ...], keys_of: Keys) -> dict[str, Any]:
    """Return the keys of a disc file for flight numbers.

    Args:
        numbers: Speed, glide, turn and fade.
        keys_of: Returns the keys of a disc of the catalogue.
    """
    speed, glide, turn, fade = numbers
    fit = _cached(keys_of)
    alpha, CL, CD, CM = fit.table.T
    wide = _shift(alpha)
    to_high = np.clip((alpha - _LOW) / (_HIGH - _LOW), 0.0, 1.0)
    at_0 = fit.turn.at(turn) - np.interp(_LOW, alpha, CM)
    at_10 = fit.fade.at(fade) - np.interp(_HIGH, alpha, CM)
    columns = {
        'alpha_deg': alpha,
        'CL': CL + wide * (fit.lift.at(glide) - np.interp(0.0, alpha, CL)),
        'CD': np.maximum(CD + wide * (fit.drag.at(speed**0.5) - CD.min()), 0.01),
        'CM': CM + wide * ((1.0 - to_high) * at_0 + to_high * at_10),
    }
    other = keys_of('wraith')
    shape = [
        np.mean([keys_of(n)[key] / (keys_of(n)['mass_kg'] * keys_of(n)['diameter_m'] ** 2)
                 for n in TABLES])
        for key in ('inertia_axial_kg_m2', 'inertia_diametral_kg_m2')
    ]  # fmt: skip
    return {
        'description': (
            f'from the flight numbers {"/".join(f"{n:g}" for n in numbers)}; '
            f'C_Lift uncertain by {fit.lift.residual:.2g}, C_Drag by {fit.drag.residual:.2g}, '
            f'C_M by {fit.turn.residual:.2g} at 0 and {fit.fade.residual:.2g} at 10 degrees'
        ),
        'mass_kg': MASS,
        'diameter_m': DIAMETER,
        'inertia_axial_kg_m2': float(shape[0]) * MASS * DIAMETER**2,
        'inertia_diametral_kg_m2': float(shape[1]) * MASS * DIAMETER**2,
        'aero': 'table',
        'ground': 'rim',
        'damping': dict(other['damping']),
        'table': {name: column.tolist() for name, column in columns.items()},
        'uncertainty': {
            'lift_offset': fit.lift.residual,
            'drag_offset': fit.drag.residual,
            'pitching_offset': max(fit.turn.residual, fit.fade.residual),
        },
    }


_cached = cache(calibration)


def _columns(keys: dict[str, Any]) -> FloatArray:
    table = keys['table']
    return np.array([table[name] for name in ('alpha_deg', 'CL', 'CD', 'CM')]).T


def _shift(alpha: FloatArray) -> FloatArray:
    """Return 1 in the range of ordinary flight, falling in straight lines to 0 at +-90 degrees."""
    low, high = _LINEAR_RANGE
    return np.interp(alpha, [-90.0, low, high, 90.0], [0.0, 1.0, 1.0, 0.0])
