"""A resumed sweep takes a part for finished only if it is what was written."""

import shutil

import pytest

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.studies import tables
from disc_sim_ros.studies.runner import sweep
from disc_sim_ros.studies.scatter import Normal
from disc_sim_ros.studies.study import Study

STUDY = Study(
    setup=Setup(disc=disc_file.load_disc('frisbee'), step=0.02),
    scatter={'pitch': Normal(2.0), 'spin': Normal(2.0, 31.0)},
    count=600,
)
BATCH = 100


class EndedError(Exception):
    """Ends a sweep between two parts."""


def _flipped(parts):
    """The bits of a page change; the part has its rows still."""
    content = bytearray(parts[1].read_bytes())
    content[len(content) // 4] ^= 0x55
    parts[1].write_bytes(content)


def _copied(parts):
    """A part stands in the place of another one with as many rows."""
    shutil.copy(parts[0], parts[1])


def _copied_with_its_digest(parts):
    _copied(parts)
    shutil.copy(parts[0].with_suffix('.sha256'), parts[1].with_suffix('.sha256'))


def _without_digest(parts):
    parts[1].with_suffix('.sha256').unlink()


@pytest.mark.parametrize('damage', [_flipped, _copied, _copied_with_its_digest, _without_digest])
def test_a_damaged_part_is_flown_again(tmp_path, damage):
    whole = sweep(STUDY, tmp_path / 'whole.parquet', batch=BATCH).read_bytes()

    def interrupt(done, _):
        if done == 2 * BATCH:
            raise EndedError

    path = tmp_path / 'resumed.parquet'
    with pytest.raises(EndedError):
        sweep(STUDY, path, batch=BATCH, progress=interrupt)
    parts = sorted((tmp_path / 'resumed.parquet.parts').glob('0*.parquet'))
    assert len(parts) >= 2  # some were under way
    damage(parts)
    assert tables.rows_of(parts[1]) in {BATCH, -1}
    done = []
    sweep(STUDY, path, resume=True, progress=lambda n, _: done.append(n))
    assert done[0] == (len(parts) - 1) * BATCH  # all but this one count as finished
    assert path.read_bytes() == whole
