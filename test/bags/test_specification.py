"""Every file that the MCAP specification allows is read whole and repaired without a loss."""

from collections import Counter
from itertools import product
from pathlib import Path
import zlib

from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, DataEnd, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
import pytest

from bags.making import everything
from bags.mcap_build import (
    CHANNEL,
    EVERYTHING,
    MAGIC,
    MESSAGES,
    SCHEMA,
    mcap_bytes,
    packed,
    raw_record,
)
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.errors import BagError

SUMMARY = ('definitions', 'statistics', 'chunks', 'others')
CONTENTS = {
    'nothing': (),
    'definitions': (SCHEMA, CHANNEL),
    'a message': (SCHEMA, CHANNEL, MESSAGES[0]),
    'a message without a schema': (
        Channel(id=0, topic='example', message_encoding='text', metadata={}, schema_id=0),
        MESSAGES[0],
    ),
    'an attachment': (EVERYTHING[-2],),
    'metadata': (EVERYTHING[-1],),
    'everything': EVERYTHING,
}


def official(path: Path) -> dict[type, list]:
    """What the reader of the `mcap` package finds in the data section."""
    records: dict[type, list] = {
        kind: [] for kind in (Message, Schema, Channel, Attachment, Metadata)
    }
    with path.open('rb') as file:
        for record in StreamReader(file, validate_crcs=True).records:
            if isinstance(record, DataEnd):
                break
            if type(record) in records and record not in records[type(record)]:
                records[type(record)].append(record)
    return records


def check(path: Path, target: Path, messages: int) -> None:
    """A file is read and repaired equal to what the official reader finds."""
    expected = official(path)
    assert len(expected[Message]) == messages
    bag = open_bag(path)
    assert bag.complete
    assert not bag.losses
    assert Counter((m.log_time, m.publish_time, m.sequence, m.data) for m in bag.raw()) == Counter(
        (m.log_time, m.publish_time, m.sequence, m.data) for m in expected[Message]
    )
    assert list(bag.attachments) == expected[Attachment]
    report = repair(path, target)
    assert report.was_whole
    assert not report.losses
    assert report.message_count == messages
    [made] = target.glob('*.mcap')
    assert official(made) == expected
    with made.open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_summary().statistics.message_count == messages
        assert sum(1 for _ in reader.iter_messages()) == messages


@pytest.mark.parametrize('content', CONTENTS)
def test_every_form_of_a_file_is_read_whole(tmp_path, content):
    """As the conformance suite of MCAP: each content with and without each part."""
    records = CONTENTS[content]
    messages = sum(isinstance(r, Message) for r in records)
    groups = [frozenset(g for g, on in zip(SUMMARY, bits, strict=True) if on)
              for bits in product((True, False), repeat=4)]  # fmt: skip
    number = 0
    for chunked, index, pad, group in product(
        (True, False), (True, False), (b'', b'\1\2\3'), groups
    ):
        if index and not chunked:
            continue
        number += 1
        path = tmp_path / f'{number}.mcap'
        path.write_bytes(
            mcap_bytes(records, pad=pad, chunked=chunked, message_index=index, summary=group)
        )
        check(path, tmp_path / f'made {number}', messages)
    assert number == 96


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'zstd+zstd', 'lz4+lz4'])
def test_a_chunk_may_have_several_frames(tmp_path, compression):
    path = tmp_path / 'x.mcap'
    path.write_bytes(mcap_bytes(EVERYTHING, compression=compression, pad=b'\0\1'))
    expected = [(m.log_time, m.data) for m in sorted(MESSAGES, key=lambda m: m.log_time)]
    bag = open_bag(path)
    assert bag.complete
    assert [(m.log_time, m.data) for m in bag.raw()] == expected
    repair(path, tmp_path / 'made')
    assert [(m.log_time, m.data) for m in open_bag(tmp_path / 'made').raw()] == expected


def test_records_in_a_chunk_may_be_longer_than_their_fields(tmp_path):
    path = tmp_path / 'x.mcap'
    path.write_bytes(mcap_bytes(EVERYTHING, pad=b'\1\2\3', pad_in_chunk=True))
    bag = open_bag(path)
    assert bag.complete
    assert [t.name for t in bag.topics] == ['example']
    assert bag.message_count == len(everything(bag)) == len(MESSAGES)


def test_a_compression_that_is_not_known_is_named_and_the_rest_read(tmp_path):
    data = b''.join(packed(r) for r in EVERYTHING[:-2])
    strange = packed(Chunk('brotli', b'??', 9, 0, 0, len(data)))
    path = tmp_path / 'x.mcap'
    path.write_bytes(mcap_bytes([SCHEMA, CHANNEL, strange, *MESSAGES], summary=frozenset()))
    report = repair(path, tmp_path / 'made')
    assert report.message_count == len(MESSAGES)
    [loss] = report.losses
    assert "the compression 'brotli' is not known" in str(loss)
    assert loss.length == len(strange)


