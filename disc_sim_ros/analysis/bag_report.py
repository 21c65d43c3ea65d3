"""Reports of a recorded flight: a document for programs, and lines to read."""

from collections.abc import Mapping
from datetime import UTC, datetime
import math
from typing import Any

import numpy as np

from disc_sim_ros import topics
from disc_sim_ros.analysis.bag_analysis import Analysis
from disc_sim_ros.analysis.checks import Stamps, turns_with_spin
from disc_sim_ros.analysis.flight_report import gusts_text, sideways, wind_text
from disc_sim_ros.analysis.recording import Began, Change, Flight
from disc_sim_ros.errors import printable
from disc_sim_ros.physics import frames, theory
from disc_sim_ros.physics.flight_config import Key
from disc_sim_ros.units import METRIC, NANOSECONDS, System

_SETUP = (
    Key.DISC,
    Key.MODEL,
    Key.AERO,
    Key.MOMENT_AXES,
    Key.PHYSICS_RATE,
    Key.PUBLISH_RATE,
    Key.VERSION,
    Key.FLIGHT,
)


# ---- documents for programs ----

UNSTAMPED = 'the header stamps do not advance, the times are log times'


def document(a: Analysis) -> dict[str, Any]:
    """Return an analysis as values that JSON knows; keys carry units, positions are in `map`."""
    flight, states = a.flight, a.trajectory
    configuration = flight.configuration
    position = frames.map_from_paper(states.position) + 0.0
    start = frames.map_from_paper(a.release[:3]) + 0.0
    end, time, spin = position[-1], float(states.t[-1]), float(states.spin[-1])
    spin_left = None
    if a.landing is not None:
        end, time = np.array([a.landing.x, a.landing.y, a.landing.z]), a.landing.time
        if a.landing.spin is not None:
            spin = a.landing.spin
            spin_left = spin / a.release.r if a.release.r else None
    away = end - start
    heading = _heading(a)
    return {
        'flight': flight.number,
        'start_ns': flight.start,
        'began': flight.began,
        'starts_late_s': flight.starts_late,
        'ended': flight.ended,
        'setup': None if configuration is None else _setup_document(configuration),
        'launch': _launch_document(a),
        'landed': a.landing is not None,
        'flight_time_s': time,
        'landing_position_m': None if a.landing is None else end.tolist(),
        'end_position_m': end.tolist(),
        'range_m': math.hypot(away[0], away[1]),
        'drift_m': math.cos(heading) * away[1] - math.sin(heading) * away[0],
        'apex_m': float(position[:, 2].max()),
        'greatest_speed_m_s': float(np.linalg.norm(states.velocity, axis=1).max()),
        'end_spin_rad_s': spin,
        'spin_left': spin_left,
        'wind': a.wind,
        'changes': [_change_document(c, flight) for c in flight.changes],
        'messages': {
            'count': a.stamps.count,
            'rate_hz': a.stamps.rate,
            'longest_gap_s': a.stamps.longest,
            'missing': a.stamps.missing,
            'missing_before': a.stamps.before,
            'missing_after': a.stamps.after,
            'repeated_stamps': a.stamps.repeated,
            'backward_stamps': a.stamps.backwards,
            'time_jumps': len(flight.jumps),
            'jumped_s': sum(shift for _, shift in flight.jumps) / NANOSECONDS,
        },
    }


def verification_document(a: Analysis) -> dict[str, Any]:
    """Return the verification as values that JSON knows."""
    results = {c.name: {'value': c.value, 'passed': c.passed} for c in a.checks}
    verification: dict[str, Any] = {'passed': a.passed, 'checks': results}
    if not a.flight.motion.is_stamped:
        return {'passed': False, 'checks': {}, 'not_verified': UNSTAMPED}
    if a.verdict is None:
        return verification | {'not_flown_again': a.why_not}
    return verification | {
        're_flight': {
            'exact': a.verdict.exact,
            'messages': a.verdict.compared,
            'identical_messages': a.verdict.identical,
            'first_difference_s': a.verdict.first,
            'largest_difference': {
                name: x if math.isfinite(x) else None for name, x in a.verdict.largest.items()
            },
            'doubts': list(a.verdict.doubts),
        }
    }


