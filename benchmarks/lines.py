"""What a benchmark found, as data: each has `lines()`, and benchmarks/run.py gathers them."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Line:
    """One comparison within one run.

    Attributes:
        what: What was measured.
        ours: What this package does, with its unit.
        beside: What it was compared with, and what that does; empty for nothing.
        ratio: The comparison as a number; None where it is none, or the peer is absent.
        bound: What is to be kept, in words; empty for no bound.
        kept: Whether it was; None without a bound, or if it could not be measured.
        short: Whether it is one of the few lines of README.md.
    """

    what: str
    ours: str
    beside: str = ''
    ratio: float | None = None
    bound: str = ''
    kept: bool | None = None
    short: bool = False


def number(value: float, digits: int = 2) -> str:
    """Return a figure as people write it: some significant digits, thousands apart."""
    if value == 0.0:
        return '0'
    rounded = float(f'{value:.{digits - 1}e}')
    if abs(rounded) >= 10 ** (digits - 1):
        return f'{rounded:,.0f}'
    return f'{rounded:.{digits}g}' if abs(rounded) >= 1e-4 else f'{rounded:.0e}'


def print_lines(lines: tuple[Line, ...]) -> None:
    """Print what a benchmark found, one comparison each."""
    for line in lines:
        words = [f'{line.what}: {line.ours}']
        if line.beside:
            words.append(f'beside {line.beside}')
        if line.ratio is not None:
            words.append(f'ratio {number(line.ratio, 3)}')
        if line.bound:
            told = {True: 'kept', False: 'NOT KEPT', None: 'not measured'}[line.kept]
            words.append(f'bound: {line.bound}, {told}')
        print('; '.join(words))
