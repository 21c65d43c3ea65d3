"""Environments for one installation: symlinks to packages that another environment has."""

from collections.abc import Collection, Iterable
from importlib.metadata import Distribution, distribution, distributions
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
    site = site_packages(source)
    present, linked, others = set(), set(), set()
    for one in distributions(path=[str(site)]):
        name = canonicalize_name(one.name)
        paths = files(one, site, source)
        if name in names:
            present.add(name)
            linked.update(paths)
        else:
            others.update(paths)
    if missing := set(names) - present:
        raise LookupError(f'{source} has no {sorted(missing)}')
    shared = {folder for path in others for folder in path.parents}
    shared.update(
        folder for path in linked for folder in path.parents if (prefix / folder).is_dir()
    )
    for path in {highest(path, shared) for path in linked}:
        (prefix / path).parent.mkdir(parents=True, exist_ok=True)
        (prefix / path).symlink_to(source / path)


def site_packages(prefix: Path) -> Path:
    """Return the folder of an environment from which Python imports."""
    return next((prefix / 'lib').glob('python3*/site-packages'))


def files(one: Distribution, site: Path, prefix: Path) -> Iterable[Path]:
    """Yield the paths of an installed package in its environment, except programs."""
    for path in one.files or ():
        top, *rest = Path(os.path.normpath(site / path)).relative_to(prefix).parts
        if top != 'bin':
            yield Path('lib' if top == 'lib64' else top, *rest)  # lib64 is a link to lib


def highest(path: Path, shared: Collection[Path]) -> Path:
    """Return the outermost folder of a path that is not shared, or the path itself."""
    return next((folder for folder in reversed(path.parents) if folder not in shared), path)
