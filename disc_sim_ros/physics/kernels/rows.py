"""A flight of an ensemble as a row of numbers: its release, plant, control inputs and wind.

The functions take one row, shape (len(NAMES),); `plant_of` and `inputs_of` also take a row for
each lane, shape (len(NAMES), WIDTH), and return vectors.
"""

import math

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.aerodynamics import Linear
from disc_sim_ros.physics.kernels.equations import Control, Plant, State
from disc_sim_ros.physics.kernels.jit import inline, jit
from disc_sim_ros.physics.kernels.rk4 import Inputs
from disc_sim_ros.physics.kernels.rotation import (
    cos_sin_degrees,
    quaternion_of_half_angles,
    rotated,
    rotation_elements,
)
from disc_sim_ros.physics.kernels.simd import element, where
from disc_sim_ros.physics.kernels.wind import WindData

# The columns of a row, in this order: a launch, then constants that may differ between flights.
NAMES = (
    'speed',
    'pitch',
    'roll',
    'yaw',
    'angle_of_attack',
    'sideslip',
    'spin',
    'roll_rate',
    'pitch_rate',
    'height',
    'wind_x',
    'wind_y',
    'wind_z',
    'control_CL',
    'control_CM',
    'control_CN',
    'mass',
    'inertia_axial',
    'inertia_diametral',
    'C_Lp',
    'C_Mq',
    'C_Nr',
    'air_density',
    'gravity',
    'lift_factor',
    'drag_factor',
    'pitching_factor',
    'lift_offset',
    'drag_offset',
    'pitching_offset',
)
AT = {name: i for i, name in enumerate(NAMES)}
_WIND = AT['wind_x']
_CONTROL = AT['control_CL']
_MASS = AT['mass']
YAW = AT['yaw']
_FACTORS = AT['lift_factor']
_OFFSETS = AT['lift_offset']


@jit
def release(row: FloatArray) -> State:
    """Return the state at release, as `Launch.state` does."""
    speed, pitch, roll, yaw, alpha, sideslip, spin, roll_rate, pitch_rate, height = row[:10]
    c_alpha, s_alpha = cos_sin_degrees(alpha)
    c_beta, s_beta = cos_sin_degrees(sideslip)
    cphi, sphi = cos_sin_degrees(roll / 2)
    cthe, sthe = cos_sin_degrees(pitch / 2)
    cpsi, spsi = cos_sin_degrees(yaw / 2)
    e0, e1, e2, e3 = quaternion_of_half_angles(cphi, sphi, cthe, sthe, cpsi, spsi)
    uvw = (c_alpha * c_beta, c_alpha * s_beta, s_alpha)
    V_X, V_Y, V_Z = rotated(rotation_elements(e0, e1, e2, e3), uvw)
    return State(
        0.0,
        0.0,
        -height,
        speed * V_X,
        speed * V_Y,
        speed * V_Z,
        e0,
        e1,
        e2,
        e3,
        roll_rate,
        pitch_rate,
        spin,
        0.0,
    )


@inline
def plant_of(row: FloatArray, plant: Plant, table: FloatArray) -> Plant:
    """Return the constants of the flight: those of the row and of its table, else of `plant`."""
    f_L, f_D, f_M = element(row, _FACTORS), element(row, _FACTORS + 1), element(row, _FACTORS + 2)
    o_L, o_D, o_M = element(row, _OFFSETS), element(row, _OFFSETS + 1), element(row, _OFFSETS + 2)
    line = plant.line
    return Plant(
        element(row, _MASS),
        plant.c,
        plant.S,
        element(row, _MASS + 2),  # I_x
        element(row, _MASS + 1),  # I_z
        element(row, _MASS + 3),
        element(row, _MASS + 4),
        element(row, _MASS + 5),
        element(row, _MASS + 6),  # rho
        element(row, _MASS + 7),  # g
        plant.model,
        plant.moment_axes,
        plant.use_linear,
        Linear(
            line.CL_0 * f_L + o_L,
            line.CL_alpha * f_L,
            line.CD_0 * f_D + o_D,
            line.CD_alpha * f_D,
            line.alpha_0,
            line.CM_0 * f_M + o_M,
            line.CM_alpha * f_M,
        ),
        table,
        plant.spin_terms,
        plant.rim,
    )


@jit
def fill_table(row: FloatArray, base: FloatArray, table: FloatArray) -> None:
    """Write the table of the flight, `base` with its coefficients scaled and shifted."""
    for j in range(len(base)):
        table[j, 0] = base[j, 0]
        table[j, 4] = base[j, 4]
        for k in range(3):
            factor, offset = row[_FACTORS + k], row[_OFFSETS + k]
            table[j, 1 + k] = base[j, 1 + k] * factor + offset
            table[j, 5 + k] = base[j, 5 + k] * factor


@inline
def inputs_of(row: FloatArray, inputs: Inputs) -> Inputs:
    """Return the control inputs and wind of the flight, and the noise of `inputs`."""
    c = inputs.control
    C_L, C_M, C_N = (
        element(row, _CONTROL),
        element(row, _CONTROL + 1),
        element(row, _CONTROL + 2),
    )
    control = Control(C_L, C_M, C_N, c.L, c.M, c.N, c.axes)
    return Inputs(control, _wind_of(row, inputs.wind), inputs.noise)


@inline
def _wind_of(row: FloatArray, wind: WindData) -> WindData:
    """Return the wind of the flight, as `Setup.wind_data` does."""
    X, Y, Z = element(row, _WIND), 0.0 - element(row, _WIND + 1), 0.0 - element(row, _WIND + 2)
    horizontal = math.sqrt(X * X + Y * Y)
    calm = horizontal <= 0.0
    h = where(calm, 1.0, horizontal)
    x_X, x_Y = where(calm, 1.0, X / h), where(calm, 0.0, Y / h)
    return WindData(X, Y, Z, wind.z0, wind.per_log, wind.W_20, x_X, x_Y)
