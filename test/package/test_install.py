"""pip and colcon install the same executables and share files from a copy of the sources."""

from fnmatch import fnmatch
from importlib.metadata import distributions
from importlib.util import find_spec
import json
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET

from packaging.requirements import Requirement
import pytest

from package import linked
from package.sources import PACKAGE, ROOT, executables

pytestmark = pytest.mark.xdist_group('install')

USE_ROS = {'sim_node', 'recorder_node', 'demo'}  # the only executables that may import rclpy
SHARED = ('config', 'launch', 'urdf', 'rviz')
# Each program with --help, in a copy of a process that has loaded what most of them import first.
HELPS = """
import os, runpy, sys
import disc_sim_ros.cli.flags
for path in sys.argv[1:]:
    print('==', path, flush=True)
    pid = os.fork()
    if pid == 0:
        sys.argv = [path, '--help']
        runpy.run_path(path, run_name='__main__')
        sys.exit()
    if os.waitpid(pid, 0)[1]:
        sys.exit(f'{path} failed')
"""

# Variables that child processes inherit from a virtual environment, a sourced ROS or ROS wheels.
INHERITED = re.compile(
    r'PYTHON|VIRTUAL_ENV|_?ROS_|AMENT_|COLCON_|CMAKE_PREFIX_PATH|LD_LIBRARY_PATH|NUMBA_|MAKE|MFLAGS'
)


def clean_environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if not INHERITED.match(name)}


def run(*command, cwd: Path, code: int = 0, **more: str) -> str:
    """Run a command as a user would and return what it printed."""
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=clean_environment() | more,
        capture_output=True,
        text=True,
        check=False,
    )
    output = f'{done.stdout}\n{done.stderr}'
    assert done.returncode == code, f'{command} ended with {done.returncode}:\n{output}'
    return done.stdout


def source_files() -> list[Path]:
    """Return the files of a checkout; without git, all files that .gitignore does not list."""
    listed = None
    if shutil.which('git'):
        listed = subprocess.run(
            ['git', 'ls-files', '-coz', '--exclude-standard'],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
        )
    if listed and listed.returncode == 0:
        names = [Path(name) for name in listed.stdout.split('\0') if name]
    else:
        names = unignored_files()
    return [name for name in names if (ROOT / name).is_file()]


def unignored_files() -> list[Path]:
    """Return all files that no pattern of .gitignore matches, relative to the root."""
    lines = (ROOT / '.gitignore').read_text(encoding='utf-8').splitlines()
    patterns = ['/.git', *(line.removesuffix('/') for line in lines if not line.startswith('#'))]
    names = []
    for folder, folders, files in os.walk(ROOT):
        place = Path(folder).relative_to(ROOT)
        folders[:] = [name for name in folders if not ignored(place / name, patterns)]
        names += [place / name for name in files if not ignored(place / name, patterns)]
    return names


def ignored(path: Path, patterns: list[str]) -> bool:
    """Return True if a pattern matches the name, or the whole path if it begins with a slash."""
    return any(
        fnmatch(f'/{path.as_posix()}' if pattern.startswith('/') else path.name, pattern)
        for pattern in patterns
    )


def copy_source(target: Path) -> Path:
    for name in source_files():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, target / name)
    return target


def test_without_git_the_sources_are_the_same():
    """The tree of a git checkout and that of a downloaded archive are installed alike."""
    if not (shutil.which('git') and (ROOT / '.git').exists()):
        pytest.skip('this is not a git checkout')
    assert set(unignored_files()) == set(source_files())


def check_helps(programs: list[Path], printed: str) -> None:
    """Every program has printed its usage."""
    _, *helps = re.split('^== ', printed, flags=re.M)
    assert len(helps) == len(programs) > 0
    for path, text in zip(programs, helps, strict=True):
        first, _, rest = text.partition('\n')
        assert first == str(path)
        assert 'usage' in rest.lower()


