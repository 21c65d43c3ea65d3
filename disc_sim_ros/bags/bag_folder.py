"""Which files make a bag: what is on the disk comes first, then what metadata.yaml says of it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
import re
import tempfile
from typing import IO, Any
import weakref

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.contents import Contents, Loss
from disc_sim_ros.bags.mcap_reader import indexed
from disc_sim_ros.bags.mcap_records import LZ4_MAGIC, MAGIC, ZSTD_MAGIC
from disc_sim_ros.bags.metadata import BagMetadata, FileInfo
from disc_sim_ros.errors import BagError
from disc_sim_ros.files import reason

_PACKED = ('.zstd', '.zst', '.lz4')
_ENDINGS = ('.mcap', *(f'.mcap{ending}' for ending in _PACKED))
_NUMBERED = re.compile(r'(.*)_(\d+)\.mcap(\.zstd|\.zst|\.lz4)?')
_BLOCK = 1 << 20  # bytes decompressed at a time
_OTHERS = (  # how files that are no MCAP begin, and what to do
    (b'SQLite format 3', 'a sqlite3 bag; convert it with `ros2 bag convert`'),
    (b'#ROSBAG', 'a ROS 1 bag; convert it with `rosbags-convert`'),
)

Read = Callable[[Path, Path | None], Contents]  # of a file and its unpacked bytes


@dataclass(frozen=True, slots=True)
class BagFolder:
    """The files of a bag in their order.

    Attributes:
        path: The folder, or one file.
        files: What is there.
        infos: What metadata.yaml says of these files.
        metadata: metadata.yaml; None where there is none that can be read.
        losses: Files that are missing or stand for another, and files that are left out.
    """

    path: Path
    files: tuple[Path, ...]
    infos: dict[Path, FileInfo] = field(default_factory=dict)
    metadata: BagMetadata | None = None
    losses: tuple[Loss, ...] = ()


def bag_folder(path: Path) -> BagFolder:
    """Find the files of a bag.

    Raises:
        BagError: It is no bag that can be read; the reason says what it is.
        OSError: The folder cannot be read.
    """
    if path.is_file():
        return BagFolder(path, (path,))
    if not path.is_dir():
        raise BagError(f'{path}: there is no such bag')
    listed = _metadata(path / metadata.FILE_NAME)
    present = _present(path) or _mcap_by_content(path)
    if listed is not None:
        _refuse_storage(path, listed, present)
    if not present:
        raise BagError(_no_files(path, listed))
    if listed is None:
        return BagFolder(
            path, tuple(present), losses=tuple(_holes(path, (f.name for f in present)))
        )
    return _compare(path, listed, present)


def read_files(folder: BagFolder, read: Read) -> list[Contents]:
    """Return what each file of a bag holds; nothing of one that is no MCAP file among others.

    A recorder may be killed before its new file has a beginning, and a disk may lose any file.

    Raises:
        BagError: No file can be read, or one is in another format.
    """
    all_contents: list[Contents] = []
    failures: list[BagError] = []
    for file in folder.files:
        contents = _read_file(file, read, failures)
        expected = folder.infos.get(file)
        if expected is not None:
            _count_missing(contents, expected)
        all_contents.append(contents)
    if failures and len(failures) == len(folder.files):
        raise failures[0]
    return all_contents


def _read_file(file: Path, read: Read, failures: list[BagError]) -> Contents:
    try:
        with file.open('rb') as opened:
            start = opened.read(16)
            for beginning, what in _OTHERS:
                if start.startswith(beginning):
                    raise BagError(f'{file}: {what}')
            if not start.startswith((ZSTD_MAGIC, LZ4_MAGIC)):
                return _read_plain(file, None, read, failures)
            unpacked, cut = _unpack(file, start)
    except OSError as error:
        failures.append(BagError(f'{file}: cannot be read ({reason(error)})'))
        return Contents(file, losses=[Loss(file, 0, 0, f'it cannot be read ({reason(error)})')])
    before = len(failures)
    contents = _read_plain(file, unpacked, read, failures)
    weakref.finalize(contents, unpacked.unlink, missing_ok=True)
    if cut:
        problem = f'the compressed file is damaged ({cut})'
        failures[before:] = [BagError(f'{file}: {problem}')] * (len(failures) - before)
        contents.losses.append(Loss(file, 0, 0, problem))
        contents.complete = False
    return contents


def _read_plain(
    file: Path, unpacked: Path | None, read: Read, failures: list[BagError]
) -> Contents:
    try:
        return read(file, unpacked)
    except BagError as error:
        failures.append(error)
        loss = Loss(file, 0, file.stat().st_size, 'the file is no MCAP file')
        return Contents(file, unpacked, losses=[loss])


def _count_missing(contents: Contents, expected: FileInfo) -> None:
    """Note how many messages of a file are lost, from what metadata.yaml counts."""
    known = sum(loss.messages or 0 for loss in contents.losses)
    missing = expected.message_count - contents.message_count - known
    if missing <= 0:
        return
    contents.complete = False
    unknown = [i for i, loss in enumerate(contents.losses) if loss.messages is None]
    if len(unknown) == 1:
        contents.losses[unknown[0]] = replace(contents.losses[unknown[0]], messages=missing)
    else:
        why = f'{metadata.FILE_NAME} counts {expected.message_count} messages in it'
        contents.losses.append(Loss(contents.path, 0, 0, why, missing))


# ---- compressed files ----


def _unpack(file: Path, start: bytes) -> tuple[Path, str]:
    """Decompress a file into a temporary one; return that and what is wrong, or ''."""
    with tempfile.NamedTemporaryFile(prefix='disc_sim_', suffix='.mcap', delete=False) as target:
        try:
            with file.open('rb') as source:
                problem = _decompress(source, target, start)
        except BaseException:
            Path(target.name).unlink()
            raise
    return Path(target.name), problem


def _decompress(source: IO[bytes], target: IO[bytes], start: bytes) -> str:
    zstd = start.startswith(ZSTD_MAGIC)

    def new_frame() -> Any:
        if zstd:
            return zstandard.ZstdDecompressor().decompressobj()
        return lz4.frame.LZ4FrameDecompressor()

    frame = new_frame()
    while block := source.read(_BLOCK):
        while block:
            if frame.eof:
                frame = new_frame()
            try:
                target.write(frame.decompress(block))
            except (zstandard.ZstdError, RuntimeError, MemoryError) as error:
                return ' '.join(str(error).split())
            block = (frame.unused_data or b'') if frame.eof else b''
    return '' if frame.eof else 'its end is cut off'


# ---- names ----


def _present(folder: Path) -> list[Path]:
    """Return the MCAP files in a folder, each once, in the order of their numbers."""
    forms: dict[str, list[Path]] = {}
    for path in folder.iterdir():
        if path.name.endswith(_ENDINGS) and not path.name.startswith('.') and path.is_file():
            forms.setdefault(_plain_name(path.name), []).append(path)
    return sorted((_best(paths) for paths in forms.values()), key=_order)


def _best(paths: Sequence[Path]) -> Path:
    """Return one of the forms of a file: the plain one, unless only a compressed one is sound.

    A recorder that is killed while it compresses leaves both.
    """
    plain = [p for p in paths if p.name.endswith('.mcap')]
    packed = [p for p in paths if p not in plain]
    if plain and (not packed or _has_end(plain[0])):
        return plain[0]
    return max(packed, key=lambda p: p.stat().st_size)


def _has_end(path: Path) -> bool:
    with path.open('rb') as file:
        size = file.seek(0, 2)
        file.seek(max(size - len(MAGIC), 0))
        return size > len(MAGIC) and file.read() == MAGIC


def _plain_name(name: str) -> str:
    ending = next((e for e in _PACKED if name.endswith(e)), '')
    return name.removesuffix(ending)


def _mcap_by_content(folder: Path) -> list[Path]:
    """Return files that begin as MCAP does and are not named so, such as bag_1.mcap.bak."""
    files = []
    for path in sorted(folder.iterdir()):
        if not path.name.startswith('.') and not path.name.endswith(_ENDINGS) and path.is_file():
            with path.open('rb') as file:
                if file.read(len(MAGIC)) == MAGIC:
                    files.append(path)
    return files


def _order(path: Path) -> tuple[int, str]:
    number = _number(path.name)
    return -1 if number is None else number, path.name


def _number(name: str) -> int | None:
    match = _NUMBERED.fullmatch(name)
    return int(match[2]) if match else None


def _stem(name: str) -> str | None:
    match = _NUMBERED.fullmatch(name)
    return match[1] if match else None


def _holes(folder: Path, names: Iterable[str], first: int = 0) -> list[Loss]:
    """Return a loss for each hole in the numbers of the files, counted from `first` on."""
    losses = []
    stems: dict[str, list[int]] = {}
    for name in names:
        number, stem = _number(name), _stem(name)
        if number is not None and stem is not None:
            stems.setdefault(stem, []).append(number)
    for stem, numbers in stems.items():
        expected = first
        for number in sorted(numbers):
            if number > expected:
                last = number - 1
                name = f'{stem}_{expected}.mcap'
                others = f', and so are the following up to number {last}' * (last > expected)
                losses.append(Loss(folder / name, 0, 0, f'the file is missing{others}'))
            expected = number + 1
    return losses


# ---- metadata.yaml and the disk ----


def _metadata(path: Path) -> BagMetadata | None:
    try:
        return metadata.parse(path.read_text(encoding='utf-8'))
    except (BagError, OSError, UnicodeDecodeError):
        return None


def _refuse_storage(path: Path, listed: BagMetadata, present: Sequence[Path]) -> None:
    """Refuse a bag in another format, unless the files on the disk are MCAP all the same."""
    there = [path / f.path for f in listed.files if (path / f.path).is_file()]
    others = [p for p in there if not p.name.endswith(_ENDINGS)]
    if listed.storage not in {'', 'mcap'} and (others or not present):
        advice = 'convert it with `ros2 bag convert`'
        raise BagError(f'{path}: a bag in {listed.storage} format is not read; {advice}')


def _no_files(path: Path, listed: BagMetadata | None) -> str:
    if any(path.glob('*.db3*')):
        advice = 'convert it with `ros2 bag convert`'
        return f'{path}: a bag in sqlite3 format is not read; {advice}'
    if listed is not None and listed.files:
        names = ', '.join(f.path for f in listed.files)
        return f'{path}: every file that {metadata.FILE_NAME} names is missing ({names})'
    return f'{path}: no bag, there is no .mcap file in it'


def _compare(path: Path, listed: BagMetadata, present: Sequence[Path]) -> BagFolder:
    """Find the files that metadata.yaml lists, and those of the bag that it does not list."""
    rest = {_plain_name(f.name): f for f in present}
    infos: dict[Path, FileInfo] = {}
    missing: list[FileInfo] = []
    for info in listed.files:
        file = rest.pop(_plain_name(Path(info.path).name), path / info.path)
        if file.is_file():
            infos[file] = info
        else:
            missing.append(info)
    if missing:
        rest |= {f.name: f for f in _mcap_by_content(path)}
    losses = []
    listed_stems = _stems(listed)
    contents = {f: _indexed(f) for f in rest.values()} if missing else {}
    for info in missing:
        candidates = {f: contents[f] for f in rest.values()}
        other = _substitute(info, len(missing), listed_stems, candidates)
        if other is None:
            loss = Loss(path / info.path, 0, 0, 'the file is missing', info.message_count)
        else:
            rest = {name: f for name, f in rest.items() if f != other}
            infos[other] = info
            loss = Loss(path / info.path, 0, 0, f'it is missing; {other.name} stands for it', 0)
        losses.append(loss)
    # The recorder may have been killed between a new file and the metadata that lists it.
    stems = listed_stems | {_stem(f.name) for f in infos}
    more = [f for f in rest.values() if not infos or _stem(f.name) in stems - {None}]
    if missing:
        losses += [
            Loss(f, 0, 0, f'it is left out: {metadata.FILE_NAME} does not name it', 0)
            for f in rest.values()
            if f not in more
        ]
    if more:
        names = [Path(f.path).name for f in listed.files] + [f.name for f in more]
        losses += _holes(path, names, min(_number(n) or 0 for n in names))
    return BagFolder(path, _ordered(listed, infos, more), infos, listed, tuple(losses))


def _stems(listed: BagMetadata) -> set[str | None]:
    return {_stem(Path(f.path).name) for f in listed.files}


def _substitute(
    info: FileInfo, missing: int, stems: set[str | None], contents: Mapping[Path, Contents | None]
) -> Path | None:
    """Return the file that was renamed: of the same content, or the same number, or the last."""
    number = _number(Path(info.path).name)
    fitting = {f: c for f, c in contents.items() if _may_be(c, info)}
    same = [f for f, c in fitting.items() if c and c.message_count == info.message_count != 0]
    numbered = [f for f in fitting if number is not None and _number(f.name) == number]
    strange = [f for f in fitting if _stem(f.name) not in stems - {None}]
    only = strange if missing == 1 else []
    return next((group[0] for group in (same, numbered, only) if len(group) == 1), None)


def _may_be(contents: Contents | None, info: FileInfo) -> bool:
    """Return False if a file is sound and begins at another time than the one that is missing."""
    return contents is None or info.message_count == 0 or contents.start == info.start


def _indexed(file: Path) -> Contents | None:
    try:
        return indexed(file)
    except OSError:
        return None


def _ordered(
    listed: BagMetadata, infos: dict[Path, FileInfo], more: Sequence[Path]
) -> tuple[Path, ...]:
    """Return files in the order of metadata.yaml, and those it does not list by their numbers."""
    numbers = [_number(Path(f.path).name) for f in listed.files]
    counted = [n for n in numbers if n is not None]
    if len(counted) == len(numbers) and counted == sorted(counted):
        numbered = {f: (_number(Path(i.path).name) or 0, f.name) for f, i in infos.items()}
        return tuple(sorted([*infos, *more], key=lambda f: numbered.get(f, _order(f))))
    order = {f.path: n for n, f in enumerate(listed.files)}
    return (*sorted(infos, key=lambda f: order[infos[f].path]), *more)
