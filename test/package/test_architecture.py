"""The import rules of pyproject.toml hold, and the linter that checks them can fail."""

import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import tomllib

import pytest

from package.sources import PACKAGE, ROOT

MAY_IMPORT_ROS = {'cli', 'ros'}


def contracts() -> dict[str, dict]:
    settings = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))
    return {c['name']: c for c in settings['tool']['importlinter']['contracts']}


@pytest.fixture
def tree(tmp_path) -> Path:
    """Return a copy of the package that a test may change."""
    shutil.copytree(
        ROOT / PACKAGE, tmp_path / PACKAGE, ignore=shutil.ignore_patterns('__pycache__')
    )
    shutil.copy(ROOT / 'pyproject.toml', tmp_path)
    return tmp_path


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [Path(sys.executable).with_name('lint-imports'), '--no-cache'],
        cwd=folder,
        env={**os.environ, 'PYTHONPATH': str(folder), 'COLUMNS': '200'},
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_import_rules_hold(tree):
    result = lint(tree)
    assert result.returncode == 0, result.stdout + result.stderr


# Folder, line, and the rule that a module with this line breaks there.
VIOLATIONS = [
    ('physics', 'import rclpy', 'only ros and cli know ROS'),
    ('physics', 'from nav_msgs.msg import Odometry', 'only ros and cli know ROS'),
    ('analysis', 'import rclpy', 'only ros and cli know ROS'),
    ('physics', 'import matplotlib', 'the physics draws nothing and records nothing'),
    ('physics', 'import mcap', 'the physics draws nothing and records nothing'),
    ('physics', f'import {PACKAGE}.bags', 'one direction, down to the physics'),
    ('bags', f'import {PACKAGE}.analysis', 'one direction, down to the physics'),
    ('paper', f'import {PACKAGE}.ros', 'one direction, down to the physics'),
    ('analysis', f'import {PACKAGE}.studies', 'one direction, down to the physics'),
    ('physics', 'import scipy', 'the physics draws nothing and records nothing'),
    (
        'physics/kernels',
        f'import {PACKAGE}.validation',
        'the kernels are arithmetic: no files, no messages, no units for people',
    ),
    (
        'estimation/prediction',
        f'import {PACKAGE}.estimation.identification.fitting',
        'predicting a landing and identifying a disc share only what measures',
    ),
    (
        'estimation/identification',
        f'import {PACKAGE}.estimation.prediction.prior',
        'predicting a landing and identifying a disc share only what measures',
    ),
    ('ros', f'import {PACKAGE}.cli', 'one direction, down to the physics'),
]


def test_the_linter_reports_each_violation(tree):
    """All in one tree: each is reported below its rule."""
    for number, (where, line, _) in enumerate(VIOLATIONS):
        (tree / PACKAGE / where / f'violation_{number}.py').write_text(f'{line}\n')
    result = lint(tree)
    assert result.returncode == 1, result.stdout + result.stderr
    _, _, reports = result.stdout.partition('Broken contracts\n')
    _, *parts = re.split(f'^({"|".join(map(re.escape, contracts()))})$', reports, flags=re.M)
    report_of = dict(zip(parts[::2], parts[1::2], strict=True))
    for number, (where, line, rule) in enumerate(VIOLATIONS):
        module = f'{PACKAGE}.{where.replace("/", ".")}.violation_{number}'
        assert f'{rule} BROKEN' in result.stdout
        assert re.search(rf'{re.escape(module)} -> ', report_of[rule]), (where, line)


def test_every_folder_is_under_the_rules():
    """A new folder must be named in the contracts, or they would not cover it."""
    folders = {path.parent.name for path in (ROOT / PACKAGE).glob('*/__init__.py')}
    layers = ' '.join(contracts()['one direction, down to the physics']['layers'])
    without_ros = contracts()['only ros and cli know ROS']['source_modules']
    for folder in folders:
        assert f'{PACKAGE}.{folder}' in layers
        assert folder in MAY_IMPORT_ROS or f'{PACKAGE}.{folder}' in without_ros


def test_every_root_module_is_under_the_rules():
    modules = {path.stem for path in (ROOT / PACKAGE).glob('*.py')} - {'__init__'}
    layers = re.findall(
        r'[\w.]+', ' '.join(contracts()['one direction, down to the physics']['layers'])
    )
    without_ros = contracts()['only ros and cli know ROS']['source_modules']
    assert {f'{PACKAGE}.{module}' for module in modules} <= set(layers) & set(without_ros)
