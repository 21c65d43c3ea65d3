"""Flies one batch of a study: the work of every worker."""

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.studies.columns import ADVANCE_RATIO, CONTROL, LAUNCH, WIND
from disc_sim_ros.studies.study import Study
from disc_sim_ros.studies.tables import Columns


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
