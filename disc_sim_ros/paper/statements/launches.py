"""Statements about Figs. 6 to 9: other launches."""

from functools import cache

import numpy as np

from disc_sim_ros.paper import conditions, fig07_range, fig09_landing
from disc_sim_ros.paper import fig06_launch_conditions as fig06
from disc_sim_ros.paper.statements.rule import Ours, Statement
from disc_sim_ros.physics.flight import Flight

pitches = cache(fig07_range.compute)
landings = cache(fig09_landing.compute)

LITERAL = 0.5  # AdvR as the panels 6e to h print it


def _row(share: float) -> int:
    return conditions.SHARES.index(share)


def _best(name: str, *, on_grid: bool) -> Ours:
    def best(share: float) -> float:
        data = pitches()
        values = getattr(data, name)[_row(share)]
        return data.best_on_grid(values) if on_grid else data.best(values)

    return best


def _sensitivity(share: float) -> float:
    """Return the relative loss of range from the best pitch to 30 degrees, by that of duration."""
    data = pitches()
    at_30 = int(np.flatnonzero(data.pitch == 30.0)[0])
    far, long = data.range[_row(share)], data.duration[_row(share)]
    return float((1.0 - far[at_30] / far.max()) / (1.0 - long[at_30] / long.max()))


def _level(ratio: float, share: float) -> Flight:
    return conditions.flown(fig06.ratio_launch(ratio), share, duration=fig06.LONGEST)


def _bend(ratio: float) -> Ours:
    """Return the sideways distance after 4 s relative to the forward distance [%]."""

    def bend(share: float) -> float:
        end = _level(ratio, share).end
        return 100.0 * end.Y / end.X

    return bend


def _depth_against(ratio: float, other: float) -> Ours:
    """Return how much lower one launch is than another after 2 s [m]."""

    def depth(share: float) -> float:
        at = round(2.0 * conditions.RATE)
        Z, Z_other = (_level(x, share).trajectory.position[at, 2] for x in (ratio, other))
        return float(Z - Z_other)

    return depth


def _first_second_without_spin(share: float) -> float:
    """Return the least pitch of a disc without spin in the first second [degrees]."""
    t = _level(0.0, share).trajectory
    return float(np.degrees(t.euler[: round(conditions.RATE), 1]).min())


def _turns_over_without_spin(share: float) -> float:
    """Return the largest absolute attitude of a disc without spin in 4 s [degrees]."""
    return float(np.degrees(_level(0.0, share).trajectory.absolute_attitude).max())


def _sideways(share: float) -> float:
    """Return the largest sideways distance of the landings of panel d [m]."""
    flights = (
        conditions.flown(fig06.pitch_launch(pitch), share, ground=True) for pitch in fig06.PITCHES
    )
    return max(abs(flight.end.Y) for flight in flights)


def _alpha_by_pitch(share: float) -> float:
    """Return the greatest forward distance in 4 s at alpha 60 degrees, relative to 0 [1]."""

    def far(alpha: float) -> float:
        launch = fig06.alpha_launch(alpha)
        t = conditions.flown(launch, share, duration=fig06.LONGEST).trajectory
        return float(t.position[:, 0].max())

    return far(60.0) / far(0.0)


def _speed_left_at_90(share: float) -> float:
    """Return the horizontal speed after 1 s at alpha 90 degrees [m/s]."""
    t = conditions.flown(fig06.alpha_launch(90.0), share, duration=fig06.LONGEST).trajectory
    return float(np.hypot(*t.velocity[round(conditions.RATE), :2]))


def _crossing(ratio: float) -> Ours:
    return lambda share: landings().crossing(ratio, share)


def _without_roll(ratio: float) -> Ours:
    return lambda share: landings().without_roll(ratio, share)


def _geometric_best(name: str) -> Ours:
    """Return the best pitch if the disc were released along its own x axis [degrees]."""

    def best(share: float) -> float:
        def value(pitch: float) -> float:
            launch = conditions.level(fig06.ADV_R_PITCH, pitch=pitch)
            flight = conditions.flown(launch, share, ground=True, rate=0.0)
            return float(getattr(flight, name))

        pitches: list[float] = np.arange(5.0, 25.0, 0.5).tolist()
        return max(pitches, key=value)

    return best


@cache
def _straightest(ratio: float, share: float) -> float:
    """Return the roll with the straightest path in the first 2 s, in whole degrees [degrees]."""
    until = round(2.0 * conditions.RATE)

    def bend(roll: float) -> float:
        launch = fig06.roll_launch(roll, ratio)
        flight = conditions.flown(launch, share, duration=2.0)
        return float(np.abs(flight.trajectory.position[:until, 1]).max())

    rolls = np.arange(-15.0, 6.0)
    return float(rolls[np.argmin([bend(float(roll)) for roll in rolls])])


def _landing_side(roll: float) -> Ours:
    def side(share: float) -> float:
        end = conditions.flown(fig06.roll_launch(roll), share, ground=True, rate=0.0).end
        return float(end.Y)

    return side


def _bends(share: float) -> float:
    """Return the number of turning points of X along the landings, at the rolls of the paper."""
    points = np.isin(fig09_landing.ROLLS, fig09_landing.GRID)
    X = landings().of(fig06.ADV_R, share)[points, 0]
    slope = np.sign(np.diff(X))
    return float(np.count_nonzero(slope[1:] != slope[:-1]))


