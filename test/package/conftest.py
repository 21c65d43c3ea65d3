"""Fixtures of the tests that install the package: one wheel for all."""

from pathlib import Path
import sys

import pytest

from package.test_install import copy_source, pip, run


@pytest.fixture(scope='session')
def wheel(tmp_path_factory) -> Path:
    """Return the wheel that pip builds from a copy of the sources; its path has a space in it."""
    folder = tmp_path_factory.mktemp('a wheel')
    source = copy_source(folder / 'a source')
    run(*pip(sys.prefix), 'wheel', '--no-deps', '-w', folder / 'made', source, cwd=folder)
    (made,) = (folder / 'made').iterdir()
    return made
