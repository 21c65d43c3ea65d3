"""What the tests of discs share."""

from collections.abc import Callable

import pytest


@pytest.fixture
def user_file(tmp_path) -> Callable[..., str]:
    """Write a user's disc file and return its name."""

    def write(content: str | bytes, name: str = 'mine.yaml') -> str:
        content = content.encode() if isinstance(content, str) else content
        (tmp_path / name).write_bytes(content)
        return str(tmp_path / name)

    return write
