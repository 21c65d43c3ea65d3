"""Disc files: YAML files, one for each disc, of the catalogue in the package or of a user.

A file may start from a disc of the catalogue with `based_on: NAME` and then holds only the
differences; a new mass or diameter without an inertia scales the inertia of that disc. Every key
carries its unit. An unknown, repeated, missing or impossible key is refused with file, key and
reason.
"""

from collections.abc import Callable, Iterable, Mapping
import copy
import difflib
import functools
from importlib.resources import files
import math
import os
from pathlib import Path
import re
from typing import Any

import yaml

from disc_sim_ros import validation
from disc_sim_ros.errors import ConfigError, brief
from disc_sim_ros.physics import flight_numbers
from disc_sim_ros.physics.disc import (
    AERODYNAMICS,
    GROUND_CONTACTS,
    AeroTable,
    Disc,
    LinearAero,
    SpinTable,
)
from disc_sim_ros.physics.disc_checks import check_number
from disc_sim_ros.quantities import DAMPING, DISC, LINEAR_AERO, VARIED
from disc_sim_ros.validation import Quantity

DEFAULT_DISC = 'frisbee'
_FOLDER = files('disc_sim_ros.physics') / 'discs'
_FORMER = {'frisbee_low_damping': 'frisbee'}  # names of 0.1
_LONGEST_NAME = 100  # of a file, in a message
_LARGEST_FILE = 1 << 17  # bytes; the largest disc of the package has 4 kB, and 1 MB takes seconds

_PROPERTIES = {quantity.key: quantity for quantity in DISC.values()}
_DAMPING = {quantity.key: quantity for quantity in DAMPING.values()}
_LINEAR = {quantity.key: quantity for quantity in LINEAR_AERO.values()}
_UNCERTAIN = {name: VARIED[name] for name in ('lift_offset', 'drag_offset', 'pitching_offset')}
_NUMBERS: dict[str, dict[str, Quantity]] = {
    'damping': _DAMPING,
    'linear': _LINEAR,
    'uncertainty': {name: quantity.within(0.0) for name, quantity in _UNCERTAIN.items()},
}
_TABLE = ('alpha_deg', 'CL', 'CD', 'CM')
_SPIN = ('advance_ratio', 'alpha_deg', 'coefficient')
_SECTIONS: dict[str, tuple[str, ...]] = {
    'damping': tuple(_DAMPING),
    'linear': tuple(_LINEAR),
    'table': _TABLE,
    'spin_roll_moment': _SPIN,
    'spin_side_force': _SPIN,
    'uncertainty': tuple(_UNCERTAIN),
}
_BUILDERS: dict[str, Callable[..., Any]] = {
    'linear': LinearAero,
    'table': AeroTable.of,
    'spin_roll_moment': SpinTable.of,
    'spin_side_force': SpinTable.of,
}
_KEYS = ('description', 'based_on', 'flight_numbers', 'aero', 'ground', *_PROPERTIES, *_SECTIONS)
_OPTIONAL = {DISC['area'].key, *_DAMPING, *_UNCERTAIN}


def disc_names() -> tuple[str, ...]:
    """Return the names of the discs in the package."""
    files = (Path(item.name) for item in _FOLDER.iterdir())
    return tuple(sorted(path.stem for path in files if path.suffix == '.yaml'))


def load_disc(name_or_file: str | os.PathLike[str]) -> Disc:
    """Return a disc of the catalogue, one from a user's YAML file, or one from flight numbers.

    Args:
        name_or_file: A name of `disc_names`, the path of a file that ends in .yaml or .yml, or
            flight numbers such as '11/5/-1/3'.

    Raises:
        ConfigError: No such disc or file, or a file that does not describe a disc; the message
            names the file, the key and what is allowed.
    """
    if isinstance(name_or_file, os.PathLike):
        name_or_file = os.fspath(name_or_file)
    if not isinstance(name_or_file, str):
        raise ConfigError('disc', name_or_file, "give a text, such as 'frisbee'")
    if is_file(name_or_file):
        path = Path(name_or_file)
        source = _shown(name_or_file)
        name = path.stem.encode(errors='replace').decode()  # plots cannot draw lone surrogates
        return _disc(name, _merged(_read(name_or_file, path), source), source)
    numbers = flight_numbers.parse(name_or_file)
    keys = _entry(name_or_file) if numbers is None else flight_numbers.keys(numbers, _entry)
    return _disc(name_or_file, keys, name_or_file)


