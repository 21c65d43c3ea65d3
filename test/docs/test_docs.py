"""What the documentation says is so: examples run, names exist, links lead somewhere.

A ```text block right after a ```python block is what that example prints. Other languages, and
python that must not run, take another word after the fence.
"""

from collections.abc import Iterator
import contextlib
import dataclasses
from functools import cached_property
import importlib.util
import inspect
import io
import math
from pathlib import Path
import re
from typing import NamedTuple
from urllib.parse import unquote
import warnings

from matplotlib.image import imread
import numpy as np
import pytest

from disc_sim_ros.analysis import flight_report
from disc_sim_ros.cli import fly as fly_command
from disc_sim_ros.cli.fly import parser
from disc_sim_ros.physics import disc, disc_file, environment, frames, theory
from disc_sim_ros.physics.flight import Flight, Setup, fly
from disc_sim_ros.physics.kernels import aerodynamics, equations
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.trajectory import Trajectory
from disc_sim_ros.quantities import LAUNCH

ROOT = Path(__file__).parents[2]
DOCS = ROOT / 'docs'
PAGES = sorted(DOCS.glob('*.md')) + [ROOT / 'README.md'] * (ROOT / 'README.md').exists()
LINKING = PAGES + sorted(ROOT.glob('CHANGELOG*'))


# ---- examples ----


class Block(NamedTuple):
    kind: str  # the word after the fence
    first: int  # line number of its first line, from 1
    last: int  # line number of the closing fence
    text: str


def blocks(text: str) -> Iterator[Block]:
    """Yield the fenced blocks of a page, without the indent of their fence."""
    opened = None
    for number, line in enumerate(text.splitlines(), start=1):
        fence = re.match(r'( *)(`{3,}|~{3,})([^`]*)$', line)
        if opened is None and fence:
            indent, marks, kind = fence.groups()
            opened, body = (indent, marks, kind.strip(), number), []
        elif opened is not None and fence and fence[2].startswith(opened[1]) and not fence[3]:
            yield Block(opened[2], opened[3] + 1, number, '\n'.join(body) + '\n')
            opened = None
        elif opened is not None:
            body.append(line.removeprefix(opened[0]))
    assert opened is None, f'the block of line {opened[3]} never ends'


def run_examples(text: str, name: str) -> str:
    """Run the examples of a page one after the other in one namespace; return what they print."""
    namespace = {'__name__': '__example__'}
    lines, found, printed = text.splitlines(), list(blocks(text)), ''
    for i, block in enumerate(found):
        if block.kind != 'python':
            continue
        source = '\n' * (block.first - 1) + block.text  # tracebacks show the line of the page
        with contextlib.redirect_stdout(io.StringIO()) as out, warnings.catch_warnings():
            warnings.simplefilter('error')
            exec(compile(source, name, 'exec'), namespace)
        after = found[i + 1] if i + 1 < len(found) else None
        if after and after.kind == 'text' and not ''.join(lines[block.last : after.first - 2]):
            assert out.getvalue().rstrip() == after.text.rstrip(), f'{name}, line {after.first}'
        printed += out.getvalue()
    return printed


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_examples_run_and_print_what_the_page_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('MPLBACKEND', 'agg')
    run_examples(page.read_text(encoding='utf-8'), str(page))


def fly_examples(text: str) -> list[tuple[str, str]]:
    """Return flags and output of each sh block that has one `fly` and a text block after it."""
    pairs = zip(found := list(blocks(text)), found[1:], strict=False)
    return [
        (block.text.removeprefix('.venv/bin/fly').strip(), after.text)
        for block, after in pairs
        if block.kind == 'sh' and after.kind == 'text' and after.first - block.last < 4
        if block.text.startswith('.venv/bin/fly') and block.text.count('\n') == 1
    ]


@pytest.mark.parametrize('page', [DOCS / 'fly.md', ROOT / 'README.md'], ids=lambda p: p.name)
def test_fly_prints_what_the_page_says(page, capsys):
    (example,) = fly_examples(page.read_text(encoding='utf-8'))
    assert fly_command.main(example[0].split()) == 0
    assert capsys.readouterr().out.rstrip() == example[1].rstrip()


