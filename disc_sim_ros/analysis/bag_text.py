"""A recorded flight, and what was verified of it, in a few lines to read."""

from collections import Counter
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from disc_sim_ros.analysis.bag_report import Analysis, changes_of, document
from disc_sim_ros.analysis.checks import Stamps
from disc_sim_ros.analysis.flight_report import sideways
from disc_sim_ros.analysis.recording import NANOSECONDS, Flight


def summary(a: Analysis) -> str:
    """Return an analysis in a few lines to read."""
    d = document(a)
    launch, told = d['launch'], d['setup']
    what = '' if told is None else f'{told["disc"]}, {told["model"]} model, '
    when = datetime.fromtimestamp(a.flight.start / NANOSECONDS, UTC)
    turns = 'clockwise' if launch['spin_rad_s'] >= 0.0 else 'anticlockwise'
    lines = [
        f'  flight {a.flight.number}: {what}{when:%Y-%m-%d %H:%M:%S} UTC'
        + (f', {d["starts_late_s"]:.3f} s of it before the bag' if d['starts_late_s'] else ''),
        f'    launch    {launch["speed_m_s"]:.2f} m/s, pitch {_tenths(launch["pitch_deg"])}, '
        f'roll {_tenths(launch["roll_deg"])}, yaw {_tenths(launch["yaw_deg"])}, '
        f'angle of attack {_tenths(launch["angle_of_attack_deg"])} degrees, '
        f'{launch["height_m"]:.2f} m up',
        f'    spin      {launch["spin_rad_s"]:.2f} rad/s, {turns} from above',
    ]
    if told is None:
        lines.append(
            f'    path      climbs by {_tenths(launch["climb_deg"])} degrees, heads '
            f'{_tenths(launch["heading_deg"])} degrees right of +x; {a.wind}'
        )
    if launch['frame_spins']:
        lines.append('    frame     turns with the spin: roll, pitch and yaw go round with it')
    lines += _wind_lines(told)
    lines += _steering_lines(a.flight)
    if d['landed']:
        x, y, _ = d['landing_position_m']
        left = '' if d['spin_left'] is None else f', {d["spin_left"]:.1%} of the spin left'
        lines.append(
            f'    landed    after {d["flight_time_s"]:.3f} s at x {x:.2f} m, y {y:.2f} m{left}'
        )
    else:
        x, y, z = d['end_position_m']
        lines.append(
            f'    ended     after {d["flight_time_s"]:.3f} s in the air at x {x:.2f} m, '
            f'y {y:.2f} m, z {z:.2f} m ({a.flight.ended})'
        )
    lines.append(
        f'    range     {d["range_m"]:.2f} m, {sideways(d["drift_m"])}, apex {d["apex_m"]:.2f} m'
    )
    lines.append(f'    messages  {_stamps_text(a.stamps)}')
    return '\n'.join(lines)


def verification(a: Analysis) -> str:
    """Return what was verified in lines to read."""
    v = a.verdict
    if v is None:
        lines = [f'    verify    not flown again: {a.why_not}']
        for check in a.checks:
            mark = 'ok' if check.passed else 'WRONG'
            lines.append(f'      {check.name.replace("_", " ")}: {mark}, {check.text}')
        return '\n'.join(lines)
    if v.exact:
        landed = ' and the landing' if a.flight.landing else ''
        lines = [f'    verify    identical to the last bit: {v.compared} messages{landed}']
        return '\n'.join(lines + [f'      note: {doubt}' for doubt in v.doubts])
    same = '' if v.first is None else f', the first at {v.first:.3f} s'
    lines = [
        f'    verify    DIFFERENT: {v.compared - v.identical} of {v.compared} messages{same}; '
        'largest differences:'
    ]
    apart = [_difference(name, x) for name, x in v.largest.items() if x]
    lines += [f'      {"; ".join(apart[i : i + 4])}' for i in range(0, len(apart), 4)]
    reasons = v.doubts or ('nothing in the bag tells why; messages may have been lost',)
    return '\n'.join(lines + [f'      because: {reason}' for reason in reasons])


def _wind_lines(told: Mapping[str, Any] | None) -> list[str]:
    if told is None:
        return []
    wind = told['wind']
    mean = [float(wind[axis]) for axis in 'xyz']
    lines = []
    if any(mean):
        lines.append(f'    wind      {mean[0]:g} {mean[1]:g} {mean[2]:g} m/s (forward, left, up)')
    if wind.get('turbulence'):
        lines.append(f'    gusts     {wind["turbulence"]:g} m/s at 6 m, seed {wind["seed"]}')
    return lines


def _steering_lines(flight: Flight) -> list[str]:
    counts = Counter(c.topic for c in changes_of(flight))
    counts['applied_wind'] -= 1  # each throw tells the wind that blows
    lines = []
    for topic, what in (
        ('applied_coefficients', 'coefficients changed'),
        ('applied_moment', 'the moment changed'),
        ('applied_wind', 'the wind changed'),
    ):
        if counts[topic] > 0:
            times = 'once' if counts[topic] == 1 else f'{counts[topic]} times'
            first = [c for c in changes_of(flight) if c.topic == topic][topic == 'applied_wind']
            at = (first.stamp - flight.start) / NANOSECONDS
            lines.append(f'    steered   {what} {times}, first at {at:.3f} s')
    return lines


def _stamps_text(stamps: Stamps) -> str:
    text = f'{stamps.count} at {stamps.rate:.6g} Hz'
    if stamps.even:
        return f'{text}, stamps even'
    return (
        f'{text}, {stamps.missing} missing (longest gap {stamps.longest:.3f} s), '
        f'{stamps.repeated} stamps repeated, {stamps.backwards} going back'
    )


def _tenths(x: float) -> str:
    return f'{round(x, 1) + 0.0:.1f}'  # no minus zero


def _difference(name: str, x: float) -> str:
    """Return a difference to read: 'position x 0.1 m' for 'position.x_m'."""
    for ending, unit in (('_rad_s', ' rad/s'), ('_m_s', ' m/s'), ('_m', ' m'), ('_s', ' s')):
        if name.endswith(ending):
            return f'{_words(name.removesuffix(ending))} {x:.3g}{unit}'
    return f'{_words(name)} {x:.3g}'


def _words(name: str) -> str:
    return name.replace('landed.landing', 'landing').replace('.', ' ').replace('_', ' ')