def is_file(name_or_file: str) -> bool:
    """Return True if a text names a disc file, not a disc of the catalogue or flight numbers."""
    return Path(name_or_file).suffix.lower() in {'.yaml', '.yml'}


def disc_document(disc: Disc) -> dict[str, Any]:
    """Return a disc as the keys and values of a disc file, complete and exact.

    `disc_from_document` makes the same disc from it, to the last bit.
    """
    document: dict[str, Any] = {'description': disc.description, 'aero': disc.aero}
    if disc.ground_contact != Disc.ground_contact:
        document['ground'] = disc.ground_contact
    document |= _numbers_of(disc, _PROPERTIES)
    document['damping'] = _numbers_of(disc, _DAMPING)
    if disc.linear is not None:
        document['linear'] = _numbers_of(disc.linear, _LINEAR)
    if disc.table is not None:
        columns = [disc.table.alpha_deg, *disc.table.coefficients.T]
        document['table'] = {
            key: values.tolist() for key, values in zip(_TABLE, columns, strict=True)
        }
    for section in ('spin_roll_moment', 'spin_side_force'):
        terms: SpinTable | None = getattr(disc, section)
        if terms is not None:
            document[section] = {key: getattr(terms, key).tolist() for key in _SPIN}
    if disc.uncertainty:
        document['uncertainty'] = dict(disc.uncertainty)
    return document


def _numbers_of(thing: Disc | LinearAero, keys: Mapping[str, Quantity]) -> dict[str, float]:
    return {key: float(getattr(thing, quantity.name)) for key, quantity in keys.items()}


def disc_from_document(name: str, keys: dict[str, Any]) -> Disc:
    """Return the disc of a `disc_document`.

    Raises:
        ConfigError: As of `load_disc`; `name` stands for the file.
    """
    return _disc(name, dict(keys), name)


def _entry(name: str) -> dict[str, Any]:
    """Return the keys of a disc of the package, completed from the disc that it is based on."""
    if name not in disc_names():
        close = difflib.get_close_matches(name, disc_names(), n=1)
        guess = f'did you mean {close[0]}? ' if close else ''
        if name in _FORMER:
            guess = f'it is called {_FORMER[name]} now; '
        names = ', '.join(disc_names())
        allowed = f'{guess}choose from {names}, or give a .yaml file or numbers such as 11/5/-1/3'
        raise ConfigError('disc', name, allowed)
    return _merged(copy.deepcopy(_document(name)), name)


@functools.cache
def _document(name: str) -> dict[str, Any]:
    """Return the keys in the file of a disc of the package, for no one to change.

    Reading the file takes 5 to 20 ms, and numbers such as 11/5/-1/3 need those of four discs.
    """
    return _parse(name, (_FOLDER / f'{name}.yaml').read_text(encoding='utf-8'))


def _merged(keys: dict[str, Any], source: str) -> dict[str, Any]:
    """Return `keys`, completed from the disc of `based_on`; sections are merged key by key.

    A table replaces the other table as a whole: half a table of each disc would mean nothing.
    """
    base_name = keys.pop('based_on', None)
    numbers = keys.pop('flight_numbers', None)
    if numbers is not None:
        base_name, base = _numbered(numbers, base_name, source)
    elif base_name is None:
        return keys
    else:
        base = _entry(validation.choice(f'{source}: based_on', base_name, disc_names()))
    _scale_inertia(base, keys, base_name)
    for key, value in keys.items():
        if key in {'damping', 'linear'} and isinstance(value, dict):
            base[key] = {**base.get(key, {}), **value}
        else:
            base[key] = value
    return base


