"""A statement of the paper, and the rule for its verdict.

A statement holds the number as it is printed, and a function that computes our number from a share
of the printed damping. The verdict is never written by hand: `judge` computes it from both.
"""

from collections.abc import Callable
from dataclasses import dataclass
import math

from disc_sim_ros.paper.conditions import PRINTED, SHARES, percent

REPRODUCED = 'reproduced'
DIFFERS = 'differs'
NOT_REPRODUCIBLE = 'not reproducible'
TAKEN = 'taken over'

Ours = Callable[[float], float]


@dataclass(frozen=True, kw_only=True)
class Statement:
    """One number of the paper's text.

    Attributes:
        where: Section or figure of the paper.
        says: Name of the number, in a few words.
        number: The number as printed; '>' or '<' before it marks a bound.
        unit: Its unit; '' for none.
        words: The words of a text without a number; `number` is then our reading of them.
        ours: Computes our number from a share of the printed damping; None if it cannot be
            computed.
        about: True if the text says about, around or approximately.
        tolerance: Tolerance to use instead of that of `rounding`.
        reason: Reason for this tolerance.
        damped: True if the number depends on roll and pitch damping.
        taken: True if the number is an input of the simulator: agreement is then no evidence.
        why: Why our number differs, or why there is none.
    """

    where: str
    says: str
    number: str
    unit: str = ''
    words: str = ''
    ours: Ours | None = None
    about: bool = False
    tolerance: float | None = None
    reason: str = ''
    damped: bool = True
    taken: bool = False
    why: str = ''

    @property
    def bound(self) -> bool:
        """Return True if the number is a bound on one side, which is weaker evidence."""
        return self.number[:1] in {'<', '>'}

    @property
    def value(self) -> float:
        """Return the printed number."""
        return float(self.number.lstrip('<>'))

    @property
    def allowed(self) -> float:
        """Return the allowed distance of our number from the printed one [unit]."""
        if self.tolerance is not None:
            return self.tolerance
        return 0.0 if self.bound else rounding(self.number, about=self.about)


@dataclass(frozen=True)
class Result:
    """A statement, our numbers and a verdict for each damping.

    Attributes:
        statement: The statement.
        ours: Our numbers, one for each of `conditions.SHARES`; a single one if damping has no
            influence; none if there is no computation.
        verdicts: One of the four verdicts for each of `conditions.SHARES`.
        detail: How much our numbers differ with each damping, and the cause.
    """

    statement: Statement
    ours: tuple[str, ...]
    verdicts: tuple[str, ...]
    detail: str


def rounding(number: str, *, about: bool) -> float:
    """Return half of the step to which a printed number is rounded.

    The step is one unit of the last digit other than 0: 0.01 for 4.34, 10 for 40. A last 5 of a
    number that the text calls approximate is taken as rounded to fives: about 15 is 15 +- 2.5.
    """
    digits = number.lstrip('-')
    if float(digits) == 0.0:
        return 0.5 * 10.0 ** -len(digits.partition('.')[2])
    whole, _, part = digits.partition('.')
    if part.strip('0'):
        part = part.rstrip('0') if about else part
        last, step = part[-1], 10.0 ** -len(part)
    elif part and not about:
        last, step = part[-1], 10.0 ** -len(part)
    else:
        kept = whole.rstrip('0')
        last, step = kept[-1], 10.0 ** (len(whole) - len(kept))
    return 0.5 * step * (5.0 if about and last == '5' else 1.0)


def judge(statement: Statement) -> Result:
    """Compute our numbers and the verdicts of a statement, each damping by itself."""
    if statement.ours is None:
        return Result(statement, (), (NOT_REPRODUCIBLE,) * len(SHARES), statement.why)
    shares = SHARES if statement.damped else (PRINTED,)
    numbers = [statement.ours(share) for share in shares]
    shown = tuple(_shown(value) for value in numbers)
    if statement.taken:
        why = statement.why or 'an input of this model'
        return Result(statement, shown, (TAKEN,) * len(SHARES), why)
    off = [distance(statement, value) for value in numbers]
    met = [value <= statement.allowed for value in off]
    verdicts = tuple(REPRODUCED if one else DIFFERS for one in met)
    if not statement.damped:
        verdicts *= len(SHARES)
    if all(met):
        return Result(statement, shown, verdicts, '')
    if statement.damped:
        amounts = ', '.join(
            f'by {_amount(statement, value)} with {percent(share)}'
            for share, value, one in zip(shares, off, met, strict=True)
            if not one
        )
    else:
        amounts = f'by {_amount(statement, off[0])}'
    detail = f'{amounts}: {statement.why}' if statement.why else amounts
    return Result(statement, shown, verdicts, detail)


def distance(statement: Statement, ours: float) -> float:
    """Return the distance from the printed number, or beyond the bound [unit]."""
    if not math.isfinite(ours):
        return math.inf
    if statement.number[:1] == '>':
        return max(0.0, statement.value - ours)
    if statement.number[0] == '<':
        return max(0.0, ours - statement.value)
    return abs(ours - statement.value)


def _shown(value: float) -> str:
    if not math.isfinite(value):
        return 'none'
    return f'{value:.3g}' if abs(value) < 1000.0 else f'{value:.0f}'


def _amount(statement: Statement, off: float) -> str:
    space = '' if statement.unit == '°' else ' '
    return f'{_shown(off)}{space}{statement.unit}'.rstrip()
