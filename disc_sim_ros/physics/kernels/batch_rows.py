"""The loop over many flights, compiled, and the columns of numbers that it takes."""

import math

import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.physics.kernels import rotation
from disc_sim_ros.physics.kernels.aerodynamics import Linear
from disc_sim_ros.physics.kernels.equations import Control, Plant, State
from disc_sim_ros.physics.kernels.integrator import STATE_SIZE, Ended, integrate
from disc_sim_ros.physics.kernels.jit import entry, inline, jit
from disc_sim_ros.physics.kernels.simd import element, where
from disc_sim_ros.physics.kernels.wind import WindData

# The columns of a row, in this order: a launch, and what else may differ from flight to flight.
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
_YAW = AT['yaw']
_FACTORS = AT['lift_factor']
_OFFSETS = AT['lift_offset']

_cos_sin_degrees = jit(rotation.cos_sin_degrees)
_quaternion_of_half_angles = inline(rotation.quaternion_of_half_angles)
_rotation_elements = inline(rotation.rotation_elements)
_rotated = inline(rotation.rotated)


@jit
def release(row: FloatArray) -> State:
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
def plant_of(row: FloatArray, plant: Plant) -> Plant:
    """Return the constants of a flight, or of a flight in each lane."""
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
    )


@jit
def fill_table(row: FloatArray, base: FloatArray, table: FloatArray) -> None:
    """Write the table of a flight, its coefficients scaled and shifted, to `table`."""
    for j in range(len(base)):
        table[j, 0] = base[j, 0]
        table[j, 4] = base[j, 4]
        for k in range(3):
            factor, offset = row[_FACTORS + k], row[_OFFSETS + k]
            table[j, 1 + k] = base[j, 1 + k] * factor + offset
            table[j, 5 + k] = base[j, 5 + k] * factor


@inline
def control_of(row: FloatArray, c: Control) -> Control:
    """Return the control inputs of a flight, or of a flight in each lane."""
    C_L, C_M, C_N = (
        element(row, _CONTROL),
        element(row, _CONTROL + 1),
        element(row, _CONTROL + 2),
    )
    return Control(C_L, C_M, C_N, c.L, c.M, c.N, c.axes)


@inline
def wind_of(row: FloatArray, wind: WindData) -> WindData:
    """Return the wind of a flight, or of a flight in each lane, as `Setup.wind_data` does."""
    X, Y, Z = element(row, _WIND), 0.0 - element(row, _WIND + 1), 0.0 - element(row, _WIND + 2)
    horizontal = math.sqrt(X * X + Y * Y)
    still = horizontal <= 0.0
    h = where(still, 1.0, horizontal)
    x_X, x_Y = where(still, 1.0, X / h), where(still, 0.0, Y / h)
    return WindData(X, Y, Z, wind.z0, wind.per_log, wind.W_20, x_X, x_Y)


@jit
def write_end(
    row: FloatArray,
    ended: Ended,
    i: int,
    status: IntArray,
    time: FloatArray,
    apex: FloatArray,
    drift: FloatArray,
    states: FloatArray,
) -> None:
    """Write how flight `i` ended into the arrays of a `Landings`."""
    status[i] = ended.status
    time[i] = ended.t
    apex[i] = 0.0 - ended.apex_Z
    c_yaw, s_yaw = _cos_sin_degrees(row[_YAW])
    drift[i] = s_yaw * ended.state.X - c_yaw * ended.state.Y
    for k in range(STATE_SIZE):
        states[i, k] = ended.state[k]


@entry
def fly_rows(
    rows: FloatArray,
    start: int,
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
    """Fly one row after the other, and fill the arrays of a `Landings` from `start` on."""
    no_samples = np.empty((0, 18))
    table = np.empty(base_table.shape)
    for i in range(len(rows)):
        row = rows[i]
        fill_table(row, base_table, table)
        ended = integrate(
            release(row),
            plant_of(row, plant),
            table,
            spin_terms,
            control_of(row, base_control),
            wind_of(row, wind),
            noise,
            step,
            duration,
            ground,
            0.0,
            no_samples,
        )
        write_end(row, ended, start + i, status, time, apex, drift, states)
