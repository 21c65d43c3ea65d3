"""What the tests of bags share: Foxglove's readers, from npm."""

from collections.abc import Callable
import json
import os
from pathlib import Path
import shutil
import subprocess

import pytest

from made_once import made_once

SOURCE = Path(__file__).with_name('js')
COPIED = ('package.json', 'package-lock.json', 'read.mjs')


@pytest.fixture(scope='session')
def foxglove() -> Callable[..., list[dict]]:
    """A function that reads .mcap files with Foxglove's packages, installed once."""
    node, npm = shutil.which('node'), shutil.which('npm')
    if node is None or npm is None:
        pytest.skip('node and npm are not installed: the readers of Foxglove cannot run')

    def install(folder: Path) -> None:
        for name in COPIED:
            shutil.copy(SOURCE / name, folder)
        command = [npm, 'ci', '--ignore-scripts', '--no-audit', '--no-fund']
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=240, check=False
        )
        assert done.returncode == 0, done.stderr

    content = b''.join((SOURCE / name).read_bytes() for name in COPIED)
    folder = made_once('foxglove', content, install)

    def read(*paths: Path) -> list[dict]:
        done = subprocess.run(
            [node, folder / 'read.mjs', *paths],
            env={**os.environ, 'NODE_NO_WARNINGS': '1'},
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return read
