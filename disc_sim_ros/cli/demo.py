"""`demo`: throws one disc in real time, records the flight and analyses the bag."""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from pathlib import Path
import shutil
import signal
import sys
import tempfile
from typing import TYPE_CHECKING, Self

import disc_sim_ros
from disc_sim_ros import __version__, topics
from disc_sim_ros.cli import flags, output, pages
from disc_sim_ros.cli.arguments import Parser, add_quantity, path
from disc_sim_ros.cli.main import DIFFERENT, run_program
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import flight
from disc_sim_ros.quantities import DURATION, TIMING
from disc_sim_ros.units import SYSTEMS, System

if TYPE_CHECKING:
    from disc_sim_ros.analysis.bag_analysis import Analysis
    from disc_sim_ros.ros.client import DiscSample

WHOLE_FLIGHT = TIMING['command_timeout'].highest  # s that --control acts without being renewed
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def parser(prog: str = 'demo') -> Parser:
    """Return the command line of `demo`."""
    p = Parser(
        prog=prog,
        description='Start sim_node and recorder_node in a ROS domain of their own, throw one '
        'disc in real time, and write a bag, a plot and a summary. Angles and control inputs have '
        f'the signs of {flags.PAPER}. Needs ROS 2 Jazzy.',
        epilog='Exit code 0; 1: a program failed; 2: bad input; 3: the flight computed again from '
        'the bag differs from the recorded one.',
    )
    p.set_defaults(prog=prog)
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    flags.add_disc(p)
    flags.add_launch(p)
    flags.add_air(p, 'air and control inputs')
    kept = p.add_argument_group('recording')
    output.add_units(kept)
    text = 'longest time to wait for the landing'
    add_quantity(kept, '--seconds', DURATION.within(0.1), dest='seconds', text=text)
    kept.add_argument(
        '--bag',
        type=path,
        default=argparse.SUPPRESS,
        metavar='DIR',
        help='new folder for the bag; the plot is DIR.png, the page with the flight in 3D '
        'DIR.html (default: bag, flight.png and flight.html in flights/DATE_TIME)',
    )
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'demo') -> int:
    """Run `demo` and return its exit code."""
    return run_program(parser(prog), _run, arguments, in_flags=flags.in_flags)


def _run(chosen: argparse.Namespace) -> int:
    release, setup = flags.thrown(chosen)
    flight.check_flight(release, setup, chosen.seconds, ground=True, sample_rate=0.0)
    try:
        from disc_sim_ros.ros import client, processes  # noqa: F401, PLC0415 - is ROS installed?
        from disc_sim_ros.ros.sim.config import configuration  # noqa: PLC0415
    except ImportError as error:
        raise DiscSimError(
            f'it needs rclpy and the message packages of ROS 2 Jazzy ({error}); '
            '`fly --plot FILE.png` works without them'
        ) from None
    parameters = flags.parameters(chosen, release, setup)
    configuration(parameters)  # refuse here what the simulator would refuse
    bag, plot = _new_paths(getattr(chosen, 'bag', None))
    try:
        with _Signals() as signals:
            _record(chosen, parameters, bag, signals)
    finally:
        with suppress(OSError):
            bag.parent.rmdir()  # removes it only if nothing was recorded
    return _report(bag, plot, SYSTEMS[chosen.units])


def _new_paths(bag: str | None) -> tuple[Path, Path]:
    """Return the paths of the bag and of the plot; neither exists.

    Raises:
        ConfigError: The bag exists, or its folder cannot be made.
    """
    if bag is not None:
        folder = Path(bag)
        plot = folder.with_name(f'{folder.name}.png')
        for path in (folder, plot, plot.with_suffix('.html')):
            if path.exists() or path.is_symlink() or not folder.name:
                raise ConfigError('--bag', bag, f'{path} exists, and nothing is overwritten')
        _make(folder.parent, '--bag', bag)
        return folder, plot
    name = f'{datetime.now().astimezone():%Y-%m-%d_%H-%M-%S}'
    for number in range(1, 1000):
        folder = Path('flights', name if number == 1 else f'{name}_{number}')
        if not folder.exists():
            _make(folder, 'flights', str(folder))
            break
    return folder / 'bag', folder / 'flight.png'


def _make(folder: Path, thing: str, value: str) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(thing, value, f'cannot make the folder ({error.strerror})') from None


