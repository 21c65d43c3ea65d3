"""Makes the pages and parameter files of the nodes from their tables of parameters.

`python tools/parameter_pages.py` prints docs/parameters.md; with the argument `yaml` it prints
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

Give parameters in a file (`config/sim.yaml` holds all of them), on the command line, or while the
node runs:

    ros2 run disc_sim_ros sim_node --ros-args --params-file my.yaml -p launch.speed:=20
    ros2 param set /sim_node launch.pitch 10

The node checks all parameters together. It refuses a change that contradicts another parameter, as
a whole, and states the reason. Set parameters that are only valid together, such as `physics_rate`
and `publish_rate`, in one `set_parameters_atomically`. A misspelt name in a file or on the command
line ends the node with an error.

In a file, `/**:` applies to every node; `sim_node:` does not match a node in a namespace. A whole
number may stand for a double. ROS itself has three traps. It refuses a list of mixed numbers such
as `[0, 0.5, 0]`; write all of them with a decimal point. It reads a number that starts with 0 as
octal: 010 is 8. On the command line it accepts an empty text only as `-p "frame_prefix:=''"`.

A change marked `next throw` does not affect the disc that is in the air. A `fixed` parameter is
read-only.
"""


_RECORDER_PAGE = """\
# recorder_node

<!-- Made by: python tools/parameter_pages.py recorder > docs/recorder.md -->

`recorder_node` writes every topic, as the bytes that arrived, to an MCAP bag for `ros2 bag`,
Foxglove and `analyse_bag` ([bags.md](bags.md) describes the contents):

    ros2 run disc_sim_ros recorder_node --ros-args -p bag:=my_flight
    ros2 run disc_sim_ros recorder_node --ros-args -p exclude:='/rosout|/parameter_events'

Ctrl-C, SIGTERM, SIGHUP (the terminal is closed) or SIGQUIT ends it: it writes the messages that
have arrived, then the index, and prints a summary of the bag. If it is killed or the power fails,
at most the messages since the last flush (`flush_period`) are lost, and `repair_bag` makes a
complete copy of the bag. If the disk is full or the folder is removed, it ends with code 1 and
leaves a readable bag. If the bag that `bag` names exists, it ends with exit code 2 and changes
nothing; a default name that is taken gets a number, such as `_2`.

- **Discovery.** A topic is subscribed within 0.05 s after the graph reports it, whether its
  publisher started before or after the recorder. A hidden topic (a part of its name begins with
  `_`) is recorded if `topics` names it; a topic that only the recorder publishes is recorded if
  `topics` or `regex` selects it. A type that is not installed causes
  one warning, and the bag and the last line name it; the other topics are recorded. If another
  type appears on a topic, it is recorded as a channel of its own, and one warning says so.
- **Quality of service.** The subscription requests what all publishers of a topic offer, with a
  depth of 5000 messages: half a second at 10 kHz. If a publisher with a weaker offer appears, a
  second subscription takes over; no message is lost or recorded twice.
- **Taking messages.** A thread of its own takes the messages as bytes, every 10 ms, or every 1 ms
  with `use_sim_time`.
- **Time stamps.** The log time is the time of arrival; with `use_sim_time` it is the time of
  `/clock`. The publish time is the time of sending. Messages that arrive before the first `/clock`
  wait for it and get its time, or the time of arrival if no `/clock` comes.
- **Jumps of the wall clock.** If the wall clock is set, log times continue without the jump, and
  the recorder warns. Stamps inside messages are not changed.
- **Losses.** `/diagnostics`, the log and `custom_data` of the bag report, for each topic: `lost`
  (lost by the middleware), `gaps` (numbers missing in the sequence of a topic with one publisher)
  and `dropped` (512 MiB already waited for the disk). A message can be in both `lost` and `gaps`.
  The cause seen so far is a machine under load that does not let the receiving thread of the
  middleware run: the queue of the shared memory, 512 messages, overflows, and the publisher
  repeats only what it still has, every 3 s. At load 16 on two cores, `sim_node` at 1 kHz kept
  2000 messages of each topic, and in three runs 2, 2 and 33 of 260,917, 254,513 and 256,013
  messages were lost; each was reported.
  These numbers are lower bounds: a gap shows with the next message of its publisher. What no
  number shows is told as well: `stood still` (this process did not run for more than 0.5 s),
  `publishers ended around a stall` (the middleware may have discarded what they sent last), and in
  the last line how many messages were sent before the subscriptions. "Nothing lost" stands there
  otherwise.
  Once a second `/diagnostics` also reports the amounts recorded and waiting, the greatest delay
  before a message was taken, and the free space on the disk.
- **Two recorders.** A second recorder of the same name writes another bag, and both warn.

| service (std_srvs/Trigger) | does |
|---|---|
| `~/pause` | stop recording until `~/resume` |
| `~/resume` | continue; latched messages that arrived during the pause are recorded first |
| `~/split` | begin the next file of the bag |
| `~/flush` | write all messages to the disk now |

Parameters are fixed when the node starts; `config/recorder.yaml` holds all of them. A misspelt
name ends the node with an error.
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
    return f'\n## {title}\n\n{head}{"".join(_markdown_row(spec) for spec in group)}'


def _markdown_row(spec: ParameterSpec) -> str:
    allowed = '; '.join(part for part in (allowed_text(spec), spec.constraint) if part)
    cells = (
        f'`{spec.name}`',
        f'`{_yaml_value(spec.default)}`',
        spec.unit,
        allowed,
        spec.effect,
        spec.meaning,
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
        f'# Every parameter of {node} with its default. Copy the file and keep what you change.',
        '# In brackets: the allowed values, and when a change takes effect while the node runs.',
        '/**:',
        '  ros__parameters:',
    ]
    for title, group in groups.items():
        lines += ['', f'    # ---- {title} ----']
        parent = ''
        for spec in group:
            *parents, key = spec.name.split('.')
            indent = ' ' * (4 + 2 * len(parents))
            if parents and parents[0] != parent:
                parent = parents[0]
                lines.append(f'    {parent}:')
            lines += _yaml_comment(spec, f'{indent}# ')
            lines.append(f'{indent}{key}: {_yaml_value(spec.default)}')
    return '\n'.join(lines) + '\n'


def _yaml_comment(spec: ParameterSpec, start: str) -> list[str]:
    allowed = f'{allowed_text(spec)} {spec.unit}'.strip()
    parts = [part for part in (allowed, spec.constraint, spec.effect) if part]
    text = f'{spec.meaning} [{"; ".join(parts)}]'.replace('`', '')
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
    """Print one of the PAGES; without an argument the first."""
    page = validation.choice('page', arguments[0] if arguments else 'markdown', PAGES)
    sys.stdout.write(PAGES[page]())


if __name__ == '__main__':
    main(sys.argv[1:])
