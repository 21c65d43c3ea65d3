"""The flags of ensembles, which `sweep` and `optimise` share."""

import argparse
from collections.abc import Iterable, Mapping, Sequence
import math
import sys

from disc_sim_ros.cli import flags as throw_flags
from disc_sim_ros.cli.arguments import Parser, add_quantity, range_text
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import ensemble, flight
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.quantities import LARGEST_SEED, STUDY, VARIED, WIND
from disc_sim_ros.studies.columns import quantity
from disc_sim_ros.studies.scatter import Normal, Uniform
from disc_sim_ros.validation import Quantity

MOST_VALUES = 100_000  # of one grid quantity
_FORMS = 'give NAME=START:STOP:STEP, NAME=START:STOP/N or NAME=A,B,C'


def names_text() -> str:
    """Return the names of all quantities with their units, for the end of a help page."""
    names = [f'{q.name} ({q.unit})' if q.unit else q.name for q in VARIED.values()]
    return f'NAME is one of {", ".join(names)}.'


def grids(texts: Iterable[str]) -> dict[str, tuple[float, ...]]:
    """Return the values of each quantity of `--vary`.

    Raises:
        ConfigError: A name twice, an empty grid, or a text in another form.
    """
    values: dict[str, tuple[float, ...]] = {}
    for text in texts:
        q, value = _split('--vary', text, _FORMS)
        if q.name in values:
            raise ConfigError('--vary', text, f'{q.name} is varied twice')
        values[q.name] = _grid_values(text, value)
    return values


def laws(
    normal: Iterable[str],
    uniform: Iterable[str],
    scatter: Iterable[str],
    disc: Mapping[str, float] | None = None,
) -> dict[str, Normal | Uniform]:
    """Return the distribution of each quantity of `--normal`, `--uniform` and `--scatter`.

    Args:
        normal: Values of this flag.
        uniform: Values of this flag.
        scatter: Values of this flag.
        disc: Of `--scatter disc`: the uncertainty of the disc.

    Raises:
        ConfigError: A name twice, or numbers that define no such distribution.
    """
    distributions: dict[str, Normal | Uniform] = {
        name: Normal(sd) for name, sd in (disc or {}).items()
    }
    for flag, form, texts in (
        ('--normal', 'NAME=MEAN,SD', normal),
        ('--uniform', 'NAME=LOW,HIGH', uniform),
        ('--scatter', 'NAME=SD', scatter),
    ):
        for text in texts:
            q, value = _split(flag, text, f'give {form}')
            if q.name in distributions:
                raise ConfigError(flag, text, f'{q.name} scatters twice')
            numbers = _numbers(flag, text, value, form.count(',') + 1, form)
            try:
                if flag == '--uniform':
                    distributions[q.name] = Uniform(*numbers)
                else:
                    distributions[q.name] = Normal(numbers[-1], *numbers[:-1])
            except ConfigError as error:
                raise ConfigError(flag, text, f'{error.thing}: {error.allowed}') from None
    return distributions


def pairs(texts: Iterable[str]) -> dict[tuple[str, str], float]:
    """Return the correlations of `--correlation A,B=R`.

    Raises:
        ConfigError: A text in another form, or a pair twice.
    """
    correlations: dict[tuple[str, str], float] = {}
    for text in texts:
        names, _, value = text.partition('=')
        both = names.split(',')
        if len(both) != 2:
            raise ConfigError('--correlation', text, 'give A,B=R with two names')
        a, b = sorted(quantity('--correlation', name).name for name in both)
        if (a, b) in correlations:
            raise ConfigError('--correlation', text, 'the pair is given twice')
        correlations[a, b] = _numbers('--correlation', text, value, 1, 'A,B=R')[0]
    return correlations


