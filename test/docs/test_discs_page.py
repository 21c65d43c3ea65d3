"""docs/discs.md has every disc of the catalogue, with its present numbers."""

from importlib.resources import files
from pathlib import Path
import re

import pytest

from disc_sim_ros.physics.disc_file import disc_names, load_disc
from docs import disc_rows

PAGE = (Path(__file__).parents[2] / 'docs' / 'discs.md').read_text(encoding='utf-8')


@pytest.mark.parametrize('row', [disc_rows.numbers, disc_rows.coefficients, disc_rows.throw])
def test_each_disc_has_its_numbers_on_the_page(row):
    for disc in disc_rows.discs():
        assert row(disc) in PAGE


def test_each_disc_file_says_what_it_was_compared_with():
    for name in disc_names():
        text = (files('disc_sim_ros.physics') / 'discs' / f'{name}.yaml').read_text(
            encoding='utf-8'
        )
        assert re.search('^# Compared with: .{20,}$', text, re.MULTILINE), name
        if load_disc(name).ground_contact == 'rim':  # a real disc
            assert re.search('^# Uncertainty: .{20,}$', text, re.MULTILINE), name


def test_each_disc_of_the_catalogue_is_named():
    for name in disc_names():
        assert f'`{name}`' in PAGE
