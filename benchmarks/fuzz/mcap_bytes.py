"""Mutation of MCAP files record by record, with lengths and checksums that fit again."""

import random
import struct
import zlib

import lz4.frame
import zstandard

MAGIC = b'\x89MCAP0\r\n'
_HEAD = struct.Struct('<BQ')
_CHUNK = 0x06
_ODD = (0, 1, 0x7F, 0x80, 0xFF, 0xFFFF, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63, 2**64 - 1)
_DEEPEST = 1 << 20  # bytes of a chunk that a mutator unpacks


def records(data: bytes) -> list[tuple[int, bytes]] | None:
    """Return opcode and content of each record; None where they do not fill the bytes."""
    contents = []
    at = 0
    while at < len(data):
        if len(data) - at < _HEAD.size:
            return None
        opcode, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if length > len(data) - at:
            return None
        contents.append((opcode, data[at : at + length]))
        at += length
    return contents


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Change some records of a file; None where it is not made of records."""
    if not (data.startswith(MAGIC) and data.endswith(MAGIC)):
        return None
    inner = records(data[len(MAGIC) : -len(MAGIC)])
    if not inner:
        return None
    for _ in range(rng.randint(1, 3)):
        if inner:
            _change(inner, rng)
    changed = MAGIC + b''.join(_HEAD.pack(o, len(c)) + c for o, c in inner) + MAGIC
    if rng.random() < 0.1:  # the recorder was killed
        changed = changed[: rng.randrange(len(changed))]
    return changed


def _change(inner: list[tuple[int, bytes]], rng: random.Random) -> None:
    at = rng.randrange(len(inner))
    opcode, content = inner[at]
    what = rng.random()
    if what < 0.1:
        del inner[at]
    elif what < 0.2:
        inner.insert(rng.randrange(len(inner) + 1), (opcode, content))
    elif what < 0.25:
        inner[at] = (rng.choice((rng.randrange(256), rng.randrange(1, 16))), content)
    elif what < 0.3:
        inner[at] = (opcode, content[: rng.randrange(len(content) + 1)])
    elif what < 0.35:  # a longer record, as the specification allows
        inner[at] = (opcode, content + rng.randbytes(rng.randrange(1, 9)))
    elif what < 0.4:  # a record of an unknown opcode
        strange = rng.randrange(0x10, 0x100), rng.randbytes(rng.randrange(20))
        inner.insert(rng.randrange(len(inner) + 1), strange)
    elif opcode == _CHUNK and what < 0.8:
        inner[at] = (opcode, _changed_chunk(content, rng))
    else:
        inner[at] = (opcode, _changed_bytes(content, rng))


def _changed_bytes(content: bytes, rng: random.Random) -> bytes:
    """Put an odd number, of one to eight bytes, somewhere."""
    if not content:
        return bytes(rng.randrange(1, 9))
    changed = bytearray(content)
    size = rng.choice((1, 2, 4, 8))
    at = rng.randrange(min(len(changed), 64) if rng.random() < 0.5 else len(changed))
    number = rng.choice(_ODD) if rng.random() < 0.7 else rng.getrandbits(64)
    changed[at : at + size] = (number & (2 ** (8 * size) - 1)).to_bytes(size, 'little')
    return bytes(changed)


def _changed_chunk(content: bytes, rng: random.Random) -> bytes:
    """Change the records in a chunk, and write size and checksum that belong to them."""
    try:
        start, end, size, _, length = struct.unpack_from('<QQQII', content)
        name = content[32 : 32 + length].decode()
        packed = content[32 + length + 8 :]
        if size > _DEEPEST:
            return _changed_bytes(content, rng)
        data = {
            '': lambda: packed,
            'zstd': lambda: zstandard.ZstdDecompressor().decompress(packed, _DEEPEST),
            'lz4': lambda: lz4.frame.decompress(packed),
        }[name]()
    except (struct.error, KeyError, ValueError, RuntimeError, zstandard.ZstdError):
        return _changed_bytes(content, rng)
    inner = records(data)
    if not inner:
        return _changed_bytes(content, rng)
    _change(inner, rng)
    data = b''.join(_HEAD.pack(o, len(c)) + c for o, c in inner)
    name = rng.choice(('', name, name))
    packed = {
        '': lambda: data,
        'zstd': lambda: zstandard.ZstdCompressor().compress(data),
        'lz4': lambda: lz4.frame.compress(data),
    }[name]()
    crc = rng.choice((0, zlib.crc32(data)))
    head = struct.pack('<QQQII', start, end, len(data), crc, len(name)) + name.encode()
    return head + struct.pack('<Q', len(packed)) + packed