def ranges(flag: str, texts: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Return the ranges of `--limit NAME=LOW:HIGH`.

    Raises:
        ConfigError: A name twice, or a range that is empty or too wide.
    """
    limits: dict[str, tuple[float, float]] = {}
    for text in texts:
        q, value = _split(flag, text, 'give NAME=LOW:HIGH')
        low, high = _numbers(flag, text, value.replace(':', ','), 2, 'NAME=LOW:HIGH')
        if q.name in limits:
            raise ConfigError(flag, text, f'{q.name} is limited twice')
        if not q.lowest <= low <= high <= q.highest:
            raise ConfigError(flag, text, f'{range_text(q)}, the lower first')
        limits[q.name] = (low, high)
    return limits


def add_throw(p: Parser, *, ground: bool = True) -> None:
    """Add the flags of a throw.

    Args:
        p: A parser with `conflict_handler='resolve'`.
        ground: Also add `--no-ground`.
    """
    throw_flags.add_disc(p)
    throw_flags.add_launch(p)
    group = throw_flags.add_air(p, 'air, control inputs and end of the flight')
    throw_flags.add_step(group)
    throw_flags.add_duration(group)
    if ground:
        throw_flags.add_no_ground(group)


def add_seed(group: argparse._ActionsContainer, text: str) -> None:
    """Add `--seed`."""
    seeds = WIND['gust_seed'].within(highest=LARGEST_SEED + 1 - 2**31)  # each sample has its own
    add_quantity(group, '--seed', seeds, dest='seed', text=text)


def add_workers(group: argparse._ActionsContainer) -> None:
    """Add the flags of the executor."""
    group.add_argument(
        '--executor',
        default='threads',
        metavar='threads|processes|dask[=ADDRESS]',
        help='compute the flights in threads, in processes, in a Dask cluster on this machine or '
        'in the cluster whose scheduler is at ADDRESS; the flights are the same',
    )
    text = 'threads or processes (default: one for each core)'
    add_quantity(group, '--workers', STUDY['workers'], text=text, default=argparse.SUPPRESS)


def thrown(chosen: argparse.Namespace) -> tuple[Launch, flight.Setup, float | None]:
    """Return the launch, the setup and the advance ratio, or None.

    Raises:
        ConfigError: As of `throw_flags.thrown`.
    """
    release, setup = throw_flags.thrown(chosen)
    ratio = getattr(chosen, 'advance_ratio', None)
    return release, setup, ratio if ratio is None else ratio * throw_flags.sense(chosen)


def check_given(
    arguments: Sequence[str],
    vary: Mapping[str, object],
    scatter: Mapping[str, Normal | Uniform],
) -> None:
    """Refuse a flag that fixes a quantity which another flag varies.

    Raises:
        ConfigError: There is such a flag.
    """
    flags = {word.partition('=')[0] for word in arguments if word.startswith('--')}
    around = {n for n, law in scatter.items() if isinstance(law, Normal) and law.mean is None}
    for name in [*vary, *(n for n in scatter if n not in around)]:
        flag = throw_flags.LAUNCH_FLAGS.get(name)
        if flag in flags:
            allowed = f'{name} differs from flight to flight; give one of the two'
            raise ConfigError(flag, 'a fixed value', allowed)
    for name, other in (('spin', '--advance-ratio'), ('advance_ratio', '--spin')):
        if (name in vary or name in scatter) and other in flags:
            raise ConfigError(other, 'a fixed value', f'{name} gives it; give one of the two')


def add_list(
    group: argparse._ActionsContainer, flag: str, metavar: str, text: str, dest: str = ''
) -> None:
    """Add a flag that may be given several times; `dest` as of `add_argument`."""
    group.add_argument(
        flag,
        dest=dest or flag.removeprefix('--'),
        action='append',
        default=argparse.SUPPRESS,
        metavar=metavar,
        help=f'{text}; may be given several times',
    )


def listed(chosen: argparse.Namespace, name: str) -> list[str]:
    """Return the values of a flag of `add_list`."""
    values: list[str] = getattr(chosen, name, [])
    return values


def _split(flag: str, text: str, form: str) -> tuple[Quantity, str]:
    name, equals, value = text.partition('=')
    if not equals:
        raise ConfigError(flag, text, form)
    return quantity(flag, name), value


def _grid_values(text: str, value: str) -> tuple[float, ...]:
    if ':' not in value:
        return _numbers('--vary', text, value, value.count(',') + 1, '')
    span, by_count, n_text = value.partition('/')
    parts = span.split(':')
    if len(parts) != (2 if by_count else 3):
        raise ConfigError('--vary', text, _FORMS)
    start, stop, *step = _numbers('--vary', text, ','.join(parts), len(parts), '')
    if by_count:
        if not n_text.isdecimal() or not 1 <= int(n_text) <= MOST_VALUES:
            raise ConfigError('--vary', text, f'N is a whole number from 1 to {MOST_VALUES}')
        n = int(n_text)
        if n == 1 and start != stop:
            raise ConfigError('--vary', text, 'one value has no START and STOP; give N from 2')
        return tuple(start + (stop - start) * (i / max(n - 1, 1)) for i in range(n))
    if step[0] == 0.0 or (stop - start) / step[0] < 0.0:
        allowed = 'the grid is empty: STEP must lead from START to STOP'
        raise ConfigError('--vary', text, allowed)
    steps = (stop - start) / step[0]
    n = math.floor(steps * (1 + 1e-12) + 1e-9) + 1
    if n > MOST_VALUES:
        raise ConfigError('--vary', text, f'at most {MOST_VALUES} values')
    return tuple(start + i * step[0] for i in range(n))


def _numbers(flag: str, text: str, value: str, count: int, form: str) -> tuple[float, ...]:
    allowed = f'give {form}' if form else _FORMS
    words = value.split(',')
    try:
        numbers = tuple(float(word) for word in words if '_' not in word)
    except ValueError:
        raise ConfigError(flag, text, allowed) from None
    if len(numbers) != count or len(words) != count or not all(map(math.isfinite, numbers)):
        raise ConfigError(flag, text, f'{allowed}, all of them finite numbers')
    return numbers


def note_compilation(prog: str, setup: flight.Setup) -> None:
    """Print why the first flights take longer, if they do."""
    if text := ensemble.first_call_note(setup):
        sys.stderr.write(f'{prog}: note: {text}\n')
