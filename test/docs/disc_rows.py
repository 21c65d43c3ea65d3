"""The rows of the tables in docs/discs.md, computed from the catalogue."""

import sys

import numpy as np

from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.disc_file import disc_names, load_disc
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch

# The standard throw of each class of disc: speed, spin; pitch 8, height 1.2 m, otherwise flat.
DRIVERS = (24.0, 110.0)
MIDRANGE = (18.0, 80.0)
FRISBEES = (15.0, 50.0)
_THROWS = {
    **dict.fromkeys(('firebird', 'roadrunner', 'teebird', 'wraith', 'wraith_tunnel'), DRIVERS),
    **dict.fromkeys(('aviar', 'buzzz', 'roc'), MIDRANGE),
}


def numbers(disc: Disc) -> str:
    """Return mass [g], diameter [mm], I_z and I_x [kg m^2] and the three dampings as a row."""
    return (
        f'| `{disc.name}` | {1e3 * disc.mass:.0f} | {1e3 * disc.diameter:.0f} | '
        f'{disc.inertia_axial:.3e} | {disc.inertia_diametral:.3e} | '
        f'{disc.C_Lp:g} | {disc.C_Mq:g} | {disc.C_Nr:g} |'
    )


def coefficients(disc: Disc) -> str:
    """Return C_Lift, C_Drag and C_M at 0 and 10 degrees and the angle of trim as a row."""
    table = disc.table
    assert table is not None
    degrees, C_M = table.alpha_deg, table.coefficients[:, 2]
    cells = [
        f'{np.interp(a, degrees, table.coefficients[:, i]):.3f}' for i in range(3) for a in (0, 10)
    ]
    usual = (degrees >= -10.0) & (degrees <= 20.0)
    trim = np.interp(0.0, C_M[usual], degrees[usual])
    return f'| `{disc.name}` | ' + ' | '.join(cells) + f' | {trim:.1f} |'


def throw(disc: Disc) -> str:
    """Return the standard throw of a disc and where it ends as a row."""
    speed, spin = _THROWS.get(disc.name, FRISBEES)
    launch = Launch(speed=speed, pitch=8.0, spin=spin, height=1.2)
    flight = fly(launch, Setup(disc=disc))
    side = 'left' if flight.drift >= 0.0 else 'right'
    return (
        f'| `{disc.name}` | {speed:g} m/s, {spin:g} rad/s | {flight.range:.0f} m | '
        f'{abs(flight.drift):.0f} m {side} | {flight.time:.1f} s | {flight.apex:.1f} m |'
    )


def discs() -> list[Disc]:
    """Return the discs of the page: all of the catalogue that have a table."""
    each = (load_disc(name) for name in disc_names())
    return [disc for disc in each if disc.table is not None and disc.aero == 'table']


if __name__ == '__main__':
    for row in (numbers, coefficients, throw):
        sys.stdout.write('\n'.join(map(row, discs())) + '\n\n')
