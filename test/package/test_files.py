"""Files and folders that appear whole or not at all."""

import os

import pytest

from disc_sim_ros import files
from disc_sim_ros.errors import ConfigError


def test_a_failed_write_keeps_the_old_file_and_leaves_no_part(tmp_path, monkeypatch):
    path = tmp_path / 'a.txt'
    path.write_bytes(b'old')

    def refuse(_):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(os, 'fsync', refuse)
    with pytest.raises(OSError, match='No space left'):
        files.write_whole(path, b'new')
    assert path.read_bytes() == b'old'
    assert [p.name for p in tmp_path.iterdir()] == ['a.txt']


def test_a_replaced_file_keeps_its_permissions_where_asked(tmp_path):
    path = tmp_path / 'a.txt'
    path.write_bytes(b'old')
    path.chmod(0o640)
    files.write_whole(path, b'new', keep_mode=True)
    assert path.read_bytes() == b'new'
    assert path.stat().st_mode & 0o777 == 0o640


def test_a_folder_appears_when_the_work_is_done_and_never_after_an_error(tmp_path):
    with files.whole_folder('OUT', tmp_path / 'deep/made') as part:
        part.mkdir()
        (part / 'a').write_bytes(b'1')
        assert not (tmp_path / 'deep/made').exists()
    assert (tmp_path / 'deep/made/a').read_bytes() == b'1'

    def fail():
        with files.whole_folder('OUT', tmp_path / 'no') as part:
            part.mkdir()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert sorted(p.name for p in tmp_path.rglob('*')) == ['a', 'deep', 'made']


def test_a_folder_that_appears_during_the_work_is_not_overwritten(tmp_path):
    def work():
        with files.whole_folder('OUT', tmp_path / 'made') as part:
            part.mkdir()
            (tmp_path / 'made').mkdir()
            (tmp_path / 'made/theirs').touch()

    with pytest.raises(ConfigError, match=r'OUT.*it exists already'):
        work()
    assert [p.name for p in (tmp_path / 'made').iterdir()] == ['theirs']


@pytest.mark.parametrize('name', ['..', '/', 'a\0b', 'x' * 300])
def test_an_impossible_name_of_a_folder_is_one_line(tmp_path, name):
    with pytest.raises(ConfigError, match='OUT') as caught:
        files.new_folder('OUT', tmp_path / name)
    assert '\n' not in str(caught.value)