def _numbered(numbers: object, base_name: object, source: str) -> tuple[str, dict[str, Any]]:
    """Return the name and the keys of the disc that the key `flight_numbers` describes."""
    text = '/'.join(map(str, numbers)) if isinstance(numbers, list) else str(numbers)
    thing = f'{source}: flight_numbers'
    if base_name is not None:
        raise ConfigError(thing, numbers, 'give one of based_on and flight_numbers')
    try:
        parsed = flight_numbers.parse(text)
    except ConfigError as error:
        raise error.named(f'{source}: {error.thing}') from None
    if parsed is None:
        raise ConfigError(thing, numbers, 'give speed/glide/turn/fade, such as 11/5/-1/3')
    return text, flight_numbers.keys(parsed, _entry)


def _scale_inertia(base: dict[str, Any], keys: dict[str, Any], base_name: str) -> None:
    """Scale the inertia of a base to another mass or diameter, and append that to the description.

    The shape is kept: I / (m d^2) stays. Nothing is scaled if the file gives an inertia itself, or
    a mass or diameter out of range, which is refused later.
    """
    given = [DISC[name].key for name in ('mass', 'diameter') if DISC[name].key in keys]
    inertias = [DISC[name].key for name in ('inertia_axial', 'inertia_diametral')]
    factor = 1.0
    for key in given:
        try:
            ratio = _PROPERTIES[key].check(keys[key]) / base[key]
        except ConfigError:
            return
        factor *= ratio if key == DISC['mass'].key else ratio * ratio
    if factor == 1.0 or any(key in keys for key in inertias):
        return
    for key in inertias:
        base[key] *= factor
    text = keys.get('description', base.get('description', ''))
    if isinstance(text, str):  # anything else is refused later
        note = f'inertia of {base_name} scaled by {factor:.4g} to the {" and ".join(given)}'
        keys['description'] = f'{text.rstrip()} ({note})'.lstrip()


def _read(name: str, path: Path) -> dict[str, Any]:
    try:
        content = _head(path)
    except OSError as error:
        raise ConfigError('disc', name, f'cannot read it ({error.strerror})') from None
    except ValueError as error:  # a name with a zero byte
        raise ConfigError('disc', name, f'cannot read it ({error})') from None
    if len(content) > _LARGEST_FILE:
        raise ConfigError('disc', name, f'a disc file has at most {_LARGEST_FILE} bytes')
    try:
        text = content.decode('utf-8-sig')
    except UnicodeDecodeError:
        raise ConfigError('disc', name, 'the file is not UTF-8 text') from None
    return _parse(_shown(name), text)


def _head(path: Path) -> bytes:
    """Return the bytes of a file; of a too large file only the first, enough to refuse it."""
    if path.exists() and not path.is_file():  # reading a pipe or a device may never end
        raise OSError(0, 'not a file')
    with path.open('rb') as file:
        return file.read(_LARGEST_FILE + 1)


def _shown(name: str) -> str:
    """Return the name of a file for a message: one line, shortened to its end."""
    text = name if name.isprintable() else repr(name)[1:-1]
    return text if len(text) <= _LONGEST_NAME else f'...{text[-_LONGEST_NAME:]}'


def _parse(name: str, text: str) -> dict[str, Any]:
    try:
        keys = yaml.load(text, Loader=_StrictLoader)  # noqa: S506 - a SafeLoader
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        mark = getattr(error, 'problem_mark', None)
        where = f' line {mark.line + 1}' if mark is not None else ''
        problem = getattr(error, 'problem', None) or getattr(error, 'reason', None) or str(error)
        if isinstance(error, RecursionError):
            problem = 'lists or keys nested too deep'
        raise ConfigError(f'{name}{where}', problem, 'the file must be valid YAML') from None
    if not isinstance(keys, dict):
        raise ConfigError(name, keys, 'the file must hold keys and values')
    return keys


