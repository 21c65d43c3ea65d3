"""A recorded flight as figures and as a document for programs."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
import re
from typing import Any

import numpy as np

from disc_sim_ros.analysis.checks import (
    Check,
    Stamps,
    checks,
    ground_crossing,
    stamps_of,
    turns_with_spin,
    with_twist,
)
from disc_sim_ros.analysis.recording import NANOSECONDS, Change, Flight
from disc_sim_ros.analysis.resimulate import Reflight, Verdict, compare, fly_again
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.physics import frames, theory
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.trajectory import Trajectory

_LOSSES = re.compile(r'drop|lost|loss|gap|missed', re.IGNORECASE)
GUSTS, MEAN, STILL = 'with gusts', 'mean wind, without gusts', 'wind unknown, taken as 0'


@dataclass(frozen=True, eq=False)
class Analysis:
    """What is known of one recorded flight.

    Attributes:
        flight: What was recorded.
        again: Its re-flight; None where it cannot be flown again.
        verdict: How that compares.
        why_not: Why there is no re-flight, or ''.
        trajectory: The recorded motion up to the landing.
        wind: Where the wind in it is from: GUSTS, MEAN or STILL.
        release: The exact state at release where it was recorded, else that of the first message.
        landing: flight_time_s, landing_x_m, landing_y_m, and spin_rad_s where it is known; None
            where no landing was seen.
        stamps: How its messages follow each other.
        checks: What was checked without knowing what flew.
    """

    flight: Flight
    again: Reflight | None
    verdict: Verdict | None
    why_not: str
    trajectory: Trajectory
    wind: str
    release: State
    landing: Mapping[str, float] | None
    stamps: Stamps
    checks: tuple[Check, ...]


def analyse(flight: Flight, bag_doubts: tuple[str, ...] = ()) -> Analysis:
    """Analyse a recorded flight.

    Args:
        flight: What was recorded.
        bag_doubts: What the bag as a whole may lack.
    """
    again, verdict, why_not = None, None, ''
    try:
        again = fly_again(flight)
        verdict = compare(flight, again, bag_doubts)
    except DiscSimError as error:
        why_not = str(error)
    motion = with_twist(flight.motion)
    states = frames.states_from_odometry(motion.numbers)
    if again is not None and verdict is not None and verdict.exact:
        winds, wind = again.winds, GUSTS if again.setup.wind.turbulence else MEAN
    else:
        winds, wind = _mean_wind(flight, again)
    landing = _landing(flight, again, verdict)
    end = math.inf if landing is None else landing['flight_time_s']
    flown = flight.time < end
    flown[0] = True
    rows = np.column_stack([flight.time, states, winds])[flown]
    diameter = math.nan if again is None else again.setup.disc.diameter
    return Analysis(
        flight=flight,
        again=again,
        verdict=verdict,
        why_not=why_not,
        trajectory=Trajectory(rows, diameter),
        wind=wind,
        release=State(*states[0].tolist()) if again is None else again.release,
        landing=landing,
        stamps=stamps_of(flight.motion),
        checks=tuple(checks(flight.motion)),
    )


def _mean_wind(flight: Flight, again: Reflight | None) -> tuple[FloatArray, str]:
    """Return the mean wind at each message, earth axes 1 [m/s], and what to call it."""
    told = [c for c in flight.disc.changes if c.topic == 'applied_wind']
    stamps = flight.motion.stamps
    winds = np.zeros((len(stamps), 3))
    if again is not None:
        winds[:] = again.setup.wind.mean
    for change in told:
        winds[stamps >= change.stamp] = frames.flip_yz(change.values)
    return winds, MEAN if told or again is not None else STILL


def _landing(
    flight: Flight, again: Reflight | None, verdict: Verdict | None
) -> Mapping[str, float] | None:
    """Return how the flight ended: as was told, as it was flown again, or as it was seen."""
    names = ('flight_time_s', 'landing_x_m', 'landing_y_m', 'spin_rad_s')
    if flight.landing is not None:
        try:
            return {name: float(flight.landing.values[name]) for name in names}
        except (KeyError, ValueError):
            pass  # not one of sim_node
    flown = again.landing if again is not None and verdict is not None and verdict.exact else {}
    if flown and flown['flight_time_s'] <= flight.time[-1]:
        return {name: flown[name] for name in names}
    told = flight.release.configuration if flight.release else None
    crossing = ground_crossing(flight.motion) if told is None or told.get('ground') else None
    if crossing is None:
        return None
    time, place = crossing
    found = {
        'flight_time_s': time + flight.starts_late,
        'landing_x_m': float(place[0]),
        'landing_y_m': float(place[1]),
    }
    if flight.motion.has_twist:
        row = int(np.searchsorted(flight.time, found['flight_time_s']))
        found['spin_rad_s'] = frames.flip(float(flight.motion.numbers[max(row - 1, 0), 12]))
    return found


def document(a: Analysis) -> dict[str, Any]:
    """Return an analysis as values that JSON knows; keys carry units, positions are in `map`."""
    flight, states = a.flight, a.trajectory
    told = flight.release.configuration if flight.release else None
    position = frames.map_from_paper(states.position) + 0.0
    start = frames.map_from_paper(a.release[:3]) + 0.0
    end = position[-1]
    if a.landing is not None:
        end = np.array([a.landing['landing_x_m'], a.landing['landing_y_m'], 0.0])
    away = end - start
    heading = _heading(a)
    spin_left = None
    if a.landing is not None and 'spin_rad_s' in a.landing and a.release.r:
        spin_left = a.landing['spin_rad_s'] / a.release.r
    return {
        'flight': flight.number,
        'start_ns': flight.start,
        'starts_late_s': flight.starts_late,
        'ended': flight.ended,
        'setup': None if told is None else _setup_document(told),
        'launch': _launch_document(a),
        'landed': a.landing is not None,
        'flight_time_s': float(states.t[-1]) if a.landing is None else a.landing['flight_time_s'],
        'landing_position_m': None if a.landing is None else end.tolist(),
        'end_position_m': end.tolist(),
        'range_m': math.hypot(away[0], away[1]),
        'drift_m': math.cos(heading) * away[1] - math.sin(heading) * away[0],
        'apex_m': float(position[:, 2].max()),
        'greatest_speed_m_s': float(np.linalg.norm(states.velocity, axis=1).max()),
        'end_spin_rad_s': (a.landing or {}).get('spin_rad_s', float(states.spin[-1])),
        'spin_left': spin_left,
        'wind': a.wind,
        'changes': [_change_document(c, flight) for c in changes_of(flight)],
        'messages': {
            'count': a.stamps.count,
            'rate_hz': a.stamps.rate,
            'longest_gap_s': a.stamps.longest,
            'missing': a.stamps.missing,
            'repeated_stamps': a.stamps.repeated,
            'backward_stamps': a.stamps.backwards,
        },
    }


def verification(a: Analysis) -> dict[str, Any]:
    """Return what was verified as values that JSON knows."""
    found: dict[str, Any] = {'passed': passed(a), 'checks': {}}
    for check in a.checks:
        found['checks'][check.name] = {'value': check.value, 'passed': check.passed}
    if a.verdict is None:
        found['not_flown_again'] = a.why_not
        return found
    found['re_flight'] = {
        'exact': a.verdict.exact,
        'messages': a.verdict.compared,
        'identical_messages': a.verdict.identical,
        'first_difference_s': a.verdict.first,
        'largest_difference': {
            name: x if math.isfinite(x) else None for name, x in a.verdict.largest.items()
        },
        'doubts': list(a.verdict.doubts),
    }
    return found


def losses(custom_data: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return what a recorder noted of losses in the `custom_data` of a bag."""
    return [
        (key, value)
        for key, value in custom_data.items()
        if _LOSSES.search(key) and value.strip() not in {'', '0', '{}', '[]'}
    ]


