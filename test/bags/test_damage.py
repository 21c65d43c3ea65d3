"""Cut and damaged files: nothing crashes, and every complete message comes out."""

from contextlib import suppress
from pathlib import Path

from mcap.opcode import Opcode
import numpy as np
import pytest

from bags.making import ODOMETRIES, ODOMETRY, START, STEP, STRING, everything, text, topic
from disc_sim_ros.bags.mcap_records import HEAD
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError

pytest.importorskip('rclpy')


def make(folder: Path, count: int, chunk: int, compression: str) -> tuple[bytes, list[tuple]]:
    """Write a bag of chunks of `chunk` messages; return its file and its messages."""
    with BagWriter(folder, compression=compression, flush_period=3600.0) as bag:
        odom, log = bag.add(topic('/odom', ODOMETRY)), bag.add(topic('/log', STRING))
        for n in range(count):
            at = START + n * STEP
            if n % 7 == 3:
                bag.write(log, text(f'message {n}'), at, at - 1)
            else:
                bag.write(odom, ODOMETRIES[n % len(ODOMETRIES)], at, at - 1)
            if n % chunk == chunk - 1:
                bag.flush()
    content = (folder / f'{folder.name}_0.mcap').read_bytes()
    return content, everything(open_bag(folder))


def chunk_places(content: bytes) -> list[tuple[int, int]]:
    """Where the chunk records of a whole file begin and end."""
    places = []
    at = 8
    while content[at] != Opcode.DATA_END:
        opcode, length = HEAD.unpack_from(content, at)
        end = at + HEAD.size + length
        if opcode == Opcode.CHUNK:
            places.append((at, end))
        at = end
    return places


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """A file of ten chunks of 20 messages, for each compression."""
    folder = tmp_path_factory.mktemp('whole')
    return {c: make(folder / c, 200, 20, c) for c in ('zstd', 'lz4', 'none')}


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
def test_a_file_cut_anywhere_keeps_every_complete_message(whole, tmp_path, compression):
    content, messages = whole[compression]
    places = chunk_places(content)
    assert len(places) == 10
    # Where a message ends that is not compressed.
    ends = [content.find(m[3]) + len(m[3]) for m in messages] if compression == 'none' else []
    path = tmp_path / 'cut.mcap'
    for size in range(0, len(content), 997):
        path.write_bytes(content[:size])
        if size < 8:
            with pytest.raises(BagError):
                open_bag(path)
            continue
        bag = open_bag(path)
        got = everything(bag)
        assert not bag.complete
        assert got == messages[: len(got)]
        assert len(got) == bag.message_count
        complete = 20 * sum(end <= size for _, end in places)
        assert complete <= len(got) < complete + 20
        if compression == 'none':  # each message whose last byte is there
            assert len(got) == sum(end <= size for end in ends)


