"""The figures on the pages are those of the stored results."""

import csv
from dataclasses import replace
import importlib
from pathlib import Path
import re
import sys

import pytest

BENCHMARKS = Path(__file__).parents[2] / 'benchmarks'


@pytest.fixture
def pages(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    yield importlib.import_module('pages')
    for name in ('lines', 'pages', 'run'):  # other folders have files with these names
        sys.modules.pop(name, None)


@pytest.fixture
def run(pages):
    return pages.loaded(pages.RESULTS.read_text(encoding='utf-8'))


@pytest.mark.parametrize('name', ['docs/benchmarks.md', 'README.md'])
def test_a_page_shows_the_stored_results(pages, run, name):
    page = pages.ROOT / name
    section = pages.section(run, short=pages.PAGES[page])
    text = page.read_text(encoding='utf-8')
    assert pages.between(text) == section
    assert pages.replaced(text, section) == text


def test_results_are_equal_after_saving_and_loading(pages, run):
    assert pages.loaded(pages.saved(run)) == run
    names = {Path(result.command.split()[0]).stem for result in run.results}
    assert names == set(importlib.import_module('run').BENCHMARKS)


def test_every_command_names_a_file(run):
    for result in run.results:
        assert (BENCHMARKS.parent / result.command.split()[0]).is_file()


def test_readme_shows_three_lines(pages, run):
    assert sum(line.short for result in run.results for line in result.lines) == 3
    readme = (pages.ROOT / 'README.md').read_text(encoding='utf-8')
    assert pages.between(readme).count('\n- ') == 2
    assert pages.between(readme).startswith('- ')


def test_a_short_line_names_result_and_peer(pages, run):
    line = next(line for result in run.results for line in result.lines if line.short)
    item = ' '.join(pages.item(line).split())
    assert item == f'- {line.what}: {line.ours}; peer: {line.beside}'
    assert pages.item(replace(line, beside='')).endswith(line.ours[-10:])


def test_the_page_gives_the_errors_of_the_stored_curves(pages):
    """For 90 rad/s and steps of 1 ms."""
    with (pages.ROOT / 'docs/steps.csv').open(encoding='utf-8') as file:
        rows = [row for row in csv.DictReader(file) if row['step_s'] == '0.001']
    number = importlib.import_module('lines').number
    errors = {r['axes']: number(float(r['error_m']) * 1e3, 1) for r in rows if '90' in r['launch']}
    sentence = '{despun} mm instead of {spinning} and {spinning_uvw} mm'.format(**errors)
    assert sentence in ' '.join((pages.ROOT / 'docs/benchmarks.md').read_text().split())


def test_the_page_says_how_many_more_steps_spinning_axes_need(pages, run):
    lines = [
        line for result in run.results if 'steps.py' in result.command for line in result.lines
    ]
    (fast,) = [line for line in lines if '90 rad/s' in line.what]
    steps = [float(ms) for ms in re.findall(r'([\d.]+) ms steps', f'{fast.ours} {fast.beside}')]
    more = [round(steps[0] / step) for step in steps]
    sentence = 'axes need {1} times as many steps at 90 rad/s, and the printed equations {2} times'
    text = ' '.join((pages.ROOT / 'docs/benchmarks.md').read_text(encoding='utf-8').split())
    assert sentence.format(*more) in text


def test_a_bound_that_is_not_kept_is_marked(pages, run):
    line = replace(run.results[0].lines[0], bound='at most 3', kept=False)
    missed = replace(run, results=(replace(run.results[0], lines=(line,)),))
    assert '| at most 3: **not kept** |' in pages.section(missed, short=False)
    assert pages.bound(replace(line, kept=None)) == 'at most 3: not measured'


def test_only_the_text_between_the_markers_changes(pages):
    page = f'a\n{pages.BEGIN}\nold\n{pages.END}\nb\n'
    assert pages.replaced(page, 'new') == page.replace('old', 'new')
    for broken in ('', page.replace(pages.END, ''), page + page):
        with pytest.raises(ValueError, match='a page needs one'):
            pages.replaced(broken, 'new')


@pytest.mark.parametrize(
    ('value', 'digits', 'text'),
    [
        (0.0, 2, '0'),
        (9716.7, 2, '9,700'),
        (55.84, 2, '56'),
        (2.68, 2, '2.7'),
        (0.0803, 3, '0.0803'),
        (99.6, 2, '100'),
        (2.3e-5, 1, '2e-05'),
    ],
)
@pytest.mark.usefixtures('pages')
def test_figures_are_rounded_to_a_few_digits(value, digits, text):
    assert importlib.import_module('lines').number(value, digits) == text
