#!/usr/bin/env python3
"""Write or check the table of dependencies and the lock file of the development environment.

    .venv/bin/python tools/dependencies.py            # say what is out of date, exit code 1
    .venv/bin/python tools/dependencies.py --write    # docs/dependencies.md, requirements-dev.lock

What is needed stands in setup.py, why in this file, licences in the metadata of what is installed.
"""

import argparse
import ast
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
import re
import sys
from xml.etree import ElementTree as Xml

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PAGE, LOCK = ROOT / 'docs' / 'dependencies.md', ROOT / 'requirements-dev.lock'
BEGIN, END = '<!-- tables: tools/dependencies.py --write -->', '<!-- end of tables -->'
EXTRAS = ('jazzy', 'dask', 'test')  # of the development environment
DISTRIBUTED = ('', 'jazzy', 'dask')  # what runs at a user's; the rest are tools
WHY = {
    'atheris': 'coverage-guided fuzzing, `benchmarks/fuzz`',
    'colcon-core': 'a test builds the package as a ROS workspace does',
    'colcon-ros': 'the same',
    'dask': 'ensembles on many machines, `sweep --executor dask`',
    'distributed': 'the same',
    'hypothesis': 'property-based tests',
    'llvmlite': 'lanes of SIMD for numba, which brings it',
    'packaging': 'a test compares the lock file with the bounds',
    'import-linter': 'holds the direction of imports',
    'lz4': 'bags with lz4 chunks',
    'matplotlib': 'plots and the figures of the paper',
    'mcap': 'the file format of bags',
    'mcap-ros2-support': 'decodes messages of bags without ROS',
    'mypy': 'types',
    'numba': 'compiles the equations of motion',
    'numpy': 'arrays, normal random numbers',
    'Pillow': 'writes pictures into bags and for figures',
    'pyarrow': 'Parquet tables of ensembles',
    'pytest': 'tests; with 9.2, pytest-xdist 3.8 keeps no group together',
    'pytest-timeout': 'a hanging test ends',
    'pytest-xdist': 'tests on all cores at once',
    'PyYAML': 'disc files, configurations, metadata of bags',
    'ros-jazzy-common-interfaces': 'messages, where no ROS is installed',
    'ros-jazzy-rclpy': 'ROS 2 for Python and its middleware, where no ROS is installed',
    'rosbags': 'an independent reader and writer of bags, in tests',
    'ruff': 'style',
    'scipy': 'fits, optimisation and integration in analyses',
    'types-PyYAML': 'types of PyYAML for mypy',
    'zstandard': 'bags with zstd chunks',
}
PERMISSIVE = {
    '0BSD', 'Apache-2.0', 'Apache-2.0 WITH LLVM-exception', 'BSD', 'BSD-2-Clause', 'BSD-3-Clause',
    'BSL-1.0', 'CC0-1.0', 'MIT', 'MIT-CMU', 'PSF', 'PSF-2.0', 'Zlib',
}  # fmt: skip
# Of tools alone: nothing of them is in this package or linked to it.
TOOLS_ONLY = {'MPL-2.0', 'any OSI', 'Public Domain and BSD and GPL'}
# What tells no licence where it is installed, or is not installed: as its repository has it.
_TOLD = {'atheris': 'Apache-2.0', 'ros-fastcdr': 'Apache-2.0', 'ros-fastrtps': 'Apache-2.0'}
_SAME = {  # how metadata and package.xml call the same licence
    'Apache License 2.0': 'Apache-2.0',
    'Apache License, Version 2.0': 'Apache-2.0',
    'Apache 2.0': 'Apache-2.0',
    'Apache Software License': 'Apache-2.0',
    'BSD License': 'BSD',
    'BSD 2-Clause License': 'BSD-2-Clause',
    'BSD 3-Clause License': 'BSD-3-Clause',
    'Boost Software License': 'BSL-1.0',
    'MIT License': 'MIT',
    'Mozilla Public License 2.0 (MPL 2.0)': 'MPL-2.0',
    'Python Software Foundation License': 'PSF',
    'GNU General Public License (GPL)': 'GPL',
    'any-OSI': 'any OSI',
    'zlib License': 'Zlib',
    'zlib': 'Zlib',
}


