"""What an identification says: a table for a terminal, a disc file, a document for programs."""

from collections.abc import Sequence
from dataclasses import asdict
import math
from typing import Any

import numpy as np
import yaml

from disc_sim_ros.estimation.identification import coefficients, information
from disc_sim_ros.estimation.identification.coefficients import NAMES
from disc_sim_ros.estimation.identification.crossvalidation import LeftOut
from disc_sim_ros.estimation.identification.identify import Identification
from disc_sim_ros.estimation.identification.observations import UNITS
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.disc_file import disc_document
from disc_sim_ros.quantities import COEFFICIENTS
from disc_sim_ros.units import METRIC, System

_STRETCHED = 1.2  # factor of a standard error from which on the report names it
_GOOD = 0.1  # of the spread or of the value: what counts as known well
_OFFSETS = {'C_L0': 'lift_offset', 'C_D0': 'drag_offset', 'C_M0': 'pitching_offset'}


def text(result: Identification, left_out: Sequence[LeftOut], system: System = METRIC) -> str:
    """Return the result for a terminal, in a system of units."""
    problem = result.problem
    base = result.base.values
    lines = [
        f'{len(problem.throws)} throw{"s" if len(problem.throws) > 1 else ""}, '
        f'disc like {result.base.disc.name}'
        + ('; interrupted: the best so far' if result.interrupted else '')
    ]
    lines.append(f'  {"coefficient":<12} {"fitted":>11} {"error":>10} {"before":>11}')
    for name, value, error, before in zip(NAMES, result.values, result.errors, base, strict=True):
        known = f'{error:10.2g}' if math.isfinite(error) else f'{"held":>10}'
        lines.append(f'  {name:<12} {value:>11.5g} {known} {before:>11.5g}')
    shared = zip(problem.names, result.x, result.shared_errors, strict=False)
    for name, value, error in list(shared)[len(problem.free) :]:
        unit = 'm' if name.startswith('camera') else 'm/s'
        shown, within = system.number(value, unit), system.number(error, unit)
        lines.append(f'  {name:<12} {shown:>11.3g} {within:10.2g} {system.unit(unit):>11}')
    lines += [f'  left at the base: {one.reason}' for one in result.left_out]
    strongest = _strongest(result)
    if strongest:
        lines.append(f'  {strongest}')
    for kind in sorted({o.kind for throw in problem.throws for o in throw.observations}):
        rms, noise = (
            system.text(value, UNITS[kind], '.3g')
            for value in (result.rms(kind), problem.noise[kind])
        )
        lines.append(f'  residuals of {kind}: {rms} rms, noise taken as {noise}')
    if result.widening > 1.0:
        lines.append(
            f'  residuals are correlated in time: something is not modelled; standard errors are '
            f'{result.widening:.1f} times those of white noise'
        )
    else:
        lines += _pattern(result)
    wider = [
        f'{problem.names[i]} {factor:.1f} times'
        for i, factor in enumerate(result.stretches)
        if factor > _STRETCHED
    ]
    if wider:
        lines.append(
            '  standard errors are wider than the curvature at the best fit says, because values '
            f'far away fit nearly as well: {", ".join(wider)}'
        )
    for throw, miss in zip(problem.throws, left_out, strict=False):
        if miss.from_path is not None:
            off = system.text(miss.from_path, 'm')
            line = f'  without {throw.name}: its last point is missed by {off}'
            if miss.from_release is not None:
                off = system.text(miss.from_release, 'm')
                line += f', from its measured release by {off}'
            lines.append(line)
    for gauge in sorted({gauge for throw in problem.throws for gauge in throw.gauges}):
        lines.append(f'  {gauge}')
    if problem.turns_only:
        lines.append(
            '  a gyro alone: another solution may fit nearly as well, far outside the errors; '
            'measure a path, an attitude or a release too'
        )
    lines.append(f'  {verdict(result, left_out, system)}')
    return '\n'.join(lines)


def _pattern(result: Identification) -> list[str]:
    """Return a line about correlations too weak to widen errors and too strong for chance."""
    between = information.correlation(result.problem, result.x)
    if between.is_chance:
        return []
    return [
        f'  neighbouring residuals correlate by {between.rho:.2f}, white noise by '
        f'{between.chance:.2f} at random; the squares of {information.LAGS} lags sum to '
        f'{between.squares:.0f}, of white noise to at most {information.CHI_SQUARED:.0f}: '
        'something is not modelled, or another solution fits better than the one found'
    ]