def _setup_document(configuration: Mapping[str, Any]) -> dict[str, Any]:
    values = {key: configuration.get(key) for key in _SETUP}
    return values | {Key.WIND: dict(configuration[Key.WIND])}


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
    """Return the heading of the launch, left of +x [rad]: of the disc, or else of the velocity."""
    s = a.release
    if a.again is not None:
        return frames.flip(float(frames.euler_from_quaternion((s.e0, s.e1, s.e2, s.e3))[2]))
    vx, vy, _ = frames.flip_yz(s[3:6])
    return math.atan2(vy, vx)


def _change_document(change: Change, flight: Flight) -> dict[str, Any]:
    return {
        'topic': change.topic,
        't_s': flight.time_of(change.stamp),
        'values': list(change.values),
        'frame': change.frame,
    }


# ---- lines to read ----


def summary(a: Analysis, system: System = METRIC) -> str:
    """Return an analysis in a few lines to read."""
    d, text = document(a), system.text
    launch, setup = d['launch'], d['setup']
    what = '' if setup is None else f'{_disc_and_model(setup)}, '
    lines = [
        f'  flight {a.flight.number}: {what}{utc(a.flight.start)} UTC'
        + (f', seen from {d["starts_late_s"]:.3f} s on' if d['starts_late_s'] else ''),
        f'    {_start_word(a.flight)} {text(launch["speed_m_s"], "m/s")}, '
        f'{_attitude_text(launch)}, {text(launch["height_m"], "m")} up',
        f'    spin      {_spin_text(launch["spin_rad_s"], system)}',
    ]
    if a.flight.began is Began.IN_FLIGHT:
        lines.append('    began     in flight: the bag holds neither the throw nor rest before it')
    if setup is None:
        lines.append(
            f'    path      climbs by {_tenths(launch["climb_deg"])} degrees, heads '
            f'{_tenths(launch["heading_deg"])} degrees right of +x; {a.wind}'
        )
    if launch['frame_spins']:
        lines.append('    frame     turns with the spin: roll, pitch and yaw go round with it')
    lines += _wind_lines(setup, system)
    lines += _steering_lines(a.flight)
    if d['landed']:
        x, y, _ = d['landing_position_m']
        left = '' if d['spin_left'] is None else f', {d["spin_left"]:.1%} of the spin left'
        lines.append(
            f'    landed    after {d["flight_time_s"]:.3f} s at x {text(x, "m")}, '
            f'y {text(y, "m")}{left}'
        )
    else:
        x, y, z = d['end_position_m']
        lines.append(
            f'    ended     after {d["flight_time_s"]:.3f} s in the air at x {text(x, "m")}, '
            f'y {text(y, "m")}, z {text(z, "m")} ({a.flight.ended})'
        )
    lines.append(
        f'    range     {text(d["range_m"], "m")}, {sideways(d["drift_m"], system)}, '
        f'apex {text(d["apex_m"], "m")}'
    )
    lines.append(f'    messages  {_stamps_text(a.stamps)}')
    if not a.flight.motion.is_stamped:
        lines.append(f'    time      {UNSTAMPED}')
    if jumps := a.flight.jumps:
        jumped = sum(shift for _, shift in jumps) / NANOSECONDS
        lines.append(f'    time      jumped to the wall clock, {jumped:.3f} s in all')
    return '\n'.join(lines)


def utc(stamp: int) -> str:
    """Return the day and time of a stamp [ns]."""
    return f'{datetime.fromtimestamp(stamp / NANOSECONDS, UTC):%Y-%m-%d %H:%M:%S}'


def title(a: Analysis, system: System = METRIC) -> str:
    """Return one line with what flew and how far."""
    d = document(a)
    launch, setup = d['launch'], d['setup']
    what = printable(a.flight.disc.name) if setup is None else _disc_and_model(setup)
    known = not math.isnan(launch['roll_deg'])
    spin = system.text(launch['spin_rad_s'], 'rad/s', '.4g')
    turning = f', pitch {launch["pitch_deg"]:.3g}°, spin {spin}'
    return (
        f'{what}: {system.text(launch["speed_m_s"], "m/s", ".4g")}{turning if known else ""}; '
        f'{system.text(d["range_m"], "m", ".1f")} in {d["flight_time_s"]:.2f} s'
    )


