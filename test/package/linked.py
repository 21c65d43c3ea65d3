"""Environments for one installation: symlinks to packages that another environment has."""

from collections.abc import Collection
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
    linked, others = set(), set()
    for name, paths in owned.items():
        (linked if name in names else others).update(paths)
    shared = folders_of(others)
    shared.update(folder for folder in folders_of(linked) if (prefix / folder).is_dir())
    for path in {highest(path, shared) for path in linked}:
        (prefix / path).parent.mkdir(parents=True, exist_ok=True)
        (prefix / path).symlink_to(source / path)


@functools.cache
def paths_of(prefix: Path) -> dict[str, set[Path]]:
    """Return the files of each package in an environment, except programs, by canonical name."""
    (site,) = (prefix / 'lib').glob('python3*/site-packages')
    inside = site.relative_to(prefix)
    owned: dict[str, set[Path]] = {}
    for one in distributions(path=[str(site)]):
        paths = owned.setdefault(canonicalize_name(one.name), set())
        for path in one.files or ():
            top, *rest = os.path.normpath(inside / path).split('/')
            if top != 'bin':
                paths.add(Path('lib' if top == 'lib64' else top, *rest))  # lib64 is a link to lib
    return owned


def folders_of(paths: Collection[Path]) -> set[Path]:
    """Return all folders on the way to some paths."""
    parents = {path.parent for path in paths}
    return parents | {folder for parent in parents for folder in parent.parents}


def highest(path: Path, shared: Collection[Path]) -> Path:
    """Return the outermost folder of a path that is not shared, or the path itself."""
    if path.parent in shared:
        return path
    return next(folder for folder in reversed(path.parents) if folder not in shared)
