"""The drawings of docs/axes.md show what the equations do, and belong to their script."""

import importlib.util
import math
from pathlib import Path
import re

from matplotlib.image import imread
import numpy as np
import pytest

from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels import equations
from docs.pages import DOCS


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
    """Return a function that draws and returns vectors of arrows and points of arcs by label."""
    shapes: dict[str, np.ndarray] = {}
    arrow, arc = make_axes.Drawing.arrow, make_axes.Drawing.arc

    def keep_arrow(self, start, vector, color, label='', **kwargs):
        shapes[label] = np.asarray(vector) / np.linalg.norm(vector)
        arrow(self, start, vector, color, label, **kwargs)

    def keep_arc(self, points, color, label='', **kwargs):
        shapes[label] = points
        arc(self, points, color, label, **kwargs)

    def draw(function, *pages):
        shapes.clear()
        function(*pages)
        return dict(shapes)

    monkeypatch.setattr(make_axes.Drawing, 'arrow', keep_arrow)
    monkeypatch.setattr(make_axes.Drawing, 'arc', keep_arc)
    return draw


@pytest.fixture
def page(make_axes):
    return make_axes.Figure().add_subplot()


def sense(points: np.ndarray) -> np.ndarray:
    """Return the unit vector of the rotation of a curved arrow, by the right-hand rule."""
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
    assert np.allclose(view['$y_3$'], F / np.linalg.norm(F))  # its label is C_Side as well
    assert np.allclose(view['$y$'], -view['$y_3$'])
    assert np.allclose(sense(view['$r, C_N$']), (0.0, 0.0, 1.0))


def test_the_disc_is_drawn_with_its_axes(make_axes, drawn, page):
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
    """Return a folder with new drawings, and their names."""
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


# matplotlib leaves out points within a ninth of a pixel of a line (path.simplify_threshold). Which
# ones, the last bit of a sine may decide, and so the processor.
SIMPLIFIED = 1 / 9


def test_the_drawings_are_those_of_the_script(made):
    folder, names = made
    for name in names:
        (version, new), (kept_version, kept) = (
            svg_outlines(where / f'{name}.svg') for where in (folder, DOCS)
        )
        if version != kept_version:  # another matplotlib may draw otherwise
            continue
        assert len(new) == len(kept), f'{name}: run docs/make_axes.py'
        for a, b in zip(new, kept, strict=True):
            if a.shape == b.shape:
                assert np.allclose(a, b, atol=0.01), f'{name}: run docs/make_axes.py'
            else:
                assert apart(a, b) < SIMPLIFIED + 0.01, f'{name}: run docs/make_axes.py'


def test_the_comparison_of_drawings_notices_another_outline():
    square = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    with_a_point_more = np.insert(square, 1, [5.0, 0.05], axis=0)
    assert apart(square, with_a_point_more) == pytest.approx(0.05)
    with_a_corner_more = np.insert(square, 1, [5.0, 0.5], axis=0)
    assert apart(with_a_corner_more, square) == pytest.approx(0.5)


def svg_outlines(path: Path) -> tuple[str, list[np.ndarray]]:
    """Return the program that wrote a drawing, and the points of each outline, shape (n, 2)."""
    text = path.read_text(encoding='utf-8')
    outlines = [
        np.array(re.findall(r'-?\d+\.?\d*', outline), dtype=float).reshape(-1, 2)
        for outline in re.findall(r' d="([^"]+)"', text)
    ]
    return re.search(r'Matplotlib v\S+', text)[0], outlines


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest distance of the points of each outline from the other outline."""
    return max(distance(a, b), distance(b, a))


def distance(points: np.ndarray, line: np.ndarray) -> float:
    """Return the largest distance of points from the line through other points."""
    start, step = line[:-1], np.diff(line, axis=0)
    length2 = np.maximum((step**2).sum(axis=1), 1e-30)
    away = points[:, None] - start
    part = np.clip((away * step).sum(axis=-1) / length2, 0.0, 1.0)
    return float(np.linalg.norm(away - part[..., None] * step, axis=-1).min(axis=1).max())