@pytest.mark.parametrize(
    ('example', 'error'),
    [
        ('```python\n1 / 0\n```\n', ZeroDivisionError),
        ('```python\nimport warnings\nwarnings.warn("old")\n```\n', UserWarning),
        ('```python\nprint(1)\n```\n\n```text\n2\n```\n', AssertionError),
        ('- x\n  ```python\n  y = 1\n  assert y == 2\n  ```\n', AssertionError),
        ('```python\nprint(1)\n', AssertionError),
    ],
)
def test_a_false_example_is_noticed(example, error):
    with pytest.raises(error):
        run_examples(example, 'page')


def test_each_page_has_its_own_namespace_and_each_example_its_output():
    page = '```python\nx = 1\n```\n\n```python\nprint(x)\n```\n\n```text\n1\n```\n'
    assert run_examples(page, 'page') == '1\n'
    with pytest.raises(NameError):
        run_examples('```python\nprint(x)\n```\n', 'page')


def test_signs_at_a_glance_are_what_the_examples_print():
    text = (DOCS / 'axes.md').read_text(encoding='utf-8')
    glance = text.partition('## Signs at a glance')[2]
    stated = re.findall(r'`([\w.]+ = [^`]+)`', glance)
    printed = run_examples(text, 'axes.md').splitlines()
    assert len(stated) > 15
    assert [line for line in stated if line not in printed] == []
    rows = [row for row in glance.splitlines() if row.startswith('| ')][1:]
    assert [row for row in rows if ' = ' not in row and 'C_Side' not in row] == []


# ---- symbols ----

SYMBOLS = (DOCS / 'symbols.md').read_text(encoding='utf-8')
CODE, ELSEWHERE, UNIT = 2, 3, 4  # columns
COMPLETE = {
    equations: ['State', 'Plant', 'Velocity', 'Control', 'Flow', 'Coefficients', 'Moment'],
    aerodynamics: ['Linear'],
    disc: ['Disc', 'LinearAero', 'AeroTable', 'SpinTable'],
    environment: ['Air', 'Wind'],
}


def rows() -> list[list[str]]:
    """Return the cells of the tables that have a column of code."""
    cells = [
        [cell.strip() for cell in line.strip('|').split('|')]
        for line in SYMBOLS.splitlines()
        if line.startswith('|')
    ]
    return [row for row in cells if len(row) == 6 and row[CODE] not in {'code', '---'}]


def names_in(cell: str) -> list[str]:
    return re.findall(r'`([^`]+)`', cell)


def fields_of(cls: type) -> list[str]:
    if dataclasses.is_dataclass(cls):
        return [field.name for field in dataclasses.fields(cls)]
    return list(cls._fields)


def properties_of(cls: type) -> list[str]:
    return [n for n, v in vars(cls).items() if isinstance(v, property | cached_property)]


def exists(name: str) -> bool:
    """Say whether `module.function` or `module.Class.field` is in physics or its kernels."""
    module, *path = name.split('.')
    places = ('disc_sim_ros.physics', 'disc_sim_ros.physics.kernels')
    full = next(
        (f'{p}.{module}' for p in places if importlib.util.find_spec(f'{p}.{module}')), None
    )
    if not path or full is None:
        return False
    thing = importlib.import_module(full)
    for i, part in enumerate(path):
        if isinstance(thing, type):
            last = i == len(path) - 1
            return last and part in fields_of(thing) + properties_of(thing)
        thing = getattr(thing, part, None)
        if thing is None:
            return False
    return True


def documented() -> set[str]:
    return {name for row in rows() for name in names_in(row[CODE])}


def elsewhere(word: str) -> set[str]:
    """Return the names that follow a word such as YAML in the column of other carriers."""
    return {name for row in rows() for name in re.findall(rf'{word} `([^`]+)`', row[ELSEWHERE])}


def test_every_table_row_is_whole():
    tables = [line for line in SYMBOLS.splitlines() if line.startswith('|')]
    widths = {len(line.strip('|').split('|')) for line in tables}
    assert widths == {3, 6}  # the last table names what has no code
    assert len(rows()) > 80
    assert [row for row in rows() if not all(row)] == []


def test_every_name_in_the_code_column_exists():
    assert sorted(name for name in documented() if not exists(name)) == []


def test_every_other_name_of_a_module_exists():
    modules = {path.stem for path in (ROOT / 'disc_sim_ros' / 'physics').rglob('*.py')}
    dotted = {n for n in names_in(SYMBOLS) if n.split('.')[0] in modules and '.' in n}
    classes = {'equations.State', 'equations.Moment', 'equations.Coefficients'}
    assert sorted(n for n in dotted if not exists(n) and n not in classes) == []


