"""Skip tests that need an optional package, without its import."""

from importlib.util import find_spec

import pytest


def need(name: str) -> None:
    """Skip the test, or at the top of a module all its tests, where a package is missing."""
    if find_spec(name) is None:
        pytest.skip(f'{name} is not installed', allow_module_level=True)
