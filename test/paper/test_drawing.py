"""Drawing of the figures: labels, captions, equal scales, colours and discs."""

import io

import matplotlib as mpl
import numpy as np
from PIL import Image
import pytest

from disc_sim_ros.paper import conditions, style
from disc_sim_ros.paper.style import DARK, LIGHT, LOOKS
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from paper.computed_figures import FIGURES, computed

pytestmark = pytest.mark.xdist_group('figures')  # computed once


@pytest.mark.parametrize('key', FIGURES)
def test_each_figure_names_damping_and_moment_axes_and_labels_its_axes(key):
    paper_figure = FIGURES[key]
    assert 'damping' in paper_figure.conditions
    assert 'axes 3' in paper_figure.conditions
    figure = paper_figure.plot(computed(key), LIGHT)
    written = ' '.join(text.get_text() for text in figure.texts)
    assert paper_figure.title in written
    assert paper_figure.conditions in written  # in the picture itself
    for text in figure.texts:  # title and conditions are not cut off
        assert text.get_window_extent(figure.canvas.get_renderer()).x1 < figure.bbox.x1
    for axis in figure.axes:
        shared = not axis.xaxis.get_tick_params()['labelbottom']
        assert axis.get_ylabel()
        assert axis.get_xlabel() or shared
    findings = paper_figure.findings(computed(key))
    assert findings
    assert all(finding.endswith('.') for finding in findings)


@pytest.mark.parametrize('key', ['4', '5', '6', '9', '10', '11', '12'])
def test_paths_have_equal_scales_and_discs(key):
    figure = FIGURES[key].plot(computed(key), DARK)
    views = [axis for axis in figure.axes if 'X' in axis.get_xlabel() or key == '9']
    assert len(views) >= 2
    stretched = [axis for axis in views if 'times larger' in axis.get_title('left')]
    assert len(stretched) == (key == '6')  # panel d says by how much
    assert all(axis.get_aspect() == (3.0 if axis in stretched else 1.0) for axis in views)
    drawn = [axis for axis in views if axis not in stretched]
    assert key == '9' or all(axis.collections for axis in drawn)  # discs


def luminance(colour):
    rgb = np.array(mpl.colors.to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def contrast(one, other):
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize('look', LOOKS.values(), ids=LOOKS)
def test_colours_have_contrast_with_their_background(look):
    assert contrast(look.ink, look.face) > 7.0  # WCAG 2.1, text, AAA
    for colour in (look.printed, look.tenth, look.third, look.fourth):
        assert contrast(colour, look.face) > 3.0  # WCAG 2.1, graphics
    family = style.family(range(8), look)
    # The bright end of a family on white has less; its curves have discs and are in order.
    assert min(contrast(colour, look.face) for colour in family) > 2.0
    brightness = [luminance(colour) for colour in family]
    assert brightness == sorted(brightness)  # distinct in grey as well


def test_a_picture_is_the_same_in_every_run_and_has_its_background():
    for look, kinds in ((LIGHT, ('png', 'svg')), (DARK, ('png',))):
        figures = [FIGURES['8'].plot(computed('8'), look) for _ in range(2)]
        for kind in kinds:
            first, second = (style.image(figure, kind, look) for figure in figures)
            assert first == second
            if kind == 'png':
                picture = Image.open(io.BytesIO(first)).convert('RGB')
                assert picture.size[0] == round(style.WIDTH * style.DPI)
                wanted = [round(255 * part) for part in mpl.colors.to_rgb(look.face)]
                assert picture.getpixel((2, 2)) == pytest.approx(wanted, abs=3)  # 256 colours
            else:
                assert first.startswith(b'<?xml')


def test_discs_are_projected_as_they_lie():
    setup = Setup(disc=conditions.frisbee())
    launch = Launch(pitch=0.0, roll=0.0, spin=30.0)
    t = fly(launch, setup, duration=0.02, ground=False, sample_rate=100.0).trajectory
    rim = style.disc_rims(t, 8.0)[0]
    assert np.linalg.norm(rim - t.position[0], axis=1) == pytest.approx(np.full(33, 4 * 0.275))
    above, side = style.view(rim, style.TOP), style.view(rim, style.SIDE)
    assert np.ptp(above, axis=0) == pytest.approx((2.2, 2.2), rel=0.01)  # round from above
    assert np.ptp(side[:, 1]) == pytest.approx(0.0, abs=1e-12)  # a line from the side
    tilted = fly(
        Launch(pitch=90.0, spin=30.0), setup, duration=0.02, ground=False, sample_rate=100.0
    ).trajectory
    side = style.view(style.disc_rims(tilted, 1.0)[0], style.SIDE)
    assert np.ptp(side, axis=0) == pytest.approx((0.0, 0.275), abs=0.003)


def test_a_view_has_height_up_and_right_as_right():
    points = np.array([[1.0, 2.0, -3.0]])
    assert style.view(points, style.SIDE).tolist() == [[1.0, 3.0]]
    assert style.view(points, style.TOP).tolist() == [[1.0, 2.0]]
    figure = FIGURES['5'].plot(computed('5'), LIGHT)
    top = figure.axes[0]
    low, high = top.get_ylim()
    assert low > high  # seen from above, flying to the right, Y points down the page
