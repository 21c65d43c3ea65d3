"""The nodes of this package as processes, in a ROS domain of their own."""

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

DOMAINS = range(1, 102)  # the ports of Fast DDS for higher ones are ephemeral ports of Linux
END = 30.0  # s for a process to end after its signal
_MODULES = {
    'sim_node': 'disc_sim_ros.ros.sim',
    'recorder_node': 'disc_sim_ros.ros.recorder',
    'predictor_node': 'disc_sim_ros.ros.predictor',
    'policy_node': 'disc_sim_ros.ros.policy',
    'live_view': 'disc_sim_ros.ros.live',
}


@contextmanager
def own_domain() -> Iterator[int]:
    """Yield a ROS domain that no other process on this machine uses, and keep it reserved.

    Within the block the environment of this process, and of those started in it, names this domain
    and keeps them on this machine. After the block the environment is as it was.

    Raises:
        DiscSimError: All domains are in use.
    """
    with reserved_domain() as domain:
        changes = {
            'ROS_DOMAIN_ID': str(domain),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        }
        before = {name: os.environ.get(name) for name in changes}
        os.environ.update(changes)
        try:
            yield domain
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value


@contextmanager
def reserved_domain() -> Iterator[int]:
    """Yield a ROS domain that no other process on this machine uses, and keep it reserved.

    Raises:
        DiscSimError: All domains are in use.
    """
    first = os.getpid() % len(DOMAINS)
    for domain in [*DOMAINS[first:], *DOMAINS[:first]]:
        name = f'disc_sim_ros_domain_{os.getuid()}_{domain}'
        with (Path(tempfile.gettempdir()) / name).open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if _has_participant(domain):
                continue
            yield domain
            return
    raise DiscSimError(f'no free ROS domain among {DOMAINS[0]} to {DOMAINS[-1]}')


def _has_participant(domain: int) -> bool:
    """Return True if a DDS participant on this machine has the first port of a domain."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(('', 7400 + 250 * domain + 10))
        except OSError:
            return True
    return False


class Process:
    """A node of this package in its own process and session.

    Ctrl-C in the terminal reaches only the parent process, which then ends this one in order.

    Attributes:
        name: Name of the program.
        log: File with its output.
    """

    def __init__(
        self, program: str, parameters: Mapping[str, object], folder: Path, *arguments: str
    ) -> None:
        """Start it.

        Args:
            program: A node of this package, such as 'sim_node'.
            parameters: Parameters of the node.
            folder: Folder for its parameter file and its log.
            arguments: More arguments for ROS, such as '-r' and '__ns:=/red'.
        """
        self.name = program
        self.log = folder / f'{program}.log'
        file = folder / f'{program}.yaml'
        document = {'/**': {'ros__parameters': dict(parameters)}}
        file.write_text(yaml.safe_dump(document), encoding='utf-8')
        command = [sys.executable, '-m', _MODULES[program]]
        with self.log.open('wb') as log:
            self._process = subprocess.Popen(  # noqa: S603 - a program of this package
                [*command, '--ros-args', '--params-file', str(file), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Return the number of the process."""
        return self._process.pid

    def check(self) -> None:
        """Check that the process runs.

        Raises:
            DiscSimError: It has ended.
        """
        if self._process.poll() is not None:
            raise self._failed(f'ended with code {self._process.returncode}')

    def end(self) -> None:
        """Send SIGTERM and wait for the end.

        A Python that still imports modules may ignore SIGINT, but not SIGTERM.

        Raises:
            DiscSimError: It did not end, or not with code 0.
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
        """Kill the process if it still runs."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()

    def _failed(self, what: str) -> DiscSimError:
        lines = self.log.read_text(encoding='utf-8', errors='replace').strip().splitlines()
        return DiscSimError(f'{self.name} {what}' + (f': {lines[-1]}' if lines else ''))


@contextmanager
def started(
    program: str, parameters: Mapping[str, object], folder: Path, *arguments: str
) -> Iterator[Process]:
    """Yield a process that ends with the block: in order if it can, otherwise it is killed.

    See `Process` for the arguments. A block that ends without an exception should call
    `Process.end`, which raises if the process does not end in order.
    """
    process = Process(program, parameters, folder, *arguments)
    try:
        yield process
    except BaseException:
        with suppress(DiscSimError):
            process.end()
        raise
    finally:
        process.kill()