def verification_text(a: Analysis) -> str:
    """Return the verification in lines to read."""
    v = a.verdict
    if not a.flight.motion.is_stamped:
        return f'    verify    nothing is verified: {UNSTAMPED}'
    if v is None:
        lines = [f'    verify    not flown again: {a.why_not}']
        for check in a.checks:
            mark = 'ok' if check.passed else 'WRONG'
            lines.append(f'      {check.name.replace("_", " ")}: {mark}, {check.text}')
        return '\n'.join(lines)
    if v.exact:
        of = '' if a.flight.motion.has_twist else 'the poses of '
        landed = ' and the landing' if v.whole_landing else ''
        lines = [f'    verify    identical to the last bit: {of}{v.compared} messages{landed}']
        if missing := a.stamps.all_missing:
            lines[0] += f'; {missing} more are missing'
        return '\n'.join(lines + [f'      note: {doubt}' for doubt in v.doubts])
    same = '' if v.first is None else f', the first at {v.first:.3f} s'
    lines = [
        f'    verify    DIFFERENT: {v.compared - v.identical} of {v.compared} messages{same}; '
        'largest differences:'
    ]
    apart = [_difference(name, x) for name, x in v.largest.items() if x]
    lines += [f'      {"; ".join(apart[i : i + 4])}' for i in range(0, len(apart), 4)]
    reasons = v.doubts or ('the bag holds no reason; messages may have been lost',)
    return '\n'.join(lines + [f'      because: {reason}' for reason in reasons])


def _start_word(flight: Flight) -> str:
    return 'at first ' if flight.began is Began.IN_FLIGHT else 'launch   '


def _attitude_text(launch: Mapping[str, Any]) -> str:
    if math.isnan(launch['roll_deg']):
        return 'attitude unknown (the quaternions are 0)'
    return (
        f'pitch {_tenths(launch["pitch_deg"])}, roll {_tenths(launch["roll_deg"])}, '
        f'yaw {_tenths(launch["yaw_deg"])}, '
        f'angle of attack {_tenths(launch["angle_of_attack_deg"])} degrees'
    )


def _spin_text(spin: float, system: System) -> str:
    if math.isnan(spin):
        return 'unknown'
    turns = 'clockwise' if spin >= 0.0 else 'anticlockwise'
    return f'{system.text(spin, "rad/s")}, {turns} from above'


def _disc_and_model(setup: Mapping[str, Any]) -> str:
    return printable(f'{setup[Key.DISC]}, {setup[Key.MODEL]} model')


def _wind_lines(setup: Mapping[str, Any] | None, system: System) -> list[str]:
    if setup is None:
        return []
    wind = setup[Key.WIND]
    mean = [float(wind[axis]) for axis in 'xyz']
    lines = []
    if any(mean):
        lines.append(f'    wind      {wind_text(mean, system)}')
    if wind.get('turbulence'):
        lines.append(f'    gusts     {gusts_text(wind["turbulence"], wind["seed"], system)}')
    return lines


_STEERED = (
    (topics.APPLIED_COEFFICIENTS, 'coefficients changed'),
    (topics.APPLIED_MOMENT, 'the moment changed'),
    (topics.APPLIED_WIND, 'the wind changed'),
)


def _steering_lines(flight: Flight) -> list[str]:
    lines = []
    for topic, what in _STEERED:
        changes = [c for c in flight.changes if c.topic == topic]
        if topic == topics.APPLIED_WIND:
            changes = changes[1:]  # the first is the wind at the throw
        if changes:
            times = 'once' if len(changes) == 1 else f'{len(changes)} times'
            at = flight.time_of(changes[0].stamp)
            lines.append(f'    steered   {what} {times}, first at {at:.3f} s')
    return lines


def _stamps_text(stamps: Stamps) -> str:
    text = f'{stamps.count} at {stamps.rate:.6g} Hz'
    if stamps.even:
        text += ', stamps even'
    else:
        text += (
            f', {stamps.missing} missing (longest gap {stamps.longest:.3f} s), '
            f'{stamps.repeated} stamps repeated, {stamps.backwards} going back'
        )
    if stamps.before:
        text += f', {stamps.before} missing at the beginning'
    return f'{text}, {stamps.after} missing at the end' if stamps.after else text


def _tenths(x: float) -> str:
    return f'{round(x, 1) + 0.0:.1f}'  # no minus zero


def _difference(name: str, x: float) -> str:
    """Return a difference to read, such as 'position x 0.1 m' for 'position.x_m'."""
    for ending, unit in (('_rad_s', ' rad/s'), ('_m_s', ' m/s'), ('_m', ' m'), ('_s', ' s')):
        if name.endswith(ending):
            return f'{_words(name.removesuffix(ending))} {x:.3g}{unit}'
    return f'{_words(name)} {x:.3g}'


def _words(name: str) -> str:
    return name.replace('landed.landing', 'landing').replace('.', ' ').replace('_', ' ')
