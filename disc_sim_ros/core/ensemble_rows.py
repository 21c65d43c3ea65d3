"""The loop over many flights, compiled, and the columns of numbers that it takes."""

import math

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.core import axes
from disc_sim_ros.core._jit import entry, inline, jit
from disc_sim_ros.core.aerodynamics import Linear
from disc_sim_ros.core.disc import FloatArray
from disc_sim_ros.core.equations import Control, Plant, State
from disc_sim_ros.core.integration import STATE_SIZE, integrate
from disc_sim_ros.core.launch import LIMITS
from disc_sim_ros.core.turbulence import WindData

IntArray = NDArray[np.int64]

# What may differ from flight to flight besides the fields of Launch: least, greatest, unit.
OTHER_LIMITS = {
    'wind_x': (-100.0, 100.0, 'm/s'),  # where the air moves to, in `map`
    'wind_y': (-100.0, 100.0, 'm/s'),
    'wind_z': (-100.0, 100.0, 'm/s'),
    'control_CL': (-10.0, 10.0, ''),  # held, the paper's signs
    'control_CM': (-10.0, 10.0, ''),
    'control_CN': (-10.0, 10.0, ''),
    'mass': (1e-3, 100.0, 'kg'),
    'inertia_axial': (1e-7, 100.0, 'kg m^2'),
    'inertia_diametral': (1e-7, 100.0, 'kg m^2'),
    'C_Lp': (-100.0, 0.0, ''),
    'C_Mq': (-100.0, 0.0, ''),
    'C_Nr': (-100.0, 0.0, ''),
    'air_density': (0.0, 100.0, 'kg/m^3'),
    'gravity': (0.0, 100.0, 'm/s^2'),
    'lift_factor': (0.0, 10.0, ''),  # times the disc's own coefficients
    'drag_factor': (0.0, 10.0, ''),
    'pitching_factor': (0.0, 10.0, ''),
    'lift_offset': (-2.0, 2.0, ''),  # added to them afterwards
    'drag_offset': (-2.0, 2.0, ''),
    'pitching_offset': (-2.0, 2.0, ''),
}
NAMES = (*LIMITS, *OTHER_LIMITS)  # the columns of the compiled loop, in this order
ALL_LIMITS = LIMITS | OTHER_LIMITS
AT = {name: i for i, name in enumerate(NAMES)}
_WIND = AT['wind_x']
_CONTROL = AT['control_CL']
_MASS = AT['mass']
_YAW = AT['yaw']
_FACTORS = AT['lift_factor']

_cos_sin_degrees = jit(axes.cos_sin_degrees)
_quaternion_of_half_angles = inline(axes.quaternion_of_half_angles)
_rotation_elements = inline(axes.rotation_elements)
_rotated = inline(axes.rotated)


@jit
def _release(row: FloatArray) -> State:
    """Return `Launch.state` of the first columns of a row."""
    speed, pitch, roll, yaw, alpha, sideslip, spin, roll_rate, pitch_rate, height = row[:10]
    c_alpha, s_alpha = _cos_sin_degrees(alpha)
    c_beta, s_beta = _cos_sin_degrees(sideslip)
    cphi, sphi = _cos_sin_degrees(roll / 2)
    cthe, sthe = _cos_sin_degrees(pitch / 2)
    cpsi, spsi = _cos_sin_degrees(yaw / 2)
    e0, e1, e2, e3 = _quaternion_of_half_angles(cphi, sphi, cthe, sthe, cpsi, spsi)
    uvw = (c_alpha * c_beta, c_alpha * s_beta, s_alpha)
    V_X, V_Y, V_Z = _rotated(_rotation_elements(e0, e1, e2, e3), uvw)
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
def _plant_of(row: FloatArray, plant: Plant) -> Plant:
    """Return the constants of a flight."""
    m, I_z, I_x, C_Lp, C_Mq, C_Nr, rho, g = row[_MASS : _MASS + 8]
    f_L, f_D, f_M, o_L, o_D, o_M = row[_FACTORS : _FACTORS + 6]
    line = plant.line
    line = Linear(
        line.CL_0 * f_L + o_L,
        line.CL_alpha * f_L,
        line.CD_0 * f_D + o_D,
        line.CD_alpha * f_D,
        line.alpha_0,
        line.CM_0 * f_M + o_M,
        line.CM_alpha * f_M,
    )
    return Plant(
        m,
        plant.c,
        plant.S,
        I_x,
        I_z,
        C_Lp,
        C_Mq,
        C_Nr,
        rho,
        g,
        plant.model,
        plant.moment_axes,
        plant.use_linear,
        line,
    )


@inline
def _wind_of(row: FloatArray, wind: WindData) -> WindData:
    """Return the wind of a flight, as `Setup.wind_data` does."""
    X, Y, Z = row[_WIND], 0.0 - row[_WIND + 1], 0.0 - row[_WIND + 2]
    horizontal = math.sqrt(X * X + Y * Y)
    x_X, x_Y = (X / horizontal, Y / horizontal) if horizontal > 0.0 else (1.0, 0.0)
    return WindData(X, Y, Z, wind.z0, wind.per_log, wind.W_20, x_X, x_Y)


@entry
def fly_rows(
    rows: FloatArray,
    start: int,
    stop: int,
    plant: Plant,
    base_table: FloatArray,
    spin_terms: FloatArray,
    base_control: Control,
    wind: WindData,
    noise: FloatArray,
    step: float,
    duration: float,
    ground: bool,
    status: IntArray,
    time: FloatArray,
    apex: FloatArray,
    drift: FloatArray,
    states: FloatArray,
) -> None:
    """Fly rows `start` to `stop` and fill the arrays of a `Landings`."""
    no_samples = np.empty((0, 18))
    table = base_table.copy()
    for i in range(start, stop):
        row = rows[i]
        for k in range(3):
            factor, offset = row[_FACTORS + k], row[_FACTORS + 3 + k]
            for j in range(len(table)):
                table[j, 1 + k] = base_table[j, 1 + k] * factor + offset
        c = base_control
        control = Control(
            row[_CONTROL], row[_CONTROL + 1], row[_CONTROL + 2], c.L, c.M, c.N, c.axes
        )
        s = _release(row)
        ended = integrate(
            s,
            _plant_of(row, plant),
            table,
            spin_terms,
            control,
            _wind_of(row, wind),
            noise,
            step,
            duration,
            ground,
            0.0,
            no_samples,
        )
        status[i] = ended.status
        time[i] = ended.t
        apex[i] = 0.0 - ended.apex_Z
        c_yaw, s_yaw = _cos_sin_degrees(row[_YAW])
        drift[i] = s_yaw * ended.state.X - c_yaw * ended.state.Y
        for k in range(STATE_SIZE):
            states[i, k] = ended.state[k]
