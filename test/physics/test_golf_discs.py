"""Golf discs: tables as published, the filled parts as their files state, and plausible order."""

import csv

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pytest

from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from physics.disc_files import DATA, assert_same_disc, published

MOULDS = {'wraith': 'dd2', 'firebird': 'cd1', 'roadrunner': 'cd5', 'teebird': 'fd2'}
INERTIA_PER_MASS = {  # m^2, axial and diametral: header of the CFD table
    'wraith': (7.465e-3, 3.755e-3),
    'firebird': (7.485e-3, 3.759e-3),
    'roadrunner': (7.616e-3, 3.829e-3),
    'teebird': (7.577e-3, 3.809e-3),
}
LINES = ('aviar', 'roc', 'buzzz')


def rows_of(disc: Disc) -> np.ndarray:
    assert disc.table is not None
    return np.column_stack([disc.table.alpha_deg, disc.table.coefficients])


def data_of(name: str) -> dict[str, np.ndarray]:
    """Return the rows of each disc in a file whose first column is its name."""
    lines = [line for line in (DATA / name).read_text().splitlines() if not line.startswith('#')]
    discs: dict[str, list[list[float]]] = {}
    for disc, *numbers in list(csv.reader(lines))[1:]:
        discs.setdefault(disc, []).append([float(x) for x in numbers])
    return {disc: np.array(rows) for disc, rows in discs.items()}


CFD = data_of('cfd_golf_discs_giljarhus2022.csv')


@pytest.mark.parametrize(('name', 'mould'), MOULDS.items())
def test_a_driver_has_the_cfd_table_and_inertia_of_its_mould(name, mould):
    disc = load_disc(name)
    assert_array_equal(rows_of(disc), CFD[mould])
    axial, diametral = INERTIA_PER_MASS[name]
    assert disc.inertia_axial == pytest.approx(axial * disc.mass, rel=1e-9)
    assert disc.inertia_diametral == pytest.approx(diametral * disc.mass, rel=1e-9)


def test_wraith_tunnel_is_measured_inside_and_cfd_outside():
    rows = rows_of(load_disc('wraith_tunnel'))
    _, measured = published('wind_tunnel_wraith_kamaruddin2018.csv')
    inside = (rows[:, 0] >= -5.0) & (rows[:, 0] <= 15.0)
    assert_array_equal(rows[inside], measured)
    cfd = CFD['dd2']
    assert_array_equal(rows[~inside], cfd[(cfd[:, 0] < -5.0) | (cfd[:, 0] > 15.0)])
    assert_same_disc(load_disc('wraith_tunnel'), load_disc('wraith'), but=('table', 'table_rows'))


@pytest.mark.parametrize('name', LINES)
def test_a_disc_of_measured_lines_is_filled_from_the_teebird_as_its_file_states(name):
    C_L0, slope, least_drag = data_of('lines_kamaruddin_golf_discs.csv')[name][0]
    base = CFD['fd2']
    expected = base.copy()
    expected[:, 1] = C_L0 + slope * base[:, 0]
    expected[:, 2] = base[:, 2] - base[:, 2].min() + least_drag
    for low, high, edge in ((-91.0, -10.5, -10.0), (14.5, 91.0, 14.0)):
        outside = (base[:, 0] > low) & (base[:, 0] < high)
        (at,) = np.flatnonzero(base[:, 0] == edge)
        fading = (90.0 - np.abs(base[outside, 0])) / (90.0 - abs(edge))
        difference = expected[at, 1:] - base[at, 1:]
        expected[outside, 1:] = base[outside, 1:] + fading[:, np.newaxis] * difference
    # The file has four decimals; the sum is rounded once.
    assert_allclose(rows_of(load_disc(name)), expected, rtol=0.0, atol=0.5001e-4)


def test_drivers_carry_the_damping_of_a_driver_and_the_others_that_of_the_ultrastar():
    for names, damping in ((MOULDS, (-0.091, -0.098, -4.3e-3)), (LINES, (-0.13, -0.14, -6.0e-3))):
        for name in names:
            disc = load_disc(name)
            assert (disc.C_Lp, disc.C_Mq, disc.C_Nr) == damping


def test_discs_turn_in_the_order_of_their_turn_numbers():
    """Firebird 0, Teebird 0, Wraith -1, Roadrunner -4: more negative drifts further right."""
    launch = Launch(speed=24.0, pitch=8.0, spin=110.0, height=1.2)
    drift = [
        fly(launch, Setup(disc=load_disc(name)), duration=1.5, ground=False).drift
        for name in ('firebird', 'teebird', 'wraith', 'roadrunner')
    ]
    assert drift[0] > drift[1] > drift[3]
    assert drift[0] > drift[2] > drift[3]
