"""Ctrl-C at many points: exit code 130 and no traceback, also while workers start.

The program itself sends it, when it comes to a point: a time would be another point on a machine
under load. As from a terminal, it goes to the program and to its workers.
"""

import os
from pathlib import Path
import signal
import subprocess
import sys

import pytest

BIN = Path(sys.executable).parent
EXECUTORS = 'disc_sim_ros.studies.executors'  # what a worker imports first
ENDED = {130, -signal.SIGINT}  # both are 130 to a shell

# Sends Ctrl-C in the import of a module: that of the program, or of one of its workers.
AT_IMPORT = """
import os, signal, sys

class Point:
    def find_spec(self, name, *_):
        if name == {name!r} and (os.getpid() == os.getsid(0)) == {program}:
            sys.meta_path.remove(self)
            if {program} or not os.path.exists('sent'):
                open('sent', 'w').close()
                os.killpg(0, signal.SIGINT)

sys.meta_path.insert(0, Point())
"""
WORKERS = """
import os, signal, sys
from multiprocessing import util
from disc_sim_ros.cli import start

def send():
    {send}

def send_once():
    if not os.path.exists('sent'):
        open('sent', 'w').close()
        send()

def spawned(*what, spawn=util.spawnv_passfds, count=[]):
    pid = spawn(*what)
    count.append(pid)
    if len(count) == {spawned}:
        send()
    return pid

util.spawnv_passfds = spawned

def main():
    from disc_sim_ros.studies import executors
    print('ready', flush=True)
    {before}
    with executors.processes(2) as pool:
        for future in [pool.submit({task}) for _ in range(4)]:
            future.result()
    print('done', flush=True)
    return 0

if __name__ == '__main__':
    sys.exit(start.run(lambda: main))
{at_import}
"""
PLAIN = {'send': 'os.killpg(0, 2)', 'spawned': 0, 'before': '', 'task': 'int', 'at_import': ''}
# The points in the time of the program: the tracker of semaphores, which is started first, or a
# worker has been spawned; a worker imports the program; it does its first task.
POINTS = {
    'tracker': {'spawned': 1},
    'first worker': {'spawned': 2},
    'second worker': {'spawned': 3},
    'import': {'at_import': 'send_once()'},
    'task': {'task': 'send_once'},
}


@pytest.fixture
def workers(tmp_path, monkeypatch):
    """Return a function that runs a program which starts two workers, as `sweep` does."""
    monkeypatch.chdir(tmp_path)

    def run(**changes: object) -> subprocess.CompletedProcess[str]:
        path = tmp_path / 'workers.py'
        path.write_text(WORKERS.format(**(PLAIN | changes)), encoding='utf-8')
        return ended([sys.executable, path])

    return run


def ended(command, environment=os.environ) -> subprocess.CompletedProcess[str]:
    """Run a program in a process group of its own to its end."""
    return subprocess.run(
        command, capture_output=True, text=True, check=False, timeout=120, env=environment,
        start_new_session=True,
    )  # fmt: skip


def interrupted(folder: Path, module: str, *command, worker=False) -> tuple[int, str]:
    """Run a program that is interrupted while it, or a worker of it, imports a module.

    Before the program begins, Python itself may still start, which has tracebacks of its own.
    """
    text = AT_IMPORT.format(name=module, program=not worker)
    (folder / 'sitecustomize.py').write_text(text, encoding='utf-8')
    done = ended(command, os.environ | {'PYTHONPATH': str(folder)})
    assert (folder / 'sent').exists(), f'it does not import {module}'
    return done.returncode, done.stderr


@pytest.mark.parametrize('point', POINTS)
def test_no_worker_shows_a_traceback_while_it_starts(workers, point):
    done = workers(**POINTS[point])
    assert (done.stdout, done.stderr) == ('ready\n', '')
    assert done.returncode in ENDED


@pytest.mark.parametrize('point', ['tracker', 'second worker'])
def test_ctrl_c_in_an_import_waits_also_for_workers_that_start_after_it(workers, tmp_path, point):
    """The program looks again by SIGALRM; here that comes when the import has ended."""
    (tmp_path / 'slow.py').write_text(
        'import signal\n'
        'signal.raise_signal(signal.SIGINT)\n'
        'assert signal.setitimer(signal.ITIMER_REAL, 0.0)[0] > 0.0\n',
        encoding='utf-8',
    )
    done = workers(
        before='import slow', send='signal.raise_signal(signal.SIGALRM)', **POINTS[point]
    )
    assert (done.stdout, done.stderr) == ('ready\n', '')
    assert done.returncode in ENDED


def test_ctrl_c_while_the_executor_is_made_leaves_no_semaphore(workers):
    """multiprocessing would remove it in the end, and warn on stderr."""
    done = workers(
        before="""
    from multiprocessing import resource_tracker
    register = resource_tracker.register
    def interrupted(*what):
        register(*what)
        signal.raise_signal(signal.SIGINT)
    resource_tracker.register = interrupted
"""
    )
    assert (done.stdout, done.stderr) == ('ready\n', '')
    assert done.returncode in ENDED


def test_the_program_ends_as_usual_without_ctrl_c(workers):
    done = workers()
    assert (done.stdout, done.stderr, done.returncode) == ('ready\ndone\n', '', 0)


@pytest.mark.parametrize(
    ('module', 'command'),
    [
        ('datetime', ['fly']),
        ('disc_sim_ros.physics.ensemble', ['sweep', '--scatter', 'pitch=1', '--count', '10']),
        ('disc_sim_ros.physics.flight', ['identify', 'throw.csv']),
        ('disc_sim_ros.physics.flight', ['disc-sim', 'predict', 'throw.csv']),
    ],
)
def test_a_program_that_still_loads_ends_without_a_traceback(
    module, command, tmp_path, monkeypatch
):
    """Interrupted where numpy imports datetime in C, numpy took itself for a bad installation."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'throw.csv').touch()
    name, *words = command
    code, error = interrupted(tmp_path, module, BIN / name, *words)
    assert error == ''
    assert code in ENDED


def test_paper_figures_ends_without_a_traceback_while_its_workers_start(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = [BIN / 'paper_figures', '--only', '3,9', '--out', 'out']
    code, error = interrupted(tmp_path, EXECUTORS, *command, worker=True)
    assert error == ''
    assert code in ENDED


def test_ctrl_c_is_not_lost_in_an_import_that_catches_all(workers, tmp_path):
    text = 'import signal\nsignal.raise_signal(signal.SIGINT)\n'
    (tmp_path / 'optional.py').write_text(text, encoding='utf-8')
    done = workers(
        before="""
    try:
        import optional
    except BaseException:
        print('not installed')
"""
    )
    assert (done.stdout, done.stderr) == ('ready\n', '')
    assert done.returncode in ENDED


def test_no_page_is_written_after_ctrl_c(tmp_path, monkeypatch):
    """Interrupted in what trimesh may do without, it went on; so it was in `analyse_bag`."""
    monkeypatch.chdir(tmp_path)
    command = [BIN / 'fly', '--html', 'a.html']
    code, error = interrupted(tmp_path, 'scipy.ndimage._nd_image', *command)
    assert error == ''
    assert code in ENDED
    assert not (tmp_path / 'a.html').exists()
