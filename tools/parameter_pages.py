"""The pages made of the parameter tables.

`python tools/parameter_pages.py` prints docs/parameters.md; with the word `yaml`
config/sim.yaml, with `recorder` docs/recorder.md, with `recorder_yaml` config/recorder.yaml.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
import sys
import textwrap

import yaml

from disc_sim_ros import validation
from disc_sim_ros.ros.parameter_spec import ParameterSpec, Value, allowed_text, plain
from disc_sim_ros.ros.recorder.options import RECORDER_GROUPS
from disc_sim_ros.ros.sim.parameters import GROUPS

_PAGE = """\
# Parameters of sim_node

<!-- Made by: python tools/parameter_pages.py > docs/parameters.md -->

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


_RECORDER_PAGE = """\
# recorder_node

<!-- Made by: python tools/parameter_pages.py recorder > docs/recorder.md -->

Records every topic, as the bytes that arrived, into an MCAP bag that `ros2 bag`, Foxglove and
`analyse_bag` read ([bags.md](bags.md) says what is in it):

    ros2 run disc_sim_ros recorder_node --ros-args -p bag:=my_flight
    ros2 run disc_sim_ros recorder_node --ros-args -p exclude:='/rosout|/parameter_events'

Ctrl-C or SIGTERM ends it: what has arrived is written, the bag gets its index, and the last line
says what is in it. Whatever else ends it (SIGKILL, power) costs at most the messages since the
last flush, `flush_period`; `repair_bag` makes such a bag whole. A full disk or a folder that is
removed ends it with exit code 1 and a bag that can be read. An existing bag is never touched: exit
code 2.

- **Found** within 0.05 s of the graph knowing it, whatever publishes it, before or after the
  start. Hidden topics (with a part that begins with `_`) are recorded if `topics` names them, and
  topics that nobody but the recorder publishes if `topics` or `regex` does. A type that is not
  installed, or a second type on a topic, is warned of once; the rest goes on.
- **Asked for** as reliably as all publishers of a topic offer, 5000 messages deep, which is half a
  second at 10 kHz; if a publisher comes that offers less, a second subscription takes over, and
  nothing is recorded twice or left out.
- **Taken** every 10 ms, every 1 ms with `use_sim_time`, by a thread of its own, as bytes.
- **Stamped** with the time of arrival as log time (of `/clock` with `use_sim_time`; what comes
  before the first `/clock` waits for it and gets that time, or that of arrival if none comes) and
  the time of sending as publish time.
- **Undisturbed** where the wall clock is set: log times go on without the jump, of which it warns.
  What has stamps of its own keeps them.
- **Counted**: messages that the middleware lost, numbers missing in the sequence of a publisher
  that is alone on its topic, and messages dropped because 512 MiB waited for the disk stand in
  `/diagnostics`, in the log and in `custom_data` of the bag, as `lost`, `gaps` and `dropped` with
  the topic. A message can be in both `lost` and `gaps`. `/diagnostics` tells once a second also
  how much is recorded and waits, how late a message was taken, and the room on the disk.
- **Alone** in its bag: a second recorder of the same name goes on with another bag, and both warn.

| service (std_srvs/Trigger) | does |
|---|---|
| `~/pause` | record nothing until `~/resume` |
| `~/resume` | go on, with the last message of each latched publisher that came meanwhile |
| `~/split` | begin the next file of the bag |
| `~/flush` | bring everything to the disk now |

Parameters are fixed when the node starts; `config/recorder.yaml` holds them all. A misspelt name
ends the node with an error.
"""


def markdown() -> str:
    """Return docs/parameters.md."""
    return _PAGE + _markdown_groups(GROUPS)


def recorder_markdown() -> str:
    """Return docs/recorder.md."""
    return _RECORDER_PAGE + _markdown_groups(RECORDER_GROUPS)


def _markdown_groups(groups: Mapping[str, Sequence[ParameterSpec]]) -> str:
    return ''.join(_markdown_group(title, group) for title, group in groups.items())


def _markdown_group(title: str, group: Iterable[ParameterSpec]) -> str:
    head = (
        '| parameter | default | unit | allowed | change | meaning |\n|---|---|---|---|---|---|\n'
    )
    return f'\n## {title}\n\n{head}{"".join(_markdown_row(entry) for entry in group)}'


def _markdown_row(entry: ParameterSpec) -> str:
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
    return _yaml_file('sim_node', GROUPS)


def recorder_yaml_file() -> str:
    """Return config/recorder.yaml."""
    return _yaml_file('recorder_node', RECORDER_GROUPS)


def _yaml_file(node: str, groups: Mapping[str, Sequence[ParameterSpec]]) -> str:
    lines = [
        f'# Every parameter of {node} with its default. Copy it and keep what you change.',
        '# In brackets: what is allowed, and when a change while the node runs takes effect.',
        '/**:',
        '  ros__parameters:',
    ]
    for title, group in groups.items():
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


def _yaml_comment(entry: ParameterSpec, start: str) -> list[str]:
    allowed = f'{allowed_text(entry)} {entry.unit}'.strip()
    parts = [part for part in (allowed, entry.constraint, entry.effect) if part]
    text = f'{entry.meaning} [{"; ".join(parts)}]'.replace('`', '')
    return textwrap.wrap(text, 99, initial_indent=start, subsequent_indent=start)


def _yaml_value(value: Value) -> str:
    text: str = yaml.safe_dump(plain(value), default_flow_style=True)
    return text.removesuffix('\n').removesuffix('\n...')


PAGES: Mapping[str, Callable[[], str]] = {
    'markdown': markdown,
    'yaml': yaml_file,
    'recorder': recorder_markdown,
    'recorder_yaml': recorder_yaml_file,
}


def main(arguments: Sequence[str]) -> None:
    """Print one of the PAGES; without a word the first."""
    page = validation.choice('page', arguments[0] if arguments else 'markdown', PAGES)
    sys.stdout.write(PAGES[page]())


if __name__ == '__main__':
    main(sys.argv[1:])