@pytest.mark.parametrize(
    'name', ['equatons.State.X', 'equations.State.W', 'equations.State.count', 'theory.gone',
             'disc.Disc.weight', 'launch'],
)  # fmt: skip
def test_a_name_that_is_not_there_is_noticed(name):
    assert not exists(name)


@pytest.mark.parametrize(
    'cls', [getattr(m, n) for m, names in COMPLETE.items() for n in names]
    + [Launch, Setup, Flight, Trajectory],
    ids=lambda cls: cls.__name__,
)  # fmt: skip
def test_no_field_is_missing(cls):
    module = cls.__module__.rpartition('.')[2]
    wanted = fields_of(cls) + (properties_of(cls) if cls in {Flight, Trajectory} else [])
    assert wanted
    missing = [n for n in wanted if f'{module}.{cls.__name__}.{n}' not in documented()]
    assert missing == []


def test_no_derived_quantity_is_missing():
    functions = {
        name
        for name, value in vars(theory).items()
        if inspect.isfunction(value) and value.__module__ == theory.__name__
    }
    assert {f'theory.{name}' for name in functions if name[0] != '_'} <= documented()


def test_flags_of_fly_exist_and_those_of_a_launch_are_all_there():
    known = {flag for action in parser()._actions for flag in action.option_strings}
    flags = {n for row in rows() for n in names_in(row[ELSEWHERE]) if n.startswith('--')}
    assert flags - known == set()
    launched = next(g for g in parser()._action_groups if g.title == 'launch')
    assert {flag for a in launched._group_actions for flag in a.option_strings} <= flags


def test_yaml_keys_are_those_of_the_catalogue():
    properties = {*disc_file._PROPERTIES, 'description', 'based_on', 'aero'}
    sections = {f'{s}.{key}' for s, keys in disc_file._SECTIONS.items() for key in keys}
    assert elsewhere('YAML') == properties | sections


def test_json_keys_are_those_of_fly():
    flight = fly(Launch(), Setup(disc=disc_file.load_disc('frisbee')), sample_rate=2.0)
    document = flight_report.document(flight)
    of_no_quantity = {'version', 'wind'}  # `wind` holds the fields of Wind under their own names
    known = set(document) | set(document['launch'])
    assert elsewhere('JSON') == known - of_no_quantity


def test_units_of_a_launch_are_its_own():
    units = {
        name.removeprefix('launch.Launch.'): row[UNIT]
        for row in rows()
        for name in names_in(row[CODE])
        if name.startswith('launch.Launch.')
    }
    assert units == {q.name: q.unit for q in LAUNCH.values()}


# ---- links ----


def links(page: Path, text: str) -> list[str]:
    """Return the targets of a Markdown or reStructuredText page, without those of the web."""
    if page.suffix == '.rst':
        found = re.findall(r'<([^<>\s]+)>`__?|^\.\. (?:image|figure|include):: (\S+)', text, re.M)
        targets = [first or second for first, second in found]
    else:
        inside = set()
        for block in blocks(text):
            inside.update(range(block.first - 1, block.last + 1))
        lines = [line for n, line in enumerate(text.splitlines(), 1) if n not in inside]
        prose = re.sub(r'`[^`]*`', '', '\n'.join(lines))
        targets = re.findall(r'\]\(<?([^)>\s]+)', prose)
        targets += re.findall(r'^\[[^\]]+\]: *(\S+)', prose, re.M)
        targets += re.findall(r'(?:src|srcset|href)="([^"]+)"', prose)
    return [t for t in targets if not re.match(r'[a-z][a-z+.-]*:', t)]


def headings(page: Path) -> set[str]:
    """Return the anchors that GitHub makes of a page's headings."""
    titles = re.findall(r'^#+ (.*)$', page.read_text(encoding='utf-8'), re.M)
    return {re.sub(r'[^\w\- ]', '', t.lower()).replace(' ', '-') for t in titles}


def broken(page: Path, text: str) -> list[str]:
    found = []
    for target in links(page, text):
        path, _, anchor = target.partition('#')
        file = page.parent / unquote(path) if path else page
        lost = not file.exists() or ROOT not in [file.resolve(), *file.resolve().parents]
        if lost or (anchor and file.suffix == '.md' and anchor not in headings(file)):
            found.append(target)
    return found


