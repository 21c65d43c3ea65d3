"""An optimum as text, as a JSON document, and as the `fly` command that repeats it."""

from dataclasses import replace
import math
import shlex
from typing import Any

import numpy as np

from disc_sim_ros.physics import theory
from disc_sim_ros.physics.flight import Flight, Setup, fly
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.studies.columns import CONTROL, LAUNCH, WIND, quantity
from disc_sim_ros.studies.optimise import ACCURACY, Optimum, slack
from disc_sim_ros.studies.study import Study, study_document
from disc_sim_ros.units import METRIC, System

WHAT = {'range': ('range', 'm'), 'time': ('time of flight', 's'),
         'accuracy': ('distance from the target', 'm')}  # fmt: skip
_FLAGS = {'angle_of_attack': '--alpha'}


def still_launch(study: Study) -> Launch:
    """Return the launch of a study without scatter; its spin follows from the advance ratio."""
    launch, ratio = study.launch, study.advance_ratio
    if ratio is None:
        return launch
    spin = theory.spin_rate(ratio, study.setup.disc.diameter, launch.speed)
    return replace(launch, spin=spin)


def still_flight(optimum: Optimum, sample_rate: float = 0.0) -> Flight:
    """Return the flight of an optimum without scatter, as `fly` computes it."""
    study = optimum.study
    return fly(
        still_launch(study),
        study.setup,
        control=study.control,
        duration=study.duration,
        sample_rate=sample_rate,
    )


def optimum_text(optimum: Optimum, command: str, system: System = METRIC) -> str:
    """Return an optimum as a few lines of text.

    Args:
        optimum: The optimum.
        command: The command that repeats its flight.
        system: Units of the text.
    """
    problem, flight, text = optimum.problem, still_flight(optimum), system.text
    what, unit = WHAT[problem.goal]
    aim = 'least' if problem.goal == ACCURACY else 'greatest'
    statistic = statistic_of(optimum)
    values = ', '.join(named_value(name, value, system) for name, value in optimum.launch.items())
    x, y, _ = (system.number(value, 'm') for value in flight.position)
    lines = [
        f'{problem.study.setup.disc.name}: {aim} {statistic}{what}',
        f'  launch   {values}',
        f'  flight   {text(flight.range, "m")}, x {x:.2f}, y {y:.2f} {system.length}, in '
        f'{flight.time:.2f} s, apex {text(flight.apex, "m")}'
        + (f', {text(_miss(optimum, flight), "m")} from the target' if problem.target else ''),
    ]
    if problem.scatters:
        spread = ', '.join(
            f'{name} ± {_shown(law.sd, name, system)}'
            for name, law in problem.study.scatter.items()
            if hasattr(law, 'sd')
        )
        r = system.number(optimum.results, unit)
        lines += [
            f'  scatter  {spread or "gusts"}: {len(r)} throws',
            f'  result   {what}: mean {r.mean():.2f}, sd {r.std(ddof=1):.2f}, 10 % below '
            f'{np.percentile(r, 10):.2f}, 90 % below {np.percentile(r, 90):.2f} '
            f'{system.unit(unit)}',
        ]
    flat = ', '.join(
        f'{name} {_bare(low, name, system)} to {_bare(high, name, system)}'
        for name, (low, high) in optimum.flat.items()
    )
    worse = text(slack(problem, optimum.value), unit, '.2g')
    # Several at an end together are worse than that.
    alone = ', one changed alone' if len(optimum.flat) > 1 else ''
    lines.append(f'  flat     {worse} worse at most{alone}: {flat}')
    if optimum.at_limit:
        lines.append(f'  limits   hold {" and ".join(optimum.at_limit)}')
    lines += [f'  tried    {optimum.launches} launches', f'  again    {command}']
    return '\n'.join(lines)


def optimum_document(optimum: Optimum, command: str) -> dict[str, Any]:
    """Return an optimum as values for JSON; keys carry units."""
    problem, flight = optimum.problem, still_flight(optimum)
    r = optimum.results
    return {
        'for': problem.goal,
        'target_m': problem.target,
        'percentile': problem.percentile,
        'limits': {quantity('', n).key: list(span) for n, span in problem.limits.items()},
        'launch': {quantity('', n).key: value for n, value in optimum.launch.items()},
        'value': optimum.value,
        'flight': {
            'range_m': flight.range,
            'position_m': flight.position.tolist(),
            'flight_time_s': flight.time,
            'apex_m': flight.apex,
        },
        'throws': len(r),
        'mean': float(r.mean()),
        'sd': float(r.std(ddof=1)) if len(r) > 1 else 0.0,
        'flat': {quantity('', n).key: list(span) for n, span in optimum.flat.items()},
        'flat_slack': optimum.slack,
        'at_limit': list(optimum.at_limit),
        'launches_tried': optimum.launches,
        'command': command,
        'question': study_document(optimum.study),  # this key is as in 0.1: programs read it
    }


def fly_command(optimum: Optimum, disc: str) -> str:
    """Return the `fly` command that repeats the flight of an optimum, without scatter.

    Args:
        optimum: The optimum.
        disc: Name or file of the disc, as for `fly --disc`.
    """
    study = optimum.study
    setup, usual = study.setup, Setup(disc=study.setup.disc)
    words = ['fly']

    def add(flag: str, *values: object, default: object = None) -> None:
        if values != (default,):
            words.extend(
                [flag, *(f'{v:.12g}' if isinstance(v, float) else str(v) for v in values)]
            )

    add('--disc', disc, default='frisbee')
    for name in ('model', 'aero', 'moment_axes'):
        add(f'--{name.replace("_", "-")}', getattr(setup, name), default=getattr(usual, name))
    release = still_launch(study)
    for name in LAUNCH:
        flag = _FLAGS.get(name, f'--{name.replace("_", "-")}')
        add(flag, getattr(release, name), default=getattr(Launch(), name))
    for flag, names in (('--control', CONTROL), ('--wind', WIND)):
        values = [study.fixed(name) + 0.0 for name in names]
        if any(values):
            add(flag, *values)
    if setup.wind.turbulence > 0.0:
        add('--turbulence', setup.wind.turbulence)
        add('--seed', setup.wind.seed)
    add('--air-density', setup.air.density, default=usual.air.density)
    add('--gravity', setup.air.gravity, default=usual.air.gravity)
    add('--step', setup.step, default=usual.step)
    add('--duration', study.duration, default=60.0)
    return shlex.join(words)


def _miss(optimum: Optimum, flight: Flight) -> float:
    x, y = optimum.problem.fixed_target
    return math.hypot(flight.position[0] - x, flight.position[1] - y)


def statistic_of(optimum: Optimum) -> str:
    """Return the optimised statistic of the throws, as words before the name of the result."""
    if not optimum.problem.scatters:
        return ''
    percentile = optimum.problem.percentile
    return 'mean ' if percentile is None else f'{percentile:g} % percentile of the '


def named_value(name: str, value: float, system: System = METRIC) -> str:
    """Return a value with its name and unit."""
    number = _shown(value, name, system, '.6g')
    return f'{name.replace("_", " ")} {number}'.strip().replace(' °', '°')


def _shown(value: float, name: str, system: System, form: str = 'g') -> str:
    return system.text(value, quantity('', name).short_unit, form)


def _bare(value: float, name: str, system: System) -> str:
    return f'{system.number(value, quantity("", name).short_unit):.4g}'