def needed() -> dict[str, list[Requirement]]:
    """Return the requirements of setup.py by extra; '' for those of everybody."""
    call = next(
        node
        for node in ast.walk(ast.parse((ROOT / 'setup.py').read_text(encoding='utf-8')))
        if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == 'setup'
    )
    given = {word.arg: word.value for word in call.keywords}
    found = {'': ast.literal_eval(given['install_requires'])}
    found |= ast.literal_eval(given['extras_require'])
    return {extra: [Requirement(line) for line in lines] for extra, lines in found.items()}


def brought(requirements: Iterable[Requirement]) -> dict[str, str]:
    """Return name and version of all that requirements bring on this machine, as installed."""
    found: dict[str, str] = {}
    asked: set[tuple[str, str]] = set()
    waiting = [(r, extra) for r in requirements for extra in ('', *r.extras)]
    while waiting:
        requirement, extra = waiting.pop()
        name = canonicalize_name(requirement.name)
        if (name, extra) in asked:
            continue
        asked.add((name, extra))
        try:
            distribution = metadata.distribution(requirement.name)
        except metadata.PackageNotFoundError:
            continue  # a tool that is left out, such as atheris
        found[distribution.metadata['Name']] = distribution.version
        for line in distribution.requires or ():
            inner = Requirement(line)
            if inner.marker is None or inner.marker.evaluate({'extra': extra}):
                waiting += [(inner, e) for e in ('', *inner.extras)]
    return found


def licence(name: str) -> str:
    """Return the licence of an installed distribution; '?' where nothing tells it."""
    try:
        found = metadata.metadata(name)
    except metadata.PackageNotFoundError:
        return _TOLD.get(name, '?')
    classifiers = found.get_all('Classifier') or ()
    words = [
        c.rpartition(' :: ')[2]
        for c in classifiers
        if c.startswith('License ::') and not c.endswith(('OSI Approved', 'DFSG approved'))
    ]
    short = (found.get('License') or '').strip()
    if '\n' in short or len(short) > 60:
        short = ''
    said = found.get('License-Expression') or _named(short) or ' and '.join(map(_named, words))
    return said or _of_ros(name)


def _named(text: str) -> str:
    return _SAME.get(text, text)


def _of_ros(name: str) -> str:
    """Return the licence in the package.xml of a ROS wheel, whose metadata has none."""
    package = re.sub('^ros-(jazzy-)?', '', name).replace('-', '_')
    file = Path(sys.prefix) / 'share' / package / 'package.xml'
    if not file.is_file():
        return _TOLD.get(name, '?')
    licences = Xml.parse(file).getroot().iter('license')  # noqa: S314 - installed
    found = [_named((e.text or '').strip()) for e in licences]
    return ' AND '.join(dict.fromkeys(found))


def is_allowed(text: str, *, tool: bool) -> bool:
    """Say whether a licence goes with Apache-2.0: a permissive one, of a tool some more."""
    if tool and text in TOOLS_ONLY:
        return True
    ways = [re.split(' AND | and ', way) for way in text.split(' OR ')]
    known = PERMISSIVE | TOOLS_ONLY if tool else PERMISSIVE
    return any(all(part in known for part in way) for way in ways)


def tables() -> str:
    """Return the tables of docs/dependencies.md.

    Raises:
        ValueError: A dependency without a reason, or with a licence that is not known to fit.
    """
    by_name: dict[str, tuple[Requirement, list[str]]] = {}
    for extra, requirements in needed().items():
        for r in requirements:
            before = by_name.setdefault(r.name, (r, []))
            if str(before[0].specifier) != str(r.specifier):
                raise ValueError(f'{r.name}: bounds differ between extras')
            before[1].append(extra)
    lines = ['| dependency | bounds | for | why | licence |', '|---|---|---|---|---|']
    for name in sorted(by_name, key=str.lower):
        requirement, extras = by_name[name]
        if name not in WHY:
            raise ValueError(f'{name}: say in tools/dependencies.py what it is needed for')
        said = _checked(name, tool=not set(extras) & set(DISTRIBUTED))
        bounds = ', '.join(sorted(map(str, requirement.specifier), reverse=True)) or 'any'
        purpose = 'all' if '' in extras else ', '.join(f'`[{extra}]`' for extra in extras)
        lines.append(f'| {name} | {bounds} | {purpose} | {WHY[name]} | {said} |')
    return '\n'.join([*lines, '', *_others(set(by_name))])


