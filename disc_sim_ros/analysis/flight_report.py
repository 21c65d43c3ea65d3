"""Reports of a simulated flight: a document for programs, a table, and a summary to read."""

from collections.abc import Sequence
from dataclasses import asdict
import math
from typing import Any

import numpy as np

from disc_sim_ros import __version__
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.flight import Flight, Setup
from disc_sim_ros.physics.theory import advance_ratio
from disc_sim_ros.physics.trajectory import Trajectory
from disc_sim_ros.units import METRIC, System


def document(flight: Flight) -> dict[str, Any]:
    """Return a flight as values that JSON knows; keys carry units, positions are in `map`.

    `range_m` is the distance over the ground from the release to the end, `drift_m` how far left
    of the launch heading it ended, `apex_m` the greatest height above the ground. The landing is
    null for a flight that ended in the air. Sampled arrays come with the samples.
    """
    values: dict[str, Any] = {
        'version': __version__,
        'launch': launch_document(flight),
        'landed': flight.landed,
        'flight_time_s': flight.time,
        'landing_position_m': flight.position.tolist() if flight.landed else None,
        'end_position_m': flight.position.tolist(),
        'range_m': flight.range,
        'drift_m': flight.drift,
        'apex_m': flight.apex,
        'end_spin_rad_s': flight.end.r,
    }
    if len(flight.trajectory):
        for name, column in columns(flight.trajectory).items():
            values[name] = [_plain(value) for value in column.tolist()]
    return values


def launch_document(flight: Flight) -> dict[str, Any]:
    """Return all values that are needed to repeat the flight, with units in the keys."""
    launch, setup, control = flight.launch, flight.setup, flight.control
    return {
        'disc': setup.disc.name,
        'model': setup.model,
        'aero': setup.aero or setup.disc.aero,
        'moment_axes': setup.moment_axes,
        'ground_contact': setup.lands_on,
        'speed_m_s': launch.speed,
        'pitch_deg': launch.pitch,
        'roll_deg': launch.roll,
        'yaw_deg': launch.yaw,
        'angle_of_attack_deg': launch.angle_of_attack,
        'sideslip_deg': launch.sideslip,
        'spin_rad_s': launch.spin,
        'roll_rate_rad_s': launch.roll_rate,
        'pitch_rate_rad_s': launch.pitch_rate,
        'height_m': launch.height,
        'control': [control.C_L, control.C_M, control.C_N],
        'wind_m_s': (frames.map_from_paper(setup.wind.mean) + 0.0).tolist(),
        'wind': {k: v for k, v in asdict(setup.wind).items() if k != 'mean'},
        'air_density_kg_m3': setup.air.density,
        'gravity_m_s2': setup.air.gravity,
        'step_s': setup.step,
    }


def columns(trajectory: Trajectory) -> dict[str, FloatArray]:
    """Return the sampled quantities, each of shape (n,) or (n, 3), under names with units."""
    euler = np.degrees(trajectory.euler)
    return {
        't_s': trajectory.t,
        'position_m': frames.map_from_paper(trajectory.position) + 0.0,
        'velocity_m_s': frames.map_from_paper(trajectory.velocity) + 0.0,
        'airspeed_m_s': trajectory.airspeed,
        'alpha_deg': np.degrees(trajectory.alpha),
        'roll_deg': euler[:, 0],
        'pitch_deg': euler[:, 1],
        'yaw_deg': euler[:, 2],
        'absolute_attitude_deg': np.degrees(trajectory.absolute_attitude),
        'spin_rad_s': trajectory.spin,
        'advance_ratio': trajectory.advance_ratio,
    }


def csv_text(trajectory: Trajectory) -> str:
    """Return the samples as comma-separated text with one header line."""
    names: list[str] = []
    parts: list[FloatArray] = []
    for name, values in columns(trajectory).items():
        if values.ndim == 2:
            quantity, unit = name.split('_', 1)
            names += [f'{quantity}_{axis}_{unit}' for axis in 'xyz']
        else:
            names.append(name)
        parts.append(values)
    lines = [','.join(names)]
    lines += [','.join(_cell(x) for x in row) for row in np.column_stack(parts).tolist()]
    return '\n'.join(lines) + '\n'


def _steps(setup: Setup) -> str:
    """Return how a flight is integrated, in words."""
    if setup.step is None:
        return 'error control'
    return f'RK4 step {setup.step * 1e3:g} ms'


