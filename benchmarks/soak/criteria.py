"""What a soak has to keep, with the reason, and the table that says whether it did."""

from collections.abc import Sequence
from dataclasses import dataclass
import itertools

from resources import MOST_FILES, MOST_GROWTH, Sample, growth, settled
from stamps import Stamps
from watcher import Second, Values

MOST_UNTOLD = 0.005  # s that time may be off what slips tell; a message is on its way for less
QUIET = 10  # s without a slip; the quickest message of them tells the offset of the clocks
STAMP = 1e-6  # s, of stamps as floats


@dataclass(frozen=True, slots=True)
class Check:
    """A line of the table.

    Attributes:
        what: Was looked at.
        measured: Came out.
        allowed: What may come out; empty where it is only told.
        kept: Whether it did.
    """

    what: str
    measured: str
    allowed: str = ''
    kept: bool = True


def table(checks: Sequence[Check]) -> str:
    """Return checks as a table in Markdown."""
    rows = [('what', 'measured', 'allowed'), ('---',) * 3]
    rows += [(c.what, c.measured, c.allowed + ('' if c.kept else ' **not kept**')) for c in checks]
    return '\n'.join(f'| {" | ".join(row)} |' for row in rows)


def throws(thrown: Sequence[Values], count: int, period: float) -> Check:
    """Every throw is told of, and was let go when it was due: weeks of throws are counted on."""
    numbers = [int(event['flight']) for event in thrown]
    first = float(thrown[0]['stamp_s'])
    late = max(
        abs(float(event['stamp_s']) - first - period * (number - 1))
        for number, event in zip(numbers, thrown, strict=True)
    )
    told = f'{len(thrown)}, off by at most {late:.6f} s'
    kept = numbers == list(range(1, count + 1)) and late < STAMP
    return Check('throws when they are due', told, f'{count}, not off', kept)


def landings(landed: Sequence[Values], failed: Sequence[Values], thrown: int) -> Check:
    """Every throw lands once: who waits for a landing that never comes waits for ever."""
    numbers = [int(event['flight']) for event in landed]
    missing = thrown - len(set(numbers))
    again = len(numbers) - len(set(numbers))
    return Check(
        'landings',
        f'{len(numbers)}, missing {missing}, twice {again}, failed {len(failed)}',
        f'{thrown}, each once',
        numbers == list(range(1, thrown + 1)) and not failed,
    )


def evenness(stamps: Stamps, throws: int) -> Check:
    """Stamps are whole periods from the first, so that estimators need not ask for gaps."""
    told = (
        f'{stamps.count} messages over {stamps.span:.0f} s, {stamps.lost} not heard: '
        f'{stamps.uneven} off the grid, '
        f'{stamps.gaps} gaps, {stamps.infinite} not finite'
    )
    kept = stamps.count > 0 and not (stamps.uneven or stamps.gaps or stamps.infinite)
    kept = kept and stamps.again <= throws
    return Check('stamps of odom', told, 'none', kept)


def truth(seconds: Sequence[Second]) -> Check:
    """Time falls behind the steady clock by what the diagnostics tell as slipped, and no more."""
    found = []
    for slipped, group in itertools.groupby(seconds, lambda second: second.slipped):
        quiet = list(group)[1:]  # in the first, what was heard may be from before the slip
        found += [
            min(second.offset for second in quiet[i : i + QUIET]) - slipped
            for i in range(0, len(quiet) - QUIET + 1, QUIET)
        ]
    if not found:
        return Check('drift that is not told', f'never {QUIET} s without a slip', '', kept=False)
    least, most = min(found), max(found)
    told = (
        f'{(found[-1] - found[0]) * 1e3:+.2f} ms over {seconds[-1].time - seconds[0].time:.0f} s, '
        f'spread {(most - least) * 1e3:.2f} ms'
    )
    allowed = f'{MOST_UNTOLD * 1e3:g} ms'
    return Check('drift that is not told', told, allowed, most - least <= MOST_UNTOLD)


def pace(seconds: Sequence[Second]) -> list[Check]:
    """Say how the machine let it keep pace; the load of the machine decides."""
    took = seconds[-1].time - seconds[0].time
    late = sorted(second.worst for second in seconds)
    slipped = seconds[-1].slipped - seconds[0].slipped
    return [
        Check(
            'slipped, as told',
            f'{slipped:.3f} s in {took:.0f} s, {seconds[-1].slips - seconds[0].slips} times',
        ),
        Check(
            'worst lateness in a second',
            f'median {late[len(late) // 2] * 1e3:.1f} ms, '
            f'p99 {late[int(0.99 * len(late))] * 1e3:.1f} ms, worst {late[-1] * 1e3:.1f} ms',
        ),
        Check('missed deadlines', str(seconds[-1].missed - seconds[0].missed)),
    ]


def losses(told: Values) -> Check:
    """The recorder lost nothing, by what it tells itself."""
    lost = {key: n for key, n in told.items() if key.split()[0] in {'dropped', 'lost', 'gaps'}}
    return Check(
        'lost by the recorder',
        ', '.join(f'{key} {n}' for key, n in lost.items()) or '0',
        '0',
        not lost,
    )


def resources(name: str, samples: Sequence[Sample]) -> list[Check]:
    """What a process holds does not grow: in a week it would be all that there is."""
    taken = settled(samples)
    memory, threads, files = (growth(samples, what) for what in ('memory', 'threads', 'files'))
    return [
        Check(
            f'{name}: memory',
            f'{samples[-1].memory:.0f} MiB, grew by {memory:+.2f}',
            f'{MOST_GROWTH:g} MiB',
            memory <= MOST_GROWTH,
        ),
        Check(
            f'{name}: threads and open files',
            f'{taken[-1].threads} and {taken[-1].files}, grew by {threads:+g} and {files:+g}',
            f'{MOST_FILES:g}',
            max(threads, files) <= MOST_FILES,
        ),
    ]