def _others(direct: set[str]) -> list[str]:
    """Return the table of what the dependencies bring, by licence."""
    wanted = needed()
    run = brought(r for extra in DISTRIBUTED for r in wanted.get(extra, ()))
    everything = brought(r for extra in ('', *EXTRAS) for r in wanted[extra])
    known = {canonicalize_name(name) for name in direct}
    lines = ['| brought by these | licence |', '|---|---|']
    for heading, names in (('at run time', set(run)), ('by tools', set(everything) - set(run))):
        by_licence: dict[str, list[str]] = {}
        for name in sorted(names, key=str.lower):
            if canonicalize_name(name) not in known:
                said = _checked(name, tool=heading == 'by tools')
                by_licence.setdefault(said, []).append(name)
        lines += [
            f'| {heading}: {_listed(by_licence[said])} | {said} |' for said in sorted(by_licence)
        ]
    return lines


def _listed(names: list[str]) -> str:
    """Return names in one line; the wheels of ROS as one where they are many."""
    wheels = [name for name in names if name.startswith('ros-')]
    if len(wheels) > 5:
        rest = [name for name in names if name not in wheels]
        names = [*rest, f'{len(wheels)} wheels of ROS 2 (ros-...)']
    return ', '.join(names)


def _checked(name: str, *, tool: bool) -> str:
    said = licence(name)
    if not is_allowed(said, tool=tool):
        raise ValueError(f'{name}: licence {said!r} is not known to go with Apache-2.0')
    return said


def lock() -> str:
    """Return the text of the lock file, from what is installed."""
    wanted = needed()
    found = brought(r for extra in ('', *EXTRAS) for r in wanted[extra])
    version = '.'.join(map(str, sys.version_info[:2]))
    lines = [
        f'# Exact versions of all that disc_sim_ros[{",".join(EXTRAS)}] brings on',
        f'# CPython {version}, Linux x86-64. Made by tools/dependencies.py --write of an',
        '# environment in which all tests pass. To install just these:',
        '#     python3 -m venv .venv',
        '#     .venv/bin/pip install -r requirements-dev.lock',
        '#     .venv/bin/pip install --no-deps -e .',
    ]
    return '\n'.join([*lines, *(f'{n}=={found[n]}' for n in sorted(found, key=str.lower))]) + '\n'


def page(text: str) -> str:
    """Return docs/dependencies.md with fresh tables."""
    before, _, rest = text.partition(BEGIN)
    after = rest.partition(END)[2]
    return f'{before}{BEGIN}\n\n{tables()}\n\n{END}{after}'


def main() -> int:
    """Check or write; return the exit code."""
    p = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    p.add_argument('--write', action='store_true', help='write both files')
    write = p.parse_args().write
    stale = []
    try:
        fresh = {PAGE: page(PAGE.read_text(encoding='utf-8')), LOCK: lock()}
    except ValueError as error:
        sys.stderr.write(f'dependencies: error: {error}\n')
        return 1
    for file, text in fresh.items():
        if not file.is_file() or file.read_text(encoding='utf-8') != text:
            stale.append(file.relative_to(ROOT))
            if write:
                file.write_text(text, encoding='utf-8')
    state = 'written' if write else 'out of date'
    sys.stdout.write(''.join(f'{file}: {state}\n' for file in stale) or 'up to date\n')
    return int(bool(stale) and not write)


if __name__ == '__main__':
    sys.exit(main())
