"""Files that are lost, renamed, empty, compressed, not in metadata.yaml: the disk comes first."""

import gc
import json
from pathlib import Path
import shutil
import tempfile

import lz4.frame
import pytest
from rosbags.rosbag2 import Reader
import yaml
import zstandard

from bags.making import ODOMETRIES, ODOMETRY, START, STRING, everything, text, topic, write_bag
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.cli.repair_bag import main
from disc_sim_ros.errors import BagError

COUNTS = [110, 110, 110, 110]  # messages in the files of the bag


@pytest.fixture
def folder(tmp_path) -> Path:
    """A bag of four files."""
    write_bag(tmp_path / 'bag', 400, split_at=(100, 200, 300), custom_data={'a': 'b'})
    return tmp_path / 'bag'


def check(folder: Path, kept: list[int], *losses: str) -> list[str]:
    """Read and repair a bag; compare the messages of its files, and what is said of the others."""
    opened = open_bag(folder)
    assert not opened.complete or not losses
    assert [c.message_count for c in opened.contents if c.message_count] == kept
    assert len(everything(opened)) == opened.message_count == sum(kept)
    target = folder.with_name('made')
    report = repair(folder, target)
    made = open_bag(target)
    assert made.complete
    assert everything(made) == everything(opened)
    assert report.message_count == sum(kept)
    said = [str(loss) for loss in report.losses]
    for loss in losses:
        assert any(loss in line for line in said), said
    return said


def test_a_lost_file_costs_its_messages_and_is_named(folder):
    (folder / 'bag_1.mcap').unlink()
    said = check(folder, [110, 110, 110], 'bag_1.mcap: 110 messages: the file is missing')
    assert len(said) == 1


@pytest.mark.parametrize('content', [b'', bytes(5000), b'\x89MCAP0\r\n', b'hello'])
def test_an_empty_or_zeroed_file_costs_its_messages_and_is_named(folder, content):
    (folder / 'bag_2.mcap').write_bytes(content)
    [loss] = check(folder, [110, 110, 110], 'bag_2.mcap: ')
    assert '110 messages' in loss


def test_a_cut_file_is_said_to_lack_what_metadata_counts(folder):
    path = folder / 'bag_1.mcap'
    path.write_bytes(path.read_bytes()[:500])
    [loss] = check(folder, [110, 110, 110])
    assert '110 messages' in loss


@pytest.mark.parametrize(
    'name',
    ['flight_1.mcap', 'old 1.mcap', 'backup.mcap', 'bag_1.mcap.zstd', 'bag_1.mcap.bak', 'bag_1'],
)
def test_a_renamed_file_is_found_and_stands_in_its_place(folder, name):
    (folder / 'bag_1.mcap').rename(folder / name)
    expected = ['bag_1.mcap: 0 messages: it is missing'] if 'zstd' not in name else []
    check(folder, COUNTS, *expected)


def test_several_renamed_files_are_recognised_by_their_content(folder):
    # Counts alone do not tell them apart.
    for number, name in enumerate('dcba'):
        (folder / f'bag_{number}.mcap').rename(folder / f'{name}.mcap')
    check(folder, COUNTS)
    times = [c.start for c in open_bag(folder).contents]
    assert times == sorted(times)


def test_a_bag_all_of_whose_files_were_renamed_is_read(folder):
    for path in folder.glob('*.mcap'):
        path.rename(folder / path.name.replace('bag', 'flight'))
    check(folder, COUNTS)


def test_a_bag_whose_files_lost_their_ending_is_read(folder):
    for path in folder.glob('*.mcap'):
        path.rename(path.with_suffix(''))
    check(folder, COUNTS)


def test_a_stray_file_is_not_taken_for_a_part_of_the_bag(folder):
    shutil.copy(folder / 'bag_0.mcap', folder / 'bag_0 (copy).mcap')
    assert open_bag(folder).complete
    check(folder, COUNTS)
    shutil.rmtree(folder.with_name('made'))
    (folder / 'bag_3.mcap').unlink()
    said = check(folder, COUNTS[:3], 'bag_3.mcap: 110 messages: the file is missing')
    assert any('bag_0 (copy).mcap' in line and 'left out' in line for line in said)


