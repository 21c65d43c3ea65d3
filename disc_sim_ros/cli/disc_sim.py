"""`disc-sim`: every program of this package under one name, for a PATH that has another `fly`."""

import argparse
from collections.abc import Callable, Sequence
import sys

from disc_sim_ros import __version__
from disc_sim_ros.cli import output, start
from disc_sim_ros.cli.arguments import Parser
from disc_sim_ros.cli.main import run_program
from disc_sim_ros.cli.start import Program


# Each is imported when it is called, as the other programs are in `start`.
def _predictor_node() -> Program:
    from disc_sim_ros.cli import predictor_node  # noqa: PLC0415

    return predictor_node.main


def _sim_node() -> Program:
    from disc_sim_ros.cli import sim_node  # noqa: PLC0415

    return sim_node.main


def _recorder_node() -> Program:
    from disc_sim_ros.cli import recorder_node  # noqa: PLC0415

    return recorder_node.main


def _policy_node() -> Program:
    from disc_sim_ros.cli import policy_node  # noqa: PLC0415

    return policy_node.main


def _live_view() -> Program:
    from disc_sim_ros.cli import live_view  # noqa: PLC0415

    return live_view.main


PROGRAMS: dict[str, tuple[Callable[[], Program], str]] = {
    'fly': (start.load_fly, 'compute one flight: summary, JSON, CSV, plot or bag'),
    'sweep': (start.load_sweep, 'compute grids and random ensembles of flights into one file'),
    'optimise': (start.load_optimise, 'find the launch with the best range, time or accuracy'),
    'identify': (start.load_identify, 'find the coefficients of a disc from measured throws'),
    'demo': (start.load_demo, 'throw in real time, record and analyse the flight (ROS 2)'),
    'sim_node': (_sim_node, 'run the simulator node (ROS 2)'),
    'recorder_node': (_recorder_node, 'run the recorder node (ROS 2)'),
    'policy_node': (_policy_node, 'steer the disc by a learned policy (ROS 2)'),
    'live_view': (_live_view, 'show the running simulators in a browser (ROS 2)'),
    'predictor_node': (_predictor_node, 'predict where a disc lands while it flies (ROS 2)'),
    'predict': (start.load_predict, 'predict the landings of recorded throws'),
    'analyse_bag': (start.load_analyse_bag, 'summarise, verify or plot the flights in a bag'),
    'repair_bag': (
        start.load_repair_bag,
        'copy what a damaged bag holds into a complete one',
    ),
    'paper_figures': (start.load_paper_figures, 'compute the figures of Crowther & Potts (2007)'),
}


def parser() -> Parser:
    """Return the command line of `disc-sim` up to the name of a program."""
    width = max(map(len, PROGRAMS))
    lines = (f'  {name:{width}}  {line}' for name, (_, line) in PROGRAMS.items())
    p = Parser(
        prog='disc-sim',
        usage='disc-sim [-h] [--version] PROGRAM ...',
        description='Simulate the flight of spin-stabilised discs. `disc-sim PROGRAM --help`\n'
        'explains a program; each program is also an executable of its own name.',
        epilog='\n'.join(['programs:', *lines]),
    )
    p.formatter_class = argparse.RawDescriptionHelpFormatter
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    p.add_argument('PROGRAM', nargs='?', choices=tuple(PROGRAMS), help=argparse.SUPPRESS)
    return p


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program that the first word names and return its exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words and words[0] in PROGRAMS:
        load, _ = PROGRAMS[words[0]]
        with start.ended_by_ctrl_c():
            program = load()
        return program(words[1:], f'disc-sim {words[0]}')
    p = parser()

    def show_help(_: argparse.Namespace) -> int:
        output.show(p.format_help().rstrip())
        return 0

    return run_program(p, show_help, words)


if __name__ == '__main__':
    sys.exit(main())
