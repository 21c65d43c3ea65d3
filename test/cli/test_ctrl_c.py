"""Ctrl-C at many moments: exit code 130 and no traceback, also while workers start."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest

from disc_sim_ros.cli import fly

BIN = Path(sys.executable).parent
ENDED = {130, -signal.SIGINT}  # both are 130 to a shell
TRIES = 5
WORKERS = """
import sys, time
from disc_sim_ros.cli import start

def main():
    from disc_sim_ros.studies import executors
    print('ready', flush=True)
    with executors.processes(3) as pool:
        for future in [pool.submit(time.sleep, 0.01 * k) for k in range(6)]:
            future.result()
    print('done', flush=True)
    return 0

if __name__ == '__main__':
    sys.exit(start.run(lambda: main))
"""


@pytest.fixture
def program(tmp_path) -> Path:
    """A program that starts three workers as `sweep` and `paper_figures` do."""
    path = tmp_path / 'workers.py'
    path.write_text(WORKERS, encoding='utf-8')
    return path


def interrupted(
    command, delay, folder, *, ready='', library='/numpy/', made=()
) -> tuple[int, str]:
    """Send SIGINT to a program and its workers, `delay` s after its first line.

    Without `ready`, after it has loaded a library: before numpy, Python itself may still start,
    which has tracebacks of its own. While this test waits for a core the program may end, or make
    its files and then end by the signal: it is started again without them.
    """
    for _ in range(TRIES):
        process = subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            start_new_session=True,
        )  # fmt: skip
        if ready:
            assert ready in process.stdout.readline()
        maps = Path(f'/proc/{process.pid}/maps')
        while not ready and process.poll() is None and library not in maps.read_text():
            time.sleep(0.003)  # to read it takes a third of that
        time.sleep(delay)
        late = process.poll() is not None
        if not late:
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of them
        _, error = process.communicate(timeout=120)
        late |= process.returncode in ENDED and any(path.exists() for path in made)
        if not late:
            return process.returncode, error
        for path in made:
            path.unlink(missing_ok=True)
    raise AssertionError(f'{command} was done {TRIES} times before it was interrupted: {error}')


@pytest.mark.parametrize('delay', [k / 1000 for k in (0, 5, 12, 22, 33, 45)])
def test_no_worker_shows_a_traceback_while_it_starts(program, tmp_path, delay):
    code, error = interrupted([sys.executable, program], delay, tmp_path, ready='ready')
    assert error == ''
    assert code in ENDED


@pytest.mark.parametrize('delay', [0.1, 0.102, 0.104, 0.106])
def test_ctrl_c_in_an_import_waits_also_for_workers_that_start_after_it(tmp_path, delay):
    (tmp_path / 'slow.py').write_text('import time; time.sleep(0.3)', encoding='utf-8')
    path = tmp_path / 'workers.py'
    path.write_text(
        WORKERS.replace("ready', flush=True)", "ready', flush=True)\n    import slow"),
        encoding='utf-8',
    )
    code, error = interrupted([sys.executable, path], delay, tmp_path, ready='ready')
    assert error == ''
    assert code in ENDED


def test_ctrl_c_while_the_executor_is_made_leaves_no_semaphore(program, tmp_path):
    """multiprocessing would remove it in the end, and warn on stderr."""
    path = tmp_path / 'semaphores.py'
    path.write_text(
        """
from multiprocessing import resource_tracker
import signal

register = resource_tracker.register

def interrupted(*what):
    register(*what)
    signal.raise_signal(signal.SIGINT)

resource_tracker.register = interrupted
"""
        + program.read_text(encoding='utf-8'),
        encoding='utf-8',
    )
    done = subprocess.run([sys.executable, path], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ('ready\n', '')
    assert done.returncode in ENDED


def test_the_program_ends_as_usual_without_ctrl_c(program):
    done = subprocess.run([sys.executable, program], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ('ready\ndone\n', '')


@pytest.mark.parametrize(
    ('command', 'delay'),
    [
        (['fly', '--no-ground', '--duration', '3600'], 0.0),
        (['sweep', '--scatter', 'pitch=1', '--count', '100000', '--step', '1e-4'], 0.02),
        (['identify', 'pipe.csv'], 0.01),
        (['disc-sim', 'predict', 'pipe.csv'], 0.0),
    ],
)
def test_a_program_that_still_loads_ends_without_a_traceback(command, delay, tmp_path):
    name, *words = command
    os.mkfifo(tmp_path / 'pipe.csv')  # nothing comes out of it: what reads it does not end
    code, error = interrupted([BIN / name, *words], delay, tmp_path)
    assert error == ''
    assert code in ENDED


def test_paper_figures_ends_without_a_traceback_while_its_workers_start(tmp_path):
    command = [BIN / 'paper_figures', '--only', '3,9', '--out', 'out']
    code, error = interrupted(command, 0.02, tmp_path, ready='parts into')
    assert error == ''
    assert code in ENDED


# Interrupted while trimesh imports what it may do without, it went on and wrote the page.
@pytest.mark.parametrize('name', ['fly', 'analyse_bag'])
def test_ctrl_c_is_not_lost_in_an_import(name, tmp_path):
    words = {'fly': ['--html', 'a.html'], 'analyse_bag': ['bag', '--html', 'a.html']}
    if name == 'analyse_bag':
        assert fly.main(['--bag', str(tmp_path / 'bag'), '--duration', '0.5']) == 0
    page, command = tmp_path / 'a.html', [BIN / name, *words[name]]
    code, error = interrupted(command, 0.0, tmp_path, library='/_nd_image', made=[page])
    assert error == ''
    assert code in ENDED
    assert not page.exists()