def test_a_hole_in_the_numbers_is_named_where_metadata_is_gone(folder):
    (folder / 'metadata.yaml').unlink()
    (folder / 'bag_1.mcap').unlink()
    check(folder, COUNTS[:3], 'bag_1.mcap: the file is missing')
    shutil.rmtree(folder.with_name('made'))
    (folder / 'bag_2.mcap').unlink()
    check(folder, COUNTS[:2], 'bag_1.mcap: the file is missing, and so are the following')


def test_a_hole_behind_the_files_that_metadata_lists_is_named(folder):
    """The recorder was killed, then a file was lost."""
    path = folder / 'metadata.yaml'
    root = yaml.safe_load(path.read_text(encoding='utf-8'))
    for key in ('files', 'relative_file_paths'):
        del root['rosbag2_bagfile_information'][key][1:]
    path.write_text(yaml.safe_dump(root, sort_keys=False), encoding='utf-8')
    (folder / 'bag_1.mcap').unlink()
    check(folder, COUNTS[:3], 'bag_1.mcap: the file is missing')


def test_a_file_that_metadata_leaves_out_of_the_middle_is_read_in_its_place(folder):
    path = folder / 'metadata.yaml'
    root = yaml.safe_load(path.read_text(encoding='utf-8'))
    for key in ('files', 'relative_file_paths'):
        del root['rosbag2_bagfile_information'][key][1]
    path.write_text(yaml.safe_dump(root, sort_keys=False), encoding='utf-8')
    check(folder, COUNTS)
    assert [p.name for p in open_bag(folder).files] == [f'bag_{n}.mcap' for n in range(4)]


def test_a_bag_whose_files_are_all_lost_is_refused_by_name(folder, capsys):
    for path in folder.glob('*.mcap'):
        path.unlink()
    assert main([str(folder), str(folder.with_name('made'))]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert 'every file that metadata.yaml names is missing (bag_0.mcap, bag_1.mcap' in line
    assert not folder.with_name('made').exists()


def test_a_bag_of_which_nothing_is_left_is_refused(folder):
    for path in folder.glob('*.mcap'):
        path.write_bytes(bytes(1000))
    with pytest.raises(BagError, match='no MCAP file'):
        repair(folder, folder.with_name('made'))


def test_the_program_names_lost_messages_in_its_document(folder, capsys):
    (folder / 'bag_1.mcap').unlink()
    assert main([str(folder), str(folder.with_name('made')), '--json']) == 0
    document = json.loads(capsys.readouterr().out)
    assert document['message_count'] == 330
    assert [(loss['file'], loss['messages']) for loss in document['losses']] == [
        (str(folder / 'bag_1.mcap'), 110)
    ]


# ---- compressed files and messages ----


def compress_files(folder: Path, numbers: range, ending: str = '.zstd') -> None:
    """Compress files as rosbag2 does in the mode FILE."""
    compress = lz4.frame.compress if ending == '.lz4' else zstandard.ZstdCompressor().compress
    for number in numbers:
        path = folder / f'bag_{number}.mcap'
        path.with_name(path.name + ending).write_bytes(compress(path.read_bytes()))
        path.unlink()


@pytest.mark.parametrize('ending', ['.zstd', '.zst', '.lz4'])
@pytest.mark.parametrize('listed', ['plain', 'packed', 'no metadata'])
@pytest.mark.parametrize('numbers', [range(4), range(3)])
def test_compressed_files_are_read_and_repaired(folder, numbers, listed, ending):
    """All of them, or all but the last, as a recorder that was killed leaves them."""
    before = everything(open_bag(folder))
    compress_files(folder, numbers, ending)
    path = folder / 'metadata.yaml'
    root = yaml.safe_load(path.read_text(encoding='utf-8'))
    about = root['rosbag2_bagfile_information']
    about |= {'compression_mode': 'FILE', 'compression_format': 'zstd'}
    if listed == 'packed':  # `files` keeps the names without the ending in some versions
        about['relative_file_paths'] = [f'bag_{n}.mcap{ending}' for n in range(4)]
    path.write_text(yaml.safe_dump(root, sort_keys=False), encoding='utf-8')
    if listed == 'no metadata':
        path.unlink()
    assert everything(open_bag(folder)) == before
    check(folder, COUNTS)
    made = open_bag(folder.with_name('made'))
    assert made.metadata.compression_mode == ''  # its files are not compressed
    assert everything(open_bag(folder / f'bag_0.mcap{ending}')) == before[:110]


def test_a_compressed_file_that_is_cut_off_keeps_its_beginning(folder):
    compress_files(folder, range(4))
    path = folder / 'bag_0.mcap.zstd'
    path.write_bytes(path.read_bytes()[:-2000])
    bag = open_bag(folder)
    assert not bag.complete
    assert any('the compressed file is damaged' in str(loss) for loss in bag.losses)
    report = repair(folder, folder.with_name('made'))
    assert 330 <= report.message_count < 440


@pytest.mark.parametrize('damaged', ['plain', 'packed'])
def test_of_a_file_and_its_compressed_form_the_sound_one_is_read_once(folder, damaged):
    """A recorder that is killed while it compresses leaves both."""
    plain = (folder / 'bag_3.mcap').read_bytes()
    compress_files(folder, range(4))
    packed = folder / 'bag_3.mcap.zstd'
    if damaged == 'packed':
        packed.write_bytes(packed.read_bytes()[:300])
        (folder / 'bag_3.mcap').write_bytes(plain)
    else:
        (folder / 'bag_3.mcap').write_bytes(plain[:300])
    check(folder, COUNTS)


def test_temporary_files_are_gone_with_the_bag(folder, tmp_path, monkeypatch):
    (tmp_path / 'tmp').mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path / 'tmp'))
    compress_files(folder, range(4))
    bag = open_bag(folder)
    assert len(list((tmp_path / 'tmp').iterdir())) == 4
    assert bag.message_count == 440
    del bag
    repair(folder, tmp_path / 'made')
    gc.collect()
    assert not list((tmp_path / 'tmp').iterdir())


