"""Serialised messages of which only a few numbers change: filled once, packed in one call.

To build a message and to serialise it costs tens of microseconds, most of it for attributes that
never change. A `CdrTemplate` finds once where the changing fields are in the serialised bytes, and
afterwards packs only these numbers between the constant pieces.

The bytes are CDR: every primitive is aligned to its own size, so that offsets depend on the length
of the strings before it. ROS leaves the padding between primitives uninitialised; a `CdrTemplate`
fills it with zeros, so that a message has the same bytes in every run.
"""

from collections.abc import Callable, Iterator, Sequence
import copy
import struct
from typing import Any, NamedTuple

from rclpy.serialization import deserialize_message, serialize_message

_HEADER = 4  # bytes of encapsulation; alignment counts from its end
_LITTLE_ENDIAN = b'\x00\x01'
_DOUBLE = 'double'
_SIZES = {
    'boolean': 1, 'octet': 1, 'char': 1, 'int8': 1, 'uint8': 1, 'int16': 2, 'uint16': 2,
    'int32': 4, 'uint32': 4, 'float': 4, 'int64': 8, 'uint64': 8, _DOUBLE: 8,
}  # fmt: skip
_CODES = {_DOUBLE: 'd', 'int32': 'i', 'uint32': 'I'}


class CdrTemplate:
    """A message type whose constant parts are serialised once.

    Attributes:
        pack: `pack(seconds, nanoseconds, *values) -> bytes` returns the complete serialised
            message, with the stamp in all `stamps` and the values in the order of `floats`. It has
            no state: threads may share it. Without stamps the first two arguments have no effect.
            The caller checks that the values are finite.
        template: The complete serialised message; its stamps and values mean nothing.
        stamp_offsets: Where the seconds of each stamp are in it, an int32 before an uint32 of
            nanoseconds, in bytes from the start.
        float_offsets: Where the values are in it, in the order of `floats`.
    """

    __slots__ = ('float_offsets', 'pack', 'stamp_offsets', 'template')

    def __init__(
        self, message: Any, floats: Sequence[str], stamps: Sequence[str] = ('header.stamp',)
    ) -> None:
        """Locate the fields that change.

        Args:
            message: A message whose other fields are the constant ones; it is not changed.
            floats: Paths of the float64 fields that change, such as 'pose.position.x' or, for
                elements of lists, 'position.0'. The lists have their final length.
            stamps: Paths of the builtin_interfaces/Time fields; all get the same time.

        Raises:
            ValueError: A path is given twice, or leads to no field of that type.
            RuntimeError: The middleware does not serialise this message as plain CDR.
        """
        fields = {path: f'value_{i}' for i, path in enumerate(floats)}
        if len(fields) != len(floats):
            raise ValueError(f'a field is given twice: {", ".join(floats)}')
        parameters = ('seconds', 'nanoseconds', *fields.values())
        for stamp in stamps:
            fields |= {f'{stamp}.sec': 'seconds', f'{stamp}.nanosec': 'nanoseconds'}
        types = {path: 'uint32' if path.endswith('.nanosec') else 'int32' for path in fields}
        places = _places(message, types | dict.fromkeys(floats, _DOUBLE))
        template = _template(message, places)
        self.pack = _packer(template, parameters, [(fields[p.path], p) for p in places])
        offsets = {p.path: p.offset for p in places}
        self.template = template
        self.stamp_offsets = tuple(offsets[f'{stamp}.sec'] for stamp in stamps)
        self.float_offsets = tuple(offsets[path] for path in floats)


class _Primitive(NamedTuple):
    """A number, or the characters of a string, and its place in the serialised message."""

    path: str
    type: str
    offset: int  # bytes from the start of the message
    size: int


def assign(message: Any, path: str, value: object) -> None:
    """Set one field of a message.

    Args:
        message: The message to change.
        path: Names and indices with dots between, such as 'transform.rotation.w', 'position.0'.
        value: The new value of the field.
    """
    *parents, last = path.split('.')
    for name in parents:
        message = message[int(name)] if name.isdigit() else getattr(message, name)
    if last.isdigit():
        message[int(last)] = value
    else:
        setattr(message, last, value)


