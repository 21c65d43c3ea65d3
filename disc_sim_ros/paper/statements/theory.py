"""Statements of the sections before the results: coefficients, models, run time, Fig. 3."""

from functools import cache
import math

import numpy as np

from disc_sim_ros.paper import (
    conditions,
    fig03_coefficients,
    fig10_similarity,
    rigid_body_models,
    roll_rate_law,
)
from disc_sim_ros.paper.fig05_typical_flight import DURATION, LAUNCH
from disc_sim_ros.paper.statements.rule import Statement
from disc_sim_ros.physics import disc_file, theory
from disc_sim_ros.physics.flight import MODELS
from disc_sim_ros.physics.launch import Launch

fig03 = cache(fig03_coefficients.compute)
models = cache(rigid_body_models.compute)
laws = cache(roll_rate_law.compute)

_HUMMEL = 'Hummel 2003 printed a slope per rad/s; made dimensionless at 13.42 m/s'
_AREA, _SPEED = 0.057, 13.42  # m^2 and m/s, Hummel 2003


def _from_hummel(slope: float) -> float:
    """Return a damping per c / (2 V) from Hummel's slope [1 / (rad/s)]."""
    return slope * 2.0 * _SPEED / (2.0 * math.sqrt(_AREA / math.pi))


def _symbol(name: str, alpha: float) -> float:
    """Return a coefficient of the symbols of Fig. 3 at a whole degree [1]."""
    read = fig03().read
    return float(read[name][read['alpha_deg'] == alpha][0])


def _inertia_ratio(_: float) -> float:
    disc = disc_file.load_disc('ultrastar')
    return disc.inertia_diametral / disc.inertia_axial


def _spin_lost(share: float) -> float:
    spin = conditions.flown(LAUNCH, share, duration=DURATION, model='exact').trajectory.spin
    return float(100.0 * (1.0 - spin[-1] / spin[0]))


def _apart(share: float) -> float:
    """Return the largest distance between constant spin and exact in 4 s, over the range [%]."""
    data = models()
    last = round(4.0 * conditions.RATE)
    way = data.of(share)['exact'].t.position[last, 0]
    return float(100.0 * data.apart('constant_spin', share)[: last + 1].max() / way)


def _sideways_at_rest(share: float) -> float:
    launch = Launch(speed=0.0, pitch=0.0, spin=LAUNCH.spin)
    end = conditions.flown(launch, share, duration=2.0, rate=0.0).end
    return math.hypot(end.X, end.Y)


def _sideways_flat(alpha: float) -> float:
    launch = Launch(speed=10.0, pitch=0.0, angle_of_attack=alpha, spin=LAUNCH.spin)
    end = conditions.flown(launch, duration=2.0, rate=0.0).end
    return math.hypot(end.X, end.Y)


def _run_time(model: str) -> float:
    """Return the CPU time of one flight at AdvR 0.29 [s]."""
    data = models()
    return float(data.seconds[list(MODELS).index(model)][0])


def _seconds_ratio(row_a: int, column_a: int, row_b: int, column_b: int) -> float:
    seconds = models().seconds
    return float(seconds[row_a, column_a] / seconds[row_b, column_b])


_SLOW = 'Matlab 5.3 on a 233 MHz Pentium then, compiled RK4 in despun axes now'
_THEORY = 'Theory, equations of motion'
_SIMPLE = 'Simplified flight dynamics'
_IMPLEMENTATION = 'Simulation implementation'

