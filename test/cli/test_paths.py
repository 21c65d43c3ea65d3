"""Paths on command lines: the home folder, stdout, endings in capitals."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

from disc_sim_ros.cli import fly, sweep
from disc_sim_ros.physics import disc_file


@pytest.fixture
def home(tmp_path, monkeypatch):
    if 'XDG_CACHE_HOME' not in os.environ:  # with another home, machine code is compiled again
        monkeypatch.setenv('XDG_CACHE_HOME', str(Path.home() / '.cache'))
    monkeypatch.setenv('HOME', str(tmp_path))
    return tmp_path


def test_a_tilde_is_the_home_folder(home):
    """The shell replaces it at the start of a word, but not after a `=`."""
    assert fly.main(['--csv=~/a.csv', '--samples', '5']) == 0
    assert (home / 'a.csv').read_text().startswith('t_s,')
    assert fly.main(['--plot', '~/a.svg']) == 0
    assert (home / 'a.svg').is_file()
    shutil.copy(disc_file._FOLDER / 'frisbee.yaml', home / 'mine.YAML')
    assert fly.main(['--disc=~/mine.YAML', '--json']) == 0
    assert sweep.main(['--vary', 'pitch=0:9:3', '--output=~/s.csv']) == 0
    assert (home / 's.csv').is_file()


def test_csv_goes_to_stdout_alone(capsys, tmp_path):
    assert fly.main(['--csv', '-', '--samples', '20']) == 0
    printed = capsys.readouterr().out
    assert fly.main(['--csv', str(tmp_path / 'a.csv'), '--samples', '20']) == 0
    assert printed == (tmp_path / 'a.csv').read_text()


@pytest.mark.parametrize('name', ['-', '/dev/stdout'])
def test_a_reader_may_stop(name):
    command = f'{sys.executable} -m disc_sim_ros.cli.fly --csv {name} --samples 5000 | head -n 1'
    done = subprocess.run(['sh', '-c', command], capture_output=True, text=True, check=False)
    assert done.stdout.startswith('t_s,')
    assert done.stderr == ''
