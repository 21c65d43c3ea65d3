"""Flies one batch of a study: the work of every worker."""

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.rk4 import STABLE
from disc_sim_ros.studies.columns import ADVANCE_RATIO, CONTROL, LAUNCH, WIND
from disc_sim_ros.studies.study import Study
from disc_sim_ros.studies.tables import Columns

# s; the shorter ones for discs that turn fast, or whose damping or pitching is fast
STEPS = (0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)
SHORTEST_FOR_NUTATION = 0.001  # s; accurate enough for any spin
STABLE_SHARE = 0.5  # of the longest step that stays bounded
TURN = 1.3  # rad, greatest nutation angle per step
TURN_WEAK = 0.5  # rad, the same of a disc whose wobble lasts for a second or more
WEAK_DAMPING = 0.5  # of C_Lp and C_Mq; the paper prints 1.3 and 1.4, real discs have 0.1


def good_step(setup: Setup, spin: float, fastest: float = 0.0) -> float:
    """Return the longest of `STEPS` that resolves the motion of a disc [s].

    With a nutation of less than `TURN` per step landings are accurate to 1 mm. A wobble that
    damping hardly reduces adds up its error over the flight, so that weakly damped discs need
    `TURN_WEAK`. Where 1 ms is too long for the fastest rate of any flight, the step is as much
    shorter as the integration needs to stay bounded.

    Args:
        setup: The setup with the disc.
        spin: The greatest spin [rad/s].
        fastest: The greatest rate of nutation, damping or pitching in any flight [1/s], see
            `Study.fastest_rate`.
    """
    nutation = abs(spin) * setup.disc.inertia_axial / setup.disc.inertia_diametral
    is_weak = min(-setup.disc.C_Lp, -setup.disc.C_Mq) < WEAK_DAMPING
    turn = TURN_WEAK if is_weak else TURN
    fitting = (
        step
        for step in STEPS
        if (step * nutation < turn or step <= SHORTEST_FOR_NUTATION)
        and step * fastest <= STABLE_SHARE * STABLE
    )
    return next(fitting, STEPS[-1])


def fly_batch(study: Study, start: int, stop: int, threads: int | None) -> Columns:
    """Fly the flights `start` to `stop` of a study.

    Args:
        study: The flights.
        start: First flight.
        stop: The flight after the last.
        threads: Threads to use; None for one per core.

    Returns:
        Columns of shape (stop - start,), named with units: the quantities that differ, and the
        state at the end of each flight.
    """
    values = study.values(start, stop)
    seeds = study.gust_seeds(start, stop)
    ended = fly_many(
        kernel_values(study, values),
        study.setup,
        control=study.control,
        seeds=seeds,
        duration=study.duration,
        ground=study.ground,
        threads=threads,
    )
    columns: Columns = {'index': np.arange(start, stop)}
    columns |= {q.key: values[q.name] for q in study.varied}
    if seeds is not None:
        columns['gust_seed'] = seeds
    return columns | {
        'status': ended.status.astype(np.int8),
        'time_s': ended.time,
        'x_m': ended.x,
        'y_m': ended.y,
        'z_m': ended.z,
        'range_m': ended.range,
        'drift_m': ended.drift,
        'apex_m': ended.apex,
        'end_speed_m_s': ended.end_speed,
        'end_spin_rad_s': ended.end_spin,
    }


def kernel_values(study: Study, values: dict[str, FloatArray]) -> dict[str, float | FloatArray]:
    """Return the arguments of `fly_many`: the quantities that differ, and the fixed ones."""
    arguments: dict[str, float | FloatArray] = {
        name: study.fixed(name) for name in (*LAUNCH, *WIND, *CONTROL)
    }
    arguments |= values
    ratio = arguments.pop(ADVANCE_RATIO, study.advance_ratio)
    if ratio is not None:
        arguments['spin'] = 2.0 * arguments['speed'] * ratio / study.setup.disc.diameter
    return arguments