def _disc(name: str, keys: dict[str, Any], source: str) -> Disc:
    """Build a disc from the keys of a file; `source` names the file in messages."""
    fields: dict[str, Any] = {'name': name}
    try:
        _refuse_unknown(keys, _KEYS, '')
        _require(keys, _PROPERTIES, '')
        fields['description'] = validation.text('description', keys.get('description', ''))
        for key, quantity in _PROPERTIES.items():
            if key in keys:
                fields[quantity.name] = check_number(quantity, keys[key], key)
        fields.setdefault('area', math.pi * fields['diameter'] * fields['diameter'] / 4)
        for section, names in _SECTIONS.items():
            if section in keys:
                fields.update(_section(section, keys[section], names))
        aero = 'table' if 'table' in keys else 'linear'
        fields['aero'] = validation.choice('aero', keys.get('aero', aero), AERODYNAMICS)
        ground = keys.get('ground', Disc.ground_contact)
        fields['ground_contact'] = validation.choice('ground', ground, GROUND_CONTACTS)
        return Disc(**fields)
    except ConfigError as error:
        key = DISC[error.quantity].key if error.quantity in DISC else error.thing
        raise error.named(f'{source}: {key}') from None


def _section(section: str, values: object, names: tuple[str, ...]) -> dict[str, Any]:
    """Return the fields of a disc from one section of its file."""
    if not isinstance(values, dict):
        raise ConfigError(section, values, f'give the keys {", ".join(names)}')
    _refuse_unknown(values, names, f'{section}.')
    _require(values, names, f'{section}.')
    if section in _NUMBERS:
        quantities = _NUMBERS[section]
        values = {
            quantities[key].name: quantities[key].check(value, f'{section}.{key}')
            for key, value in values.items()
        }
    if section == 'damping':
        return values
    if section == 'uncertainty':
        return {section: values}
    try:
        return {section: _BUILDERS[section](**values)}
    except ConfigError as error:
        raise error.named(f'{section}.{error.thing}') from None


def _refuse_unknown(values: Mapping[Any, Any], allowed: tuple[str, ...], prefix: str) -> None:
    for key in values:
        if key not in allowed:
            close = difflib.get_close_matches(str(key), allowed, n=1)
            guess = f'did you mean {close[0]}? ' if close else ''
            message = f'{guess}known keys are {", ".join(allowed)}'
            raise ConfigError(f'{prefix}{brief(key)}', 'an unknown key', message)


def _require(values: Mapping[str, Any], needed: Iterable[str], prefix: str) -> None:
    for key in needed:
        if key not in values and key not in _OPTIONAL:
            raise ConfigError(f'{prefix}{key}', None, 'the key is missing')


class _StrictLoader(yaml.SafeLoader):
    """A safe loader that refuses repeated and merged keys, and reads only decimal numbers.

    Merge keys can grow without bound, and `based_on` serves their purpose.
    """

    def construct_mapping(
        self,
        node: yaml.MappingNode,
        deep: bool = False,  # noqa: FBT002
    ) -> dict[Any, Any]:
        keys = set()
        for key_node, _ in node.value:
            key = key_node.value if isinstance(key_node, yaml.ScalarNode) else None
            if key is None or key in keys or key == '<<':
                problem = 'the repeated key' if key in keys else 'a key that is not a word'
                raise yaml.constructor.ConstructorError(
                    None, None, f'{problem} {key or ""}'.strip(), key_node.start_mark
                )
            keys.add(key)
        return super().construct_mapping(node, deep)


# PyYAML follows YAML 1.1, which reads 1e-3 as text, -045 as -37 and 1:30 as 90; YAML 1.2 does not.
_NUMBER_TAGS = {'tag:yaml.org,2002:float', 'tag:yaml.org,2002:int'}
_StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in _NUMBER_TAGS]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_StrictLoader.add_implicit_resolver(
    'tag:yaml.org,2002:float',
    re.compile(r'^([-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|[-+]?\.inf|\.nan)$', re.IGNORECASE),
    list('-+0123456789.'),
)