def _strongest(result: Identification) -> str:
    """Return the strongest correlation of two coefficients in words; '' below 0.9."""
    n = len(result.problem.free)
    if n < 2:
        return ''
    correlation = np.abs(result.correlation[:n, :n] - np.eye(n))
    i, j = np.unravel_index(int(np.argmax(correlation)), correlation.shape)
    if correlation[i, j] < 0.9:
        return ''
    value = result.correlation[i, j]
    names = result.problem.names
    return f'{names[i]} and {names[j]} are correlated: {value:.3f}; together they are known better'


def verdict(result: Identification, left_out: Sequence[LeftOut], system: System = METRIC) -> str:
    """Return what the result is worth, in words."""
    spread = result.problem.prior.coefficients
    known = [
        name
        for name, error, s in zip(NAMES, result.errors, spread, strict=True)
        if math.isfinite(error) and error < _GOOD * s
    ]
    words = [
        f'{len(known)} of {len(NAMES)} coefficients are known ten times better than before'
        + (f': {", ".join(known)}' if known else '')
    ]
    misses = [miss.from_path for miss in left_out if miss.from_path is not None]
    if misses:
        off = system.text(float(np.mean(misses)), 'm')
        words.append(f'a throw that was not used is missed by {off} in the mean')
    if result.widening > 2.0:
        words.append('the model leaves a pattern in the residuals: trust paths more than numbers')
    return '; '.join(words)


def disc_of(result: Identification, name: str) -> Disc:
    """Return the identified disc."""
    described = f'{result.base.disc.name}, with coefficients identified from throws'
    return coefficients.disc_with(result.base, result.values, name, described)


def disc_file(result: Identification, name: str, provenance: Sequence[str]) -> str:
    """Return the identified disc as a disc file, with standard errors and provenance.

    Args:
        result: The identification.
        name: Of the disc.
        provenance: Lines on files, date, version and command, written as comments.
    """
    document = disc_document(disc_of(result, name))
    uncertain = {
        _OFFSETS[key]: float(f'{error:.3g}')
        for key, error in zip(NAMES, result.errors, strict=True)
        if key in _OFFSETS and math.isfinite(error)
    }
    if uncertain:
        document['uncertainty'] = uncertain
    lines = [f'# {line}' for line in provenance]
    lines += ['#', '# Identified, with one standard error:']
    for key, value, error in zip(NAMES, result.values, result.errors, strict=True):
        unit = f' {COEFFICIENTS[key].unit}' if COEFFICIENTS[key].unit else ''
        how = f'+- {error:.2g}' if math.isfinite(error) else 'held at the value of the base disc'
        lines.append(f'#   {key:<10} {value:.6g} {how}{unit}')
    lines += [f'#   {one.reason}' for one in result.left_out]
    body = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=100)
    return '\n'.join(lines) + '\n' + body


def document(result: Identification, left_out: Sequence[LeftOut]) -> dict[str, Any]:
    """Return the result for programs: numbers in SI units, null where there is none."""
    problem = result.problem
    shared = list(zip(problem.names, result.x, result.shared_errors, strict=False))
    return {
        'base': result.base.disc.name,
        'throws': [throw.name for throw in problem.throws],
        'interrupted': result.interrupted,
        'coefficients': {
            name: {'value': float(value), 'error': _number(error), 'before': float(before)}
            for name, value, error, before in zip(
                NAMES, result.values, result.errors, result.base.values, strict=True
            )
        },
        'shared': {
            name: {'value': float(value), 'error': float(error)}
            for name, value, error in shared[len(problem.free) :]
        },
        'names': list(problem.names),
        'correlation': result.correlation.tolist(),
        'noise': {
            kind: {'rms': result.rms(kind), 'taken': float(problem.noise[kind])}
            for kind in sorted({o.kind for throw in problem.throws for o in throw.observations})
        },
        'widening': result.widening,
        'stretches': {
            NAMES[i]: float(factor)
            for i, factor in zip(problem.free, result.stretches, strict=True)
        },
        'left_out': [one.reason for one in result.left_out],
        'miss_without_m': {
            throw.name: asdict(miss) for throw, miss in zip(problem.throws, left_out, strict=False)
        },
        'verdict': verdict(result, left_out),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