@pytest.mark.parametrize('page', LINKING, ids=lambda page: page.name)
def test_links_and_images_exist(page):
    assert broken(page, page.read_text(encoding='utf-8')) == []


@pytest.mark.parametrize(
    ('page', 'text', 'lost'),
    [
        ('docs/axes.md', '[a](gone.md) [b](axes.md) `[c](no.md)`', ['gone.md']),
        ('docs/axes.md', '[![a](gone.png)](symbols.md)', ['gone.png']),
        ('docs/axes.md', '[a](#the-flow) [b](#no-such)', ['#no-such']),
        ('docs/axes.md', '<img src="gone.svg"> [w](https://example.org/x)', ['gone.svg']),
        ('docs/axes.md', '[a][b]\n\n[b]: gone.md', ['gone.md']),
        ('docs/axes.md', '```sh\n[a](gone.md)\n```\n[b](../../outside.md)', ['../../outside.md']),
        ('CHANGELOG.rst', '`a <gone.md>`_ `b <docs/axes.md>`_', ['gone.md']),
    ],
)
def test_a_broken_link_is_noticed(page, text, lost):
    assert broken(ROOT / page, text) == lost


# ---- drawings ----


def load_make_axes():
    spec = importlib.util.spec_from_file_location('make_axes', DOCS / 'make_axes.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def make_axes():
    return load_make_axes()


@pytest.fixture
def drawn(make_axes, monkeypatch):
    """What the drawings show, per drawing: arrows as vectors, arcs as points, by their labels."""
    seen: dict[str, np.ndarray] = {}
    arrow, arc = make_axes.Drawing.arrow, make_axes.Drawing.arc

    def keep_arrow(self, start, vector, color, label='', **kwargs):
        seen[label] = np.asarray(vector) / np.linalg.norm(vector)
        arrow(self, start, vector, color, label, **kwargs)

    def keep_arc(self, points, color, label='', **kwargs):
        seen[label] = points
        arc(self, points, color, label, **kwargs)

    def draw(function, *pages):
        seen.clear()
        function(*pages)
        return dict(seen)

    monkeypatch.setattr(make_axes.Drawing, 'arrow', keep_arrow)
    monkeypatch.setattr(make_axes.Drawing, 'arc', keep_arc)
    return draw


@pytest.fixture
def page(make_axes):
    return make_axes.Figure().add_subplot()


def sense(points: np.ndarray) -> np.ndarray:
    """Return the unit vector about which a curved arrow turns by the right-hand rule."""
    axis = np.cross(points[1] - points[0], points[-1] - points[-2])
    return axis / np.linalg.norm(axis)


def flying(velocity: np.ndarray, theta: float) -> equations.State:
    e = frames.quaternion_from_euler(0.0, theta, 0.0)
    return equations.State(0.0, 0.0, 0.0, *(10.0 * velocity), *e, 0.0, 0.0, 30.0, 0.0)


STILL = equations.Velocity(0.0, 0.0, 0.0)


def test_the_side_view_draws_what_the_equations_do(make_axes, drawn, page):
    view = drawn(make_axes.from_the_right, page)
    x_3 = view['$x_3$']
    theta = math.degrees(math.atan2(-x_3[2], x_3[0]))
    s = flying(view['$x_4$'], theta)
    a = equations.flow(s, STILL)
    start, *_, end = view['$\\alpha$'] / np.linalg.norm(view['$\\alpha$'], axis=1)[:, None]
    assert np.allclose(start, x_3)
    assert np.allclose(end, view['$x_4$'])
    assert math.isclose(a.alpha, math.acos(start @ end))

    plant = Setup(disc=disc_file.load_disc('frisbee')).plant
    nothing = equations.Coefficients(0.0, 0.0, 0.0, 0.0, 0.0)
    e = s[6:10]
    for label, name in (('$C_{Lift}$', 'Lift'), ('$C_{Drag}$', 'Drag')):
        F = frames.earth_from_body(e, equations.force(a, nothing._replace(**{name: 1.0}), plant))
        assert np.allclose(view[label], F / np.linalg.norm(F))
    m = equations.moment(a, s, nothing, plant, equations.Control(C_M=1.0))
    M = np.array(frames.earth_from_body(e, (m.L, m.M, 0.0)))
    assert np.allclose(sense(view['$C_M$']), M / np.linalg.norm(M))


def test_the_view_from_above_draws_what_the_equations_do(make_axes, drawn, page):
    view = drawn(make_axes.from_above, page)
    s = flying(view['$x_3 = x$'], 0.0)
    a = equations.flow(s, STILL)
    assert np.allclose(view['$x_3 = x$'], (a.d_x, a.d_y, 0.0))
    assert np.allclose(
        view['$\\beta$'][-1] / np.linalg.norm(view['$\\beta$'][-1]), (a.d_x, a.d_y, 0)
    )
    plant = Setup(disc=disc_file.load_disc('frisbee')).plant
    F = equations.force(a, equations.Coefficients(0.0, 0.0, 1.0, 0.0, 0.0), plant)
    assert np.allclose(view['$y_3$'], F / np.linalg.norm(F))  # C_Side is written beside it
    assert np.allclose(view['$y$'], -view['$y_3$'])
    assert np.allclose(sense(view['$r, C_N$']), (0.0, 0.0, 1.0))


def test_the_disc_is_drawn_as_the_axes_say(make_axes, drawn, page):
    view = drawn(make_axes.scene, page)
    x, y, z = view['$x_2 = x$'], view['$y_2$'], view['$z_2$']
    assert np.allclose(np.cross(x, y), z)
    assert z[2] > 0.0
    assert np.allclose(view['$z$'], -z)
    assert np.allclose(sense(view['$r > 0$']), z)
    assert np.allclose(sense(view['$\\sigma$']), z)


@pytest.mark.parametrize(
    ('drawing', 'labels', 'positive'),
    [
        ('yaw', ('$\\psi$', '$X_1$', '$x_2$'), {'psi': 1.0}),
        ('pitch', ('$\\theta$', '$X_1$', '$x_2$'), {'theta': 1.0}),
        ('roll', ('$\\phi$', '$Y_1$', '$y_2$'), {'phi': 1.0}),
    ],
)
def test_angles_are_drawn_from_the_old_axis_to_the_new(three_angles, drawing, labels, positive):
    view = three_angles[drawing]
    points, start, end = (view[label] for label in labels)
    assert np.allclose(points[0] / np.linalg.norm(points[0]), start)
    assert np.allclose(points[-1] / np.linalg.norm(points[-1]), end, atol=1e-9)
    _, *about = frames.quaternion_from_euler(**{'phi': 0.0, 'theta': 0.0, 'psi': 0.0, **positive})
    assert np.allclose(sense(points), about / np.linalg.norm(about))


@pytest.fixture
def three_angles(make_axes, drawn, page):
    return {name: drawn(getattr(make_axes, name), page) for name in ('yaw', 'pitch', 'roll')}


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """A folder with newly made drawings, and their names."""
    module = load_make_axes()
    folder = tmp_path_factory.mktemp('drawings')
    module.main(folder)
    return folder, list(module.DRAWINGS)


def test_the_drawings_are_wide_enough_and_on_white(made):
    folder, names = made
    for name in names:
        png = imread(folder / f'{name}.png')
        assert png.shape == imread(DOCS / f'{name}.png').shape
        assert png.shape[1] == 1600
        assert np.all(png[..., 3] == 1.0)
        assert np.all(png[[0, 0, -1, -1], [0, -1, 0, -1]] == 1.0)


def test_the_drawings_are_those_of_the_script(made):
    folder, names = made
    for name in names:
        new, old = (svg_paths(where / f'{name}.svg') for where in (folder, DOCS))
        if new[0] == old[0]:  # another matplotlib may draw otherwise
            assert len(new[1]) == len(old[1]), f'{name}: run docs/make_axes.py'
            assert np.allclose(new[1], old[1], atol=0.01), f'{name}: run docs/make_axes.py'


def svg_paths(path: Path) -> tuple[str, np.ndarray]:
    """Return which program wrote a drawing, and the numbers of all its outlines."""
    text = path.read_text(encoding='utf-8')
    outlines = ' '.join(re.findall(r' d="([^"]*)"', text))
    numbers = np.array(re.findall(r'-?\d+\.?\d*', outlines), dtype=float)
    return re.search(r'Matplotlib v\S+', text)[0], numbers
