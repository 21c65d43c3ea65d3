"""metadata.yaml and the record of the same content in each MCAP file: version 9, as in Jazzy."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
import re
from typing import Any

import yaml

from disc_sim_ros.bags.topic import LOADER, MALFORMED, Topic, qos_profiles, qos_yaml
from disc_sim_ros.errors import BagError

FILE_NAME = 'metadata.yaml'
RECORD = 'rosbag2'  # name of the MCAP metadata record
KEY = 'serialized_metadata'
DISTRO_KEY = 'ROS_DISTRO'  # beside it, in files before version 9
VERSION = 9
NO_TIME = 9223372036854775807  # ns, rosbag2's starting time of a bag without messages
LATE_QOS = 'offered_qos_profiles:'  # begins a key of custom_data, with the name of the topic
_ROOT = 'rosbag2_bagfile_information'  # of metadata.yaml; the MCAP record has none


@dataclass(frozen=True, slots=True, kw_only=True)
class FileInfo:
    """One file of a bag. Times are nanoseconds of the log time."""

    path: str  # relative to the folder of the bag
    message_count: int = 0
    start: int = 0
    end: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicInfo:
    """A topic and how many messages of it there are."""

    topic: Topic
    message_count: int

    @property
    def name(self) -> str:
        """The name of the topic."""
        return self.topic.name

    @property
    def type(self) -> str:
        """The type of its messages."""
        return self.topic.type


@dataclass(frozen=True, slots=True, kw_only=True)
class BagMetadata:
    """What metadata.yaml holds.

    Attributes:
        topics: Topics with the counts of their messages.
        files: The files of the bag, in their order.
        custom_data: Free texts.
        ros_distro: Of the recorder; '' where it is not known.
        storage: Format of the files; `mcap` is written.
        compression_format: Such as 'zstd', where the compression mode is not none.
        compression_mode: 'MESSAGE' if each message is compressed, 'FILE' if each file is.
        message_count: As read; what is written is the sum over the files.
    """

    topics: tuple[TopicInfo, ...] = ()
    files: tuple[FileInfo, ...] = ()
    custom_data: Mapping[str, str] = field(default_factory=dict)
    ros_distro: str = ''
    storage: str = 'mcap'
    compression_format: str = ''
    compression_mode: str = ''
    message_count: int = 0


def text_of(metadata: BagMetadata) -> str:
    """Return metadata.yaml, every field in the order of rosbag2."""
    lines = [f'{_ROOT}:', *(f'  {line}' for line in _fields(metadata))]
    return '\n'.join(lines) + '\n'


def record_of(metadata: BagMetadata) -> dict[str, str]:
    """Return the content of the MCAP metadata record `rosbag2`: the same fields without a root.

    rosbag2 looks for `version` at the top level and plays nothing where it is not there.
    """
    return {KEY: '\n'.join(_fields(metadata)) + '\n'}


def parse(text: str) -> BagMetadata:
    """Read metadata.yaml or the text of an MCAP record, of this or of an older version.

    Raises:
        BagError: It is no such YAML.
    """
    try:
        content = yaml.load(text, Loader=LOADER)  # noqa: S506 - a SafeLoader
        root = content.get(_ROOT, content)
        return BagMetadata(
            topics=tuple(_parsed_topic(t) for t in _list_of(root['topics_with_message_count'])),
            files=tuple(_parsed_files(root)),
            custom_data={str(k): str(v) for k, v in (root.get('custom_data') or {}).items()},
            ros_distro=str(root.get('ros_distro') or ''),
            storage=str(root.get('storage_identifier') or ''),
            compression_format=str(root.get('compression_format') or ''),
            compression_mode=str(root.get('compression_mode') or ''),
            message_count=int(root['message_count']),
        )
    except MALFORMED as error:
        reason = ' '.join(str(error).split())
        raise BagError(f'no metadata of rosbag2 ({type(error).__name__}: {reason})') from None


def parse_record(content: Mapping[str, str]) -> BagMetadata:
    """Read the MCAP metadata record `rosbag2`.

    Raises:
        BagError: It holds no such YAML.
    """
    parsed = parse(content.get(KEY, ''))
    return replace(parsed, ros_distro=parsed.ros_distro or content.get(DISTRO_KEY, ''))


def has_root(content: Mapping[str, str]) -> bool:
    """Return True if an MCAP record has the root of metadata.yaml, so that rosbag2 refuses it."""
    return content.get(KEY, '').lstrip().startswith(_ROOT)


def scalar(text: str) -> str:
    """Return any text as one YAML scalar, plain where that is safe."""
    if _PLAIN.fullmatch(text) and text.lower() not in _WORDS:
        return text
    return '"' + ''.join(_ESCAPES.get(c) or _escaped(c) for c in text) + '"'


_PLAIN = re.compile(r'[A-Za-z/_][A-Za-z0-9/_]*(\.mcap)?', re.ASCII)
_WORDS = frozenset(('null', 'true', 'false', 'yes', 'no', 'on', 'off', 'y', 'n'))
_ESCAPES = {'"': '\\"', '\\': '\\\\', '\n': '\\n', '\t': '\\t', '\r': '\\r', '\0': '\\0'}


def _escaped(c: str) -> str:
    if c.isprintable() and not '\ud800' <= c <= '\udfff':
        return c
    n = ord(c)
    if 0xD800 <= n <= 0xDFFF:  # half of a pair is no character
        return '\ufffd'
    return f'\\x{n:02x}' if n < 0x100 else f'\\u{n:04x}' if n < 0x10000 else f'\\U{n:08x}'


def _fields(metadata: BagMetadata) -> list[str]:
    """Return the lines of all fields, without the root."""
    filled = [f for f in metadata.files if f.message_count]
    start = min((f.start for f in filled), default=NO_TIME)
    end = max((f.end for f in filled), default=NO_TIME)
    lines = [
        f'version: {VERSION}',
        'storage_identifier: mcap',
        'duration:',
        f'  nanoseconds: {end - start}',
        'starting_time:',
        f'  nanoseconds_since_epoch: {start}',
        f'message_count: {sum(f.message_count for f in metadata.files)}',
        *_block('topics_with_message_count', [_topic(t) for t in metadata.topics]),
        f'compression_format: {scalar(metadata.compression_format)}',
        f'compression_mode: {scalar(metadata.compression_mode)}',
        *_block('relative_file_paths', [[scalar(f.path)] for f in metadata.files]),
        *_block('files', [_file(f) for f in metadata.files]),
    ]
    if metadata.custom_data:
        lines.append('custom_data:')
        lines += [f'  {scalar(k)}: {scalar(v)}' for k, v in metadata.custom_data.items()]
    else:
        lines.append('custom_data: ~')
    lines.append(f'ros_distro: {scalar(metadata.ros_distro)}')
    return lines


def _block(key: str, items: list[list[str]]) -> list[str]:
    """Return a sequence of items, each some lines."""
    if not items:
        return [f'{key}: []']
    lines = [f'{key}:']
    for first, *rest in items:
        lines.append(f'  - {first}')
        lines += [f'    {line}' for line in rest]
    return lines


def _topic(info: TopicInfo) -> list[str]:
    topic = info.topic
    profiles = qos_yaml(topic.qos)
    offered = (
        [f'  offered_qos_profiles: {profiles}']
        if profiles == '[]'
        else ['  offered_qos_profiles:', *(f'    {line}' for line in profiles.split('\n'))]
    )
    return [
        'topic_metadata:',
        f'  name: {scalar(topic.name)}',
        f'  type: {scalar(topic.type)}',
        f'  serialization_format: {scalar(topic.serialization_format)}',
        *offered,
        f'  type_description_hash: {scalar(topic.type_hash)}',
        f'message_count: {info.message_count}',
    ]


def _file(info: FileInfo) -> list[str]:
    start, end = (info.start, info.end) if info.message_count else (NO_TIME, NO_TIME)
    return [
        f'path: {scalar(info.path)}',
        'starting_time:',
        f'  nanoseconds_since_epoch: {start}',
        'duration:',
        f'  nanoseconds: {end - start}',
        f'message_count: {info.message_count}',
    ]


def _parsed_topic(item: Any) -> TopicInfo:
    about = item['topic_metadata']
    try:
        profiles = qos_profiles(about.get('offered_qos_profiles') or [])
    except BagError:
        profiles = ()
    return TopicInfo(
        topic=Topic(
            name=str(about['name']),
            type=str(about['type']),
            serialization_format=str(about['serialization_format']),
            qos=profiles,
            type_hash=str(about.get('type_description_hash') or ''),
        ),
        message_count=int(item['message_count']),
    )


def _list_of(value: Any) -> list[Any]:
    """Return a sequence of YAML; a text is none, though Python would give its characters."""
    if value is None:
        return []
    if not isinstance(value, list):
        raise TypeError(f'{value!r:.40} is no list')
    return value


def _parsed_files(root: Any) -> list[FileInfo]:
    infos = {_plain_path(f['path']): f for f in _list_of(root.get('files'))}
    files = []
    for path in _list_of(root['relative_file_paths']):
        info = infos.get(_plain_path(path))
        if info is None:
            files.append(FileInfo(path=str(path)))
            continue
        start = int(info['starting_time']['nanoseconds_since_epoch'])
        files.append(
            FileInfo(
                path=str(path),
                message_count=int(info['message_count']),
                start=start,
                end=start + int(info['duration']['nanoseconds']),
            )
        )
    return files


def _plain_path(path: object) -> str:
    """Return the path without the ending of a compressed file, which rosbag2 gives only once."""
    return str(path).removesuffix('.zstd')
