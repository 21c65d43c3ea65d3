"""What the tests of bags share: Foxglove's readers, from npm."""

from collections.abc import Callable, Iterator
from contextlib import suppress
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
def foxglove() -> Iterator[Callable[..., list[dict]]]:
    """A function that reads .mcap files with Foxglove's packages, installed once.

    One process reads all: to load Node.js and the packages takes longer than to read a bag.
    """
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

    with subprocess.Popen(
        [node, folder / 'read.mjs'],
        env={**os.environ, 'NODE_NO_WARNINGS': '1'},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:

        def read(*paths: Path) -> list[dict]:
            with suppress(BrokenPipeError):  # it ended at what it read before
                print(json.dumps(list(map(str, paths))), file=process.stdin, flush=True)
            answer = process.stdout.readline()
            assert answer, process.stderr.read()
            return json.loads(answer)

        yield read
        with suppress(BrokenPipeError):
            process.stdin.close()
