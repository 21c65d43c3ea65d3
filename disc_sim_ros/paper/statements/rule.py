"""What a statement is, and the rule that gives its verdict.

A statement holds the number as it is printed, and a function that computes ours from a share of
the printed damping. The verdict is never typed: it follows from both, by `judge`.
"""

from collections.abc import Callable
from dataclasses import dataclass
import math

from disc_sim_ros.paper.conditions import PRINTED, SHARES

REPRODUCED = 'reproduced'
DIFFERS = 'differs'
NOT_REPRODUCIBLE = 'not reproducible'
TAKEN = 'taken over'

Ours = Callable[[float], float]


@dataclass(frozen=True, kw_only=True)
class Statement:
    """One number of the paper's text.

    Attributes:
        where: Section or figure.
        says: What the number is, in few words.
        number: The number as printed, with '>' or '<' before it where it is a bound.
        unit: Its unit; '' for none.
        words: What the text says in words where it has no number; `number` is then our reading.
        ours: Our number from a share of the printed damping; None where none can be computed.
        about: The text says about, around or approximately.
        tolerance: Instead of the one that `rounding` gives.
        reason: Why that tolerance.
        damped: Whether roll and pitch damping have a part in it; else one number is shown.
        taken: The number is an input of ours, so that meeting it proves nothing.
        open_value: A launch value that the text does not give, and what was assumed; `ours` then
            returns a bound of what the assumed values give, and `upper` the other.
        upper: See `open_value`.
        why: Why ours differs, or why there is none.
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
    open_value: str = ''
    upper: Ours | None = None
    why: str = ''

    @property
    def value(self) -> float:
        """The printed number."""
        return float(self.number.lstrip('<>'))

    @property
    def allowed(self) -> float:
        """How far ours may be from it [unit]."""
        if self.tolerance is not None:
            return self.tolerance
        return 0.0 if self.number[0] in '<>' else rounding(self.number, about=self.about)


@dataclass(frozen=True)
class Result:
    """A statement, what we get and the verdict.

    Attributes:
        statement: The statement.
        ours: Our numbers, for each of `paper.SHARES`; one without damping; none if not computed.
        verdict: One of the four words.
        detail: By how much and why, or with which damping.
        met: Whether each of `paper.SHARES` meets it; empty where damping has no part or nothing is
            judged.
    """

    statement: Statement
    ours: tuple[str, ...]
    verdict: str
    detail: str
    met: tuple[bool, ...] = ()


def rounding(number: str, *, about: bool) -> float:
    """Return half of the step to which a printed number is rounded.

    The step is one of its last digit that is not 0: 4.34 is 0.01, 40 is 10. Of a number that the
    text calls approximate, a last 5 counts as rounded to fives: about 15 is 15 +- 2.5.
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
    """Compute ours and give the verdict."""
    if statement.ours is None:
        return Result(statement, (), NOT_REPRODUCIBLE, statement.why)
    shares = SHARES if statement.damped else (PRINTED,)
    lower = [statement.ours(share) for share in shares]
    if statement.upper is not None:
        return _judge_open(statement, lower, [statement.upper(share) for share in shares])
    shown = tuple(_shown(value) for value in lower)
    if statement.taken:
        return Result(statement, shown, TAKEN, statement.why or 'an input of this model')
    off = [distance(statement, value) for value in lower]
    met = [value <= statement.allowed for value in off]
    kept = tuple(met) if statement.damped else ()
    if all(met):
        return Result(statement, shown, REPRODUCED, '', kept)
    if any(met):
        which = ('damping as printed', '10 % damping')[met.index(True)]
        other = f'with {which}; off by {_amount(statement, max(off))} with the other'
        return Result(statement, shown, REPRODUCED, other, kept)
    detail = f'by {_amount(statement, min(off))}: {statement.why}'
    return Result(statement, shown, DIFFERS, detail, kept)


def distance(statement: Statement, ours: float) -> float:
    """Return how far ours is from the printed number, or on the wrong side of a bound [unit]."""
    if not math.isfinite(ours):
        return math.inf
    if statement.number[0] == '>':
        return max(0.0, statement.value - ours)
    if statement.number[0] == '<':
        return max(0.0, ours - statement.value)
    return abs(ours - statement.value)


def _judge_open(statement: Statement, lower: list[float], upper: list[float]) -> Result:
    """Judge a statement about a launch that the text does not give in full."""
    shown = tuple(
        f'{_shown(min(a, b))} to {_shown(max(a, b))}' for a, b in zip(lower, upper, strict=True)
    )
    allowed = statement.allowed
    within = any(
        min(a, b) - allowed <= statement.value <= max(a, b) + allowed
        for a, b in zip(lower, upper, strict=True)
    )
    if within:
        detail = f'{statement.open_value}: what these give includes it'
        return Result(statement, shown, NOT_REPRODUCIBLE, detail)
    off = min(distance(statement, value) for value in lower + upper)
    detail = f'by {_amount(statement, off)} at least, {statement.open_value}: {statement.why}'
    return Result(statement, shown, DIFFERS, detail)


def _shown(value: float) -> str:
    if not math.isfinite(value):
        return 'none'
    return f'{value:.3g}' if abs(value) < 1000.0 else f'{value:.0f}'


def _amount(statement: Statement, off: float) -> str:
    space = '' if statement.unit == '°' else ' '
    return f'{_shown(off)}{space}{statement.unit}'.rstrip()