def check_files(prefix: Path) -> None:
    """Everything that `ros2 run` and `ros2 launch` look for is below the prefix."""
    programs = prefix / 'lib' / PACKAGE
    assert {path.name for path in programs.iterdir()} == set(executables())
    assert all(os.access(path, os.X_OK) for path in programs.iterdir())
    assert (prefix / 'share/ament_index/resource_index/packages' / PACKAGE).is_file()
    share = prefix / 'share' / PACKAGE
    assert (share / 'package.xml').is_file()
    for name in source_files():
        if name.parts[0] in SHARED:
            assert (share / name).read_bytes() == (ROOT / name).read_bytes()


def check_package_data(site: Path) -> None:
    assert (site / PACKAGE / 'py.typed').is_file()
    for name in source_files():
        if name.parts[:3] == (PACKAGE, 'physics', 'discs') and name.suffix == '.yaml':
            assert (site / name).is_file(), f'{name} is not installed'


@pytest.fixture(scope='module')
def pip_prefix(tmp_path_factory, wheel) -> Path:
    """Return a fresh virtual environment without ROS; every path has a space in it.

    What the package needs is linked, as `make setup-test` has installed it; pip finds it complete.
    """
    folder = tmp_path_factory.mktemp('with pip')
    prefix = folder / 'a prefix'
    linked.make(prefix)
    linked.link(prefix, linked.requirements('fast'))  # test_noble.py flies without numba
    run(*pip(prefix), 'install', '--no-index', f'{wheel}[fast]', cwd=folder)
    return prefix


def pip(prefix: Path | str) -> tuple[object, ...]:
    """Return the command of this environment's pip that acts on another one, which has none.

    `pip --python` starts the same, after it has started itself for that.
    """
    (folder,) = find_spec('pip').submodule_search_locations
    return (Path(prefix) / 'bin/python', Path(folder) / '__pip-runner__.py')


@pytest.fixture(scope='module')
def colcon_workspace(tmp_path_factory) -> Path:
    """Return a workspace built by the colcon of this environment, for its Python."""
    workspace = tmp_path_factory.mktemp('colcon')
    copy_source(workspace / 'src' / PACKAGE)
    # colcon writes the path of its Python into scripts; with a space in it, no shell runs them.
    environment = workspace / 'environment'
    environment.symlink_to(sys.prefix)
    colcon = (environment / 'bin/python', environment / 'bin/colcon')
    output = run(*colcon, 'build', '--base-paths', 'src', cwd=workspace)
    assert f'Finished <<< {PACKAGE}' in output
    return workspace


def run_sourced(workspace: Path, *command, **more: str) -> str:
    """Run a command in the workspace after sourcing it, as for `ros2 run`."""
    script = '. install/setup.sh && exec "$@"'
    return run('sh', '-c', script, 'sh', *command, cwd=workspace, **more)


def test_scripts_and_executables_agree():
    assert {path.name for path in (ROOT / 'scripts').iterdir()} == set(executables())


@pytest.mark.parametrize('name', sorted(executables()))
def test_each_script_starts_the_executable_of_its_name(name, tmp_path):
    script = tmp_path / 'a prefix/lib' / PACKAGE / name
    script.parent.mkdir(parents=True)
    shutil.copy(ROOT / 'scripts' / name, script)
    program = tmp_path / 'a prefix/bin' / name
    program.parent.mkdir()
    program.write_text('#!/bin/sh\nprintf "<%s>" "$@"; exit 7\n', encoding='utf-8')
    program.chmod(0o755)
    assert run(script, 'a b', '', '*', cwd=tmp_path, code=7) == '<a b><><*>'


def test_the_version_is_the_same_everywhere():
    # setup.py reads the version from the package; test_pip_metadata covers that.
    version = run(
        sys.executable, '-c', f'import {PACKAGE}; print({PACKAGE}.__version__)', cwd=ROOT
    ).strip()
    assert ET.parse(ROOT / 'package.xml').findtext('version') == version


