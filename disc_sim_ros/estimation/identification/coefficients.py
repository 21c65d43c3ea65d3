"""The coefficients that measured throws can determine, and a disc with other values of them.

A base disc gives the shape of each curve over the angle of attack. Lift and pitching moment have
two coefficients: the value at alpha = 0 and the slope (the mean from 0 to 10 degrees). Drag has
the value at alpha = 0 and the rise, a factor on what the base disc's drag is above that value. The
ratio of the inertias is counted as a coefficient: it sets how fast the disc wobbles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import numpy as np

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.disc import AeroTable, Disc, LinearAero
from disc_sim_ros.physics.flight import Setup, check_setup
from disc_sim_ros.physics.kernels.aerodynamics import linear_coefficients, table_coefficients
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.quantities import COEFFICIENTS

NAMES = tuple(COEFFICIENTS)
_LIFT, _DRAG, _MOMENT = range(3)
_SLOPE_END = math.radians(10.0)
_RISING = {'C_L_slope': _LIFT, 'C_M_slope': _MOMENT}
_AT_ZERO = {'C_L0': _LIFT, 'C_D0': _DRAG, 'C_M0': _MOMENT}


@dataclass(frozen=True)
class Base:
    """A base disc: values and slopes of its curves, in which a change is expressed.

    Attributes:
        disc: The disc.
        aero: 'table' or 'linear'.
        at_zero: Lift, drag and moment coefficient at alpha = 0, shape (3,).
        slope: Their mean slopes from 0 to 10 degrees [1/rad], shape (3,).
        least_drag: Least drag coefficient at any angle.
    """

    disc: Disc
    aero: str
    at_zero: FloatArray
    slope: FloatArray
    least_drag: float

    @property
    def values(self) -> FloatArray:
        """Return the coefficients of the base disc in the order of NAMES, shape (9,)."""
        disc = self.disc
        by_name = {name: self.at_zero[k] for name, k in _AT_ZERO.items()}
        by_name |= {name: self.slope[k] for name, k in _RISING.items()}
        by_name |= {'C_D_rise': 1.0, 'damping': 1.0, 'C_Nr': disc.C_Nr}
        by_name['I_ratio'] = disc.inertia_axial / disc.inertia_diametral
        return np.array([float(by_name[name]) for name in NAMES])


def base_of(setup: Setup) -> Base:
    """Return the base disc of a setup.

    Raises:
        ConfigError: The lift or the moment of the disc does not change from 0 to 10 degrees, or
            the disc has no damping, so that a factor on it means nothing.
    """
    check_setup(setup)
    disc, aero = setup.disc, setup.aero or setup.disc.aero
    plant = setup.plant

    def curve(alpha: float) -> FloatArray:
        if aero == 'linear':
            return np.array(linear_coefficients(alpha, plant.line))
        return np.array(table_coefficients(alpha, plant.table))

    at_zero = curve(0.0)
    slope = (curve(_SLOPE_END) - at_zero) / _SLOPE_END
    for name, k in _RISING.items():
        if abs(slope[k]) < 1e-3:
            raise ConfigError(name, float(slope[k]), f'disc {disc.name} gives it no shape: not 0')
    if disc.C_Lp == 0.0 or disc.C_Mq == 0.0:
        raise ConfigError('damping', 0.0, f'disc {disc.name} has none: give C_Lp and C_Mq below 0')
    drag = plant.line.CD_0 if aero == 'linear' else float(plant.table[:, 2].min())
    return Base(disc, aero, at_zero, slope, drag)


def write_rows(base: Base, values: FloatArray, rows: FloatArray) -> None:
    """Write coefficients into rows of constants, see `sampled.default_row`.

    Args:
        base: The base disc.
        values: In the order of NAMES, shape (n, 9).
        rows: Changed in place, shape (n, len(rows.NAMES)).
    """
    of = dict(zip(NAMES, values.T, strict=True))
    factors, offsets = changes(base, of)
    for k, name in enumerate(('lift', 'drag', 'pitching')):
        rows[:, AT[f'{name}_factor']] = factors[k]
        rows[:, AT[f'{name}_offset']] = offsets[k]
    rows[:, AT['C_Lp']] = base.disc.C_Lp * of['damping']
    rows[:, AT['C_Mq']] = base.disc.C_Mq * of['damping']
    rows[:, AT['C_Nr']] = of['C_Nr']
    rows[:, AT['inertia_diametral']] = base.disc.inertia_axial / of['I_ratio']


def changes(base: Base, of: dict[str, FloatArray]) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the factors and offsets of lift, drag and moment that give coefficients."""
    factors = [
        of['C_L_slope'] / base.slope[_LIFT],
        of['C_D_rise'],
        of['C_M_slope'] / base.slope[_MOMENT],
    ]
    at_zero = [of['C_L0'], of['C_D0'], of['C_M0']]
    offsets = [x - f * z for x, f, z in zip(at_zero, factors, base.at_zero, strict=True)]
    return factors, offsets


def disc_with(base: Base, values: FloatArray, name: str, description: str) -> Disc:
    """Return the base disc with other coefficients.

    Args:
        base: The base disc.
        values: In the order of NAMES, shape (9,).
        name: Of the new disc.
        description: Of the new disc.

    Raises:
        ConfigError: The drag would be negative at some angle of attack.
    """
    of = {key: np.asarray(x) for key, x in zip(NAMES, values, strict=True)}
    factors, offsets = ([float(x) for x in part] for part in changes(base, of))
    least = factors[_DRAG] * base.least_drag + offsets[_DRAG]
    if least < 0.0:
        raise ConfigError('C_D0', float(of['C_D0']), f'the least drag would be {least:.3g}, not 0')
    disc = base.disc
    table, linear = disc.table, disc.linear
    if base.aero == 'table' and table is not None:
        curves = table.coefficients * factors + offsets
        table = AeroTable(table.alpha_deg, curves)
    if base.aero == 'linear' and linear is not None:
        linear = LinearAero(
            CL_0=linear.CL_0 * factors[_LIFT] + offsets[_LIFT],
            CL_alpha=linear.CL_alpha * factors[_LIFT],
            CD_0=linear.CD_0 * factors[_DRAG] + offsets[_DRAG],
            CD_alpha=linear.CD_alpha * factors[_DRAG],
            alpha_0=linear.alpha_0,
            CM_0=linear.CM_0 * factors[_MOMENT] + offsets[_MOMENT],
            CM_alpha=linear.CM_alpha * factors[_MOMENT],
        )
    return replace(
        disc,
        name=name,
        description=description,
        aero=base.aero,
        C_Lp=disc.C_Lp * float(of['damping']),
        C_Mq=disc.C_Mq * float(of['damping']),
        C_Nr=float(of['C_Nr']),
        inertia_diametral=disc.inertia_axial / float(of['I_ratio']),
        table=table,
        linear=linear,
        uncertainty={},
    )


def chosen(names: Sequence[str]) -> list[int]:
    """Return the places of coefficients in NAMES, in that order.

    Raises:
        ConfigError: A name is unknown or stands twice.
    """
    if isinstance(names, str):
        raise ConfigError('free', names, f"give a list of names, such as ['{NAMES[0]}']")
    for name in names:
        validation.choice('free', name, NAMES)
        if list(names).count(name) > 1:
            raise ConfigError('free', name, 'name each coefficient once')
    return [i for i, name in enumerate(NAMES) if name in names]
