#!/usr/bin/env python3
"""Write or check the table of dependencies and the lock file of the development environment.

    make lock                                              # install, then write both files
    .venv/bin/python tools/dependencies.py                 # exit code 1 if a file is out of date
    .venv/bin/python tools/dependencies.py --write         # docs/dependencies.md and the lock file
    .venv/bin/python tools/dependencies.py --check-lock    # exit code 1 if the lock file is stale

setup.py lists the requirements and their bounds, this file gives the reason for each, and the
metadata of the installed packages name the licences.
"""

import argparse
import ast
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
import re
import sys
from typing import Any
from xml.etree import ElementTree as Xml

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PAGE, LOCK = ROOT / 'docs' / 'dependencies.md', ROOT / 'requirements-dev.lock'
BEGIN, END = '<!-- tables: tools/dependencies.py --write -->', '<!-- end of tables -->'
EXTRAS = (
    'jazzy',
    'fast',
    'parquet',
    'view',
    'dask',
    'envs',
    'test',
    'docs',
)  # of the development environment
DISTRIBUTED = (
    '',
    'jazzy',
    'fast',
    'parquet',
    'view',
    'dask',
    'envs',
)  # what users run; the other extras are tools
RENEW = 'run `make lock`, then `make test`'
WHY = {
    'atheris': 'coverage-guided fuzzing, `benchmarks/fuzz`',
    'colcon-core': 'a test builds the package as a ROS workspace does',
    'colcon-ros': 'as colcon-core',
    'dask': 'ensembles on many machines, `sweep --executor dask`',
    'distributed': 'as dask',
    'hypothesis': 'property-based tests',
    'gymnasium': 'the interface of environments for reinforcement learning',
    'furo': 'theme of the documentation site; its files are local',
    'llvmlite': 'runs compiled equations; SIMD instructions for numba',
    'myst-parser': 'Markdown pages for Sphinx',
    'packaging': 'compares the lock file with the bounds',
    'import-linter': 'enforces the direction of imports',
    'lz4': 'bags with lz4 chunks',
    'matplotlib': 'plots and the figures of the paper',
    'mcap': 'the file format of bags',
    'mcap-ros2-support': 'decodes messages of bags without ROS',
    'mypy': 'types',
    'numba': 'compiles the equations of motion',
    'numpy': 'arrays, normal random numbers',
    'Pillow': 'writes pictures into bags and for figures',
    'pyarrow': 'Parquet tables of ensembles',
    'pytest': 'tests; with pytest 9.2, pytest-xdist 3.8 no longer keeps groups together',
    'pytest-timeout': 'ends a test that hangs',
    'pytest-xdist': 'runs tests on all cores',
    'PyYAML': 'disc files, configurations, metadata of bags',
    'ros-jazzy-common-interfaces': 'message types, for machines without a ROS installation',
    'ros-jazzy-rclpy': 'ROS 2 for Python with its middleware, for the same machines',
    'rosbags': 'an independent reader and writer of bags, in tests',
    'ruff': 'linter and formatter',
    'scipy': 'fits, optimisation and integration in analyses',
    'Sphinx': 'builds the documentation site',
    'soupsieve': 'of furo; version 3 refuses Python 3.11.0 to 3.11.4, as of Debian 12',
    'stable-baselines3': 'trains the policy of `examples/train_steer.py`',
    'torch': 'as stable-baselines3; flying the policy does not need it',
    'trimesh': 'the viewer of pages with flights, with three.js in it',
    'types-PyYAML': 'types of PyYAML for mypy',
    'websockets': 'the web server of `live_view`',
    'zstandard': 'bags with zstd chunks',
}
PERMISSIVE = {
    '0BSD', 'Apache-2.0', 'Apache-2.0 WITH LLVM-exception', 'BSD', 'BSD-2-Clause', 'BSD-3-Clause',
    'BSL-1.0', 'CC0-1.0', 'MIT', 'MIT-CMU', 'PSF', 'PSF-2.0', 'Zlib',
}  # fmt: skip
# Allowed for tools only: nothing of them is in this package or linked to it.
TOOLS_ONLY = {'MPL-2.0', 'any OSI', 'Public Domain and BSD and GPL'}
# Packages whose metadata name no licence, or that are not installed: from their repositories.
_FROM_REPOSITORY = {
    'atheris': 'Apache-2.0',
    'stable-baselines3': 'MIT',
    'torch': 'BSD-3-Clause',
    'ros-fastcdr': 'Apache-2.0',
    'ros-fastrtps': 'Apache-2.0',
}
_SAME = {  # other names of a licence in metadata and in package.xml
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
    """Return the requirements of setup.py by extra; '' is the key of install_requires."""
    lines = {'': setup_argument('install_requires')} | setup_argument('extras_require')
    return {extra: [Requirement(line) for line in group] for extra, group in lines.items()}


def setup_argument(name: str) -> Any:
    """Return an argument of the call of setup() in setup.py, without running the file."""
    call = next(
        node
        for node in ast.walk(ast.parse((ROOT / 'setup.py').read_text(encoding='utf-8')))
        if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == 'setup'
    )
    return ast.literal_eval(next(word.value for word in call.keywords if word.arg == name))


def installed(requirements: Iterable[Requirement]) -> dict[str, str]:
    """Return the installed versions, by name, of requirements and of all their dependencies."""
    versions: dict[str, str] = {}
    visited: set[tuple[str, str]] = set()
    waiting = [(r, extra) for r in requirements for extra in ('', *r.extras)]
    while waiting:
        requirement, extra = waiting.pop()
        name = canonicalize_name(requirement.name)
        if (name, extra) in visited:
            continue
        visited.add((name, extra))
        try:
            distribution = metadata.distribution(requirement.name)
        except metadata.PackageNotFoundError:
            continue  # an optional tool such as atheris
        versions[distribution.metadata['Name']] = distribution.version
        for line in distribution.requires or ():
            inner = Requirement(line)
            if inner.marker is None or inner.marker.evaluate({'extra': extra}):
                waiting += [(inner, e) for e in ('', *inner.extras)]
    return versions


def licence(name: str) -> str:
    """Return the licence of an installed distribution; '?' if it is unknown."""
    try:
        fields = metadata.metadata(name)
    except metadata.PackageNotFoundError:
        return _FROM_REPOSITORY.get(name, '?')
    classifiers = fields.get_all('Classifier') or ()
    words = [
        c.rpartition(' :: ')[2]
        for c in classifiers
        if c.startswith('License ::') and not c.endswith(('OSI Approved', 'DFSG approved'))
    ]
    short = (fields.get('License') or '').strip()
    if '\n' in short or len(short) > 60:
        short = ''
    stated = fields.get('License-Expression') or _short(short) or ' and '.join(map(_short, words))
    return stated or _of_ros(name)


def _short(text: str) -> str:
    return _SAME.get(text, text)


def _of_ros(name: str) -> str:
    """Return the licence from the package.xml of a ROS wheel; its metadata have none."""
    package = re.sub('^ros-(jazzy-)?', '', name).replace('-', '_')
    file = Path(sys.prefix) / 'share' / package / 'package.xml'
    if not file.is_file():
        return _FROM_REPOSITORY.get(name, '?')
    licences = Xml.parse(file).getroot().iter('license')  # noqa: S314 - installed
    names = [_short((e.text or '').strip()) for e in licences]
    return ' AND '.join(dict.fromkeys(names))


def is_allowed(text: str, *, tool: bool) -> bool:
    """Return True if a licence is compatible with Apache-2.0; tools may have some more."""
    if tool and text in TOOLS_ONLY:
        return True
    choices = [re.split(' AND | and ', choice) for choice in text.split(' OR ')]
    allowed = PERMISSIVE | TOOLS_ONLY if tool else PERMISSIVE
    return any(all(part in allowed for part in choice) for choice in choices)


def tables() -> str:
    """Return the tables of docs/dependencies.md.

    Raises:
        ValueError: A dependency has no reason, or a licence that is not known to be compatible.
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
            raise ValueError(f'{name}: add the reason for it to WHY in tools/dependencies.py')
        terms = _allowed_licence(name, tool=not set(extras) & set(DISTRIBUTED))
        bounds = ', '.join(sorted(map(str, requirement.specifier), reverse=True)) or 'any'
        purpose = 'all' if '' in extras else ', '.join(f'`[{extra}]`' for extra in extras)
        lines.append(f'| {name} | {bounds} | {purpose} | {WHY[name]} | {terms} |')
    return '\n'.join([*lines, '', *_others(set(by_name))])


def _others(direct: set[str]) -> list[str]:
    """Return the table of indirect dependencies, by licence."""
    wanted = needed()
    run = installed(r for extra in DISTRIBUTED for r in wanted.get(extra, ()))
    everything = installed(r for extra in ('', *EXTRAS) for r in wanted[extra])
    known = {canonicalize_name(name) for name in direct}
    lines = ['| indirect dependencies | licence |', '|---|---|']
    for heading, names in (('at run time', set(run)), ('of tools', set(everything) - set(run))):
        by_licence: dict[str, list[str]] = {}
        for name in sorted(names, key=str.lower):
            if canonicalize_name(name) not in known:
                terms = _allowed_licence(name, tool=heading == 'of tools')
                by_licence.setdefault(terms, []).append(name)
        lines += [
            f'| {heading}: {_listed(by_licence[terms])} | {terms} |'
            for terms in sorted(by_licence)
        ]
    return lines


def _listed(names: list[str]) -> str:
    """Return names in one line; more than five ROS wheels become one entry."""
    wheels = [name for name in names if name.startswith('ros-')]
    if len(wheels) > 5:
        rest = [name for name in names if name not in wheels]
        names = [*rest, f'{len(wheels)} wheels of ROS 2 (ros-...)']
    return ', '.join(names)


def _allowed_licence(name: str, *, tool: bool) -> str:
    terms = licence(name)
    if not is_allowed(terms, tool=tool):
        raise ValueError(
            f'{name}: licence {terms!r} is not known to be compatible with Apache-2.0'
        )
    return terms


def lock() -> str:
    """Return the text of the lock file, from the installed packages.

    Raises:
        ValueError: A requirement is not installed, or this is not the oldest supported Python.
            Only that one installs every backport.
    """
    oldest = setup_argument('python_requires').removeprefix('>=')
    version = '.'.join(map(str, sys.version_info[:2]))
    if version != oldest:
        raise ValueError(f'the lock file is made with CPython {oldest}, and this is {version}')
    requirements = [r for extra in ('', *EXTRAS) for r in needed()[extra]]
    versions = installed(requirements)
    names = {canonicalize_name(name) for name in versions}
    for requirement in requirements:
        if canonicalize_name(requirement.name) not in names:
            raise ValueError(f'{requirement.name} is not installed; {RENEW}')
    lines = [
        f'# Exact versions of disc_sim_ros[{",".join(EXTRAS)}] and all its dependencies, for',
        f'# CPython {version} and newer on Linux x86-64. `make setup` and `make test` install',
        '# these versions; `make lock` writes this file.',
    ]
    pins = (f'{name}=={versions[name]}' for name in sorted(versions, key=str.lower))
    return '\n'.join([*lines, *pins]) + '\n'


def pinned(text: str) -> dict[str, str]:
    """Return the versions of a lock file by canonical name."""
    pins = (line.partition('==') for line in text.splitlines() if not line.startswith('#'))
    return {canonicalize_name(name): version for name, _, version in pins}


def stale_pin(text: str) -> str:
    """Return why a lock file does not fit setup.py, in one line; '' if it does."""
    pins = pinned(text)
    for extra, requirements in needed().items():
        for requirement in requirements if extra in {'', *EXTRAS} else ():
            version = pins.get(canonicalize_name(requirement.name))
            if version is None:
                return f'setup.py needs {requirement}, which is not in the file; {RENEW}'
            if not requirement.specifier.contains(version, prereleases=True):
                return f'setup.py needs {requirement}, and the file has {version}; {RENEW}'
    return ''


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
    task = p.add_mutually_exclusive_group()
    task.add_argument('--write', action='store_true', help='write both files')
    task.add_argument('--check-lock', action='store_true', help='check the lock file alone')
    given = p.parse_args()
    if given.check_lock:
        reason = stale_pin(LOCK.read_text(encoding='utf-8'))
        sys.stderr.write(f'{LOCK.name} is stale: {reason}\n' if reason else '')
        return int(bool(reason))
    stale = []
    try:
        fresh = {PAGE: page(PAGE.read_text(encoding='utf-8')), LOCK: lock()}
    except ValueError as error:
        sys.stderr.write(f'dependencies: error: {error}\n')
        return 1
    for file, text in fresh.items():
        if not file.is_file() or file.read_text(encoding='utf-8') != text:
            stale.append(file.relative_to(ROOT))
            if given.write:
                file.write_text(text, encoding='utf-8')
    state = 'written' if given.write else 'out of date'
    sys.stdout.write(''.join(f'{file}: {state}\n' for file in stale) or 'up to date\n')
    return int(bool(stale) and not given.write)


if __name__ == '__main__':
    sys.exit(main())
