"""The pages made of the parameter table: docs/parameters.md and config/sim.yaml.

`python -m disc_sim_ros.nodes.parameter_pages` prints the first, with the word `yaml` the second.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
import sys
import textwrap

import yaml

from disc_sim_ros.core import check
from disc_sim_ros.nodes.parameter_table import GROUPS, Entry, Value, allowed_text, plain

_PAGE = """\
# Parameters of sim_node

<!-- Made by: python -m disc_sim_ros.nodes.parameter_pages > docs/parameters.md -->

Give them in a file (`config/sim.yaml` holds them all), on the command line or while the node runs:

    ros2 run disc_sim_ros sim_node --ros-args --params-file my.yaml -p launch.speed:=20
    ros2 param set /sim_node launch.pitch 10

All are checked together, and a change that is impossible with the rest is refused with the reason,
as a whole: parameters that only fit together, such as `physics_rate` and `publish_rate`, go in one
`set_parameters_atomically`. A misspelt name in a file or on the command line ends the node with an
error.

In a file, `/**:` means every node; `sim_node:` would miss a node in a namespace. A whole number
will do where a double is due. ROS itself refuses a list of mixed numbers, `[0, 0.5, 0]`, so write
all of them with a point or none; reads a number that starts with 0 as octal, so that 010 is 8; and
takes an empty text on the command line only as `-p "frame_prefix:=''"`.

A parameter whose change takes effect at the next throw keeps its old meaning for the disc that is
in the air. A fixed one is read-only.
"""


def markdown() -> str:
    """Return docs/parameters.md."""
    return _PAGE + ''.join(_markdown_group(title, group) for title, group in GROUPS.items())


def _markdown_group(title: str, group: Iterable[Entry]) -> str:
    head = (
        '| parameter | default | unit | allowed | change | meaning |\n|---|---|---|---|---|---|\n'
    )
    return f'\n## {title}\n\n{head}{"".join(_markdown_row(entry) for entry in group)}'


def _markdown_row(entry: Entry) -> str:
    allowed = '; '.join(part for part in (allowed_text(entry), entry.constraint) if part)
    cells = (
        f'`{entry.name}`',
        f'`{_yaml_value(entry.default)}`',
        entry.unit,
        allowed,
        entry.effect,
        entry.meaning,
    )
    return f'| {" | ".join(cells)} |\n'


def yaml_file() -> str:
    """Return config/sim.yaml: every parameter with its default."""
    lines = [
        '# Every parameter of sim_node with its default. Copy it and keep what you change.',
        '# In brackets: what is allowed, and when a change while the node runs takes effect.',
        '/**:',
        '  ros__parameters:',
    ]
    for title, group in GROUPS.items():
        lines += ['', f'    # ---- {title} ----']
        parent = ''
        for entry in group:
            *parents, key = entry.name.split('.')
            indent = ' ' * (4 + 2 * len(parents))
            if parents and parents[0] != parent:
                parent = parents[0]
                lines.append(f'    {parent}:')
            lines += _yaml_comment(entry, f'{indent}# ')
            lines.append(f'{indent}{key}: {_yaml_value(entry.default)}')
    return '\n'.join(lines) + '\n'


def _yaml_comment(entry: Entry, start: str) -> list[str]:
    allowed = f'{allowed_text(entry)} {entry.unit}'.strip()
    parts = [part for part in (allowed, entry.constraint, entry.effect) if part]
    text = f'{entry.meaning} [{"; ".join(parts)}]'.replace('`', '')
    return textwrap.wrap(text, 99, initial_indent=start, subsequent_indent=start)


def _yaml_value(value: Value) -> str:
    text: str = yaml.safe_dump(plain(value), default_flow_style=True)
    return text.removesuffix('\n').removesuffix('\n...')


def main(arguments: Sequence[str]) -> None:
    """Print docs/parameters.md, or with `yaml` config/sim.yaml."""
    pages: Mapping[str, Callable[[], str]] = {'markdown': markdown, 'yaml': yaml_file}
    page = check.choice('page', arguments[0] if arguments else 'markdown', pages)
    sys.stdout.write(pages[page]())


if __name__ == '__main__':
    main(sys.argv[1:])
