"""Readers that are not of this package decode every message of every kind of bag."""

from pathlib import Path
import shutil

from mcap.reader import make_reader
from mcap.records import Channel, Chunk, DataEnd, Message, MessageIndex, Schema, Statistics
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.highlevel import AnyReader
import yaml

from bags.making import START, everything, write_bag
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.cli.fly import main as fly


def ordinary(folder: Path) -> None:
    write_bag(folder, 300)


def split(folder: Path) -> None:
    write_bag(folder, 300, split_at=(100, 200), repeat_latched=True)


def repaired(folder: Path) -> None:
    """Of a recorder that was killed in its second file."""
    killed = folder.with_name('killed')
    write_bag(killed, 300, split_at=(200,), repeat_latched=True)
    path = killed / 'killed_1.mcap'
    path.write_bytes(path.read_bytes()[:-2000])
    repair(killed, folder)
    shutil.rmtree(killed)


def flown(folder: Path) -> None:
    assert fly(['--bag', str(folder), '--duration', '0.5', '--samples', '100']) == 0


def without_messages(folder: Path) -> None:
    with BagWriter(folder) as bag:
        bag.add(Topic(name='/odd', type='odd_msgs/msg/Odd'))
        bag.add(Topic(name='/empty', type='std_msgs/msg/Empty', definition=''))


KINDS = {k.__name__: k for k in (ordinary, split, repaired, flown, without_messages)}


@pytest.fixture(scope='module', params=KINDS)
def bag(request, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp('bags') / request.param
    KINDS[request.param](folder)
    return folder


def counts(folder: Path) -> dict[str, int]:
    """Messages by topic, as metadata.yaml has them."""
    root = yaml.safe_load((folder / 'metadata.yaml').read_text(encoding='utf-8'))
    return {
        t['topic_metadata']['name']: t['message_count']
        for t in root['rosbag2_bagfile_information']['topics_with_message_count']
    }


def test_rosbags_decodes_every_message(bag):
    decoded = dict.fromkeys(counts(bag), 0)
    with AnyReader([bag]) as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == counts(bag)
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            decoded[connection.topic] += 1
    assert decoded == counts(bag)


def test_mcap_ros2_support_decodes_every_message(bag):
    decoded = dict.fromkeys(counts(bag), 0)
    for path in bag.glob('*.mcap'):
        with path.open('rb') as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _, channel, _, _ in reader.iter_decoded_messages():
                decoded[channel.topic] += 1
    assert decoded == counts(bag)


def test_foxglove_decodes_every_message(bag, foxglove):
    decoded = dict.fromkeys(counts(bag), 0)
    for file in foxglove(*sorted(bag.glob('*.mcap'))):
        assert file['profile'] == 'ros2'
        for name, about in file['topics'].items():
            decoded[name] += about['count']
    assert decoded == counts(bag)


def test_this_package_decodes_every_message(bag):
    opened = open_bag(bag)
    assert opened.complete
    assert sum(1 for _ in opened.messages()) == opened.message_count == len(everything(opened))


def test_a_strict_reader_finds_nothing_to_say(bag):
    """What `mcap doctor` checks: order of definitions, times, sizes and counts of the index."""
    for path in bag.glob('*.mcap'):
        problems = list(doubts(path))
        assert not problems, problems


def doubts(path: Path):
    """Yield what is not as the specification demands."""
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    messages: dict[int, int] = {}
    with path.open('rb') as file:
        records = list(StreamReader(file, emit_chunks=True, validate_crcs=True).records)
    end = next(n for n, r in enumerate(records) if isinstance(r, DataEnd))
    for record in records[:end]:
        if isinstance(record, (Channel, Schema)):
            yield from _define(record, channels, schemas)
        elif isinstance(record, Chunk):
            yield from _check_chunk(record, channels, schemas, messages)
        elif isinstance(record, MessageIndex) and not record.records:
            yield 'an empty message index'
    repeated = [r for r in records[end:] if isinstance(r, (Channel, Schema))]
    for record in repeated:
        known = channels if isinstance(record, Channel) else schemas
        if known.get(record.id) != record:
            yield f'{record} is in the summary alone'
    [statistics] = [r for r in records[end:] if isinstance(r, Statistics)]
    if messages != statistics.channel_message_counts:
        yield f'{messages} messages there, {statistics.channel_message_counts} counted'
    if sum(messages.values()) != statistics.message_count:
        yield 'messages are not counted right'
    if [len(channels), len(schemas)] != [statistics.channel_count, statistics.schema_count]:
        yield 'definitions are not counted right'
    if sum(isinstance(r, Chunk) for r in records) != statistics.chunk_count:
        yield 'chunks are not counted right'


def _check_chunk(chunk, channels, schemas, messages):
    times = []
    for record in breakup_chunk(chunk, validate_crc=True):
        if isinstance(record, Message):
            if record.channel_id not in channels:
                yield f'a message of channel {record.channel_id} before its definition'
            messages[record.channel_id] = messages.get(record.channel_id, 0) + 1
            times.append(record.log_time)
        elif isinstance(record, (Channel, Schema)):
            yield from _define(record, channels, schemas)
    if (chunk.message_start_time, chunk.message_end_time) != (min(times), max(times)):
        yield 'a chunk states other times than its messages have'


def _define(record, channels, schemas):
    known = channels if isinstance(record, Channel) else schemas
    if known.setdefault(record.id, record) != record:
        yield f'{record} differs from its first definition'
    if isinstance(record, Channel) and record.schema_id and record.schema_id not in schemas:
        yield f'{record} before its schema'


def test_times_of_a_flown_bag_are_of_now(tmp_path):
    flown(tmp_path / 'bag')
    assert open_bag(tmp_path / 'bag').start > START
