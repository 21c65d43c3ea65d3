"""Every command refuses what it cannot write before it begins its work, in one line."""

import argparse
from importlib import import_module
import os
from pathlib import Path
import re

import pytest

from disc_sim_ros.cli import disc_sim
from disc_sim_ros.cli.arguments import path as path_type

NO_PARSER = {'sim_node', 'recorder_node', 'policy_node', 'live_view', 'predictor_node'}
COMMANDS = sorted(set(disc_sim.PROGRAMS) - NO_PARSER)
# What the commands read; a path of an unknown flag is an output, and must be refused.
INPUTS = {'bag', 'source', 'throws', 'disc', 'discs', 'techdisc', 'policy'}
WORDS = {  # a valid command, but for its input, which is missing: work would begin by reading it
    'analyse_bag': ['none.mcap'],
    'identify': ['none.csv'],
    'predict': ['none.csv'],
    'repair_bag': ['none.mcap'],
    'sweep': ['--vary', 'pitch=1,2', '--disc', 'none.yaml'],
    'optimise': ['--disc', 'none.yaml'],
    'fly': ['--disc', 'none.yaml'],
    'demo': [],
    'paper_figures': [],
}
ENDINGS = {'plot': '.png', 'html': '.html', 'csv': '.csv', 'output': '.csv', 'out': '.yaml'}


def outputs():
    """Each command with each of its flags that takes the path of a file or folder to write."""
    for command in COMMANDS:
        parser = import_module(f'disc_sim_ros.cli.{command}').parser()
        for action in parser._actions:
            is_input = action.dest in INPUTS and not (
                action.dest == 'bag' and action.option_strings
            )
            if action.type is path_type and not is_input:
                yield command, action


def case(command: str, action: argparse.Action, name: str) -> list[str]:
    flag = [action.option_strings[-1], name] if action.option_strings else [name]
    return [*WORDS[command], *flag]


OUTPUTS = {f'{command} {action.dest}': (command, action) for command, action in outputs()}
# Folders are made with their parents.
FILES = set(OUTPUTS) - {
    'demo bag', 'fly bag', 'identify report', 'paper_figures out', 'repair_bag target',
}  # fmt: skip
MADE_AT_ONCE = {'demo bag', 'paper_figures out'}  # by a program that has nothing to do before


def refusal(command: str, words: list[str], capsys) -> str:
    with pytest.raises(SystemExit) as ended:
        import_module(f'disc_sim_ros.cli.{command}').main(words)
    out, err = capsys.readouterr()
    assert (ended.value.code, out) == (2, '')
    assert re.fullmatch(rf'{command}: error: [^\n]+\n', err)
    return err


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path('file').touch()
    return tmp_path


def test_all_commands_are_here():
    assert set(WORDS) == set(COMMANDS)
    assert set(OUTPUTS) == {
        'analyse_bag plot', 'analyse_bag html', 'demo bag', 'fly csv', 'fly plot', 'fly bag',
        'fly html', 'identify out', 'identify report', 'optimise plot', 'paper_figures out',
        'predict plot', 'predict html', 'repair_bag target', 'sweep output', 'sweep plot',
    }  # fmt: skip


@pytest.mark.parametrize('name', OUTPUTS)
def test_a_path_below_a_file_is_refused_before_the_work(name, capsys, folder):
    """The input is missing, too; that it is not named shows that the work has not begun."""
    command, action = OUTPUTS[name]
    words = case(command, action, 'file/below' + ENDINGS.get(action.dest, ''))
    error = refusal(command, words, capsys)
    assert 'file/below' in error
    assert 'none.' not in error
    assert {path.name for path in folder.iterdir()} == {'file'}


@pytest.mark.parametrize('name', sorted(FILES))
def test_a_file_in_a_missing_folder_is_refused_before_the_work(name, capsys, folder):
    command, action = OUTPUTS[name]
    error = refusal(command, case(command, action, 'missing/x' + ENDINGS[action.dest]), capsys)
    assert f'the folder {folder}/missing does not exist' in error
    assert {path.name for path in folder.iterdir()} == {'file'}


@pytest.mark.parametrize('name', sorted(set(OUTPUTS) - MADE_AT_ONCE))
def test_a_read_only_folder_is_refused_before_the_work(name, capsys, folder, monkeypatch):
    """Root may write everywhere, so the answer of the system is simulated."""
    command, action = OUTPUTS[name]
    system = os.access
    monkeypatch.setattr(os, 'access', lambda path, mode: mode != os.W_OK and system(path, mode))
    words = case(command, action, 'new' + ENDINGS.get(action.dest, ''))
    error = refusal(command, words, capsys)
    assert re.search(r'no permission to write|Permission denied', error)
    assert {path.name for path in folder.iterdir()} == {'file'}


@pytest.mark.parametrize('command', ['fly', 'predict', 'analyse_bag'])
def test_view_where_its_folder_cannot_be_made_is_refused_before_the_work(command, capsys, folder):
    (folder / 'flights').touch()
    error = refusal(command, [*WORDS[command], '--view'], capsys)
    assert 'cannot make the folder flights (File exists)' in error
