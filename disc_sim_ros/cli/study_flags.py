"""The flags of ensembles, which `sweep` and `optimise` share."""

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
import math
import sys

from disc_sim_ros.cli import flags as throw_flags
from disc_sim_ros.cli.arguments import Parser, number
from disc_sim_ros.errors import ConfigError, brief
from disc_sim_ros.physics import ensemble, flight
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.quantities import VARIED
from disc_sim_ros.studies.columns import quantity
from disc_sim_ros.studies.scatter import Normal, Uniform
from disc_sim_ros.validation import Quantity

MOST_VALUES = 100_000  # of one grid quantity
_FORMS = 'give NAME=START:STOP:STEP, NAME=START:STOP/N or NAME=A,B,C'


def names_text() -> str:
    """Return the names of all quantities with their units, for the end of a help page."""
    told = [f'{q.name} ({q.unit})' if q.unit else q.name for q in VARIED.values()]
    return f'NAME is one of {", ".join(told)}.'


def grids(texts: Iterable[str]) -> dict[str, tuple[float, ...]]:
    """Return the values of each `--vary`.

    Raises:
        ConfigError: A name twice, an empty grid, or text that is none.
    """
    found: dict[str, tuple[float, ...]] = {}
    for text in texts:
        q, value = _split('--vary', text, _FORMS)
        if q.name in found:
            raise ConfigError('--vary', text, f'{q.name} is varied twice')
        found[q.name] = _grid_values(text, value)
    return found


def laws(
    normal: Iterable[str], uniform: Iterable[str], scatter: Iterable[str]
) -> dict[str, Normal | Uniform]:
    """Return the laws of each `--normal`, `--uniform` and `--scatter`.

    Raises:
        ConfigError: A name twice, or numbers that are no such law.
    """
    found: dict[str, Normal | Uniform] = {}
    for flag, form, texts in (
        ('--normal', 'NAME=MEAN,SD', normal),
        ('--uniform', 'NAME=LOW,HIGH', uniform),
        ('--scatter', 'NAME=SD', scatter),
    ):
        for text in texts:
            q, value = _split(flag, text, f'give {form}')
            if q.name in found:
                raise ConfigError(flag, text, f'{q.name} scatters twice')
            numbers = _numbers(flag, text, value, form.count(',') + 1, form)
            try:
                if flag == '--uniform':
                    found[q.name] = Uniform(*numbers)
                else:
                    found[q.name] = Normal(numbers[-1], *numbers[:-1])
            except ConfigError as error:
                raise ConfigError(flag, text, f'{error.thing}: {error.allowed}') from None
    return found


def pairs(texts: Iterable[str]) -> dict[tuple[str, str], float]:
    """Return the correlations of `--correlation A,B=R`.

    Raises:
        ConfigError: Text that is none, or a pair twice.
    """
    found: dict[tuple[str, str], float] = {}
    for text in texts:
        names, _, value = text.partition('=')
        both = names.split(',')
        if len(both) != 2:
            raise ConfigError('--correlation', text, 'give A,B=R with two names')
        a, b = sorted(quantity('--correlation', name).name for name in both)
        if (a, b) in found:
            raise ConfigError('--correlation', text, 'the pair is given twice')
        found[a, b] = _numbers('--correlation', text, value, 1, 'A,B=R')[0]
    return found


