"""What `identify` makes of sessions in which something is not as it assumes.

Five throws of one disc, positions to 2 cm and gyro to 0.02 rad/s at 60 Hz. One thing at a time is
wrong: the drag law, the height of a drone, a steady air. For each the table states how many
standard errors each fitted coefficient lies from the truth, and whether the report warns.

python benchmarks/identification_bias.py
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
import sys

import numpy as np

from disc_sim_ros.estimation.identification.coefficients import NAMES, base_of
from disc_sim_ros.estimation.identification.crossvalidation import left_out_misses
from disc_sim_ros.estimation.identification.identify import Identification, identify
from disc_sim_ros.estimation.identification.observations import CAMERA, GYRO, POSITION, Camera
from disc_sim_ros.estimation.identification.throws import Throw
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from estimation import synthetic_sessions

BASE = Setup(disc=load_disc('ultrastar'), step=5e-4)
COUNT, SEED = 5, 11


def session(setup: Setup, kinds: tuple[str, ...] = (POSITION, GYRO)) -> list[Throw]:
    """Return five throws of the disc of a setup."""
    generator = np.random.default_rng(SEED)
    values = base_of(setup).values
    return synthetic_sessions.session(values, setup, kinds, generator, count=COUNT)


def as_assumed() -> list[Throw]:
    """Return throws in which everything is as `identify` assumes."""
    return session(BASE)


def drag_law() -> list[Throw]:
    """Return throws of a disc whose drag rises sooner than that of any disc like the base.

    Above its value at 0 the drag is multiplied by the root of |alpha| / 10 degrees: it is right at
    10 degrees and too large below.
    """
    table = BASE.disc.table
    if table is None:
        raise TypeError(BASE.disc.name)
    curves = table.coefficients.copy()
    at_zero = np.interp(0.0, table.alpha_deg, curves[:, 1])
    curves[:, 1] = at_zero + (curves[:, 1] - at_zero) * np.sqrt(np.abs(table.alpha_deg) / 10.0)
    bent = replace(table, coefficients=curves)
    return session(replace(BASE, disc=replace(BASE.disc, table=bent)))


def drone_height() -> list[Throw]:
    """Return throws filmed from 100 m, of which `identify` is told 90 m."""
    throws = session(BASE, (CAMERA, GYRO))
    return [
        replace(
            throw,
            observations=tuple(
                replace(o, height=90.0) if isinstance(o, Camera) else o for o in throw.observations
            ),
        )
        for throw in throws
    ]


def drone() -> list[Throw]:
    """Return throws filmed from 100 m, as `identify` is told."""
    return session(BASE, (CAMERA, GYRO))


def gusts() -> list[Throw]:
    """Return throws of which each has a wind of its own, 1 m/s about the mean in x and in y."""
    generator = np.random.default_rng(SEED)
    throws = []
    for k in range(COUNT):
        x, y = generator.standard_normal(2)
        throws.append(session(replace(BASE, wind=Wind(mean=(x, y, 0.0))))[k])
    return throws


CASES: dict[str, Callable[[], list[Throw]]] = {
    'as assumed': as_assumed,
    'drag rises sooner': drag_law,
    'drone at 100 m, as told': drone,
    'drone at 100 m, told 90 m': drone_height,
    'each throw has its own wind, 1 m/s': gusts,
}


def row(name: str, result: Identification) -> str:
    """Return a row of the table."""
    z = (result.values - base_of(BASE).values) / result.errors
    worst = int(np.nanargmax(np.abs(z)))
    shift = (result.values - base_of(BASE).values)[worst]
    misses = [m.from_path for m in left_out_misses(result) if m.from_path is not None]
    noise = ', '.join(f'{kind} {sigma:.3g}' for kind, sigma in sorted(noise_of(result).items()))
    return (
        f'| {name} | {np.nanmean(np.abs(z) < 3.0):.0%} of {np.isfinite(z).sum()} | '
        f'{NAMES[worst]} {shift:+.2g}, {z[worst]:+.1f} | {noise} | {result.widening:.1f} | '
        f'{np.mean(misses):.2f} |'
    )


def noise_of(result: Identification) -> dict[str, float]:
    """Return the estimated noise of the instruments that measured."""
    kinds = {o.kind for throw in result.problem.throws for o in throw.observations}
    return {kind: result.problem.noise[kind] for kind in kinds}


def main() -> None:
    """Print the table."""
    print('| wrong | within 3 errors | farthest: shift, in errors | noise | widened | missed, m |')
    print('|---|---|---|---|---|---|')
    for name, made in CASES.items():
        print(row(name, identify(made(), BASE)), flush=True)


if __name__ == '__main__':
    main()
