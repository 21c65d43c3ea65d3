"""docs/discs.md has every disc of the catalogue, with its present numbers."""

from pathlib import Path

import pytest

from disc_sim_ros.physics.disc_file import disc_names
from docs import disc_rows

PAGE = (Path(__file__).parents[2] / 'docs' / 'discs.md').read_text(encoding='utf-8')


@pytest.mark.parametrize('row', [disc_rows.numbers, disc_rows.coefficients, disc_rows.throw])
def test_each_disc_has_its_numbers_on_the_page(row):
    for disc in disc_rows.discs():
        assert row(disc) in PAGE


def test_each_disc_of_the_catalogue_is_named():
    for name in disc_names():
        assert f'`{name}`' in PAGE
