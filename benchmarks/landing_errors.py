"""Measure the landing errors of error control and fixed steps over many throws of two discs.

The throws are drawn with a fixed seed: 10 to 25 m/s, pitch -5 to 25 degrees, roll within 30
degrees, spin 20 to 60 rad/s of either sign, with and without a wobble of up to 2 rad/s. The error
is the distance of the landing point from that of the same throw in steps of 0.1 ms.

usage: benchmarks/landing_errors.py
"""

import numpy as np

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.integrator import LANDED

COUNT = 400  # throws with a wobble, and as many without
FINE = 1e-4  # s
STEPS = (None, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2)  # s; None: error control
DISCS = ('frisbee_as_printed', 'frisbee')


def main() -> None:
    """Print the median and the largest error for each disc, wobble and step."""
    print('disc                 wobble  step, ms   median, mm   largest, mm')
    for name in DISCS:
        for wobble in (0.0, 2.0):
            launches = throws(wobble)
            fine = landings(name, launches, FINE)
            for step in STEPS:
                errors = np.linalg.norm(landings(name, launches, step) - fine, axis=1) * 1e3
                steps = f'{step * 1e3:g}' if step else 'control'
                print(f'{name:20s} {wobble:6g} {steps:>9s} {np.median(errors):12.6f} '
                      f'{errors.max():13.6f}')  # fmt: skip


def throws(wobble: float) -> dict[str, np.ndarray]:
    """Return launches with transverse rates within `wobble` [rad/s]."""
    rng = np.random.default_rng(17)
    sign = rng.choice((-1.0, 1.0), COUNT)
    return {
        'speed': rng.uniform(10.0, 25.0, COUNT),
        'pitch': rng.uniform(-5.0, 25.0, COUNT),
        'roll': rng.uniform(-30.0, 30.0, COUNT),
        'spin': sign * rng.uniform(20.0, 60.0, COUNT),
        'roll_rate': rng.uniform(-wobble, wobble, COUNT),
        'pitch_rate': rng.uniform(-wobble, wobble, COUNT),
    }


def landings(name: str, launches: dict[str, np.ndarray], step: float | None) -> np.ndarray:
    """Return the landing points [m] of the launches, shape (COUNT, 2)."""
    ends = fly_many(launches, Setup(disc=disc_file.load_disc(name), step=step), duration=60.0)
    if not (ends.status == LANDED).all():
        raise SystemExit(f'{name}, {step} s: a throw did not land, its error is not defined')
    return np.column_stack((ends.x, ends.y))


if __name__ == '__main__':
    main()
