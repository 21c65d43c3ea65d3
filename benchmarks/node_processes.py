"""The processes that benchmarks/node.py starts, and the diagnostics that it watches."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
import os
from pathlib import Path
import select
import signal
import subprocess
import sys
import tempfile
import time

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.node import Node

from node_roles import HIGH

SIM_NODE = (sys.executable, '-m', 'disc_sim_ros.ros.sim')
PYTHON_LOOP = """
import runpy
from disc_sim_ros.ros.sim import loop
loop.compiled_loop = lambda *_: None
runpy.run_module('disc_sim_ros.ros.sim', run_name='__main__')
"""
DEADLINE = 60.0  # s, for a process to be ready


@contextmanager
def simulator(
    physics: int, publish: int, kind: str, **environment: str
) -> Iterator[subprocess.Popen]:
    """Run a node in a process of its own: 'sim_node', its 'Python loop', 'naive' or 'C++'."""
    if kind == 'naive':
        with role('naive', str(physics)) as process:
            yield process
    elif kind.startswith('C++'):
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            yield stack.enter_context(role('rcl', str(build_rcl_loop(folder)), str(physics)))
    else:
        python_loop = kind == 'Python loop'
        with started(physics, publish, python_loop=python_loop, **environment) as process:
            yield process


def build_rcl_loop(folder: Path) -> Path:
    """Build benchmarks/rcl_loop.cpp with the headers of the ROS that rclpy belongs to."""
    maps = Path('/proc/self/maps').read_text(encoding='utf-8').splitlines()
    root = next(Path(line.split()[-1]) for line in maps if line.endswith('/librcl.so')).parents[1]
    library = folder / 'librcl_loop.so'
    command = ['g++', '-O2', '-std=c++17', '-shared', '-fPIC', '-Wall', '-Wextra']
    for path in (root / 'include').iterdir():
        command += ['-isystem', str(path)]
    command += [str(Path(__file__).with_name('rcl_loop.cpp')), '-o', str(library)]
    command += [f'-L{root / "lib"}', '-Wl,--allow-shlib-undefined']
    command += ['-lrcl', '-lrcutils', '-lrosidl_runtime_c']
    for package in ('nav_msgs', 'geometry_msgs'):
        command += [f'-l{package}__rosidl_typesupport_c', f'-l{package}__rosidl_generator_c']
    subprocess.run(command, check=True)
    return library


@contextmanager
def started(
    physics: int, publish: int, *more: str, python_loop: bool = False, **environment: str
) -> Iterator[subprocess.Popen]:
    """Run sim_node with a disc that stays in the air, with its compiled loop or without."""
    parameters = (
        f'physics_rate:={float(physics)}', f'publish_rate:={float(publish)}',
        f'launch.height:={HIGH}', 'ground:=false', 'command_timeout:=0.5', *more,
    )  # fmt: skip
    command = [sys.executable, '-c', PYTHON_LOOP] if python_loop else [*SIM_NODE]
    command.append('--ros-args')
    for parameter in parameters:
        command += ['-p', parameter]
    with ended(subprocess.Popen(command, env={**os.environ, **environment})) as process:
        yield process


@contextmanager
def role(*words: str) -> Iterator[subprocess.Popen]:
    """Run a role of benchmarks/node_roles.py."""
    command = [sys.executable, str(Path(__file__).with_name('node_roles.py')), *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with ended(process):
        yield process


@contextmanager
def ended(process: subprocess.Popen) -> Iterator[subprocess.Popen]:
    """End a process after the block."""
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def wait_for_line(process: subprocess.Popen) -> None:
    """Wait until a process has printed a line.

    Raises:
        TimeoutError: It prints none in time.
    """
    if not select.select([process.stdout], [], [], DEADLINE)[0] or not process.stdout.readline():
        raise TimeoutError(f'{process.args}: no message within {DEADLINE:g} s')


class Watch(Node):
    """Subscribes to the diagnostics of the simulator."""

    @classmethod
    @contextmanager
    def running(cls) -> Iterator['Watch']:
        """Yield a node that exists while the block runs."""
        rclpy.init()
        try:
            yield cls('watch')
        finally:
            rclpy.shutdown()

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._values: list[dict[str, str]] = []
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self._values.append({pair.key: pair.value for pair in message.status[0].values})

    def spin(self, seconds: float) -> None:
        """Take messages for a while [s]."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            rclpy.spin_once(self, timeout_sec=0.1)

    def wait(self) -> None:
        """Wait for the first diagnostics, which do not count."""
        until = time.monotonic() + DEADLINE
        while not self._values and time.monotonic() < until:
            rclpy.spin_once(self, timeout_sec=0.1)

    @property
    def worst(self) -> float:
        """Return the greatest lateness that was reported [s]."""
        return max(float(row['worst_lateness_s']) for row in self._values)

    def medians(self) -> tuple[float, float, float]:
        """Return medians of real-time factor, lateness p50 and p99 [s]; zeros of a naive node."""
        rows = self._values[1:] or self._values
        if not rows:
            return 0.0, 0.0, 0.0
        names = ('real_time_factor', 'lateness_p50_s', 'lateness_p99_s')
        columns = (sorted(float(row[name]) for row in rows) for name in names)
        factor, p50, p99 = (column[len(column) // 2] for column in columns)
        return factor, p50, p99