@pytest.mark.parametrize('opcode', [0x10, 0x42, 0x7F, 0x80, 0xFF])
@pytest.mark.parametrize('chunked', [True, False])
@pytest.mark.parametrize('size', [0, 5, 200_000])
def test_records_of_unknown_opcodes_are_skipped(tmp_path, opcode, chunked, size):
    strange = raw_record(opcode, bytes(range(256)) * (size // 256) + b'x' * (size % 256))
    path = tmp_path / 'x.mcap'
    records = [strange, *EVERYTHING[:7], strange, *EVERYTHING[7:]]
    path.write_bytes(mcap_bytes(records, chunked=chunked))
    bag = open_bag(path)
    assert bag.complete
    assert bag.message_count == len(MESSAGES)
    report = repair(path, tmp_path / 'made')
    assert report.was_whole
    assert report.message_count == len(MESSAGES)
    kept = (tmp_path / 'made/made_0.mcap').read_bytes().count(strange) if size == 200_000 else 2
    if opcode >= 0x80:  # of another program, which may want it again
        assert kept == 2


def test_a_record_of_an_unknown_opcode_in_a_chunk_is_skipped(tmp_path):
    chunk = b''.join(packed(r) for r in EVERYTHING[:5]) + raw_record(0x55, b'abc')
    chunk += b''.join(packed(r) for r in MESSAGES[3:])
    record = packed(Chunk('', chunk, 9, 0, zlib.crc32(chunk), len(chunk)))
    path = tmp_path / 'x.mcap'
    path.write_bytes(mcap_bytes([record], chunked=False, summary=frozenset()))
    bag = open_bag(path)
    assert bag.complete
    assert bag.message_count == len(MESSAGES)


def test_a_wrong_checksum_of_all_data_is_a_damage_and_keeps_everything(tmp_path):
    """The messages have no checksum of their own: whether a byte is right is not known."""
    content = bytearray(mcap_bytes(EVERYTHING, chunked=False))
    at = content.index(MESSAGES[4].data)
    content[at + 1] ^= 1
    path = tmp_path / 'x.mcap'
    path.write_bytes(content)
    report = repair(path, tmp_path / 'made')
    assert not report.was_whole
    [loss] = report.losses
    assert 'the checksum of all data disagrees' in str(loss)
    assert report.message_count == len(MESSAGES)


@pytest.mark.parametrize('end', [True, False])
def test_a_file_without_chunks_is_read_on_behind_any_damage(tmp_path, end):
    """Damage of 40 bytes anywhere costs at most the records that it hits."""
    content = mcap_bytes(EVERYTHING, chunked=False, data_crc=False, end=end)
    places = {}
    for m in MESSAGES:
        at = content.index(packed(m))
        places[m.sequence] = (at, at + len(packed(m)))
    definition = content.index(packed(CHANNEL))
    defined_again = end and content.index(packed(CHANNEL), definition + 1)
    path = tmp_path / 'x.mcap'
    last = content.index(packed(EVERYTHING[-1]))
    for number, begin in enumerate(range(8, last, 7)):
        damaged = bytearray(content)
        damaged[begin : begin + 40] = bytes(40)
        path.write_bytes(damaged)
        hit = {n for n, (a, b) in places.items() if a < begin + 40 and b > begin}
        target = tmp_path / f'made {number}'
        if begin - len(packed(CHANNEL)) < definition < begin + 40 and not defined_again:
            if begin <= definition:  # its head is lost, and with it what the messages are
                with pytest.raises(BagError, match='nothing can be kept'):
                    repair(path, target)
            continue
        repair(path, target)
        kept = {m.sequence for m in open_bag(target).raw()}
        assert kept >= set(places) - hit, begin
    assert number > 70


def test_messages_whose_schema_is_lost_are_kept(tmp_path):
    content = bytearray(mcap_bytes(EVERYTHING, chunked=False, end=False))
    at = content.index(packed(SCHEMA))
    content[at : at + len(packed(SCHEMA))] = bytes(len(packed(SCHEMA)))
    path = tmp_path / 'x.mcap'
    path.write_bytes(content)
    report = repair(path, tmp_path / 'made')
    assert report.kept == {'example': len(MESSAGES)}
    assert 'the schema of example is lost; its messages are kept' in report.summary()
    assert len(everything(open_bag(tmp_path / 'made'))) == len(MESSAGES)


@pytest.mark.parametrize('size', [8, 30, 60])
def test_a_file_of_which_nothing_can_be_kept_is_refused(tmp_path, size):
    path = tmp_path / 'x.mcap'
    path.write_bytes(mcap_bytes(EVERYTHING)[:size])
    with pytest.raises(BagError, match='nothing can be kept') as caught:
        repair(path, tmp_path / 'made')
    assert '\n' not in str(caught.value)
    assert not (tmp_path / 'made').exists()


def test_a_whole_file_is_copied_byte_for_byte(tmp_path):
    path = tmp_path / 'x.mcap'
    path.write_bytes(mcap_bytes([raw_record(0x80, b'theirs'), *EVERYTHING], compression='lz4'))
    report = repair(path, tmp_path / 'made')
    assert report.was_whole
    assert not report.mended
    assert (tmp_path / 'made/made_0.mcap').read_bytes() == path.read_bytes()
    assert path.read_bytes().startswith(MAGIC)