def ranges(flag: str, texts: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Return the ranges of `--limit NAME=LOW:HIGH`.

    Raises:
        ConfigError: A name twice, or a range that is none.
    """
    found: dict[str, tuple[float, float]] = {}
    for text in texts:
        q, value = _split(flag, text, 'give NAME=LOW:HIGH')
        low, high = _numbers(flag, text, value.replace(':', ','), 2, 'NAME=LOW:HIGH')
        if q.name in found:
            raise ConfigError(flag, text, f'{q.name} is limited twice')
        if not q.lowest <= low <= high <= q.highest:
            allowed = f'from {q.lowest:g} to {q.highest:g} {q.unit}, the lower first'.rstrip()
            raise ConfigError(flag, text, allowed)
        found[q.name] = (low, high)
    return found


def add_throw(p: Parser, *, ground: bool = True) -> None:
    """Add the flags of a throw, whose step is chosen where it is not given.

    Args:
        p: A parser with `conflict_handler='resolve'`.
        ground: Add `--no-ground` too.
    """
    throw_flags.add_disc(p)
    throw_flags.add_launch(p)
    around = throw_flags.add_air(p, 'air, controls and end')
    around.add_argument(
        '--step',
        type=number(1e-6, 0.1, 's'),
        default=argparse.SUPPRESS,
        metavar='S',
        help='integration step; from 1e-6 to 0.1 s (default: the longest of 20, 10, 5, 2 and 1 ms '
        'in which the fastest nutation turns by less than 1.3 rad)',
    )
    text = 'longest time of flight'
    throw_flags.add_number(around, '--duration', 60.0, 1e-6, flight.LONGEST, 's', 'S', text)
    if not ground:  # every flight ends there
        return
    around.add_argument(
        '--no-ground', action='store_true', help='fly on below z = 0, for the whole duration'
    )


def add_seed(group: argparse._ActionsContainer, text: str) -> None:
    """Add `--seed`."""
    group.add_argument(
        '--seed',
        type=whole(0, 2**63 - 2**31),
        default=0,
        metavar='N',
        help=f'{text}, a whole number from 0',
    )


def add_workers(group: argparse._ActionsContainer) -> None:
    """Add where the flights are flown."""
    group.add_argument(
        '--executor',
        default='threads',
        metavar='threads|processes|dask[=ADDRESS]',
        help='fly in threads, in processes, in a Dask cluster of this machine or in the one whose '
        'scheduler is at ADDRESS; the flights are the same',
    )
    group.add_argument(
        '--workers',
        type=whole(1, 1024),
        default=argparse.SUPPRESS,
        metavar='N',
        help='threads or processes (default: one for each core)',
    )


def thrown(chosen: argparse.Namespace) -> tuple[Launch, flight.Setup, float | None]:
    """Return the release, the setup (with a step for no particular spin) and the advance ratio.

    Raises:
        ConfigError: As of `throw_flags.thrown`.
    """
    values = vars(chosen) | {'step': getattr(chosen, 'step', 1e-6)}
    release, setup = throw_flags.thrown(argparse.Namespace(**values))
    return release, setup, getattr(chosen, 'advance_ratio', None)


def check_given(
    arguments: Sequence[str],
    vary: Mapping[str, object],
    scatter: Mapping[str, Normal | Uniform],
) -> None:
    """Refuse a flag that says what another one varies.

    Raises:
        ConfigError: A contradiction.
    """
    flags = {word.partition('=')[0] for word in arguments if word.startswith('--')}
    around = {n for n, law in scatter.items() if isinstance(law, Normal) and law.mean is None}
    flag_of = throw_flags.FLAG_OF | {'advance_ratio': '--advance-ratio'}
    for name in [*vary, *(n for n in scatter if n not in around)]:
        if flag_of.get(name) in flags:
            allowed = f'{name} differs from flight to flight already; give one of the two'
            raise ConfigError(flag_of[name], 'a fixed value', allowed)
    for name, other in (('spin', '--advance-ratio'), ('advance_ratio', '--spin')):
        if (name in vary or name in scatter) and other in flags:
            raise ConfigError(other, 'a fixed value', f'{name} gives it; give one of the two')


def whole(lowest: int, highest: int) -> Callable[[str], int]:
    """Return a converter of command-line text to a whole number."""

    def convert(text: str) -> int:
        if not text.isascii() or not text.isdigit() or not lowest <= int(text) <= highest:
            allowed = f'give a whole number from {lowest} to {highest}'
            raise argparse.ArgumentTypeError(f'{brief(text)} is not allowed; {allowed}')
        return int(text)

    return convert


def add_list(group: argparse._ActionsContainer, flag: str, metavar: str, text: str) -> None:
    """Add a flag that may be given several times."""
    group.add_argument(
        flag,
        action='append',
        default=argparse.SUPPRESS,
        metavar=metavar,
        help=f'{text}; may be given several times',
    )


def listed(chosen: argparse.Namespace, name: str) -> list[str]:
    """Return what a flag of `add_list` was given."""
    found: list[str] = getattr(chosen, name, [])
    return found


def _split(flag: str, text: str, form: str) -> tuple[Quantity, str]:
    name, found, value = text.partition('=')
    if not found:
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
        found = tuple(float(word) for word in words if '_' not in word)
    except ValueError:
        raise ConfigError(flag, text, allowed) from None
    if len(found) != count or len(words) != count or not all(map(math.isfinite, found)):
        raise ConfigError(flag, text, f'{allowed}, all of them finite numbers')
    return found


def note_compilation(prog: str, setup: flight.Setup) -> None:
    """Say that the first run on a machine takes longer."""
    if not ensemble.is_ready(setup):
        text = 'compiling the equations of motion, once on this machine, about 15 s'
        sys.stderr.write(f'{prog}: note: {text}\n')
