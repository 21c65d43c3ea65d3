"""All statements with their verdicts, and the table as text."""

from dataclasses import replace

from disc_sim_ros.paper import conditions
from disc_sim_ros.paper.statements import control, launches, theory, typical
from disc_sim_ros.paper.statements.rule import (
    DIFFERS,
    NOT_REPRODUCIBLE,
    REPRODUCED,
    TAKEN,
    Result,
    Statement,
    judge,
)

STATEMENTS: tuple[Statement, ...] = (
    *theory.STATEMENTS,
    *typical.STATEMENTS,
    *launches.STATEMENTS,
    *control.STATEMENTS,
)
HEADER = ('where', 'what', 'paper', 'ours, damping as printed', 'ours, 10 % damping', 'tolerance',
          'verdict, damping as printed', 'verdict, 10 % damping', 'how much, why')  # fmt: skip
VERDICT_COLUMNS = (6, 7)


def evaluate() -> tuple[Result, ...]:
    """Judge all statements; the results hold no functions, so that they can be pickled."""
    results = (judge(statement) for statement in STATEMENTS)
    return tuple(
        replace(result, statement=replace(result.statement, ours=None)) for result in results
    )


def tally(results: tuple[Result, ...], share: float) -> dict[str, int]:
    """Return the number of statements with each verdict, with one of `conditions.SHARES`."""
    row = conditions.SHARES.index(share)
    words = (REPRODUCED, DIFFERS, NOT_REPRODUCIBLE, TAKEN)
    return {word: sum(result.verdicts[row] == word for result in results) for word in words}


def bounds(results: tuple[Result, ...], share: float) -> tuple[int, int]:
    """Return the number of one-sided bounds, and how many a damping reproduces."""
    row = conditions.SHARES.index(share)
    bounded = [result.verdicts[row] for result in results if result.statement.bound]
    return len(bounded), bounded.count(REPRODUCED)


def cells(result: Result) -> tuple[str, ...]:
    """Return one row of the table, with the columns of `HEADER`."""
    statement = result.statement
    about = 'about ' if statement.about else ''
    if statement.words:
        about = f'{statement.words}; read as '
    unit = statement.unit if statement.unit == '°' else f' {statement.unit}'
    ours = result.ours or ('-', '-')
    if len(ours) == 1:
        ours = (ours[0], 'the same')
    allowed = '-'
    if statement.bound:
        allowed = 'bound on one side'
    elif result.ours:
        allowed = f'±{statement.allowed:.3g}'
        if statement.reason:
            allowed += f' ({statement.reason})'
    return (
        statement.where,
        statement.says,
        f'{about}{statement.number}{unit}'.strip() if statement.number else statement.words,
        *ours,
        allowed,
        *result.verdicts,
        result.detail,
    )


def csv(results: tuple[Result, ...]) -> str:
    """Return the table as CSV."""
    return conditions.csv_text(HEADER, [cells(result) for result in results])
