"""The cache of machine code: without a place, on a full disk, at first starts at the same time."""

import itertools
import os
from pathlib import Path
import re

import pytest

from disc_sim_ros.physics.kernels import jit
from forked import Forked

pytestmark = [
    pytest.mark.skipif(not jit.COMPILED, reason='without compilation there is no cache'),
    pytest.mark.xdist_group('code cache'),  # numba is loaded once
]
SCRIPT = """
import resource, signal, sys, warnings
warnings.simplefilter('error')
if 'full' in sys.argv:  # no file may grow beyond 1 kB: writing fails as on a full disk
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
if 'upgraded' in sys.argv:
    sys.version += ' and a patch'
from disc_sim_ros.physics.kernels.code_cache import cache_folder
from disc_sim_ros.physics.kernels.jit import entry, note_before
@entry
def triple(x):
    return 3.0 * x
if 'noted' in sys.argv:
    assert note_before(triple, seconds=3).startswith('compiling '), 'users wait unawares'
print(triple(2.0), triple.hits, cache_folder())
"""


@pytest.fixture
def start(tmp_path):
    """Return a function that starts a program with one kernel, in an environment of its own.

    It starts with numba, which takes most of the time and knows nothing of the cache.
    """
    script = tmp_path / 'script.py'
    script.write_text(SCRIPT, encoding='utf-8')
    places = {'HOME', 'NUMBA_CACHE_DIR', 'XDG_CACHE_HOME'}
    numbers = itertools.count()
    others = {name: value for name, value in os.environ.items() if name not in places}

    def start(*words, **environment):
        written = [tmp_path / f'{name}_{next(numbers)}' for name in ('output', 'errors')]
        for path in written:
            path.touch()
        process = Forked(
            script, words, written[0],
            errors=written[1], environment=others | environment, imports='physics.numba_ready',
        )  # fmt: skip
        return process, *written

    return start


def result_of(started):
    """Return the number, the hits in the cache and its folder; then what went to stderr."""
    process, output, errors = started
    code, stderr = process.wait(120), errors.read_text()
    assert code == 0, stderr
    return tuple(output.read_text().split()), stderr


def test_a_home_that_does_not_exist_is_not_made(start, tmp_path):
    home = tmp_path / 'gone'
    assert result_of(start(HOME=str(home))) == (('6.0', '0', 'None'), '')
    assert not home.exists()


def test_a_home_has_the_cache(start, tmp_path):
    (_, _, folder), stderr = result_of(start(HOME=str(tmp_path)))
    assert Path(folder).parent == tmp_path / '.cache/disc_sim_ros'
    assert stderr == ''


@pytest.mark.parametrize(
    ('kind', 'place'), [('NUMBA_CACHE_DIR', '/proc/nowhere'), ('XDG_CACHE_HOME', 'file')]
)
def test_where_no_folder_can_be_made_the_machine_code_stays_in_memory(
    start, tmp_path, kind, place
):
    """/proc is read-only, also for root, whom permissions do not stop."""
    (tmp_path / 'file').touch()
    started = start('noted', **{kind: str(tmp_path / place)})
    assert result_of(started) == (('6.0', '0', 'None'), '')


def test_a_full_disk_costs_one_line_and_the_next_start_is_sound(start, tmp_path):
    place = {'NUMBA_CACHE_DIR': str(tmp_path / 'cache')}
    (number, hits, _), stderr = result_of(start('full', **place))
    assert (number, hits) == ('6.0', '0')
    assert re.fullmatch(r'[^\n]*cannot keep machine code: [^\n]*File too large[^\n]*\n', stderr)
    assert result_of(start(**place))[0][:2] == ('6.0', '0')
    (number, hits, _), stderr = result_of(start(**place))
    assert (number, hits, stderr) == ('6.0', '1', '')


def test_first_starts_at_once_do_not_disturb_each_other(start, tmp_path):
    place = {'NUMBA_CACHE_DIR': str(tmp_path / 'cache')}
    for started in [start(**place) for _ in range(3)]:
        (number, _, _), stderr = result_of(started)
        assert (number, stderr) == ('6.0', '')
    (number, hits, _), stderr = result_of(start(**place))
    assert (number, hits, stderr) == ('6.0', '1', '')


def test_another_compiler_has_a_folder_of_its_own(start, tmp_path):
    place = {'NUMBA_CACHE_DIR': str(tmp_path / 'cache')}
    before, _ = result_of(start(**place))
    after, stderr = result_of(start('upgraded', **place))
    assert (after[:2], stderr) == (('6.0', '0'), '')
    assert after[2] != before[2]
    assert result_of(start(**place))[0] == ('6.0', '1', before[2])