def message_compressed(folder: Path, *, end: bool, labelled: bool) -> None:
    """A bag of which each message is compressed, as rosbag2 does in the mode MESSAGE."""
    compress = zstandard.ZstdCompressor().compress
    bag = BagWriter(folder, compression='none')
    odom, log = bag.add(topic('/odom', ODOMETRY)), bag.add(topic('/log', STRING))
    for n in range(50):
        bag.write(odom, compress(ODOMETRIES[n]), START + n, START)
    bag.write(log, compress(text('hello')), START + 50, START)
    bag.flush()
    if end:
        bag.close()
    else:
        (folder / 'metadata.yaml').unlink()
        shutil.copytree(folder, folder.with_name('copy'))
        bag.close()
        shutil.rmtree(folder)
        folder.with_name('copy').rename(folder)
    if labelled:
        path = folder / 'metadata.yaml'
        root = yaml.safe_load(path.read_text(encoding='utf-8'))
        root['rosbag2_bagfile_information'] |= {
            'compression_mode': 'MESSAGE',
            'compression_format': 'zstd',
        }
        path.write_text(yaml.safe_dump(root, sort_keys=False), encoding='utf-8')


@pytest.mark.parametrize(('end', 'labelled'), [(True, True), (True, False), (False, False)])
def test_compressed_messages_are_read_and_repaired_with_their_label(tmp_path, end, labelled):
    message_compressed(tmp_path / 'bag', end=end, labelled=labelled)
    for folder in ('bag', 'made'):
        bag = open_bag(tmp_path / folder)
        assert [m.data for m in bag.raw('/odom')] == ODOMETRIES[:50]
        assert [m.value.data for m in bag.messages('/log')] == ['hello']
        if folder == 'bag':
            report = repair(tmp_path / 'bag', tmp_path / 'made')
            assert report.message_count == 51
    assert bag.complete
    assert bag.metadata.compression_mode == 'MESSAGE'
    assert bag.metadata.compression_format == 'zstd'
    with Reader(tmp_path / 'made') as reader:
        assert [data for _, _, data in reader.messages()] == [*ODOMETRIES[:50], text('hello')]


def test_a_message_that_cannot_be_decompressed_is_named(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        bag.write(bag.add(topic('/log', STRING)), b'\x28\xb5\x2f\xfdxyz', 5, 5)
    with pytest.raises(BagError, match='the message at 5 ns is damaged'):
        list(open_bag(tmp_path / 'bag').raw())