class _Signals:
    """Turns the first SIGINT, SIGTERM or SIGHUP in its block into a KeyboardInterrupt."""

    def __init__(self) -> None:
        self._held = False
        self._received = 0

    def __enter__(self) -> Self:
        self._before = {number: signal.signal(number, self._take) for number in _SIGNALS}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Delay signals to the end of this block, so that each started process is known."""
        self._held = True
        try:
            yield
        finally:
            self._held = False
        if self._received:
            raise KeyboardInterrupt(self._received)

    def _take(self, number: int, _: object) -> None:
        # This program is ending already. Not SIG_IGN: a process that is still started would
        # inherit it, and ignore the SIGTERM that ends it.
        for other in _SIGNALS:
            signal.signal(other, lambda *_: None)
        self._received = number
        if not self._held:
            raise KeyboardInterrupt(number)


def _record(
    chosen: argparse.Namespace,
    parameters: dict[str, bool | float | str],
    bag: Path,
    signals: _Signals,
) -> None:
    """Fly and record one throw."""
    from disc_sim_ros.ros import client, processes  # noqa: PLC0415
    from disc_sim_ros.ros.sim import compiled_loop  # noqa: PLC0415

    control = flags.control_of(chosen)
    parameters |= {'auto_throw': False, 'command_timeout': WHOLE_FLIGHT}
    progress = _Progress(chosen.prog, SYSTEMS[chosen.units])
    with ExitStack() as stack:
        domain = stack.enter_context(processes.own_domain())
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix='demo_')))
        progress.line(f'starting sim_node and recorder_node in ROS domain {domain}')
        if text := compiled_loop.first_call_note():
            progress.line(text)
        with signals.held():
            sim = stack.enter_context(processes.started('sim_node', parameters, folder))
            to = {'bag': str(bag.absolute()), 'start_paused': True}
            recorder = stack.enter_context(processes.started('recorder_node', to, folder))
        watcher = client.Watcher(domain, (sim, recorder), signals.held)
        stack.callback(watcher.close)
        watcher.wait_until_recorded(bag)
        if any((control.C_L, control.C_M, control.C_N)):
            watcher.steer(control)
        speed = SYSTEMS[chosen.units].text(chosen.speed, 'm/s', 'g')
        progress.line(f'throwing {chosen.disc} at {speed}')
        watcher.throw()
        ended = watcher.watch(chosen.seconds, progress.show)
        progress.line(ended)
        if not watcher.wait_until_kept(bag):
            progress.line('the recorder has not received every flight event')
        recorder.end()
        sim.end()


class _Progress:
    """Lines on stderr; on a terminal also the state of the disc, in a line that is updated."""

    def __init__(self, prog: str, system: System) -> None:
        self._prog, self._system = prog, system
        self._live = sys.stderr.isatty()
        self._open = False

    def line(self, text: str) -> None:
        """Write a line."""
        sys.stderr.write(('\n' if self._open else '') + f'{self._prog}: {text}\n')
        sys.stderr.flush()
        self._open = False

    def show(self, sample: 'DiscSample') -> None:
        """Show the state of the disc, on a terminal."""
        if self._live:
            height = self._system.text(sample.height, 'm', '6.2f')
            speed = self._system.text(sample.speed, 'm/s', '5.2f')
            sys.stderr.write(f'\r  {sample.time:5.1f} s  height {height}  speed {speed} ')
            sys.stderr.flush()
            self._open = True


def _report(bag: Path, plot: Path, system: System) -> int:
    """Analyse the bag, write the plot, print the summary; return the exit code."""
    from disc_sim_ros.analysis import bag_analysis, bag_report, flights, plots, recording  # noqa: PLC0415
    from disc_sim_ros.bags.reader import open_bag  # noqa: PLC0415

    opened = open_bag(bag)
    disc = recording.discs(opened, f'/{topics.ODOM}')[0]
    doubts = bag_analysis.doubts_of(opened)
    analyses = [bag_analysis.analyse(f, doubts) for f in flights.flights(disc)]
    if not analyses:
        raise DiscSimError(f'{bag}: the bag does not hold the throw')
    title = bag_report.title(analyses[0], system)
    image = plots.image(plots.bag_figure(analyses, title, system), 'png')
    output.write_whole('--bag', str(plot), image)
    page = _page(bag, plot.with_suffix('.html'), analyses, system)
    size = sum(file.stat().st_size for file in opened.files)
    filled = sum(info.message_count > 0 for info in opened.topics)
    lines = [
        bag_report.summary(analyses[0], system),
        bag_report.verification_text(analyses[0]),
        f'recorded {opened.message_count} messages of {filled} topics, {size / 1e6:.1f} MB, '
        + (', '.join(doubts) or 'nothing lost'),
    ]
    lines += [
        f'  {bag}',
        f'  {plot}',
        *([f'  {page}    the flight in 3D: open it in a browser'] if page else []),
        'next',
        f'  {_program_folder()}analyse_bag --verify {bag}',
        f'  ros2 bag play {bag}    (in an installation of ROS 2)',
        f'  Foxglove: open {opened.files[0]} with the layout {_layout()}',
    ]
    output.show('\n'.join(lines))
    if page:
        pages.opened(page)
    return 0 if all(a.passed for a in analyses) else DIFFERENT


def _page(bag: Path, page: Path, analyses: 'Sequence[Analysis]', system: System) -> Path | None:
    """Write the page of the flight; return None, after a note, if it cannot be written."""
    from disc_sim_ros.view.page import ViewerMissingError  # noqa: PLC0415
    from disc_sim_ros.view.page import page as page_of  # noqa: PLC0415

    try:
        content = page_of([pages.recorded(a, system) for a in analyses], bag.name, system)
    except ViewerMissingError as error:
        output.note('demo', f'note: {error}')
        return None
    output.write_whole('--bag', str(page), content)
    return page


def _program_folder() -> str:
    """Return the folder of the programs with a slash, or '' if it is first in the PATH."""
    folder = Path(sys.executable).parent
    first = shutil.which('analyse_bag')
    return '' if first and Path(first).parent == folder else f'{_short(folder)}/'


def _layout() -> Path:
    """Return the path of the layout for Foxglove."""
    name = Path('config', 'foxglove_layout.json')
    source = Path(disc_sim_ros.__file__).parents[1] / name
    return _short(source) if source.is_file() else Path(sys.prefix, 'share', 'disc_sim_ros', name)


def _short(path: Path) -> Path:
    """Return a path relative to the working directory where it lies below that."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


if __name__ == '__main__':
    sys.exit(main())