def test_importing_the_package_imports_nothing_heavy():
    loaded = run(
        sys.executable,
        '-c',
        f'import {PACKAGE}, sys; print(*{{"rclpy", "numba", "numpy"}} & set(sys.modules))',
        cwd=ROOT,
    )
    assert loaded.strip() == ''


@pytest.mark.packaging
def test_pip_installs_all_files(pip_prefix):
    check_files(pip_prefix)
    check_package_data(next((pip_prefix / 'lib').glob('python3*/site-packages')))


@pytest.mark.packaging
def test_pip_metadata(pip_prefix):
    (site,) = (pip_prefix / 'lib').glob('python3*/site-packages')
    (installed,) = distributions(name=PACKAGE, path=[str(site)])
    assert installed.version == ET.parse(ROOT / 'package.xml').findtext('version')
    needed = [Requirement(line) for line in installed.requires]
    needed = {one.name for one in needed if not one.marker or one.marker.evaluate({'extra': ''})}
    assert 'numpy' in needed
    assert not [name for name in needed if 'ros-jazzy' in name]


@pytest.mark.packaging
def test_executables_without_ros_run_where_ros_is_not_installed(pip_prefix):
    run(pip_prefix / 'bin/python', '-c', 'import rclpy', cwd=pip_prefix, code=1)
    programs = [pip_prefix / 'bin' / name for name in sorted(set(executables()) - USE_ROS)]
    python = pip_prefix / 'bin/python'
    check_helps(programs, run(python, '-c', HELPS, *programs, cwd=pip_prefix))


@pytest.mark.packaging
def test_fly_flies_after_pip_as_compiled(pip_prefix):
    """Machine code that another installation of the same sources has left does for this one."""
    command = [pip_prefix / 'lib' / PACKAGE / 'fly', '--json']
    done = subprocess.run(
        command, cwd=pip_prefix, env=clean_environment(),
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert json.loads(done.stdout)['landed'] is True
    assert re.fullmatch(r'(fly: note: compiling [^\n]+\n)?', done.stderr)  # numba is there


@pytest.mark.packaging
def test_colcon_installs_all_files(colcon_workspace):
    prefix = colcon_workspace / 'install' / PACKAGE
    check_files(prefix)
    check_package_data(next((prefix / 'lib').glob('python3*/site-packages')))
    # This file exists only if colcon recognised a ROS package, not a plain Python one.
    assert (prefix / f'share/{PACKAGE}/hook/ament_prefix_path.sh').is_file()


@pytest.mark.packaging
def test_python_imports_the_package_that_colcon_installed(colcon_workspace):
    """With the editable install of this environment the tests below would prove nothing."""
    python = colcon_workspace / 'environment/bin/python'
    imported = run_sourced(
        colcon_workspace, python, '-P', '-c', f'import {PACKAGE}; print({PACKAGE}.__file__)'
    )
    assert Path(imported.strip()).is_relative_to(colcon_workspace / 'install')


@pytest.mark.packaging
def test_executables_run_after_colcon(colcon_workspace):
    folder = colcon_workspace / 'install' / PACKAGE / 'lib' / PACKAGE
    without_ros = USE_ROS if find_spec('rclpy') is None else set()
    programs = [folder / name for name in sorted(set(executables()) - without_ros)]
    python = colcon_workspace / 'environment/bin/python'
    check_helps(programs, run_sourced(colcon_workspace, python, '-P', '-c', HELPS, *programs))


@pytest.mark.packaging
def test_fly_flies_after_colcon(colcon_workspace):
    fly = colcon_workspace / 'install' / PACKAGE / 'lib' / PACKAGE / 'fly'
    # The test of pip covers compiled code; compiling again here would only take time.
    document = run_sourced(colcon_workspace, fly, '--json', NUMBA_DISABLE_JIT='1')
    assert json.loads(document)['landed'] is True
