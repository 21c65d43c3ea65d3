"""Statements about Figs. 10 to 12: similarity and control inputs."""

from functools import cache

import numpy as np

from disc_sim_ros.paper import fig10_similarity as fig10
from disc_sim_ros.paper import fig11_12_spirals as spirals
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.statements.rule import Ours, Statement
from disc_sim_ros.paper.statements.theory import fig03
from disc_sim_ros.physics import theory

plates = cache(fig10.compute)
turns = cache(spirals.compute_turn)
rolls = cache(spirals.compute_roll)


def _lift_by_weight(diameter: float) -> float:
    disc = fig10.plate()
    area = np.pi * diameter**2 / 4.0
    pressure = 0.5 * 1.225 * fig10.SPEED**2
    needed = theory.lift_for_weight(disc.mass, fig10.GRAVITY, pressure, area)
    slope = disc.linear.CL_alpha if disc.linear else 0.0
    return float(slope * np.radians(fig10.ALPHA) / needed)


def _turn(share: float) -> Curve:
    return next(c for c in turns().curves if c.share == share)


def _mean(name: str) -> Ours:
    return lambda share: spirals.mean(_turn(share), name)


def _swing(share: float) -> float:
    """Return the amplitude of the angle of attack while it should be steady [degrees]."""
    t = _turn(share).t
    steady = (t.t >= spirals.SETTLED[0]) & (t.t <= spirals.SETTLED[1])
    return float(np.ptp(np.degrees(t.alpha[steady])) / 2)


def _roll(share: float, *, gravity: bool) -> Curve:
    return next(c for c in rolls().curves if c.share == share and (c.value > 0.0) == gravity)


def _depth(share: float, *, gravity: bool) -> float:
    return _roll(share, gravity=gravity).flight.end.Z


def _alpha_off(share: float) -> float:
    """Return the largest distance from -3 degrees of the angle of attack, in means over 0.5 s."""
    window = round(0.5 * 100)
    alpha = np.degrees(_roll(share, gravity=False).t.alpha)
    means = alpha[: len(alpha) // window * window].reshape(-1, window).mean(axis=1)
    return float(np.abs(means + 3.0).max())


def _path_swing(share: float, *, gravity: bool) -> float:
    lowest, highest = spirals.descent_angle(_roll(share, gravity=gravity))
    return highest - lowest


def _slows(share: float) -> float:
    V = _roll(share, gravity=False).t.airspeed
    return float(V[-1] / V[0])


_P_HAT = 'the panels print -2.14 and -1.3, as the values of the legends give'
_GRAVITY = 'with gravity the disc falls; the figure was drawn without'
_ROLLS = 'with the printed damping the first roll takes the disc off its angle'

STATEMENTS = (
    Statement(where='Fig. 10, text', says='lift by weight at 2° and 15.7 m/s, c the diameter',
              number='1', tolerance=0.05, reason='5 %', damped=False,
              ours=lambda _: _lift_by_weight(0.06), why='the printed c = 0.06 m is the radius'),
    Statement(where='Fig. 10, text', says='the same, 0.06 m the radius', number='1',
              tolerance=0.05, reason='5 %', damped=False, ours=lambda _: _lift_by_weight(0.12)),
    Statement(where='Fig. 10, text', says='I_z by eqn 60, 0.06 m for c, 1e-6', number='6.7',
              unit='kg m²', tolerance=0.1, reason='cut off, not rounded', damped=False,
              ours=lambda _: 1e6 * theory.uniform_inertia(fig10.plate().mass, 0.06)),
    Statement(where='Fig. 10, text', says='the same, of the plate that flies, 1e-6', number='6.7',
              unit='kg m²', tolerance=0.1, reason='cut off, not rounded', damped=False,
              ours=lambda _: 1e6 * fig10.plate().inertia_axial,
              why='eqn 64 rests on eqn 60 with the diameter, 0.12 m'),
    Statement(where='Fig. 10, caption', says='p_hat of the first row, eqn 64 as printed',
              number='1.3', damped=False,
              ours=lambda _: abs(fig10.law(plates().first[0], printed=True)), why=_P_HAT),
    Statement(where='Fig. 10, caption', says='p_hat of the second row, eqn 64 as printed',
              number='0.47', damped=False,
              ours=lambda _: abs(fig10.law(plates().second[0], printed=True)), why=_P_HAT),
    Statement(where='Fig. 10, panels', says='p_hat of the first row, eqn 64 as printed',
              number='-2.14', damped=False, tolerance=0.01,
              reason='the slopes have two or three digits',
              ours=lambda _: fig10.law(plates().first[0], printed=True)),
    Statement(where='Fig. 10, panels', says='p_hat of the second row, eqn 64 as printed',
              number='-1.3', damped=False,
              ours=lambda _: fig10.law(plates().second[0], printed=True)),
    Statement(where='Fig. 10a', says='flights apart, by their length',
              words='fall together', number='<2', unit='%', damped=False,
              ours=lambda _: 100.0 * fig10.spread(plates().first)),
    Statement(where='Fig. 10b', says='flights apart, by their length',
              words='fall together', number='<2', unit='%', damped=False,
              ours=lambda _: 100.0 * fig10.spread(plates().second)),
    Statement(where='Text on Fig. 11', says='angle of attack, mean from 2 to 4 s', number='15',
              unit='°', about=True, ours=_mean('alpha_deg'), why='the figures have less damping'),
    Statement(where='Text on Fig. 11', says='absolute attitude, mean from 2 to 4 s', number='30',
              unit='°', about=True, ours=_mean('lambda_deg'),
              why='it swings as the bank does; the turn is not steady here'),
    Statement(where='Text on Fig. 11', says='speed, mean from 2 to 4 s', number='7', unit='m/s',
              about=True, ours=_mean('V_m_s')),
    Statement(where='Text on Fig. 11', says='swing of alpha from 2 to 4 s',
              words='steady after 2 s', number='<2.5', unit='°', ours=_swing,
              why='it goes on swinging'),
    Statement(where='Text on Fig. 11', says='without drag and pitch',
              words='level turn at constant speed', number='', ours=None,
              why='the launch of that flight is not given'),
    Statement(where='Fig. 12, text', says='angle of no lift', number='-3', unit='°', damped=False,
              ours=lambda _: fig03().zero(0)),
    Statement(where='Text on Fig. 12', says='alpha stays at -3°: means over 0.5 s are off by',
              number='0', unit='°', tolerance=0.5, reason='half the last digit', ours=_alpha_off,
              why='the release itself swings it; ' + _ROLLS),
    Statement(where='Text on Fig. 12', says='path at a constant angle, no gravity: varies by',
              number='0', unit='°', tolerance=2.5, reason='what the eye sees in a figure',
              ours=lambda share: _path_swing(share, gravity=False), why=_ROLLS),
    Statement(where='Text on Fig. 12', says='path at a constant angle, with gravity: varies by',
              number='0', unit='°', tolerance=2.5, reason='what the eye sees in a figure',
              ours=lambda share: _path_swing(share, gravity=True), why=_GRAVITY),
    Statement(where='Text on Fig. 12', says='speed at 4 s by that at launch', words='falls',
              number='<1',
              ours=_slows),
    Statement(where='Fig. 12, read off', says='depth after 4 s, no gravity', number='12',
              unit='m', about=True, ours=lambda share: _depth(share, gravity=False)),
    Statement(where='Fig. 12, read off', says='depth after 4 s, with gravity', number='12',
              unit='m', about=True, ours=lambda share: _depth(share, gravity=True), why=_GRAVITY),
)  # fmt: skip
