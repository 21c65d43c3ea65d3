"""Fixtures of the tests of pages: one browser for all."""

from collections.abc import Iterator

import pytest

import browser


@pytest.fixture(scope='session')
def chromium() -> Iterator[browser.Browser]:
    """A browser, to show pages one after the other: its start takes as long as their tests."""
    with browser.Browser(900, 500) as tab:
        yield tab
