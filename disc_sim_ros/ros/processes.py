"""One throw in real time, with sim_node and recorder_node as processes of their own."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
import fcntl
import os
from pathlib import Path
import socket
import subprocess
import sys
import tempfile

import yaml

from disc_sim_ros.errors import DiscSimError

DOMAINS = range(1, 102)  # above, the ports of Fast DDS are among those the system hands out
END = 30.0  # s for a process to end after its signal
_PROGRAM = 'import sys; from disc_sim_ros.cli.{0} import main; sys.exit(main())'


@contextmanager
def own_domain() -> Iterator[int]:
    """Yield a ROS domain that nobody on this machine uses, and keep it taken.

    The environment of processes started meanwhile has it, and keeps them on this machine.

    Raises:
        DiscSimError: All are taken.
    """
    first = os.getpid() % len(DOMAINS)
    for domain in [*DOMAINS[first:], *DOMAINS[:first]]:
        name = f'disc_sim_ros_domain_{os.getuid()}_{domain}'
        with (Path(tempfile.gettempdir()) / name).open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if _is_used(domain):
                continue
            os.environ['ROS_DOMAIN_ID'] = str(domain)
            os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
            yield domain
            return
    raise DiscSimError(f'no free ROS domain among {DOMAINS[0]} to {DOMAINS[-1]}')


def _is_used(domain: int) -> bool:
    """Say whether a DDS participant of this machine listens on the first port of a domain."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(('', 7400 + 250 * domain + 10))
        except OSError:
            return True
    return False


class Process:
    """A program of this package in a process and a session of its own.

    Ctrl-C in the terminal reaches only who started it, who then ends it in order.
    """

    def __init__(
        self, program: str, parameters: Mapping[str, object], folder: Path, *arguments: str
    ) -> None:
        """Start it.

        Args:
            program: Such as 'sim_node'.
            parameters: Of the node.
            folder: For the file of parameters and for what it says.
            arguments: More for ROS, such as '-r' and '__ns:=/red'.
        """
        self.name = program
        self.log = folder / f'{program}.log'
        file = folder / f'{program}.yaml'
        document = {'/**': {'ros__parameters': dict(parameters)}}
        file.write_text(yaml.safe_dump(document), encoding='utf-8')
        command = [sys.executable, '-c', _PROGRAM.format(program)]
        with self.log.open('wb') as log:
            self._process = subprocess.Popen(  # noqa: S603 - this package's own programs
                [*command, '--ros-args', '--params-file', str(file), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def check(self) -> None:
        """Raise where it has ended by itself."""
        if self._process.poll() is not None:
            raise self._failed(f'ended with code {self._process.returncode}')

    def end(self) -> None:
        """Send SIGTERM and wait for the end.

        A Python that is still importing may swallow a SIGINT, but never this.

        Raises:
            DiscSimError: It did not end, or not with 0.
        """
        if self._process.poll() is None:
            self._process.terminate()
        try:
            code = self._process.wait(END)
        except subprocess.TimeoutExpired:
            self.kill()
            raise self._failed(f'did not end within {END:g} s') from None
        if code:
            raise self._failed(f'ended with code {code}')

    def kill(self) -> None:
        """End it at once, if it still runs."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()

    def _failed(self, what: str) -> DiscSimError:
        said = self.log.read_text(encoding='utf-8', errors='replace').strip().splitlines()
        return DiscSimError(f'{self.name} {what}' + (f': {said[-1]}' if said else ''))


@contextmanager
def started(
    program: str, parameters: Mapping[str, object], folder: Path, *arguments: str
) -> Iterator[Process]:
    """Yield a process that ends with the block, in order or, where that fails, at once."""
    process = Process(program, parameters, folder, *arguments)
    try:
        yield process
    except BaseException:
        with suppress(DiscSimError):
            process.end()
        raise
    finally:
        process.kill()