def _places(message: Any, types: dict[str, str]) -> list[_Primitive]:
    """Return the primitives with these paths and types, in the order of serialisation."""
    places = [p for p in _layout(message) if types.get(p.path) == p.type]
    missing = set(types) - {p.path for p in places}
    if missing:
        named = ', '.join(f'{path} ({types[path]})' for path in sorted(missing))
        raise ValueError(f'{type(message).__name__} has no field {named}')
    return places


def _template(message: Any, places: list[_Primitive]) -> bytes:
    """Return the serialised message with zeros for padding, after checking its layout.

    Each changing field gets a number of its own, which must be at the expected offset. The message
    must deserialise and serialise again to the same bytes, apart from padding.
    """
    sample = copy.deepcopy(message)
    for number, place in enumerate(places, start=1):
        value = float(number) if place.type == _DOUBLE else number
        assign(sample, place.path, value)
    template = _without_padding(serialize_message(sample), sample)
    numbers = [struct.unpack_from(f'<{_CODES[p.type]}', template, p.offset)[0] for p in places]
    again = serialize_message(deserialize_message(template, type(message)))
    if (
        template[:2] != _LITTLE_ENDIAN
        or numbers != list(range(1, len(places) + 1))
        or _without_padding(again, sample) != template
    ):
        name = type(message).__name__
        raise RuntimeError(f'{name}: the middleware does not serialise it as plain CDR')
    return template


def _packer(
    template: bytes, parameters: Sequence[str], places: list[tuple[str, _Primitive]]
) -> Callable[..., bytes]:
    """Return the function that packs the arguments between the constant pieces.

    It is compiled from source text: one call without slices or unpacking is twice as fast as any
    other way that was tried.
    """
    code, arguments, constants, end = '<', [], {}, 0
    for name, place in places:
        if place.offset > end:
            constants[f'constant_{end}'] = template[end : place.offset]
            arguments.append(f'constant_{end}')
            code += f'{place.offset - end}s'
        arguments.append(name)
        code += _CODES[place.type]
        end = place.offset + place.size
    constants['rest'] = template[end:]
    packer = struct.Struct(f'{code}{len(template) - end}s')
    source = f'lambda {", ".join(parameters)}: pack({", ".join([*arguments, "rest"])})'
    # All names in the source text are made in this file.
    function: Callable[..., bytes] = eval(source, {'pack': packer.pack, **constants})  # noqa: S307
    return function


def _without_padding(cdr: bytes, message: Any) -> bytes:
    """Return a serialised message with zeros wherever no field is written."""
    clean = bytearray(len(cdr))
    clean[:_HEADER] = cdr[:_HEADER]
    for p in _layout(message):
        clean[p.offset : p.offset + p.size] = cdr[p.offset : p.offset + p.size]
    return bytes(clean)


def _layout(message: Any) -> Iterator[_Primitive]:
    """Yield all primitives of a message in the order in which they are serialised."""
    end = 0
    for path, type_, size, alignment in _primitives('', '', message):
        start = -(-end // alignment) * alignment
        end = start + size
        yield _Primitive(path, type_, _HEADER + start, size)


def _primitives(path: str, type_: str, value: Any) -> Iterator[tuple[str, str, int, int]]:
    """Yield path, type, size and alignment of all primitives in a value of an IDL type."""
    if type_ in _SIZES:
        yield path, type_, _SIZES[type_], _SIZES[type_]
    elif type_.endswith(']'):
        yield from _elements(path, type_.partition('[')[0], value)
    elif type_.startswith('string'):
        yield path, 'length', 4, 4
        yield path, 'characters', len(value.encode()) + 1, 1
    elif type_.startswith('sequence<'):
        yield path, 'length', 4, 4
        yield from _elements(path, type_[len('sequence<') : -1].partition(',')[0], value)
    else:
        for name, inner in value.get_fields_and_field_types().items():
            yield from _primitives(f'{path}.{name}' if path else name, inner, getattr(value, name))


def _elements(path: str, type_: str, values: Any) -> Iterator[tuple[str, str, int, int]]:
    for i, value in enumerate(values):
        yield from _primitives(f'{path}.{i}', type_, value)
