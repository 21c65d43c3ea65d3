"""The pages of the documentation and their fenced blocks."""

from collections.abc import Iterator
from pathlib import Path
import re
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
DOCS = ROOT / 'docs'
PAGES = [*sorted(DOCS.glob('*.md')), ROOT / 'README.md', ROOT / 'CONTRIBUTING.md']


class Block(NamedTuple):
    kind: str  # the word after the fence
    first: int  # number of its first line, from 1
    last: int  # number of the line of the closing fence
    text: str


def blocks(text: str) -> Iterator[Block]:
    """Yield the fenced blocks of a page, without the indent of the fence."""
    opened = None
    for number, line in enumerate(text.splitlines(), start=1):
        fence = re.match(r'( *)(`{3,}|~{3,})([^`]*)$', line)
        if opened is None and fence:
            indent, marks, kind = fence.groups()
            opened, body = (indent, marks, kind.strip(), number), []
        elif opened is not None and fence and fence[2].startswith(opened[1]) and not fence[3]:
            yield Block(opened[2], opened[3] + 1, number, '\n'.join(body) + '\n')
            opened = None
        elif opened is not None:
            body.append(line.removeprefix(opened[0]))
    assert opened is None, f'the block of line {opened[3]} never ends'
