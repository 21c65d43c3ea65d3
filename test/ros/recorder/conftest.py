"""Recorders in processes of their own."""

import pytest


@pytest.fixture
def record(ros, tmp_path):
    """A function that starts a recorder; those that still run at the end are killed."""
    from ros.recorder_process import Recorder

    started = []

    def start(bag=None, before='', **parameters):
        folder = bag or tmp_path / f'bag_{len(started)}'
        started.append(Recorder(ros, folder, parameters, before))
        return started[-1]

    yield start
    for recorder in started:
        recorder.process.kill()
        recorder.process.wait()
