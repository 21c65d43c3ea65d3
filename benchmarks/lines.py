"""Results as data: each benchmark has a function `lines()`, and benchmarks/run.py calls it."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Line:
    """One comparison within one run.

    Attributes:
        what: The quantity.
        ours: The result of this package, with its unit.
        beside: The peer and its result; empty without a peer.
        ratio: The comparison as a number; None if there is no number, or the peer is absent.
        bound: The bound, in words; empty without a bound.
        kept: True if the bound was kept; None without a bound, or if it could not be measured.
        short: True if README.md shows the line.
    """

    what: str
    ours: str
    beside: str = ''
    ratio: float | None = None
    bound: str = ''
    kept: bool | None = None
    short: bool = False


def number(value: float, digits: int = 2) -> str:
    """Return a figure with a few significant digits and separators of thousands."""
    if value == 0.0:
        return '0'
    rounded = float(f'{value:.{digits - 1}e}')
    if abs(rounded) >= 10 ** (digits - 1):
        return f'{rounded:,.0f}'
    return f'{rounded:.{digits}g}' if abs(rounded) >= 1e-4 else f'{rounded:.0e}'


def print_lines(lines: tuple[Line, ...]) -> None:
    """Print the results of a benchmark, one comparison a line."""
    for line in lines:
        words = [f'{line.what}: {line.ours}']
        if line.beside:
            words.append(f'peer: {line.beside}')
        if line.ratio is not None:
            words.append(f'ratio {number(line.ratio, 3)}')
        if line.bound:
            verdict = {True: 'kept', False: 'NOT KEPT', None: 'not measured'}[line.kept]
            words.append(f'bound: {line.bound}, {verdict}')
        print('; '.join(words))
