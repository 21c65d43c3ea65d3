"""The scripts behind `make`: checks repeat their failures, a stale lock file stops the set-up."""

import os
from pathlib import Path
import re
import shutil
import subprocess
import sys

import pytest

from package import linked

ROOT = Path(__file__).parents[2]
MADE_BY_COMMANDS = ('bags', 'flights', 'fuzz_findings', 'paper_figures', 'peers')


# What pytest loads beside pytest-xdist and pytest-timeout takes half of the time of its start.
PLUGINS = ('hypothesispytest', 'pytest_cov', 'colcon_core_warnings_stderr')


def run(*command, cwd: Path) -> subprocess.CompletedProcess[str]:
    options = ' '.join(f'-p no:{name}' for name in PLUGINS)
    return subprocess.run(
        [str(part) for part in command], cwd=cwd, env=os.environ | {'PYTEST_ADDOPTS': options},
        capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.fixture
def tree(tmp_path) -> Path:
    """A tree with the settings and tools of this one, its .venv, and one good source file.

    Tests run in one process beside pytest, as each takes half a second to start, and those that
    fail run again at once: nothing is left of others.
    """
    shutil.copy(ROOT / 'pyproject.toml', tmp_path)
    shutil.copytree(ROOT / 'tools', tmp_path / 'tools', ignore=shutil.ignore_patterns('viewer'))
    check = (tmp_path / 'tools/check').read_text(encoding='utf-8')
    for text, quick in ((' -n 3 ', ' -n 1 '), ('sleep 5 ', 'sleep 0 ')):
        assert check.count(text) == 1
        check = check.replace(text, quick)
    (tmp_path / 'tools/check').write_text(check, encoding='utf-8')
    (tmp_path / '.venv').symlink_to(sys.prefix)
    (tmp_path / 'tools/compile.py').write_text('"""Nothing here flies."""\n', encoding='utf-8')
    (tmp_path / 'examples').mkdir()
    (tmp_path / 'examples/good.py').write_text('"""A module."""\n', encoding='utf-8')
    return tmp_path


def test_checks_that_pass_end_with_0(tree):
    done = run('tools/check', 'ruff', 'format', cwd=tree)
    assert done.returncode == 0, done.stdout
    assert done.stdout.splitlines()[-1] == 'passed: ruff format'


def test_all_checks_run_and_failures_come_last(tree):
    (tree / 'examples/bad.py').write_text('"""A module."""\n\nimport os\n', encoding='utf-8')
    done = run('tools/check', 'ruff', 'format', cwd=tree)
    assert done.returncode == 1
    assert '== format' in done.stdout
    _, _, end = done.stdout.partition('== failures of ruff')
    assert 'F401' in end
    assert 'failures of format' not in end
    assert done.stderr.strip() == 'FAILED: ruff'


MANY_BAD = """import pytest
@pytest.mark.parametrize('n', range(10))
def test_worse(n): assert n < 0
"""


def test_failed_tests_are_listed_last(tree):
    (tree / 'test').mkdir()
    (tree / 'test/test_bad.py').write_text(
        'def test_good(): pass\ndef test_bad(): assert 1 == 2\n' + MANY_BAD, encoding='utf-8'
    )
    done = run('tools/check', 'tests', 'ruff', cwd=tree)
    assert done.returncode == 1
    _, _, end = done.stdout.partition('== failures of tests\n')
    first = end.splitlines()[0]
    assert first.startswith('FAILED test/test_bad.py::test_bad')
    assert '::test_good' not in end
    assert 'again alone' not in done.stdout, 'so many failures are no accident'


ONCE = """from pathlib import Path
import pytest

@pytest.mark.parametrize('name', ['a b@c'])
@pytest.mark.xdist_group('real time')
def test_once(name):
    before = Path('failed_before')
    if not before.exists():
        before.touch()
        pytest.fail('too late')
"""


def test_a_test_that_fails_beside_others_is_run_again_alone(tree):
    (tree / 'test').mkdir()
    (tree / 'test/test_once.py').write_text(ONCE, encoding='utf-8')
    done = run('tools/check', 'tests', cwd=tree)
    assert done.returncode == 0, done.stdout
    first, _, again = done.stdout.partition('== failed beside other tests')
    assert 'too late' in first
    assert 'test/test_once.py::test_once[a b@c]' in again.splitlines()
    assert '1 passed' in again


def test_an_unknown_check_is_refused(tree):
    done = run('tools/check', 'rough', cwd=tree)
    assert done.returncode == 1
    assert "no check 'rough'; allowed: tests ruff format mypy imports" in done.stdout


@pytest.mark.packaging
def test_a_stale_lock_file_stops_the_setup_with_one_line(tree):
    for name in ('setup.py', 'setup.cfg', 'package.xml', 'requirements-dev.lock'):
        shutil.copy(ROOT / name, tree)
    for folder in ('disc_sim_ros', 'resource'):
        shutil.copytree(ROOT / folder, tree / folder)
    # As one that `make setup` made here before the lock file changed; a new one takes 5 s more.
    venv = tree / '.venv'
    venv.unlink()
    linked.make(venv)
    linked.link(venv, {'packaging'})
    (site,) = (venv / 'lib').glob('python3*/site-packages')
    (site / 'here.pth').write_text(f'{tree}\n', encoding='utf-8')
    made_from = f'{tree.resolve()}\n'
    for name in ('ready-run', 'ready-test'):
        (venv / name).write_text(made_from, encoding='utf-8')
    lock = tree / 'requirements-dev.lock'
    text = lock.read_text(encoding='utf-8')
    lock.write_text(re.sub('^numpy==.*', 'numpy==1.0', text, flags=re.M), encoding='utf-8')
    done = run('tools/setup-venv', 'test', cwd=tree)
    assert done.returncode == 1
    (line,) = [line for line in done.stderr.splitlines() if 'WARNING' not in line]
    assert 'needs numpy' in line
    assert 'the file has 1.0; run `make lock`' in line
    assert 'making' not in done.stdout
    assert 'installing' not in done.stdout
    assert (venv / 'ready-test').read_text(encoding='utf-8') == made_from, 'it is up to date'


def test_folders_that_our_commands_make_change_no_check(tree):
    """After `make fly`, ruff once took flights/ for a module and wanted another import order."""
    (tree / 'examples/uses.py').write_text(
        '"""A module."""\n\nimport numpy as np\n\nimport flights\n\nprint(flights, np)\n',
        encoding='utf-8',
    )
    (tree / 'examples/flights.py').write_text('"""A module."""\n', encoding='utf-8')
    before = run('tools/check', 'ruff', cwd=tree)
    for folder in MADE_BY_COMMANDS:
        (tree / folder).mkdir()
        (tree / folder / 'throw.py').write_text('import os, sys\n', encoding='utf-8')
    shutil.copy(ROOT / '.gitignore', tree)
    run('git', 'init', cwd=tree)  # ruff reads .gitignore in a repository alone
    after = run('tools/check', 'ruff', cwd=tree)
    assert before.returncode == after.returncode == 0, after.stdout


def test_git_ignores_what_our_commands_make():
    ignored = (ROOT / '.gitignore').read_text(encoding='utf-8').splitlines()
    assert {f'/{folder}/' for folder in MADE_BY_COMMANDS} <= set(ignored)