def passed(a: Analysis) -> bool:
    """Say whether all that can be verified is as it should be."""
    if a.verdict is not None:
        return a.verdict.exact
    return all(check.passed for check in a.checks)


def _setup_document(told: Mapping[str, Any]) -> dict[str, Any]:
    names = ('disc', 'model', 'aero', 'moment_axes', 'physics_rate', 'publish_rate', 'version')
    return {name: told.get(name) for name in names} | {
        'flight': told.get('flight'),
        'wind': dict(told['wind']),
    }


def _launch_document(a: Analysis) -> dict[str, Any]:
    s = a.release
    e = (s.e0, s.e1, s.e2, s.e3)
    roll, pitch, yaw = np.degrees(frames.euler_from_quaternion(e)).tolist()
    u, v, w = (frames.rotation_matrix(e).T @ np.array(s[3:6])).tolist()
    vx, vy, vz = frames.flip_yz(s[3:6])
    return {
        'speed_m_s': math.hypot(*s[3:6]),
        'roll_deg': roll + 0.0,
        'pitch_deg': pitch,
        'yaw_deg': yaw + 0.0,
        'angle_of_attack_deg': math.degrees(theory.angle_of_attack(u, v, w)),
        'climb_deg': math.degrees(math.atan2(vz, math.hypot(vx, vy))),
        'heading_deg': math.degrees(math.atan2(s.VY, s.VX)),
        'spin_rad_s': s.r,
        'roll_rate_rad_s': s.p,
        'pitch_rate_rad_s': s.q,
        'position_m': (frames.map_from_paper(s[:3]) + 0.0).tolist(),
        'height_m': frames.flip(s.Z),
        'frame_spins': turns_with_spin(a.flight.motion),
    }


def _heading(a: Analysis) -> float:
    """Return where the launch aimed, left of +x [rad]: the disc, or else the velocity."""
    s = a.release
    if a.again is not None:
        return frames.flip(float(frames.euler_from_quaternion((s.e0, s.e1, s.e2, s.e3))[2]))
    vx, vy, _ = frames.flip_yz(s[3:6])
    return math.atan2(vy, vx)


def changes_of(flight: Flight) -> list[Change]:
    """Return what was applied during a flight."""
    end = int(flight.motion.stamps[-1])
    return [c for c in flight.disc.changes if flight.start <= c.stamp <= end]


def _change_document(change: Change, flight: Flight) -> dict[str, Any]:
    return {
        'topic': change.topic,
        't_s': (change.stamp - flight.start) / NANOSECONDS,
        'values': list(change.values),
        'frame': change.frame,
    }
