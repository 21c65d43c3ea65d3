"""Programs that a process starts which has loaded what they import already.

To load Python, NumPy and ROS takes half a second of a core, and the tests start some hundred
nodes; numba takes longer. One process for each test process loads them once; a program is then a
copy of it, with arguments, environment, folder and output of its own. It runs as a program started
anew does, in a process of its own; ROS is first initialised there. What takes most of the time
from there on is in memory too: the C code of messages, machine code, the disc. The tests of the
start itself start anew.
"""

import atexit
from collections.abc import Mapping, Sequence
import contextlib
import ctypes
import functools
import gc
import importlib
import inspect
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

    def __init__(
        self,
        program: str | Path,
        arguments: Sequence[str],
        output: Path,
        *,
        errors: Path | None = None,
        environment: Mapping[str, str] = os.environ,
        imports: str = '',
        before: str = '',
    ) -> None:
        """Run a program.

        Args:
            program: A module of `IMPORTS`, or a script.
            arguments: What follows it on the command line.
            output: A file that exists and gets stdout.
            errors: Another one for stderr; None for the same.
            environment: What it sees as its environment.
            imports: A module that is loaded before; '' for those of `IMPORTS`.
            before: Python code that runs first in the copy.
        """
        self.returncode: int | None = None
        self._end, theirs = socket.socketpair()
        request = {
            'program': str(program),
            'is_script': isinstance(program, Path),
            'imports': imports or IMPORTS[str(program)],
            'before': before,
            'arguments': list(arguments),
            'output': str(output),
            'errors': str(errors or output),
            'folder': str(Path.cwd()),
            'environment': dict(environment),
        }
        requests = _server(imports).requests
        with theirs:
            socket.send_fds(requests, [json.dumps(request).encode()], [theirs.fileno()])
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

    Anew where the environment is another one than that of the server, in what is read before ROS
    is initialised.

    Args:
        module: What `python -m` runs.
        arguments: What follows it on the command line.
        output: The file that gets stdout and stderr.
        before: Python code that runs first.
    """
    output.write_bytes(b'')
    if _environment() == _server().environment:
        return Forked(module, arguments, output, before=before)
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
        program = f'import forked\nforked.become(forked.serve({theirs.fileno()}))'
        path = os.pathsep.join(sys.path)  # `forked` is found in test/
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
def _server(imports: str = '') -> Server:
    """Return the process that has loaded a module, or '' for that of ROS."""
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
        prepare(request['imports'])
        gc.freeze()  # the copy need not look for garbage in what is here
        pid = fork()
        if pid == 0:
            for one in (requests, end, *(other for _, other in running.values())):
                one.close()
            for handle in running:
                os.close(handle)
            return request
        running[os.pidfd_open(pid)] = pid, end
        end.sendall(f'{pid}\n'.encode())


def fork() -> int:
    """Fork, and tell LTTng, which the wheels of ROS load.

    It has two threads, which a copy does not have. Without a word it would end them with the copy
    nevertheless: a segmentation fault, if their memory is in use for something else by then.
    """
    maps = Path('/proc/self/maps').read_text(encoding='utf-8')
    paths = {line.split(maxsplit=5)[-1] for line in maps.splitlines() if '/liblttng-ust' in line}
    libraries = [ctypes.CDLL(path, mode=os.RTLD_NOLOAD | os.RTLD_NOW) for path in paths]
    signals = ctypes.create_string_buffer(128)  # a sigset_t

    def tell(what: str) -> None:
        for library in libraries:
            for name in (f'ust_{what}', f'lttng_ust_{what}'):  # until LTTng 2.12, and since
                if hasattr(library, name):
                    getattr(library, name)(signals)

    tell('before_fork')
    pid = os.fork()
    tell('after_fork_parent' if pid else 'after_fork_child')
    return pid


@functools.cache
def prepare(imports: str) -> None:
    """Load a module, and if it is of a node what each node loads after it is made."""
    importlib.import_module(imports)
    if imports not in IMPORTS.values():
        return
    from rclpy.type_support import check_for_type_support

    from disc_sim_ros.physics import disc_file

    for name, module in list(sys.modules.items()):
        if name.endswith(('.msg', '.srv')):
            for kind in vars(module).values():
                if hasattr(type(kind), '__import_type_support__'):
                    check_for_type_support(kind)
    inspect.getmodule(sys._getframe())  # for the log: finds the files of all modules
    disc_file.load_disc('frisbee')
    if 'disc_sim_ros.ros.sim.compiled_loop' in sys.modules:
        sys.modules['disc_sim_ros.ros.sim.compiled_loop'].warm_up()


def become(request: Mapping[str, Any]) -> None:
    """Be the program, in a new process; its end is that of the process."""
    for number, name in ((1, 'output'), (2, 'errors')):
        file = os.open(request[name], os.O_WRONLY | os.O_APPEND)
        os.dup2(file, number)
        os.close(file)
    os.environ.clear()
    os.environ.update(request['environment'])
    os.chdir(request['folder'])
    sys.argv = ['-c', *request['arguments']]
    exec(request['before'], {})
    run = runpy.run_module
    if request['is_script']:
        sys.path.insert(0, str(Path(request['program']).parent))
        run = runpy.run_path
    run(request['program'], run_name='__main__')
