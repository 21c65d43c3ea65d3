"""metadata.yaml and metadata records of other writers: the messages of the bag are read anyway."""

import random
import re
import shutil

from mcap.writer import Writer
import scratch

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.reader import Bag, open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.errors import BagError

NAME = 'bag_metadata'
WORDS = (
    'rosbag2_bagfile_information', 'version', 'storage_identifier', 'relative_file_paths', 'files',
    'message_count', 'topics_with_message_count', 'topic_metadata', 'offered_qos_profiles',
    'custom_data', 'ros_distro', 'compression_mode', 'compression_format', 'nanoseconds', 'FILE',
    'MESSAGE', 'zstd', 'a.mcap', '../a.mcap', '.inf', '.nan', '~', '[]', '{}', '&a', '*a', '!!',
    '- ', ': ', '2020-01-01', '1e999', '0x7fffffffffffffff', '9223372036854775807', '1_0', '\\0',
)  # fmt: skip
_COUNT = 6  # messages in the bag
_TIME = 1_700_000_000_000_000_000  # ns
_CDR = b'\x00\x01\x00\x00\x03\x00\x00\x00hi\x00'
_FOLDER = scratch.folder() / 'bag'
_TARGET = scratch.folder() / 'whole'
_WORD = re.compile(r'[^\s:\[\]{},"\']+')
_OLD_QOS = (
    '- history: 1\\n  depth: 7\\n  reliability: 2\\n  durability: 1\\n  deadline:\\n    sec: 0\\n'
)
_OLD_QOS += '    nsec: 0\\n  lifespan:\\n    sec: 0\\n    nsec: 0\\n  liveliness: 1\\n'
_OLD_QOS += '  liveliness_lease_duration:\\n    sec: 0\\n    nsec: 0\\n'
_OLD_QOS += '  avoid_ros_namespace_conventions: false'


def seeds() -> list[bytes]:
    """Return texts of several versions, each after a byte: 0 for the file, 1 for the record."""
    old = _text(4, _quoted(_OLD_QOS)), _text(5, '""'), _text(6, _quoted(_OLD_QOS), files=True)
    new = _text(8, '[]', files=True, more='  custom_data: {a: b}\n  ros_distro: iron\n')
    return [bytes([kind]) + text.encode() for kind in (0, 1) for text in (*old, new)]


def _quoted(text: str) -> str:
    return f'"{text}"'


def _text(version: int, qos: str, *, files: bool = False, more: str = '') -> str:
    times = f'starting_time: {{nanoseconds_since_epoch: {_TIME}}}, duration: {{nanoseconds: 5}}'
    listed = f'  files:\n    - {{path: a.mcap, {times}, message_count: {_COUNT}}}\n'
    return (
        f'rosbag2_bagfile_information:\n  version: {version}\n  storage_identifier: mcap\n'
        '  duration:\n    nanoseconds: 5\n'
        f'  starting_time:\n    nanoseconds_since_epoch: {_TIME}\n'
        f'  message_count: {_COUNT}\n  topics_with_message_count:\n'
        '    - topic_metadata:\n        name: /a\n        type: std_msgs/msg/String\n'
        f'        serialization_format: cdr\n        offered_qos_profiles: {qos}\n'
        f'      message_count: {_COUNT}\n  compression_format: ""\n  compression_mode: ""\n'
        f'  relative_file_paths:\n    - a.mcap\n{listed if files else ""}{more}'
    )


def one(data: bytes) -> None:
    """Open, read and repair a bag that has this text as its metadata."""
    text = data[1:].decode(errors='replace')
    _require_that_it_is_written_back(text)
    in_record = bool(data[:1]) and data[0] % 2 == 1
    _FOLDER.mkdir()
    try:
        with (_FOLDER / 'a.mcap').open('wb') as file:
            writer = Writer(file)
            writer.start(profile='ros2', library='seed')
            schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data')
            channel = writer.register_channel('/a', 'cdr', schema, {'offered_qos_profiles': text})
            for n in range(_COUNT):
                writer.add_message(channel, _TIME + n, _CDR, _TIME, n)
            if in_record:
                writer.add_metadata(metadata.RECORD, {metadata.KEY: text})
            writer.finish()
        if not in_record:
            (_FOLDER / metadata.FILE_NAME).write_bytes(data[1:])
        _read(in_record=in_record)
        _mend()
    finally:
        shutil.rmtree(_FOLDER)
        shutil.rmtree(_TARGET, ignore_errors=True)


def _require_that_it_is_written_back(text: str) -> None:
    """Require that what is read of a text is read again from what is written of it."""
    try:
        parsed = metadata.parse(text)
    except BagError as error:
        _require_line(error)
        return
    again = metadata.parse(metadata.text_of(parsed))
    kept = ('topics', 'custom_data', 'ros_distro', 'compression_format', 'compression_mode')
    for name in kept:
        if _printable(getattr(again, name)) != _printable(getattr(parsed, name)):
            raise AssertionError(f'{name}: {getattr(parsed, name)} became {getattr(again, name)}')


def _printable(value: object) -> str:
    """Return a text of the value; half of a surrogate pair is no character in YAML."""
    return re.sub('[\ud800-\udfff]', '\ufffd', str(value))


def _read(*, in_record: bool) -> None:
    try:
        bag = open_bag(_FOLDER)
    except BagError as error:
        _require_line(error)
        if in_record:
            raise AssertionError(f'a record hides a sound file: {error}') from None
        return
    _require_all(bag)
    bag.metadata.files  # noqa: B018 - it may be computed


def _mend() -> None:
    try:
        repair(_FOLDER, _TARGET)
    except BagError as error:
        _require_line(error)
        return
    _require_all(open_bag(_TARGET))
    metadata.parse((_TARGET / metadata.FILE_NAME).read_text(encoding='utf-8'))


def _require_all(bag: Bag) -> None:
    messages = [raw.data for raw in bag.raw()]
    if messages != [_CDR] * _COUNT:
        raise AssertionError(f'{len(messages)} of {_COUNT} messages are read')


def _require_line(error: BagError) -> None:
    if '\n' in str(error):
        raise AssertionError(f'not one line: {error!r}') from None


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Change words and lines of the text."""
    text = data[1:].decode(errors='replace')
    for _ in range(rng.randint(1, 3)):
        places = list(_WORD.finditer(text))
        lines = text.split('\n')
        at = rng.randrange(len(lines))
        what = rng.random()
        if places and what < 0.6:
            place = rng.choice(places)
            text = text[: place.start()] + rng.choice(WORDS) + text[place.end() :]
            continue
        if what < 0.7:
            lines.insert(at, rng.choice(lines))
        elif what < 0.8:
            del lines[at]
        elif what < 0.9:
            lines[at] = ' ' * rng.randint(0, 8) + lines[at].lstrip()
        else:
            lines[at] += rng.choice(('[' * 3000, '"', "'", '#', '\t', '|', '>', '\x00', '\u0085'))
        text = '\n'.join(lines)
    return data[:1] + text.encode(errors='surrogateescape')