def test_a_file_cut_anywhere_is_made_whole(whole, tmp_path):
    content, messages = whole['zstd']
    path = tmp_path / 'cut.mcap'
    for number, size in enumerate(range(997, len(content), 997 * 4)):
        path.write_bytes(content[:size])
        before = open_bag(path)
        if before.message_count == 0:  # cut before the first message
            with pytest.raises(BagError, match='nothing can be kept'):
                repair(path, tmp_path / f'made {number}')
            assert not (tmp_path / f'made {number}').exists()
            continue
        report = repair(path, tmp_path / f'made {number}')
        made = open_bag(tmp_path / f'made {number}')
        assert made.complete
        assert everything(made) == messages[: before.message_count]
        assert report.message_count == made.message_count == before.message_count
        assert not report.was_whole
        assert path.read_bytes() == content[:size]
    assert number > 5


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
def test_the_beginning_of_a_cut_chunk_is_kept(tmp_path, compression):
    content, messages = make(tmp_path / 'bag', 900, 900, compression)
    [(begin, end)] = chunk_places(content)
    path = tmp_path / 'cut.mcap'
    path.write_bytes(content[: (begin + 3 * end) // 4])
    bag = open_bag(path)
    got = everything(bag)
    # Blocks are of 128 KiB (zstd) and 64 KiB (lz4) of some 650 KiB: half must come out.
    assert 450 < len(got) < 700
    assert got == messages[: len(got)]
    [loss] = bag.losses
    assert f'its first {len(got)} messages are kept' in str(loss)
    report = repair(path, tmp_path / 'made')
    assert everything(open_bag(tmp_path / 'made')) == got
    assert report.losses == (loss,)


@pytest.mark.parametrize('compression', ['zstd', 'none'])
def test_flipped_bytes_cost_at_most_the_chunks_they_are_in(whole, tmp_path, compression):
    content, messages = whole[compression]
    places = chunk_places(content)
    rng = np.random.default_rng(20)
    path = tmp_path / 'flipped.mcap'
    for trial in range(40):
        damaged = bytearray(content)
        spots = rng.integers(0, len(content), size=rng.integers(1, 4))
        for spot in spots:
            damaged[spot] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        with suppress(BagError):  # of a damaged chunk, or that there is no bag left
            assert set(everything(open_bag(path))) <= set(messages)
        report = repair(path, tmp_path / f'made {trial}')
        kept = everything(open_bag(tmp_path / f'made {trial}'))
        hit = {i for i, (a, b) in enumerate(places) for spot in spots if a <= spot < b}
        safe = [m for i, m in enumerate(messages) if i // 20 not in hit]
        assert set(kept) >= set(safe), (trial, spots)
        assert set(kept) <= set(messages), (trial, spots)
        if len(kept) < len(messages):
            assert report.losses, (trial, spots)


def test_a_damaged_chunk_of_an_indexed_bag_is_named_when_it_is_read(whole, tmp_path):
    content, _ = whole['zstd']
    begin, end = chunk_places(content)[4]
    damaged = bytearray(content)
    damaged[(begin + end) // 2] ^= 0x55
    path = tmp_path / 'damaged.mcap'
    path.write_bytes(damaged)
    bag = open_bag(path)
    with pytest.raises(BagError, match=rf'{path}: damaged at byte {begin} .*`repair_bag`'):
        everything(bag)
    report = repair(path, tmp_path / 'made')
    assert report.message_count == 180
    [loss] = report.losses
    assert (loss.offset, loss.length, loss.messages) == (begin, end - begin, 20)


def test_a_file_without_end_outlives_its_first_chunk(whole, tmp_path):
    """Definitions are in more than one chunk."""
    content, messages = whole['zstd']
    places = chunk_places(content)
    damaged = bytearray(content[: places[-1][1]])
    damaged[places[0][0] + 2000] ^= 0x55
    path = tmp_path / 'first.mcap'
    path.write_bytes(damaged)
    assert everything(open_bag(path)) == messages[20:]


def test_a_missing_piece_in_the_middle_costs_no_more_than_its_chunks(whole, tmp_path):
    """As a file system leaves it after a power loss: a hole of zeros over several records."""
    content, messages = whole['zstd']
    places = chunk_places(content)
    damaged = bytearray(content)
    begin, end = places[3][0] + 100, places[5][0] + 100
    damaged[begin:end] = bytes(end - begin)
    path = tmp_path / 'hole.mcap'
    path.write_bytes(damaged)
    report = repair(path, tmp_path / 'made')
    assert everything(open_bag(tmp_path / 'made')) == messages[:60] + messages[120:]
    assert report.bytes_lost >= end - begin


def test_a_damaged_index_costs_nothing(whole, tmp_path):
    content, messages = whole['zstd']
    path = tmp_path / 'index.mcap'
    for back in (1, 12, 30, 200, 700):
        damaged = bytearray(content)
        damaged[-back] ^= 0xFF
        path.write_bytes(damaged)
        bag = open_bag(path)
        assert not bag.complete
        assert everything(bag) == messages