def summary(flight: Flight, system: System = METRIC) -> str:
    """Return a flight in a few lines to read."""
    text = system.text
    launch, setup = flight.launch, flight.setup
    wind = frames.map_from_paper(setup.wind.mean) + 0.0
    turns = 'clockwise' if launch.spin >= 0.0 else 'anticlockwise'
    ratio = (
        f', AdvR {advance_ratio(abs(launch.spin), setup.disc.diameter, launch.speed):.2f}'
        if launch.speed > 0.0
        else ''
    )
    lines = [
        f'{setup.disc.name}: {setup.disc.description or "no description"}',
        f'  model   {setup.model}, {setup.aero or setup.disc.aero} aerodynamics, '
        f'moments in {setup.moment_axes} axes, {_steps(setup)}',
        f'  launch  {text(launch.speed, "m/s", "g")}, pitch {launch.pitch:g}, '
        f'roll {launch.roll:g}, yaw {launch.yaw:g}, '
        f'angle of attack {launch.angle_of_attack:g} degrees, {text(launch.height, "m", "g")} up',
        f'  spin    {text(launch.spin, "rad/s", "g")}, {turns} from above{ratio}',
    ]
    if any((launch.sideslip, launch.roll_rate, launch.pitch_rate)):
        lines.append(
            f'  also    sideslip {launch.sideslip:g} degrees, roll rate {launch.roll_rate:g}, '
            f'pitch rate {launch.pitch_rate:g} rad/s'
        )
    if np.any(wind != 0.0):
        lines.append(f'  wind    {wind_text(wind, system)}')
    if setup.wind.turbulence:
        lines.append(f'  gusts   {gusts_text(setup.wind.turbulence, setup.wind.seed, system)}')
    control = flight.control
    if any((control.C_L, control.C_M, control.C_N)):
        lines.append(f'  control C_L {control.C_L:g}, C_M {control.C_M:g}, C_N {control.C_N:g}')
    ended = 'landed ' if flight.landed else 'in the air'
    lines += [
        f'  {ended} after {flight.time:.3f} s at x {text(flight.position[0], "m")}, '
        f'y {text(flight.position[1], "m")}, z {text(flight.position[2], "m")}',
        *(['  (on the ground and not climbing: try --height 1)'] if flight.time == 0.0 else []),
        f'  range   {text(flight.range, "m")}, {sideways(flight.drift, system)}, '
        f'apex {text(flight.apex, "m")}',
        f'  speed   {text(math.hypot(*flight.end[3:6]), "m/s")} at the end'
        + (f', {flight.end.r / launch.spin:.1%} of the spin left' if launch.spin else ''),
    ]
    return '\n'.join(lines)


def wind_text(wind: Sequence[float] | FloatArray, system: System = METRIC) -> str:
    """Return a wind in `map` axes [m/s], to read."""
    x, y, z = (system.number(float(w), 'm/s') for w in wind)
    return f'{x:g} {y:g} {z:g} {system.speed} (forward, left, up)'


def gusts_text(turbulence: float, seed: int, system: System = METRIC) -> str:
    """Return the gusts of a mean wind at 6 m [m/s], to read."""
    at = system.text(6.0, 'm', '.3g')
    return f'{system.text(turbulence, "m/s", "g")} at {at}, seed {seed}'


def samples_text(trajectory: Trajectory, system: System = METRIC) -> str:
    """Return the samples as an aligned table to read; angles in degrees."""
    samples = columns(trajectory)
    lines = [
        '     t s '
        + ' '.join(f'{f"{axis} {system.length}":>8}' for axis in 'xyz')
        + f' {f"V {system.speed}":>7}  alpha   roll  pitch lambda {_spin_head(system):>6}  AdvR'
    ]
    position = system.number(samples['position_m'], 'm')
    airspeed = system.number(samples['airspeed_m_s'], 'm/s')
    spin = system.number(samples['spin_rad_s'], 'rad/s')
    angles = ('alpha_deg', 'roll_deg', 'pitch_deg', 'absolute_attitude_deg')
    for i, t in enumerate(trajectory.t):
        x, y, z = position[i]
        line = f'{t:8.3f} {x:8.3f} {y:8.3f} {z:8.3f} {airspeed[i]:7.2f}'
        line += ''.join(f' {samples[name][i]:6.1f}' for name in angles)
        line += f' {spin[i]:6.2f} {samples["advance_ratio"][i]:5.2f}'
        lines.append(line)
    return '\n'.join(lines)


def _spin_head(system: System) -> str:
    return 'spin' if system is METRIC else system.spin


def sideways(drift: float, system: System = METRIC) -> str:
    """Return a drift in words; positive is left [m]."""
    return f'drift {system.text(abs(drift), "m")} to the {"left" if drift >= 0.0 else "right"}'


def _plain(value: Any) -> Any:
    """Return None, JSON's null, for numbers that JSON does not know."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _cell(value: float) -> str:
    return repr(value) if math.isfinite(value) else ''
