"""One batch of an ensemble: what every worker does."""

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.studies.columns import ADVANCE_RATIO, CONTROL, LAUNCH, WIND
from disc_sim_ros.studies.study import Study
from disc_sim_ros.studies.tables import Columns

STEPS = (0.02, 0.01, 0.005, 0.002, 0.001)  # s
TURN = 1.3  # rad of nutation in a step


def good_step(setup: Setup, spin: float) -> float:
    """Return the longest of `STEPS` that follows the nutation of a disc.

    A turn of less than 1.3 rad in a step leaves landings right to 1 mm.

    Args:
        setup: Of the disc.
        spin: The fastest [rad/s].
    """
    nutation = abs(spin) * setup.disc.inertia_axial / setup.disc.inertia_diametral
    return next((step for step in STEPS if step * nutation < TURN), STEPS[-1])


def fly_batch(question: Study, start: int, stop: int, threads: int | None) -> Columns:
    """Fly the flights `start` to `stop` of a question.

    Args:
        question: What is flown.
        start: First flight.
        stop: The flight after the last.
        threads: Threads to fly in; None for one a core.

    Returns:
        Columns of shape (stop - start,): what differs, and how the flights ended, under names
        with units.
    """
    values = question.values(start, stop)
    seeds = question.gust_seeds(start, stop)
    ended = fly_many(
        kernel_values(question, values),
        question.setup,
        control=question.control,
        seeds=seeds,
        duration=question.duration,
        ground=question.ground,
        threads=threads,
    )
    columns: Columns = {'index': np.arange(start, stop)}
    columns |= {q.key: values[q.name] for q in question.varied}
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


def kernel_values(question: Study, values: dict[str, FloatArray]) -> dict[str, float | FloatArray]:
    """Return what `fly_many` takes: every value that differs, and the fixed ones of a throw."""
    found: dict[str, float | FloatArray] = {
        name: question.fixed(name) for name in (*LAUNCH, *WIND, *CONTROL)
    }
    found |= values
    ratio = found.pop(ADVANCE_RATIO, question.advance_ratio)
    if ratio is not None:
        found['spin'] = 2.0 * found['speed'] * ratio / question.setup.disc.diameter
    return found
