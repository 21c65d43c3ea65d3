"""Links and images of the documentation lead to existing files and headings."""

from pathlib import Path
import re
from urllib.parse import unquote

import pytest

from docs.pages import PAGES, ROOT, blocks

LINKING = PAGES + sorted(ROOT.glob('CHANGELOG*'))


def links(page: Path, text: str) -> list[str]:
    """Return the link targets of a Markdown or reStructuredText page, without web addresses."""
    if page.suffix == '.rst':
        pairs = re.findall(r'<([^<>\s]+)>`__?|^\.\. (?:image|figure|include):: (\S+)', text, re.M)
        targets = [first or second for first, second in pairs]
    else:
        inside = set()
        for block in blocks(text):
            inside.update(range(block.first - 1, block.last + 1))
        lines = [line for n, line in enumerate(text.splitlines(), 1) if n not in inside]
        prose = re.sub(r'`[^`]*`', '', '\n'.join(lines))
        targets = re.findall(r'\]\(<?([^)>\s]+)', prose)
        targets += re.findall(r'^\[[^\]]+\]: *(\S+)', prose, re.M)
        targets += re.findall(r'(?:src|srcset|href)="([^"]+)"', prose)
    return [t for t in targets if not re.match(r'[a-z][a-z+.-]*:', t)]


def headings(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub derives them."""
    titles = re.findall(r'^#+ (.*)$', page.read_text(encoding='utf-8'), re.M)
    return {re.sub(r'[^\w\- ]', '', t.lower()).replace(' ', '-') for t in titles}


def broken(page: Path, text: str) -> list[str]:
    lost = []
    for target in links(page, text):
        path, _, anchor = target.partition('#')
        file = page.parent / unquote(path) if path else page
        missing = not file.exists() or ROOT not in [file.resolve(), *file.resolve().parents]
        if missing or (anchor and file.suffix == '.md' and anchor not in headings(file)):
            lost.append(target)
    return lost


@pytest.mark.parametrize('page', LINKING, ids=lambda page: page.name)
def test_links_and_images_exist(page):
    assert broken(page, page.read_text(encoding='utf-8')) == []


@pytest.mark.parametrize(
    ('page', 'text', 'lost'),
    [
        ('docs/axes.md', '[a](gone.md) [b](axes.md) `[c](no.md)`', ['gone.md']),
        ('docs/axes.md', '[![a](gone.png)](symbols.md)', ['gone.png']),
        ('docs/axes.md', '[a](#the-flow) [b](#no-such)', ['#no-such']),
        ('docs/axes.md', '<img src="gone.svg"> [w](https://example.org/x)', ['gone.svg']),
        ('docs/axes.md', '[a][b]\n\n[b]: gone.md', ['gone.md']),
        ('docs/axes.md', '```sh\n[a](gone.md)\n```\n[b](../../outside.md)', ['../../outside.md']),
        ('CHANGELOG.rst', '`a <gone.md>`_ `b <docs/axes.md>`_', ['gone.md']),
    ],
)
def test_a_broken_link_is_noticed(page, text, lost):
    assert broken(ROOT / page, text) == lost
