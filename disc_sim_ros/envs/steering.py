"""What a policy of Steer-v0 sees and does; the environment and a node share these functions.

They take the numbers of nav_msgs/Odometry, so that a node that subscribes to `odom` computes the
bits of the environment.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.envs.components import Component, Float32Array, bounds, vector
from disc_sim_ros.physics.frames import flip
from disc_sim_ros.physics.kernels.rotation import rotated, rotation_elements

PERIOD = 0.05  # s from one action to the next
STEP = 0.01  # s, integration step
STEPS = round(PERIOD / STEP)
LARGEST = (0.05, 0.05, 0.005)  # of C_L, C_M, C_N

OBSERVATION = (
    *vector('to_target', 'm', 200.0, 'From the disc to the target'),
    *vector('velocity', 'm/s', 60.0, 'Velocity over the ground'),
    *vector('acceleration', 'm/s^2', 200.0, 'Mean acceleration since the last action'),
    *vector('up', '', 1.0, 'Unit vector out of the top of the disc'),
    *vector('turning', 'rad/s', 100.0, 'Angular velocity without the spin'),
    Component('spin', 'rad/s', -150.0, 150.0, 'Spin rate, clockwise from above positive'),
)
ACTION = tuple(
    Component(name, '', -1.0, 1.0, f'{symbol} as a share of {most:g}, {sign} positive')
    for name, symbol, most, sign in zip(
        ('roll', 'pitch', 'spin'),
        ('C_L', 'C_M', 'C_N'),
        LARGEST,
        ('right edge down', 'nose up', 'clockwise from above'),
        strict=True,
    )
)
_LOW, _HIGH = bounds(OBSERVATION)


def velocity(odometry: tuple[Any, ...]) -> FloatArray:
    """Return velocities over the ground in `map` [m/s], shape (3, n).

    Args:
        odometry: Numbers in the order of `frames.odometry`, each of shape (n,).
    """
    _, _, _, qx, qy, qz, qw, *uvw = odometry[:10]
    return np.stack(rotated(rotation_elements(qw, qx, qy, qz), tuple(uvw)))


def observations(
    odometry: tuple[Any, ...], before: FloatArray, targets: FloatArray
) -> tuple[Float32Array, FloatArray]:
    """Return what a policy sees of n discs, and their velocities.

    Args:
        odometry: Numbers in the order of `frames.odometry`, each of shape (n,).
        before: Velocities at the last action (at the release: the present ones), shape (3, n).
        targets: Points on the ground in `map` [m], shape (2, n).

    Returns:
        Observations as in OBSERVATION, within its bounds, shape (n, 16); velocities in `map`
        [m/s], shape (3, n).
    """
    x, y, z, qx, qy, qz, qw, u, v, w, p, q, r = odometry
    elements = rotation_elements(qw, qx, qy, qz)
    _, _, up_x, _, _, up_y, _, _, up_z = elements
    now = np.stack(rotated(elements, (u, v, w)))
    rows = np.empty((len(OBSERVATION), now.shape[1]))
    rows[0] = targets[0] - x
    rows[1] = targets[1] - y
    rows[2] = 0.0 - z
    rows[3:6] = now
    rows[6:9] = (now - before) / PERIOD
    rows[9], rows[10], rows[11] = up_x, up_y, up_z
    rows[12:15] = rotated(elements, (p, q, 0.0))
    rows[15] = flip(r)
    clipped: Float32Array = rows.T.astype(np.float32).clip(_LOW, _HIGH)
    return clipped, now


def controls(actions: ArrayLike) -> FloatArray:
    """Return C_L, C_M, C_N of actions, shape (n, 3); actions beyond -1 and 1 count as those."""
    shares: FloatArray = np.asarray(actions, dtype=float).clip(-1.0, 1.0) * LARGEST
    return shares
