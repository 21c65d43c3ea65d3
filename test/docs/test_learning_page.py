"""docs/learning.md has the spaces of the environments, with units and bounds."""

from pathlib import Path

import pytest

pytest.importorskip('gymnasium')

from disc_sim_ros.envs import steer, steering, throw
from disc_sim_ros.envs.components import Component

PAGE = Path(__file__).parents[2] / 'docs' / 'learning.md'


def table(title: str, components: tuple[Component, ...]) -> str:
    """The table of some components, as the page has it."""
    lines = [f'| {title} | from | to | unit | meaning |', '|---|---|---|---|---|']
    lines += [
        f'| `{c.name}` | {c.lowest:g} | {c.highest:g} | {c.unit} | {c.meaning} |'
        for c in components
    ]
    return '\n'.join(lines)


@pytest.mark.parametrize(
    ('title', 'components'),
    [
        ('observation', steering.OBSERVATION),
        ('action', steering.ACTION),
        ('drawn', (*steer.THROW, *steer.TARGET)),
        ('observation', throw.OBSERVATION),
        ('action', throw.ACTION),
    ],
)
def test_the_page_has_the_spaces(title, components):
    assert table(title, components) in PAGE.read_text(encoding='utf-8')
