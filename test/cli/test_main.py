"""The wrapper of every program, and `disc-sim`, which gathers them."""

import argparse
import ast
from contextlib import suppress
import os
from pathlib import Path
import re
import signal
import subprocess
import sys

import pytest

from disc_sim_ros import __version__
from disc_sim_ros.cli import disc_sim, output
from disc_sim_ros.cli.arguments import Parser
from disc_sim_ros.cli.main import UsageError, run_program
from disc_sim_ros.errors import ConfigError, DiscSimError

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent


def run(body, *arguments, in_flags=None):
    """Run a program with one flag, whose body is given."""
    parser = Parser(prog='thrower')
    parser.add_argument('--speed', type=float, default=1.0, help='in m/s')
    return run_program(parser, body, arguments, in_flags=in_flags)


def raising(error):
    def body(_: argparse.Namespace) -> int:
        raise error

    return body


def test_a_program_gets_its_flags_and_gives_its_exit_code(capsys):
    assert run(lambda chosen: int(chosen.speed), '--speed', '3') == 3
    assert capsys.readouterr() == ('', '')


@pytest.mark.parametrize(
    ('error', 'code', 'line'),
    [
        (DiscSimError('the disk is full'), 1, 'thrower: error: the disk is full\n'),
        (KeyboardInterrupt(), 128 + signal.SIGINT, ''),
        (KeyboardInterrupt(signal.SIGTERM), 128 + signal.SIGTERM, ''),
        (output.ClosedStdoutError(), 128 + signal.SIGPIPE, ''),
    ],
    ids=['failure', 'Ctrl-C', 'another signal', 'closed stdout'],
)
def test_an_exception_becomes_an_exit_code(capsys, error, code, line):
    assert run(raising(error)) == code
    assert capsys.readouterr() == ('', line)


@pytest.mark.parametrize(
    ('body', 'arguments', 'line'),
    [
        (raising(ConfigError('mass', 3.0, 'at most 1 kg')), (), 'mass: 3 is not allowed; '),
        (raising(UsageError('give --a or --b')), (), 'give --a or --b'),
        (lambda _: 0, ('--sped', '3'), 'unrecognized arguments: --sped 3'),
        (lambda _: 0, ('--speed', 'fast'), '--speed: invalid float value'),
    ],
    ids=['value', 'usage', 'flag', 'text'],
)
def test_bad_input_ends_with_code_2_and_one_line(capsys, body, arguments, line):
    with pytest.raises(SystemExit) as ended:
        run(body, *arguments)
    out, err = capsys.readouterr()
    assert (ended.value.code, out) == (2, '')
    assert err.startswith(f'thrower: error: {line}')
    assert err.count('\n') == 1


def test_an_error_is_reported_in_the_words_of_the_command_line(capsys):
    def in_flags(error, chosen, parser):
        return error.named(f'{parser.prog} --{error.thing} at {chosen.speed:g}')

    with pytest.raises(SystemExit):
        run(raising(ConfigError('mass', 3.0, 'at most 1')), '--speed', '7', in_flags=in_flags)
    assert capsys.readouterr().err == (
        'thrower: error: thrower --mass at 7: 3 is not allowed; at most 1\n'
    )


@pytest.mark.parametrize('arguments', [('fly', '--help'), ('disc-sim', '--help'), ('fly',)])
def test_a_reader_that_closes_stdout_ends_a_program_with_141(arguments):
    program, *rest = arguments
    environment = {k: v for k, v in os.environ.items() if k != 'PYTHONUNBUFFERED'}
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, 'w') as stdout:
        ended = subprocess.run(
            [BIN / program, *rest],
            stdout=stdout,
            stderr=subprocess.PIPE,
            env=environment | {'NUMBA_DISABLE_JIT': '1'},
            text=True,
            check=False,
            timeout=120,
        )
    assert (ended.returncode, ended.stderr) == (128 + signal.SIGPIPE, '')


# ---- disc-sim ----


def executables():
    """The executables of setup.py."""
    for node in ast.parse((ROOT / 'setup.py').read_text(encoding='utf-8')).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == 'EXECUTABLES':
            return ast.literal_eval(node.value)
    raise AssertionError('setup.py has no EXECUTABLES')


def test_disc_sim_gathers_every_executable():
    assert {*disc_sim.PROGRAMS, 'disc-sim'} == set(executables())


def test_help_lists_each_program_in_one_line(capsys):
    with pytest.raises(SystemExit) as ended:
        disc_sim.main(['--help'])
    text = capsys.readouterr().out
    assert ended.value.code == 0
    for name, (_, line) in disc_sim.PROGRAMS.items():
        assert re.search(rf'^  {name} +{re.escape(line)}$', text, re.MULTILINE)
    assert max(map(len, text.splitlines())) < 80
    assert disc_sim.main([]) == 0
    assert capsys.readouterr().out == text


def test_disc_sim_has_the_version_of_the_package(capsys):
    with pytest.raises(SystemExit):
        disc_sim.main(['--version'])
    assert capsys.readouterr().out == f'disc-sim {__version__}\n'


@pytest.mark.parametrize('name', disc_sim.PROGRAMS)
def test_each_program_knows_the_name_it_is_called_by(name, capsys):
    code = 0
    try:
        code = disc_sim.main([name, '--version'])
    except SystemExit as end:
        code = end.code
    assert (code, capsys.readouterr()) == (0, (f'disc-sim {name} {__version__}\n', ''))


@pytest.mark.parametrize('name', disc_sim.PROGRAMS)
def test_help_tells_each_default_once_and_in_words_of_the_command_line(name, capsys):
    with suppress(SystemExit):
        disc_sim.main([name, '--help'])
    text = ' '.join(capsys.readouterr().out.split())
    assert 'usage' in text
    assert not re.search(r'\(default: (?:None|True|False|\(|\[)', text)
    assert not re.search(r'\(default: [^()]*\) \(default', text)


@pytest.fixture(autouse=True)
def signal_handlers():
    """Restore the handlers that a node sets."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


def test_an_unknown_program_is_refused_in_one_line(capsys):
    with pytest.raises(SystemExit) as ended:
        disc_sim.main(['flie'])
    assert ended.value.code == 2
    out, err = capsys.readouterr()
    assert (out, err.count('\n')) == ('', 1)
    assert err.startswith("disc-sim: error: PROGRAM: invalid choice: 'flie'")


def test_the_installed_disc_sim_flies_as_fly_does():
    flags = ('--json', '--speed', '12', '--samples', '10')
    flown, gathered = (
        subprocess.run([*command, *flags], capture_output=True, check=True, timeout=120)
        for command in ([BIN / 'fly'], [BIN / 'disc-sim', 'fly'])
    )
    assert gathered.stdout == flown.stdout
    refused = subprocess.run(
        [BIN / 'disc-sim', 'fly', '--speed', '300'], capture_output=True, text=True, check=False
    )
    assert refused.returncode == 2
    assert refused.stderr.startswith('disc-sim fly: error: --speed: 300')


def test_disc_sim_imports_only_what_it_needs():
    code = (
        'import sys\n'
        'from disc_sim_ros.cli import disc_sim\n'
        'disc_sim.main([])\n'
        "assert not {'numba', 'rclpy', 'scipy'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, '-c', code], stdout=subprocess.DEVNULL, check=True)
