"""Bags: any bytes are refused in one line, or read and repaired, and the result is whole."""

from pathlib import Path
import random
import shutil

from mcap.writer import CompressionType, Writer
import mcap_bytes
import scratch

from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.reader import Bag, RawMessage, open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.topic import Qos, Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError

NAME = 'mcap_files'
WORDS = ('zstd', 'lz4', 'ros2msg', 'cdr', 'std_msgs/msg/String', 'string data', 'rosbag2',
         'serialized_metadata', '\x06\x00\x00', 'ros2')  # fmt: skip
_PLACE = scratch.folder()
_STRING = 'std_msgs/msg/String'
_POSE = 'geometry_msgs/msg/PoseStamped'
_TIME = 1_700_000_000_000_000_000  # ns
_CDR = b'\x00\x01\x00\x00\x03\x00\x00\x00hi\x00'
_POSE_CDR = b'\x00\x01\x00\x00' + bytes(8) + b'\x04\x00\x00\x00map\x00' + bytes(56)


def seeds() -> list[bytes]:
    """Return small bags: of this package and of the MCAP library, in all compressions."""
    return [
        *(_ours(compression) for compression in ('zstd', 'lz4', 'none')),
        *(_theirs(c, chunked=chunked) for c in CompressionType for chunked in (True, False)),
    ]


def _ours(compression: str) -> bytes:
    folder = _PLACE / 'seed'
    with BagWriter(folder, compression=compression, custom_data={'a': 'b'}) as bag:
        ids = [
            bag.add(
                Topic(
                    name=name,
                    type=kind,
                    definition=schemas.definition(kind),
                    type_hash=schemas.type_hash(kind) or '',
                    qos=(Qos(depth=3),),
                )
            )
            for name, kind in (('/a', _STRING), ('/pose', _POSE))
        ]
        for n in range(4):
            bag.write(ids[0], _CDR, _TIME + n, _TIME)
            bag.write(ids[1], _POSE_CDR, _TIME + 2 * n, _TIME)
            if n == 1:
                bag.flush()
        bag.attach('a.txt', 'text/plain', b'text', log_time=_TIME, create_time=0)
        bag.note('note', {'key': 'value'})
    data = next(folder.glob('*.mcap')).read_bytes()
    shutil.rmtree(folder)
    return data


def _theirs(compression: CompressionType, *, chunked: bool) -> bytes:
    path = _PLACE / 'theirs.mcap'
    with path.open('wb') as file:
        writer = Writer(file, compression=compression, use_chunking=chunked, chunk_size=64)
        writer.start(profile='ros2', library='seed')
        schema = writer.register_schema(_STRING, 'ros2msg', b'string data')
        channel = writer.register_channel('/a', 'cdr', schema)
        for n in range(6):
            writer.add_message(channel, _TIME + n, _CDR, _TIME, n)
        writer.finish()
    return path.read_bytes()


def one(data: bytes) -> None:
    """Open, read, decode and repair one file."""
    source, target = _PLACE / 'x.mcap', _PLACE / 'whole'
    source.write_bytes(data)
    try:
        bag = _opened(source)
        if bag is not None:
            _read(bag)
        _repair(source, target, len(data))
    finally:
        shutil.rmtree(target, ignore_errors=True)


def _opened(path: Path) -> Bag | None:
    try:
        return open_bag(path)
    except BagError as error:
        _require_line(error)
        return None


def _read(bag: Bag) -> None:
    """Read all of a bag: as bytes, decoded, attached."""
    try:
        for _ in bag.raw():  # an index may lie of how many there are
            pass
    except BagError as error:
        _require_line(error)
    for topic in bag.topics:
        try:
            for _ in bag.messages([topic.topic.name]):
                pass
        except BagError as error:
            _require_line(error)
    try:
        _ = bag.attachments
    except BagError as error:
        _require_line(error)


def _repair(source: Path, target: Path, size: int) -> None:
    """Repair a file: the new bag is complete and holds what the report says."""
    try:
        report = repair(source, target)
    except BagError as error:
        _require_line(error)
        if target.exists():
            raise AssertionError('a repair that failed left a folder') from None
        return
    report.summary()
    if not 0 <= report.bytes_lost <= size:
        raise AssertionError(f'{report.bytes_lost} bytes lost of {size}')
    if not (report.was_whole or report.message_count or report.attachments):
        raise AssertionError(f'nothing was kept, and it is no error: {report}')
    bag = open_bag(target)
    made = _raw(bag)
    if not bag.complete or bag.losses or len(made) != report.message_count:
        raise AssertionError(f'not whole after a repair: {len(made)}, {report}')
    if report.was_whole and not report.mended and _raw(open_bag(source)) != made:
        raise AssertionError(f'a whole file was changed: {report}')


def _raw(bag: Bag) -> list[RawMessage]:
    """Return all messages, as far as they can be decompressed."""
    messages = []
    try:
        messages.extend(bag.raw())
    except BagError as error:
        if 'the message at' not in str(error):  # one that only looks compressed
            raise
    return messages


def _require_line(error: BagError) -> None:
    if '\n' in str(error):
        raise AssertionError(f'not one line: {error!r}') from None


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Change records of the file."""
    return mcap_bytes.mutate(data, rng)
