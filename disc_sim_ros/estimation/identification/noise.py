"""The noise of the instruments, from the residuals of a fit."""

from collections.abc import Collection, Mapping
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.identification import information
from disc_sim_ros.estimation.identification.observations import NOISE, UNITS
from disc_sim_ros.estimation.identification.problem import Problem

HOPELESS = 3.0  # margin of `refuse_misfit` with which a first fit is refused already
_NORMAL = 1.4826  # standard deviation over median of the absolute values, of normal numbers
_WORST_FIT = 30.0  # times the usual noise of an instrument: beyond, it is no flight of such a disc


def estimated_noise(problem: Problem, x: FloatArray, given: Collection[str]) -> dict[str, float]:
    """Return the noise of each instrument from the residuals, with an allowance for the fit.

    Residuals of a fit are smaller than the noise, because its parameters follow some of it.

    Args:
        problem: The problem.
        x: Its fitted parameters, shape (p,).
        given: Instruments whose noise was given and stays.
    """
    by_kind: dict[str, list[FloatArray]] = {}
    fitted = information.information(problem, x).fitted
    for k, throw in enumerate(problem.throws):
        here = problem.here(k, x)[np.newaxis]
        for o, r in zip(throw.observations, problem.predictions(k, here), strict=True):
            by_kind.setdefault(o.kind, []).append(r.ravel())
    count = sum(len(r) for every in by_kind.values() for r in every)
    factor = _NORMAL * math.sqrt(count / max(count - fitted, 1.0))
    return {
        kind: problem.noise[kind]
        if kind in given
        else max(factor * float(np.median(np.abs(np.concatenate(r)))), 1e-9)
        for kind, r in by_kind.items()
    }


def refuse_misfit(
    problem: Problem,
    estimated: Mapping[str, float],
    given: Collection[str],
    margin: float = 1.0,
) -> None:
    """Refuse measurements that no disc like the base disc gives.

    Raises:
        ConfigError: The residuals are far larger than the noise of any such instrument.
    """
    for kind, sigma in estimated.items():
        if kind not in given and sigma > margin * _WORST_FIT * NOISE[kind]:
            raise ConfigError(
                kind,
                f'{sigma:.3g} {UNITS[kind]}',
                f'the best fit of a disc like {problem.base.disc.name} leaves this residual; more '
                f'than {_WORST_FIT * NOISE[kind]:.3g} {UNITS[kind]} is another disc, another unit '
                'or no flight of a disc',
            )
