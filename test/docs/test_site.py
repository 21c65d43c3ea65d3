"""`make docs` builds the documentation site without a warning, and the site needs no network."""

from collections.abc import Iterator
import fcntl
from importlib.util import find_spec
from pathlib import Path
import re
import shutil
import subprocess
import sys

import pytest

from made_once import made_once

pytestmark = [
    pytest.mark.xdist_group('site'),  # one build for all
    pytest.mark.skipif(  # each test process would take half a second to import them
        None in map(find_spec, ('sphinx', 'myst_parser', 'furo')),
        reason='needs the extra [docs]: pip install -e .[docs]',
    ),
]

ROOT = Path(__file__).parents[2]
NO_API = "\nexec(open(r'{}').read())\napidoc_modules = []\n"
# What takes three quarters of the time of the build and gives no warnings of the pages: the theme,
# the sources as pages and where in them a function is, types in signatures (mypy reads them), the
# index of the search, the garbage collector. The site without reference below has all but the
# sources.
PLAIN = """
html_theme = 'basic'
extensions.remove('sphinx.ext.viewcode')
smartquotes = False
autodoc_typehints = 'none'
import gc, logging
from sphinx.builders.html import StandaloneHTMLBuilder
from sphinx.pycode.parser import DefinitionFinder
StandaloneHTMLBuilder.search = False
DefinitionFinder.parse = lambda self: None
logging.disable(logging.DEBUG)
gc.disable()
"""
OUTSIDE = re.compile(
    r'<(?:script|img|iframe|source)[^>]* src(?:set)?="https?:'
    r'|<link[^>]* rel="(?:stylesheet|preload)"[^>]* href="https?:'
)


def build(source: Path, target: Path, *more: object) -> subprocess.CompletedProcess[str]:
    """Run Sphinx with the options of `make docs`, and more."""
    (options,) = re.findall(r'-m sphinx (.*) docs build/docs', (ROOT / 'Makefile').read_text())
    return subprocess.run(
        [sys.executable, '-m', 'sphinx', *options.split(), *map(str, more), source, target],
        capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.fixture(scope='module')
def site() -> Iterator[Path]:
    """Return the folder of the site, built from a copy of docs/: Sphinx writes into its source.

    The copy stays for the next run of the tests, in which Sphinx reads only what has changed since
    then, and writes every page again: a link to a page that has gone fails. After a warning the
    copy is removed, or the next run would not read the page that gave it.
    """
    settings = (ROOT / 'docs/conf.py', ROOT / 'requirements-dev.lock', Path(__file__))
    content = b''.join(path.read_bytes() for path in settings)
    tree = made_once('site', content, link_sources)
    with (tree / 'lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # two test runs may come at once
        update(tree)
        shutil.rmtree(tree / 'build', ignore_errors=True)
        done = build(tree / 'docs', tree / 'build', '--write-all', '--doctree-dir', tree / 'read')
        if done.returncode:
            shutil.rmtree(tree)
        assert done.returncode == 0, done.stderr
        yield tree / 'build'


def link_sources(tree: Path) -> None:
    for name in ('disc_sim_ros', 'config'):
        (tree / name).symlink_to(ROOT / name)


def update(tree: Path) -> None:
    """Copy docs/ and the pages beside it into a tree; what is the same keeps its time."""
    names = ['CONTRIBUTING.md', 'CHANGELOG.rst']  # links in them are relative to their folder
    names += [
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / 'docs').rglob('*')
        if path.is_file() and not {'api', '__pycache__'} & set(path.relative_to(ROOT).parts)
    ]
    for path in (tree / 'docs').rglob('*'):
        name = path.relative_to(tree).as_posix()
        if path.is_file() and name not in names and not name.startswith('docs/api/'):
            path.unlink()
    for name in names:
        text = (ROOT / name).read_bytes() + (PLAIN.encode() if name == 'docs/conf.py' else b'')
        copy = tree / name
        if not copy.is_file() or copy.read_bytes() != text:
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(text)


@pytest.mark.slow
def test_every_page_is_in_the_site(site):
    for page in (ROOT / 'docs').glob('*.md'):
        assert (site / f'{page.stem}.html').is_file()
    index = (site / 'index.html').read_text(encoding='utf-8')
    assert 'href="deviations.html"' in index


@pytest.mark.slow
def test_the_reference_has_the_docstrings_of_functions_classes_and_kernels(site):
    for page, name, words in (
        ('physics.flight', 'disc_sim_ros.physics.flight.fly', 'Returns'),
        ('physics.launch', 'disc_sim_ros.physics.launch.Launch', 'Raises'),
        ('physics.kernels.equations', 'disc_sim_ros.physics.kernels.equations.derivative', ''),
    ):
        text = (site / f'api/disc_sim_ros.{page}.html').read_text(encoding='utf-8')
        assert f'id="{name}"' in text
        assert words in text


@pytest.mark.slow
def test_the_site_needs_no_network(site):
    assert len(list(site.rglob('*.html'))) > 50
    assert pages_that_load_from_outside(site) == []


def pages_that_load_from_outside(folder: Path) -> list[str]:
    pages = folder.rglob('*.html')
    return [page.name for page in pages if OUTSIDE.search(page.read_text(encoding='utf-8'))]


def test_a_broken_link_fails_the_build_and_the_theme_needs_no_network(tmp_path):
    (tmp_path / 'conf.py').write_text(NO_API.format(ROOT / 'docs/conf.py'), encoding='utf-8')
    index = tmp_path / 'index.md'
    index.write_text('# Title\n\n[a link](#title)\n', encoding='utf-8')
    good = tmp_path / 'good'
    assert build(tmp_path, good).returncode == 0
    assert list(good.rglob('furo*.css'))
    assert pages_that_load_from_outside(good) == []
    page = good / 'index.html'
    page.write_text(page.read_text(encoding='utf-8') + '<script src="https://x.js">')
    assert pages_that_load_from_outside(good) == ['index.html']
    index.write_text('# Title\n\n[a link](gone.md)\n', encoding='utf-8')
    done = build(tmp_path, tmp_path / 'bad')
    assert done.returncode == 1
    assert 'gone.md' in done.stderr
