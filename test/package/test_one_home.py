"""Ranges, names of topics and frames, and patterns are written once, in their homes.

The syntax trees of the package are searched for numbers and texts that repeat those of
`quantities` and `topics`.
"""

import ast
from collections import Counter
from collections.abc import Iterator
import dataclasses
from functools import cache
import itertools
import math
import operator
from pathlib import Path
import re

import pytest

from disc_sim_ros import topics
from disc_sim_ros.quantities import QUANTITIES, VARIED
from disc_sim_ros.topics import Frames

pytestmark = pytest.mark.xdist_group('one home')  # each source is parsed once

ROOT = Path(__file__).parents[2]
SOURCES = sorted(
    path
    for folder in ('disc_sim_ros', 'launch', 'tools')
    for path in (ROOT / folder).rglob('*.py')
)
HOMES = {'disc_sim_ros/quantities.py', 'disc_sim_ros/topics.py'}
# Axes of plots and samples of measured data, which share round numbers with some ranges.
OF_PAPER = 'disc_sim_ros/paper/'

RANGES = {
    (float(quantity.lowest), float(quantity.highest))
    for quantity in (*QUANTITIES.values(), *VARIED.values())
    if math.isfinite(quantity.lowest) and math.isfinite(quantity.highest)
}
TOPICS = {v for k, v in vars(topics).items() if k.isupper() and isinstance(v, str)}
FRAMES = {field.default for field in dataclasses.fields(Frames)}
# Words that mean other things as well are looked for only where a topic or a frame belongs.
WORDS = {name for name in TOPICS | FRAMES if re.fullmatch(r'[a-z]+', name)} | TOPICS & set(
    QUANTITIES
)
TAKES_TOPIC = re.compile(r'create_(publisher|subscription)|count_\w+|\w+_info_by_topic|sink')
PATTERN_FUNCTIONS = {
    'compile',
    'fullmatch',
    'match',
    'search',
    'findall',
    'finditer',
    'sub',
    'split',
}
_OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Pow: operator.pow,
}


