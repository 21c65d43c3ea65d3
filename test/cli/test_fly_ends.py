"""`fly`: interrupted, with a closed or full stdout, and in a minimal environment."""

import json
import os
from pathlib import Path
import re
import signal
import subprocess
import threading

from numpy.testing import assert_allclose
import pytest

from cli.fly_command import EXECUTABLE, Result, environment, start, table_of
from disc_sim_ros.cli import fly as program
from disc_sim_ros.physics import disc_file, flight

pytestmark = pytest.mark.usefixtures('compiled')


def test_ctrl_c_ends_a_flight_at_once(fly, monkeypatch):
    """Compiled code checks no signals: the system must end the process."""
    handlers = []
    real = flight.fly

    def watched(*arguments: object, **options: object) -> flight.Flight:
        handlers.append(signal.getsignal(signal.SIGINT))
        return real(*arguments, **options)

    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(flight, 'fly', watched)
    assert fly().code == 0
    assert handlers == [signal.SIG_DFL]
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_before_the_flight_prints_no_traceback(fly, monkeypatch):
    def interrupted(_: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(disc_file, 'load_disc', interrupted)
    assert fly() == Result(130, '', '')


def test_it_runs_in_any_thread(fly):
    codes = []
    thread = threading.Thread(target=lambda: codes.append(program.main(['--json'])))
    thread.start()
    thread.join()
    assert codes == [0]


def test_a_reader_that_stops_reading_is_no_error():
    with subprocess.Popen(
        [EXECUTABLE, '--json', '--samples', '2000'],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as running:
        assert running.stdout.read(1) == b'{'
        running.stdout.close()  # as `head -c 1` does; more is written than a pipe holds
        err = running.stderr.read()
    assert b'Traceback' not in err
    assert b'rror' not in err
    assert running.returncode == 141  # as a shell says of SIGPIPE


def test_a_full_stdout_is_reported_in_one_line():
    with Path('/dev/full').open('w', encoding='utf-8') as full:
        ended = start('--json', stdout=full, env=environment(NUMBA_DISABLE_JIT='1'))
    assert ended.returncode == 1
    assert re.fullmatch(r'fly: error: [^\n]*stdout[^\n]*No space left[^\n]*\n', ended.stderr)


def test_it_runs_without_streams_and_with_a_minimal_environment(tmp_path):
    """No stdin, stdout or stderr; no HOME, ASCII only; spaces and umlauts in every name."""
    folder = tmp_path / 'a folder'
    folder.mkdir()
    (folder / 'Schüssel 1.yaml').write_text(
        'based_on: frisbee\ndescription: Schüssel\n', encoding='utf-8'
    )
    bare = {
        'PATH': os.environ['PATH'],
        'LANG': 'C',
        'LC_ALL': 'C',
        'PYTHONIOENCODING': 'ascii',
        'NUMBA_DISABLE_JIT': '1',
    }
    arguments = ('--step', '0.01', '--disc', 'Schüssel 1.yaml', '--csv', 'wür fe.csv')
    closed = ['sh', '-c', 'exec "$0" "$@" <&- >&- 2>&-', str(EXECUTABLE), *arguments]
    ended = subprocess.run(closed, cwd=folder, env=bare, check=False, timeout=120)
    assert ended.returncode == 0
    head, rows = table_of(folder / 'wür fe.csv')
    assert head[0] == 't_s'
    assert len(rows) > 300
    # With stdout open, characters outside ASCII are escaped.
    shown = start(*arguments, cwd=folder, env=bare, stdin=subprocess.DEVNULL)
    assert (shown.returncode, shown.stderr) == (0, '')
    assert 'Sch\\xfcssel 1: Sch\\xfcssel' in shown.stdout


def test_plain_python_gives_the_compiled_flight(document):
    arguments = ('--step', '0.01', '--turbulence', '5', '--disc', 'frisbee_roll_moment')
    ended = start('--json', *arguments, env=environment(NUMBA_DISABLE_JIT='1'))
    assert (ended.returncode, ended.stderr) == (0, '')
    plain, compiled = json.loads(ended.stdout), document(*arguments)
    assert plain['launch'] == compiled['launch']
    # The compiler may fuse and reorder; 400 steps of 1e-16 each.
    for name in ('landing_position_m', 'flight_time_s', 'apex_m', 'end_spin_rad_s'):
        assert_allclose(plain[name], compiled[name], rtol=0.0, atol=1e-9)
