"""Environments for one installation: symlinks to packages that another environment has."""

from collections.abc import Collection
import csv
import functools
from importlib.metadata import distribution, distributions
import os
from pathlib import Path
import sys
import venv

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from package.sources import PACKAGE


def requirements(extra: str) -> set[str]:
    """Return the names of all packages that this one with an extra needs, also indirectly."""
    names: set[str] = set()
    wanted = [Requirement(f'{PACKAGE}[{extra}]')]
    while wanted:
        needed = wanted.pop()
        extras = needed.extras or {''}
        for line in distribution(needed.name).requires or ():
            one = Requirement(line)
            if one.marker is None or any(one.marker.evaluate({'extra': e}) for e in extras):
                name = canonicalize_name(one.name)
                if name not in names or one.extras:
                    wanted.append(one)
                names.add(name)
    return names


def make(prefix: Path) -> None:
    """Make an empty virtual environment with this Python, without pip."""
    venv.create(prefix, symlinks=True)


def link(prefix: Path, names: Collection[str], source: Path = Path(sys.prefix)) -> None:
    """Give an environment the packages that another one has, by symlinks.

    Linking takes a tenth of a second, unpacking the packages takes ten; their compiled modules
    are shared. Programs of bin/ are left out: their first line names the Python of the source.
    Of a folder that is there already, or in which another package has files, only the content is
    linked.

    Args:
        prefix: The environment that gets them.
        names: Canonical names of packages.
        source: The environment that has them.

    Raises:
        LookupError: The source has not all of the packages.
    """
    owned = paths_of(source)
    if missing := set(names) - set(owned):
        raise LookupError(f'{source} has no {sorted(missing)}')
    linked: set[str] = set()
    others: set[str] = set()
    for name, paths in owned.items():
        (linked if name in names else others).update(paths)
    shared = folders_of(others)
    shared.update(one for one in folders_of(linked) if (prefix / one).is_dir())
    for path in {highest(path, shared) for path in linked}:
        (prefix / path).parent.mkdir(parents=True, exist_ok=True)
        (prefix / path).symlink_to(source / path)


@functools.cache
def paths_of(prefix: Path) -> dict[str, set[str]]:
    """Return the files of each package in an environment, except programs, by canonical name.

    There are 30,000; as paths in place of strings they would take a second.
    """
    (site,) = (prefix / 'lib').glob('python3*/site-packages')
    inside = site.relative_to(prefix).as_posix()
    owned: dict[str, set[str]] = {}
    for one in distributions(path=[str(site)]):
        paths = owned.setdefault(canonicalize_name(one.name), set())
        for name, *_ in csv.reader((one.read_text('RECORD') or '').splitlines()):
            top, slash, rest = os.path.normpath(f'{inside}/{name}').partition('/')
            if top != 'bin':  # lib64 is a link to lib
                paths.add(f'{"lib" if top == "lib64" else top}{slash}{rest}')
    return owned


def folders_of(paths: Collection[str]) -> set[str]:
    """Return all folders on the way to some paths; '' is the environment itself."""
    folders = set()
    for path in paths:
        folder = path.rpartition('/')[0]
        while folder not in folders:
            folders.add(folder)
            folder = folder.rpartition('/')[0]
    return folders


def highest(path: str, shared: Collection[str]) -> str:
    """Return the outermost folder of a path that is not shared, or the path itself."""
    parts = path.split('/')
    for number in range(1, len(parts)):
        folder = '/'.join(parts[:number])
        if folder not in shared:
            return folder
    return path