STATEMENTS = (
    Statement(
        where=_THEORY, says='C_Mq, from Hummel', number='-1.40', tolerance=0.07,
        reason='5 %: her speed is not given', damped=False,
        ours=lambda _: _from_hummel(-1.44e-2), why=_HUMMEL,
    ),
    Statement(
        where=_THEORY, says='C_Lp, from Hummel', number='-1.30', tolerance=0.065,
        reason='5 %: her speed is not given', damped=False,
        ours=lambda _: _from_hummel(-1.25e-2), why=_HUMMEL,
    ),
    Statement(
        where='Fig. 3a', says='slope of lift around 5°', number='3.09', unit='/rad', damped=False,
        ours=lambda _: fig03_coefficients.slope(fig03(), 'CL'), tolerance=0.3,
        reason='10 %: which points were fitted is not printed',
        why='least squares over the symbols from 0 to 10° is steeper; the printed line is flown '
        'wherever lines are',
    ),
    Statement(
        where='Fig. 3c', says='slope of C_M around 5°', number='0.057', unit='/rad', damped=False,
        ours=lambda _: fig03_coefficients.slope(fig03(), 'CM'), tolerance=0.0057,
        reason='10 %: which points were fitted is not printed',
        why='the printed slope is near that of the symbols from 0 to 9°; a fit that takes in 10° '
        'is steeper, since the moment bends there',
    ),
    Statement(
        where='Fig. 3a', says='lift at 0°, the line', number='0.13', damped=False, tolerance=0.01,
        reason='error of reading', ours=lambda _: _symbol('CL', 0.0),
    ),
    Statement(
        where='Fig. 3b', says='least drag, the parabola', number='0.085', damped=False,
        tolerance=0.004, reason='error of reading',
        ours=lambda _: float(fig03().read['CD'].min()),
        why='the parabola is fitted around 5° and goes below the symbols at -3°',
    ),
    Statement(
        where='Fig. 3a, text on Fig. 6', says='angle of no lift, from the +3° offset', number='-3',
        unit='°', damped=False, ours=lambda _: fig03().zero(0),
    ),
    Statement(
        where='Theory, Fig. 3c', says='misfit of the C_M line above 10° by that from 0 to 10°',
        words='poor', number='>1', damped=False,
        ours=lambda _: fig03_coefficients.misfit(fig03(), 11, 34)
        / fig03_coefficients.misfit(fig03(), 0, 10),
    ),
    Statement(
        where='Theory, Fig. 3c', says='misfit of the C_M line below 0° by that from 0 to 10°',
        words='poor', number='>1', damped=False,
        ours=lambda _: fig03_coefficients.misfit(fig03(), -10, -1)
        / fig03_coefficients.misfit(fig03(), 0, 10),
    ),
    Statement(
        where=f'{_SIMPLE}, eqn 53', says='I_x / I_z of a thin disc', number='0.5', damped=False,
        tolerance=0.025, reason='5 %: a disc that is not quite flat', ours=_inertia_ratio,
    ),
    Statement(
        where='Eqns 53, 54', says='p by M / (r I_z), magnitude', number='2', damped=False,
        tolerance=0.1, reason='5 %: mean over one nutation at AdvR 3.8',
        ours=lambda _: float(roll_rate_law.factor(laws())[-1]) / 4.0,
        why='printed are dp/dt = dq/dt = 0 in axes that spin; in axes that do not it is 1',
    ),
    Statement(
        where='Eqn 64', says='p V / g by k_n / AdvR', number='8', damped=False, tolerance=0.4,
        reason='5 %: mean over one nutation at AdvR 3.8',
        ours=lambda _: float(roll_rate_law.factor(laws())[-1]),
        why='follows from eqn 54; corrected it is 4',
    ),
    Statement(
        where='Eqn 60', says='I_z by m c² of a uniform disc', number='0.125', damped=False,
        tolerance=0.00625, reason='5 %',
        ours=lambda _: conditions.frisbee().inertia_axial
        / (conditions.frisbee().mass * conditions.frisbee().diameter ** 2),
        why='the disc of Fig. 5 carries more of its mass in the rim, as real discs do',
    ),
    Statement(
        where=_IMPLEMENTATION, says='spin lost in 4 s, exact model', number='3', unit='%',
        about=True, ours=_spin_lost, taken=True,
        why='C_Nr is not printed and was chosen to give this',
    ),
    Statement(
        where=_IMPLEMENTATION, says='exact and constant spin apart in 4 s, by the range',
        words='visually identical', number='<1', unit='%', ours=_apart,
        why='mostly from the spin that the exact disc loses',
    ),
    Statement(
        where=_IMPLEMENTATION, says='5 s flight, constant spin, run time', number='180',
        unit='s', about=True, damped=False, ours=lambda _: _run_time('constant_spin'), why=_SLOW,
    ),
    Statement(
        where=_IMPLEMENTATION, says='5 s flight, exact, run time', number='600', unit='s',
        about=True, damped=False, ours=lambda _: _run_time('exact'), why=_SLOW,
    ),
    Statement(
        where=_IMPLEMENTATION, says='run time of exact by constant spin', number='3.3',
        damped=False, tolerance=0.5, reason='both are rounded to minutes',
        ours=lambda _: _seconds_ratio(0, 0, 1, 0),
        why='in despun axes neither model has to follow the spin, and both nutate',
    ),
    Statement(
        where=_IMPLEMENTATION, says='run time at AdvR 2.2 by that at 0.29, constant spin',
        words='increases significantly', number='>1.5', damped=False,
        ours=lambda _: _seconds_ratio(1, -1, 1, 0),
    ),
    Statement(
        where=_IMPLEMENTATION, says='release at zero speed, level: way to the side in 2 s',
        number='0', unit='m', tolerance=1e-9, reason='rounding', ours=_sideways_at_rest,
    ),
    Statement(
        where=_IMPLEMENTATION, says='launch at alpha = 90°: way to the side in 2 s', number='0',
        unit='m', tolerance=1e-9, reason='rounding', damped=False,
        ours=lambda _: _sideways_flat(90.0),
    ),
    Statement(
        where=_IMPLEMENTATION, says='launch at alpha = -90°: way to the side in 2 s', number='0',
        unit='m', tolerance=1e-9, reason='rounding', damped=False,
        ours=lambda _: _sideways_flat(-90.0),
    ),
    Statement(
        where='Fig. 10, text', says='static margin of the plate by AdvR: eqn 64 as printed',
        number='-2.14', damped=False,
        ours=lambda _: float(theory.printed_roll_rate_law(
            theory.static_margin(fig10_similarity.plate()), 1.0)),
        tolerance=0.01, reason='the slopes have two or three digits',
    ),
    Statement(
        where='Fig. 10, text', says='p V / g of the plate, simulated', number='-2.14',
        damped=False, tolerance=0.107, reason='5 %',
        ours=lambda _: float(np.interp(1.0, roll_rate_law.RATIOS, laws().simulated)),
        why='the factor 8 of eqn 64 should be 4',
    ),
)  # fmt: skip
