"""A question as values that JSON knows: what a result needs to be repeated, and to be resumed."""

from collections.abc import Mapping
from typing import Any

from disc_sim_ros import __version__
from disc_sim_ros.analysis.ensembles.quantities import ADVANCE_RATIO, CONTROL, LAUNCH, WIND
from disc_sim_ros.analysis.ensembles.question import Question
from disc_sim_ros.analysis.ensembles.scatter import Normal
from disc_sim_ros.core import catalogue
from disc_sim_ros.core.errors import brief


def document(question: Question) -> dict[str, Any]:
    """Return all that decides the flights of a question; the disc as a disc file holds it.

    Angles are in degrees, all else in SI units; wind is where the air moves to, in `map` axes.
    """
    setup = question.setup
    names = (*LAUNCH, *WIND, *CONTROL)
    fixed = {name: question.fixed(name) for name in names}
    if question.advance_ratio is not None or ADVANCE_RATIO in question.vary:
        fixed[ADVANCE_RATIO] = question.fixed(ADVANCE_RATIO)
        del fixed['spin']
    return {
        'version': __version__,
        'disc': setup.disc.name,
        'disc_file': catalogue.document(setup.disc),
        'model': setup.model,
        'aero': setup.aero or setup.disc.aero,
        'moment_axes': setup.moment_axes,
        'air_density': setup.air.density,
        'gravity': setup.air.gravity,
        'roughness_length': setup.wind.roughness_length,
        'reference_height': setup.wind.reference_height,
        'turbulence': setup.wind.turbulence,
        'gust_seed': setup.wind.seed,
        'gust_seeds': question.gusts,
        'step': setup.step,
        'duration': question.duration,
        'ground': question.ground,
        'fixed': fixed,
        'vary': {name: [float(x) for x in values] for name, values in question.vary.items()},
        'scatter': {
            name: {'normal': [law.mean, law.sd]}
            if isinstance(law, Normal)
            else {'uniform': [law.low, law.high]}
            for name, law in question.scatter.items()
        },
        'correlations': {f'{a},{b}': r for (a, b), r in question.correlations.items()},
        'count': question.count,
        'seed': question.seed,
        'sampling': question.sampling,
    }


def differences(old: Mapping[str, Any], new: Mapping[str, Any], prefix: str = '') -> list[str]:
    """Return what differs between two documents, each as 'name OLD, now NEW'."""
    found: list[str] = []
    for key in dict.fromkeys([*old, *new]):
        before, after = old.get(key), new.get(key)
        if isinstance(before, dict) and isinstance(after, dict):
            within = '' if key == 'fixed' else f'{key} '
            found += differences(before, after, f'{prefix}{within}')
        elif before != after:
            found.append(f'{prefix}{key} {_shown(before)}, now {_shown(after)}')
    return found


def _shown(value: object) -> str:
    return 'not given' if value is None else brief(value)