_FINE = (
    'the curve is flat: on a fine grid the maximum is at 16°, on the points of the paper at 20°'
)
_GEOMETRIC = 'the figures follow with the angle of no lift'
_STRAIGHT = 'strong damping holds the first roll back'
_AXIS = '0.24 gives -5.5° at 10 % damping'
_LEVEL = 'Text on Fig. 6a, b'

STATEMENTS = (
    Statement(where=_LEVEL, says='AdvR 8: to the side in 4 s',
              words='almost straight', number='<5', unit='% of the way', ours=_bend(8.0)),
    Statement(where=_LEVEL, says='AdvR 0.4: to the right in 4 s',
              words='turns right', number='>5', unit='% of the way',
              ours=_bend(0.4), why='it turns right, but less'),
    Statement(where=_LEVEL, says='AdvR 0.4 by 1: lower after 2 s by',
              words='not much affected', number='<1', unit='m', ours=_depth_against(0.4, 1.0)),
    Statement(where=_LEVEL, says='AdvR 0.1 by 0.4: lower after 2 s by',
              words='sinks faster', number='>1', unit='m', ours=_depth_against(0.1, 0.4)),
    Statement(where=_LEVEL, says='AdvR 0: least pitch in 1 s', words='nose down',
              number='<-45',
              unit='°', ours=_first_second_without_spin),
    Statement(where=_LEVEL, says='AdvR 0: largest absolute attitude in 4 s',
              words='tumbles', number='>90', unit='°', ours=_turns_over_without_spin),
    Statement(where='Text on Fig. 6c, 30°', says='least pitch from which the disc turns back',
              number='30', unit='°', tolerance=2.5, reason='half of 5°',
              ours=lambda share: fig06.least_returning_pitch(share, 1),
              why='seen on pitches 10° apart it would be 30°'),
    Statement(where='Text on Fig. 6c, 30°', says='the same, pitches 10° apart', number='30',
              unit='°', tolerance=2.5, reason='half of 5°',
              ours=lambda share: fig06.least_returning_pitch(share, 10)),
    Statement(where='Text on Fig. 6d', says='landing to the side at AdvR 1.1, at most',
              words='little', number='<3', unit='m', ours=_sideways),
    Statement(where='Text on Fig. 7', says='pitch of the greatest range, paper\'s ten pitches',
              number='10', unit='°', about=True, ours=_best('range', on_grid=True)),
    Statement(where='Text on Fig. 7', says='the same, every half degree', number='10', unit='°',
              about=True, ours=_best('range', on_grid=False)),
    Statement(where='Text on Fig. 7', says='the same, released along the disc', number='10',
              unit='°', about=True, ours=_geometric_best('range'), why=_GEOMETRIC),
    Statement(where='Text on Fig. 8', says='pitch of the longest duration, paper\'s ten pitches',
              number='20', unit='°', about=True, ours=_best('duration', on_grid=True)),
    Statement(where='Text on Fig. 8', says='the same, every half degree', number='20', unit='°',
              about=True, ours=_best('duration', on_grid=False), why=_FINE),
    Statement(where='Text on Fig. 8', says='the same, released along the disc', number='20',
              unit='°', about=True, ours=_geometric_best('time'), why=_GEOMETRIC),
    Statement(where='Text on Figs. 7, 8', says='loss of range to 30° by that of duration',
              words='much more sensitive', number='>2',
              ours=_sensitivity),
    Statement(where='Text on Fig. 6e, f', says='alpha 60°: way forward by that of 0°',
              words='much reduced', number='<0.5', ours=_alpha_by_pitch),
    Statement(where='Text on Fig. 6e, f', says='alpha 90°: horizontal speed after 1 s, of 19',
              words='decelerates rapidly', number='<5', unit='m/s', ours=_speed_left_at_90),
    Statement(where='Text on Fig. 6g, h', says='roll of a straight first 2 s', number='-7',
              unit='°', about=True, ours=lambda share: _straightest(fig06.ADV_R, share),
              why=_STRAIGHT),
    Statement(where='Text on Fig. 9', says='landing to the right without roll', number='8',
              unit='m', about=True, ours=_without_roll(fig06.ADV_R), why=_STRAIGHT),
    Statement(where='Text on Fig. 9', says='roll of the landing nearest the X axis', number='-6',
              unit='°', about=True, ours=_crossing(fig06.ADV_R), why=_AXIS),
    Statement(where='Text on Fig. 9', says='the same at AdvR 0.5 by eqn 63', number='-6',
              unit='°', about=True, ours=_crossing(LITERAL),
              why='the printed 0.5 is r c / V, 0.25 by eqn 63'),
    Statement(where='Text on Fig. 9', says='roll -30°: lands at Y', words='left', number='<0',
              unit='m', ours=_landing_side(-30.0)),
    Statement(where='Text on Fig. 9', says='roll +30°: lands at Y', words='right', number='>0',
              unit='m', ours=_landing_side(30.0)),
    Statement(where='Text on Fig. 9', says='turning points of X along the locus',
              words='S-shaped', number='2',
              ours=_bends),
)  # fmt: skip
