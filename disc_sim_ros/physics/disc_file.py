"""The disc catalogue: YAML files, one a disc, in the package or the user's own.

A file may start from another disc with `based_on: NAME` and then gives only what differs. Every
key carries its unit; an unknown, doubled, missing or impossible one is refused with file, key and
reason.
"""

from collections.abc import Callable, Mapping
import difflib
from importlib.resources import files
import math
from pathlib import Path
import re
from typing import Any

import yaml

from disc_sim_ros import validation
from disc_sim_ros.errors import ConfigError, brief
from disc_sim_ros.physics.disc import AeroTable, Disc, LinearAero, SpinTable

_FOLDER = files('disc_sim_ros.physics') / 'discs'
_LONGEST_NAME = 100  # of a file, in a message
_LARGEST_FILE = 1 << 17  # bytes; the largest disc of the package has 4 kB, and 1 MB takes seconds

_PROPERTIES = {
    'mass_kg': 'mass',
    'diameter_m': 'diameter',
    'area_m2': 'area',
    'inertia_axial_kg_m2': 'inertia_axial',
    'inertia_diametral_kg_m2': 'inertia_diametral',
}
_DAMPING = {'C_Lp': 'C_Lp', 'C_Mq': 'C_Mq', 'C_Nr': 'C_Nr'}
_LINEAR = {
    'CL_0': 'CL_0',
    'CL_alpha_per_rad': 'CL_alpha',
    'CD_0': 'CD_0',
    'CD_alpha_per_rad2': 'CD_alpha',
    'alpha_0_rad': 'alpha_0',
    'CM_0': 'CM_0',
    'CM_alpha_per_rad': 'CM_alpha',
}
_TABLE = {'alpha_deg': 'alpha_deg', 'CL': 'CL', 'CD': 'CD', 'CM': 'CM'}
_SPIN = {'advance_ratio': 'advance_ratio', 'alpha_deg': 'alpha_deg', 'coefficient': 'coefficient'}
_SECTIONS: dict[str, dict[str, str]] = {
    'damping': _DAMPING,
    'linear': _LINEAR,
    'table': _TABLE,
    'spin_roll_moment': _SPIN,
    'spin_side_force': _SPIN,
}
_BUILDERS: dict[str, Callable[..., Any]] = {
    'linear': LinearAero,
    'table': AeroTable.of,
    'spin_roll_moment': SpinTable.of,
    'spin_side_force': SpinTable.of,
}
_KEYS = ('description', 'based_on', 'aero', *_PROPERTIES, *_SECTIONS)
_OPTIONAL = {'area_m2', 'C_Lp', 'C_Mq', 'C_Nr'}


def disc_names() -> tuple[str, ...]:
    """Return the names of the discs in the package."""
    found = (Path(item.name) for item in _FOLDER.iterdir())
    return tuple(sorted(path.stem for path in found if path.suffix == '.yaml'))


def load_disc(name_or_file: str) -> Disc:
    """Return a disc of the catalogue by name, or one from a user's YAML file.

    Args:
        name_or_file: A name as `names` lists them, or a path that ends in .yaml or .yml.

    Raises:
        ConfigError: No such disc or file, or a file that does not describe a disc; the message
            names the file, the key and what is allowed.
    """
    path = Path(name_or_file)
    if path.suffix in {'.yaml', '.yml'}:
        source = _shown(name_or_file)
        name = path.stem.encode(errors='replace').decode()  # what is no text cannot be drawn
        return _disc(name, _merged(_read(name_or_file, path), source), source)
    return _disc(name_or_file, _entry(name_or_file), name_or_file)


def disc_document(disc: Disc) -> dict[str, Any]:
    """Return a disc as the keys and values of a disc file, complete and exact.

    `from_document` makes the very same disc of it, to the last bit.
    """
    found: dict[str, Any] = {'description': disc.description, 'aero': disc.aero}
    found |= {key: float(getattr(disc, name)) for key, name in _PROPERTIES.items()}
    found['damping'] = {key: float(getattr(disc, name)) for key, name in _DAMPING.items()}
    if disc.linear is not None:
        found['linear'] = {k: float(getattr(disc.linear, name)) for k, name in _LINEAR.items()}
    if disc.table is not None:
        columns = disc.table.coefficients.T.tolist()
        found['table'] = {
            'alpha_deg': disc.table.alpha_deg.tolist(),
            **dict(zip(('CL', 'CD', 'CM'), columns, strict=True)),
        }
    for section in ('spin_roll_moment', 'spin_side_force'):
        terms: SpinTable | None = getattr(disc, section)
        if terms is not None:
            found[section] = {key: getattr(terms, key).tolist() for key in _SPIN}
    return found


def disc_from_document(name: str, keys: dict[str, Any]) -> Disc:
    """Return the disc of a `document`; raises ConfigError as `load` does."""
    return _disc(name, dict(keys), name)


