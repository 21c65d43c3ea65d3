"""The criteria of a soak, each with its reason, and the table of the results."""

from collections.abc import Sequence
from dataclasses import dataclass
import itertools

from resources import MOST_FILES, MOST_GROWTH, Sample, growth, settled
from stamps import Stamps
from watcher import Second, Values

MOST_UNREPORTED = 0.005  # s of drift beside the reported slips; no message takes longer
QUIET = 10  # s without a slip; the fastest message in it shows the offset of the clocks
STAMP = 1e-6  # s, of stamps as floats


@dataclass(frozen=True, slots=True)
class Check:
    """A line of the table.

    Attributes:
        what: What was checked.
        measured: The result.
        allowed: The allowed result; empty where there is no limit.
        kept: Whether the result is allowed.
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
    """Check that every throw is published, and released when due: users rely on it for weeks."""
    numbers = [int(event['flight']) for event in thrown]
    first = float(thrown[0]['stamp_s'])
    late = max(
        abs(float(event['stamp_s']) - first - period * (number - 1))
        for number, event in zip(numbers, thrown, strict=True)
    )
    measured = f'{len(thrown)}, off by at most {late:.6f} s'
    kept = numbers == list(range(1, count + 1)) and late < STAMP
    return Check('throws when they are due', measured, f'{count}, not off', kept)


def landings(landed: Sequence[Values], failed: Sequence[Values], thrown: int) -> Check:
    """Check that every throw lands once: programs wait for the landing."""
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
    """Check that stamps are whole periods from the first: estimators rely on even spacing."""
    measured = (
        f'{stamps.count} messages over {stamps.span:.0f} s, {stamps.lost} not received: '
        f'{stamps.uneven} off the grid, '
        f'{stamps.gaps} gaps, {stamps.infinite} not finite'
    )
    kept = stamps.count > 0 and not (stamps.uneven or stamps.gaps or stamps.infinite)
    kept = kept and stamps.repeated <= throws
    return Check('stamps of odom', measured, 'none', kept)


def drift(seconds: Sequence[Second]) -> Check:
    """Check that time falls behind the steady clock only by the slips in the diagnostics."""
    offsets = []
    for slipped, group in itertools.groupby(seconds, lambda second: second.slipped):
        quiet = list(group)[1:]  # messages in the first may be from before the slip
        offsets += [
            min(second.offset for second in quiet[i : i + QUIET]) - slipped
            for i in range(0, len(quiet) - QUIET + 1, QUIET)
        ]
    what = 'drift that is not reported'
    if not offsets:
        return Check(what, f'never {QUIET} s without a slip', '', kept=False)
    least, most = min(offsets), max(offsets)
    duration = seconds[-1].time - seconds[0].time
    measured = (
        f'{(offsets[-1] - offsets[0]) * 1e3:+.2f} ms over {duration:.0f} s, '
        f'spread {(most - least) * 1e3:.2f} ms'
    )
    allowed = f'{MOST_UNREPORTED * 1e3:g} ms'
    return Check(what, measured, allowed, most - least <= MOST_UNREPORTED)


def pace(seconds: Sequence[Second]) -> list[Check]:
    """Report slips and lateness, which depend on the load of the machine."""
    duration = seconds[-1].time - seconds[0].time
    late = sorted(second.worst for second in seconds)
    slipped = seconds[-1].slipped - seconds[0].slipped
    return [
        Check(
            'slipped, as reported',
            f'{slipped:.3f} s in {duration:.0f} s, {seconds[-1].slips - seconds[0].slips} times',
        ),
        Check(
            'worst lateness in a second',
            f'median {late[len(late) // 2] * 1e3:.1f} ms, '
            f'p99 {late[int(0.99 * len(late))] * 1e3:.1f} ms, worst {late[-1] * 1e3:.1f} ms',
        ),
        Check('missed deadlines', str(seconds[-1].missed - seconds[0].missed)),
    ]


def losses(diagnostics: Values) -> Check:
    """Check that the recorder lost nothing, by its own diagnostics."""
    lost = {
        key: n for key, n in diagnostics.items() if key.split()[0] in {'dropped', 'lost', 'gaps'}
    }
    return Check(
        'lost by the recorder',
        ', '.join(f'{key} {n}' for key, n in lost.items()) or '0',
        '0',
        not lost,
    )


def resources(name: str, samples: Sequence[Sample]) -> list[Check]:
    """Check that the resources of a process do not grow: in a week they would be exhausted."""
    last = settled(samples)[-1]
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
            f'{last.threads} and {last.files}, grew by {threads:+g} and {files:+g}',
            f'{MOST_FILES:g}',
            max(threads, files) <= MOST_FILES,
        ),
    ]
