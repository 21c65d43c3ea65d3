"""Wobble and spin decay of a disc from a gyro in its plastic, measured or simulated alike."""

import csv
import math
from pathlib import Path

import numpy as np

from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.environment import Air
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch

# Of the logs: 94.9 kPa and 26 to 35 C (their header). The airspeed was not measured; a throw over
# the field is released at 14 to 21 m/s.
DENSITY = 1.09  # kg/m^3
SPEEDS = (14.0, 17.5, 21.0)  # m/s
TURN = 10  # samples at 100 Hz: about one turn, over which the wobble is averaged


def logs(path: Path) -> dict[str, np.ndarray]:
    """Return columns t [s], w_x, w_y, w_z [rad/s] of each throw, shape (n, 4)."""
    lines = [x for x in path.read_text(encoding='utf-8').splitlines() if not x.startswith('#')]
    throws: dict[str, list[list[float]]] = {}
    for name, *numbers in list(csv.reader(lines))[1:]:
        throws.setdefault(name, []).append([float(x) for x in numbers])
    return {name: np.array(rows) for name, rows in throws.items()}


def spin_decay(log: np.ndarray) -> float:
    """Return the share of the spin that is lost in a second, by a fit of its logarithm [1/s]."""
    return -float(np.polyfit(log[:, 0], np.log(np.abs(log[:, 3])), 1)[0])


def wobble_decay(log: np.ndarray) -> float:
    """Return 1 / (time until the transverse rate, rms over a turn, has fallen to 1/e) [1/s]."""
    squares = log[:, 1] ** 2 + log[:, 2] ** 2
    rms = np.sqrt(np.convolve(squares, np.full(TURN, 1.0 / TURN), mode='valid'))
    below = np.flatnonzero(rms < rms[0] / math.e)
    return 1.0 / float(log[below[0], 0]) if below.size else 0.0


def simulated(disc: Disc, log: np.ndarray, speed: float) -> np.ndarray:
    """Return the log of a simulated throw with the spin and the wobble of a measured one."""
    launch = Launch(
        speed=speed,
        pitch=10.0,
        spin=float(log[0, 3]),
        roll_rate=float(log[0, 1]),
        pitch_rate=float(log[0, 2]),
        height=50.0,
    )
    t = fly(
        launch,
        Setup(disc=disc, air=Air(density=DENSITY)),
        duration=float(log[-1, 0]),
        ground=False,
        sample_rate=100.0,
    ).trajectory
    c, s = np.cos(t.spin_angle), np.sin(t.spin_angle)
    p, q, r = t.rates.T
    return np.column_stack([t.t, c * p + s * q, c * q - s * p, r])  # axes fixed in the disc


def damping_of(log: np.ndarray, disc: Disc, speed: float) -> tuple[float, float]:
    """Return the damping of roll and pitch, and of the spin, that the decays of a log mean.

    With moment q S c C w c / (2 V), a rate w decays at rho V S c^2 C / (4 I).
    """
    scale = DENSITY * speed * disc.area * disc.diameter**2 / 4.0
    wobble, spin = wobble_decay(log), spin_decay(log)
    return -wobble * disc.inertia_diametral / scale, -spin * disc.inertia_axial / scale


def wobble_turns(log: np.ndarray) -> float:
    """Return how often the wobble turns in the axes of the disc for each turn of the disc.

    The transverse rate as a complex number has its largest component there, over the angle by
    which the disc has turned.
    """
    spin = log[:, 3]
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (spin[1:] + spin[:-1]) * np.diff(log[:, 0]))])
    transverse = log[:, 1] + 1j * log[:, 2]
    turns = np.linspace(0.5, 1.5, 1001)  # not 0: the offset of the gyro
    power = np.abs(np.exp(-1j * np.outer(turns, turned)) @ transverse)
    return float(turns[np.argmax(power)])