def number(node: ast.expr) -> float | None:
    """Return the value of a number, of its negative or of arithmetic of two of them."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
        case ast.UnaryOp(op=ast.USub()):
            value = number(node.operand)
            return None if value is None else -value
        case ast.BinOp() if type(node.op) in _OPERATORS:
            left, right = number(node.left), number(node.right)
            if left is not None and right is not None and abs(right) < 100.0:
                return _OPERATORS[type(node.op)](left, right)
    return None


@cache
def nodes_of(source: str) -> list[ast.AST]:
    """Return all nodes of a module."""
    return list(ast.walk(ast.parse(source)))


def texts(nodes: list[ast.AST]) -> Iterator[ast.Constant]:
    """Yield every text of a module that is not a docstring."""
    docs = {
        node.body[0].value
        for node in nodes
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in docs:
            yield node


def ranges_in(source: str) -> list[tuple[float, float]]:
    """Return the ranges of the table that are written as two neighbouring numbers or in a text."""
    nodes = nodes_of(source)
    repeated = []
    for node in nodes:
        match node:
            case ast.Tuple() | ast.List():
                values = node.elts
            case ast.Call():
                values = [*node.args, *(keyword.value for keyword in node.keywords)]
            case ast.Compare():
                values = [x for x in (node.left, *node.comparators) if number(x) is not None]
            case _:
                continue
        numbers = [number(value) for value in values]
        repeated += [pair for pair in itertools.pairwise(numbers) if pair in RANGES]
    for node in texts(nodes):
        for low, high in re.findall(r'(-?\d[\d.e+-]*) (?:to|and) (-?\d[\d.e+]*)', node.value):
            try:
                pair = float(low), float(high.rstrip('.'))
            except ValueError:
                continue
            repeated += [pair] if pair in RANGES else []
    return repeated


def names_in(source: str) -> list[str]:
    """Return the topics and frames that a module names in a text of its own."""
    nodes = nodes_of(source)
    names = (TOPICS | FRAMES) - WORDS | {f'/{name}' for name in TOPICS}
    repeated = [node.value for node in texts(nodes) if node.value in names]
    for node in nodes:
        match node:
            case ast.Call(func=ast.Name(id=called) | ast.Attribute(attr=called)):
                named = list(node.args) if TAKES_TOPIC.fullmatch(called) else []
                named += [
                    k.value for k in node.keywords if k.arg in {'frame_id', 'child_frame_id'}
                ]
            case ast.Assign(targets=[ast.Attribute(attr='frame_id' | 'child_frame_id')]):
                named = [node.value]
            case _:
                continue
        repeated += [n.value for n in named if isinstance(n, ast.Constant) and n.value in WORDS]
    return repeated


def patterns_in(source: str) -> list[str]:
    """Return the regular expressions that a module compiles or matches."""
    return [
        node.args[0].value
        for node in nodes_of(source)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and (node.func.value.id, node.func.attr in PATTERN_FUNCTIONS) == ('re', True)
        and isinstance(node.args[0], ast.Constant)
    ]


def source_of(path: Path) -> str:
    return path.read_text(encoding='utf-8')


def outside_of_homes() -> list[tuple[str, str]]:
    named = [(path.relative_to(ROOT).as_posix(), source_of(path)) for path in SOURCES]
    return [(name, source) for name, source in named if name not in HOMES]


def test_no_range_is_written_twice():
    repeated = {name: ranges_in(source) for name, source in outside_of_homes()}
    assert {n: r for n, r in repeated.items() if r and not n.startswith(OF_PAPER)} == {}


def test_no_topic_or_frame_is_named_twice():
    repeated = {name: names_in(source) for name, source in outside_of_homes()}
    assert {name: names for name, names in repeated.items() if names} == {}


def test_no_pattern_is_written_twice_and_only_topics_refuses_frame_prefixes():
    counts = Counter(pattern for path in SOURCES for pattern in patterns_in(source_of(path)))
    assert [pattern for pattern, count in counts.items() if count > 1] == []
    assert counts[Frames.PREFIX.pattern] == 1
    refusing = [
        name for name, source in outside_of_homes() if "ConfigError('frame_prefix'" in source
    ]
    assert refusing == []


@pytest.mark.parametrize(
    'source',
    [
        "number('wind', x, -100.0, 100.0, unit='m/s')",
        "number('wind', x, lowest=-100, highest=1e2)",
        "LIMITS = {'speed': (0.0, 200.0, 'm/s')}",
        'if not 0.1 <= height <= 1000.0: pass',
        'whole_number(x, 0, 2**63 - 1)',
        "p.add_argument('--pitch', help='nose up; from -180 to 180 degrees')",
    ],
)
def test_a_planted_range_is_noticed(source):
    assert len(ranges_in(source)) == 1
    assert ranges_in('"""From -180 to 180."""\nf(lowest, 200.0)\ng(1.0, 200.0)') == []


@pytest.mark.parametrize(
    'source',
    [
        "discs = bag.messages('applied_wind')",
        "discs = recording.discs(bag, '/odom')",
        "node.create_subscription(Odometry, 'odom', callback, 10)",
        "message = Odometry(child_frame_id='disc')",
        "message.header.frame_id = 'map'",
        "axes = {'disc_air': 3}",
    ],
)
def test_a_planted_name_is_noticed(source):
    assert len(names_in(source)) == 1
    assert names_in("wind = v['wind']\nmap(str, x)\n") == []


def test_a_planted_pattern_is_noticed():
    own = source_of(ROOT / 'disc_sim_ros/topics.py')
    assert Frames.PREFIX.pattern in patterns_in(own)
    assert patterns_in(f'ok = re.fullmatch({Frames.PREFIX.pattern!r}, prefix)') == [
        Frames.PREFIX.pattern
    ]