def _entry(name: str) -> dict[str, Any]:
    """Return the keys of a disc of the package, with those of the disc it is based on."""
    if name not in disc_names():
        close = difflib.get_close_matches(name, disc_names(), n=1)
        guess = f'did you mean {close[0]}? ' if close else ''
        allowed = f'{guess}choose from {", ".join(disc_names())} or give a .yaml file'
        raise ConfigError('disc', name, allowed)
    return _merged(_parse(name, (_FOLDER / f'{name}.yaml').read_text(encoding='utf-8')), name)


def _merged(keys: dict[str, Any], source: str) -> dict[str, Any]:
    """Return `keys` over those of the disc that it is based on; sections are merged by key.

    Tables replace each other whole: half a table of one disc and half of another is none.
    """
    base_name = keys.pop('based_on', None)
    if base_name is None:
        return keys
    base = _entry(validation.choice(f'{source}: based_on', base_name, disc_names()))
    for key, value in keys.items():
        if key in {'damping', 'linear'} and isinstance(value, dict):
            base[key] = {**base.get(key, {}), **value}
        else:
            base[key] = value
    return base


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
    """Return the bytes of a file, of a large one only as many as show that it is too large."""
    if path.exists() and not path.is_file():  # a pipe would wait, a device may never end
        raise OSError(0, 'not a file')
    with path.open('rb') as file:
        return file.read(_LARGEST_FILE + 1)


def _shown(name: str) -> str:
    """Return the name of a file for a message: one line, of a long one the end."""
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
    known: dict[str, Any] = {'name': name}
    try:
        _refuse_unknown(keys, _KEYS, '')
        _require(keys, _PROPERTIES, '')
        known['description'] = validation.text('description', keys.get('description', ''))
        for key, attribute in _PROPERTIES.items():
            if key in keys:
                known[attribute] = validation.number(key, keys[key], above=0.0)
        known.setdefault('area', math.pi * known['diameter'] * known['diameter'] / 4)
        for section, fields in _SECTIONS.items():
            if section in keys:
                known.update(_section(section, keys[section], fields))
        aero = 'table' if 'table' in keys else 'linear'
        known['aero'] = validation.choice('aero', keys.get('aero', aero), ('table', 'linear'))
        return Disc(**known)
    except ConfigError as error:
        thing = _YAML_KEYS.get(error.thing, error.thing)
        raise ConfigError(f'{source}: {thing}', error.value, error.allowed) from None


_YAML_KEYS = {attribute: key for key, attribute in _PROPERTIES.items()} | {
    attribute: f'damping.{key}' for key, attribute in _DAMPING.items()
}


def _section(section: str, values: object, fields: Mapping[str, str]) -> dict[str, Any]:
    """Return the attributes of a disc that one section of its file gives."""
    if not isinstance(values, dict):
        raise ConfigError(section, values, f'give the keys {", ".join(fields)}')
    _refuse_unknown(values, fields, f'{section}.')
    _require(values, fields, f'{section}.')
    try:
        if section in {'damping', 'linear'}:
            values = {key: validation.number(key, value) for key, value in values.items()}
        renamed = {fields[key]: value for key, value in values.items()}
        if section == 'damping':
            return renamed
        return {section: _BUILDERS[section](**renamed)}
    except ConfigError as error:
        key = next((k for k, attribute in fields.items() if attribute == error.thing), error.thing)
        raise ConfigError(f'{section}.{key}', error.value, error.allowed) from None


def _refuse_unknown(
    values: Mapping[Any, Any], allowed: Mapping[str, Any] | tuple[str, ...], prefix: str
) -> None:
    for key in values:
        if key not in allowed:
            close = difflib.get_close_matches(str(key), allowed, n=1)
            guess = f'did you mean {close[0]}? ' if close else ''
            message = f'{guess}known keys are {", ".join(allowed)}'
            raise ConfigError(f'{prefix}{brief(key)}', 'an unknown key', message)


def _require(values: Mapping[str, Any], needed: Mapping[str, str], prefix: str) -> None:
    for key in needed:
        if key not in values and key not in _OPTIONAL:
            raise ConfigError(f'{prefix}{key}', None, 'the key is missing')


class _StrictLoader(yaml.SafeLoader):
    """A safe loader that refuses doubled and merged keys and has one kind of number, decimal.

    Merge keys of merge keys grow without bound, and `based_on` does what they are for.
    """

    def construct_mapping(
        self,
        node: yaml.MappingNode,
        deep: bool = False,  # noqa: FBT002
    ) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = key_node.value if isinstance(key_node, yaml.ScalarNode) else None
            if key is None or key in seen or key == '<<':
                problem = 'a doubled key' if key in seen else 'a key that is no word'
                raise yaml.constructor.ConstructorError(
                    None, None, f'{problem} {key or ""}'.strip(), key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)


# PyYAML follows YAML 1.1, which reads 1e-3 as text, -045 as -37 and 1:30 as 90; YAML 1.2 does not.
_NUMBERS = {'tag:yaml.org,2002:float', 'tag:yaml.org,2002:int'}
_StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in _NUMBERS]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_StrictLoader.add_implicit_resolver(
    'tag:yaml.org,2002:float',
    re.compile(r'^([-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|[-+]?\.inf|\.nan)$', re.IGNORECASE),
    list('-+0123456789.'),
)
