"""Programs of ROS that a process starts which has loaded what they import already.

To load Python, NumPy and ROS takes half a second of a core, and the tests start some hundred
nodes. One process for each test process loads them once; a program is then a copy of it, with
arguments, environment, folder and output of its own. It runs as a program started anew does, in a
process of its own; ROS is first initialised there. The tests of the start itself start anew.
"""

import atexit
from collections.abc import Mapping, Sequence
import contextlib
import functools
import importlib
import json
import os
from pathlib import Path
import runpy
import select
import signal
import socket
import subprocess
import sys
from typing import Any

IMPORTS = {  # what a program imports first of all, which its first copy waits for
    'disc_sim_ros.ros.live': 'disc_sim_ros.ros.live.node',
    'disc_sim_ros.ros.policy': 'disc_sim_ros.ros.policy.node',
    'disc_sim_ros.ros.recorder': 'disc_sim_ros.ros.recorder.node',
    'disc_sim_ros.ros.sim': 'disc_sim_ros.ros.sim.node',
    'disc_sim_ros.ros.throw_when_ready': 'disc_sim_ros.ros.client',
}
READ_LATE = {  # variables that a program reads when it initialises ROS, or not at all
    'FASTDDS_DEFAULT_PROFILES_FILE', 'FASTRTPS_DEFAULT_PROFILES_FILE', 'PYTEST_CURRENT_TEST',
    'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_DOMAIN_ID', 'ROS_LOG_DIR',
}  # fmt: skip


class Forked:
    """A program that was started so, with the interface of `subprocess.Popen`.

    Attributes:
        pid: Its process.
        returncode: Its exit code, or minus the signal that ended it; None until one has asked
            after its end.
    """

    def __init__(self, module: str, arguments: Sequence[str], output: Path) -> None:
        """Run a module; stdout and stderr go to a file that exists."""
        self.returncode: int | None = None
        self._end, theirs = socket.socketpair()
        request = {
            'module': module,
            'arguments': list(arguments),
            'output': str(output),
            'folder': str(Path.cwd()),
            'environment': dict(os.environ),
        }
        with theirs:
            socket.send_fds(_server().requests, [json.dumps(request).encode()], [theirs.fileno()])
        self.pid = int(self._line())

    def _line(self) -> str:
        """Return the next line from the server."""
        text = b''
        while not text.endswith(b'\n'):
            part = self._end.recv(1)
            if not part:
                raise ConnectionError('the process that starts programs has ended')
            text += part
        return text.decode()

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.wait(0.0)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end, at most `timeout` [s]; return the exit code."""
        if self.returncode is None:
            ready, _, _ = select.select([self._end], [], [], timeout)
            if not ready:
                raise subprocess.TimeoutExpired(f'process {self.pid}', timeout or 0.0)
            self.returncode = int(self._line())
            self._end.close()
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill it."""
        self.send_signal(signal.SIGKILL)


def start(
    module: str, arguments: Sequence[str], output: Path, before: str = ''
) -> Forked | subprocess.Popen[bytes]:
    """Run a module of `IMPORTS` in a process of its own.

    Anew where `before`, Python code, has to run first, or where the environment is another one
    than that of the server, in what is read before ROS is initialised.

    Args:
        module: What `python -m` runs.
        arguments: What follows it on the command line.
        output: The file that gets stdout and stderr.
        before: Python code that runs first.
    """
    output.write_bytes(b'')
    if not before and _environment() == _server().environment:
        return Forked(module, arguments, output)
    program = f'{before}\nimport runpy\nrunpy.run_module({module!r}, run_name="__main__")'
    with output.open('wb') as file:
        command = [sys.executable, '-c', program, *arguments]
        return subprocess.Popen(command, stdout=file, stderr=file)


def _environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in READ_LATE}


class Server:
    """The process that has loaded all and copies itself.

    Attributes:
        requests: The socket that takes a request each.
        environment: That of its start, without `READ_LATE`.
    """

    def __init__(self) -> None:
        self.environment = _environment()
        self.requests, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        program = f'from ros import forked\nforked.become(forked.serve({theirs.fileno()}))'
        path = os.pathsep.join(sys.path)  # `ros` is found in test/
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, '-c', program],
                pass_fds=[theirs.fileno()],
                env=os.environ | {'PYTHONPATH': path},
            )
        atexit.register(self._end)

    def _end(self) -> None:
        self.requests.close()
        self._process.wait()


@functools.cache
def _server() -> Server:
    return Server()


def serve(number: int) -> dict[str, Any]:
    """Start programs until the test process ends, and report their exit codes.

    Args:
        number: The file descriptor of the socket with the requests.

    Returns:
        In the process of a program: the request for it. The server itself ends with `SystemExit`.
    """
    requests = socket.socket(fileno=number)
    running: dict[int, tuple[int, socket.socket]] = {}  # by what is readable once it has ended
    while True:
        ready, _, _ = select.select([requests, *running], [], [])
        for handle in set(ready) & set(running):
            pid, end = running.pop(handle)
            _, status = os.waitpid(pid, 0)
            os.close(handle)
            with contextlib.suppress(OSError), end:
                end.sendall(f'{os.waitstatus_to_exitcode(status)}\n'.encode())
        if requests not in ready:
            continue
        data, handles, _, _ = socket.recv_fds(requests, 1 << 20, 1)
        if not data:
            sys.exit()
        end, request = socket.socket(fileno=handles[0]), json.loads(data)
        importlib.import_module(IMPORTS[request['module']])
        pid = os.fork()
        if pid == 0:
            for one in (requests, end, *(other for _, other in running.values())):
                one.close()
            for handle in running:
                os.close(handle)
            return request
        running[os.pidfd_open(pid)] = pid, end
        end.sendall(f'{pid}\n'.encode())


def become(request: Mapping[str, Any]) -> None:
    """Be the program, in a new process; its end is that of the process."""
    output = os.open(request['output'], os.O_WRONLY | os.O_APPEND)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    os.environ.clear()
    os.environ.update(request['environment'])
    os.chdir(request['folder'])
    sys.argv = ['-c', *request['arguments']]
    runpy.run_module(request['module'], run_name='__main__')
