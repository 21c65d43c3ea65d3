"""Plugin of pytest: write the ids of the failed tests into the file $FAILED_TESTS."""

import os
from pathlib import Path

import pytest


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Write one id a line, each once, as pytest takes them on its command line."""
    stats = terminalreporter.stats
    reports = [*stats.get('failed', ()), *stats.get('error', ())]
    ids = dict.fromkeys(without_group(report.nodeid) for report in reports)
    text = ''.join(f'{node_id}\n' for node_id in ids)
    Path(os.environ['FAILED_TESTS']).write_text(text, encoding='utf-8')


def without_group(node_id: str) -> str:
    """Return the id without the group that pytest-xdist appends after an `@`."""
    at = node_id.rfind('@')
    return node_id[:at] if at > node_id.rfind(']') and at > node_id.rfind('::') else node_id
