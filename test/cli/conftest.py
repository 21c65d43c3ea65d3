"""Fixtures of the tests of commands: `fly` in this process."""

from collections.abc import Callable
import json

import pytest

from cli.fly_command import Result
from disc_sim_ros.cli import fly as program
from disc_sim_ros.physics import disc_file, flight
from disc_sim_ros.physics.launch import Launch


@pytest.fixture(scope='module')
def compiled():
    """Compile first, so that no test gets the note about it."""
    flight.fly(Launch(), flight.Setup(disc=disc_file.load_disc('frisbee')))


@pytest.fixture
def fly(capsys) -> Callable[..., Result]:
    """Run `fly` in this process."""

    def run(*arguments: object) -> Result:
        try:
            code = program.main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code
        return Result(code, *capsys.readouterr())

    return run


@pytest.fixture
def document(fly) -> Callable[..., dict]:
    """Run `fly --json` and return its document."""

    def run(*arguments: object) -> dict:
        result = fly('--json', *arguments)
        assert (result.code, result.err) == (0, '')
        assert result.out.count('\n') == 1
        return json.loads(result.out, parse_constant=pytest.fail)  # no NaN, no Infinity

    return run
