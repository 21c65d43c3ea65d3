"""A flight as a page shows it: poses, wind and curves over the time."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from disc_sim_ros.physics import frames
from disc_sim_ros.physics.flight import Flight
from disc_sim_ros.physics.trajectory import Trajectory
from disc_sim_ros.units import System
from disc_sim_ros.view import predicted
from disc_sim_ros.view.predicted import ShownPredictions
from disc_sim_ros.view.rounding import plain

LEVEL = (1.0, 0.0, 0.0, 0.0)  # the attitude of a disc that lies on the ground, heading +x
MOST_SAMPLES = 6000  # of one flight in a page; longer ones are thinned out evenly
# Digits behind the point: 0.1 mm, 1e-5 of a radian. They keep the page small.
_PLACES = {'t': 4, 'position': 4, 'attitude': 6, 'spin': 4, 'wind': 3, 'curve': 4}


@dataclass(frozen=True, eq=False)
class ShownFlight:
    """One flight of one disc.

    Attributes:
        name: What the page calls it.
        result: One line on how it ended; '' for none.
        trajectory: The motion, in the paper's axes, at least one sample.
        landed: True if the last sample is on the ground.
        wind_is_known: False where the wind in the trajectory is not that of the flight.
        predictions: What was predicted while it flew; None for a flight without a predictor.
    """

    name: str
    result: str
    trajectory: Trajectory
    landed: bool = True
    wind_is_known: bool = True
    predictions: ShownPredictions | None = None


def of_flight(flight: Flight, name: str, system: System) -> ShownFlight:
    """Return a simulated flight with its end as the last sample.

    Args:
        flight: A flight with samples.
        name: What the page calls it.
        system: Units of the text.

    Raises:
        ValueError: The flight has no samples.
    """
    rows = flight.trajectory.rows
    if not len(rows):
        raise ValueError('the flight has no samples: fly it with a sample rate')
    if flight.time > rows[-1, 0]:
        rows = np.vstack([rows, [flight.time, *flight.end, *rows[-1, 15:]]])
    ended = 'landed' if flight.landed else 'in the air'
    side = 'left' if flight.drift >= 0.0 else 'right'
    result = (
        f'{ended} after {flight.time:.2f} s, '
        f'range {system.text(flight.range, "m", ".1f")}, '
        f'{system.text(abs(flight.drift), "m", ".1f")} to the {side}'
    )
    trajectory = Trajectory(rows, flight.trajectory.diameter)
    return ShownFlight(name, result, trajectory, flight.landed)


def of_recording(
    trajectory: Trajectory,
    name: str,
    result: str,
    *,
    landed: bool,
    wind_is_known: bool,
    turns_with_spin: bool,
) -> ShownFlight:
    """Return a recorded flight, whose spin angle is the integral of its spin rate.

    A recording may lack values: samples without a position are left out, and where there is no
    attitude the disc is shown level.

    Args:
        trajectory: The recorded motion.
        name: What the page calls it.
        result: One line on how it ended.
        landed: True if it ended on the ground.
        wind_is_known: True if the trajectory has the wind of the flight.
        turns_with_spin: True if the recorded attitude is that of the plastic, spin included.

    Raises:
        ValueError: No sample has a position.
    """
    rows = trajectory.rows[np.isfinite(trajectory.position).all(axis=1)]
    if not len(rows):
        raise ValueError('no sample has a position')
    rows = rows.copy()
    known = np.isfinite(rows[:, 7:11]).all(axis=1)
    rows[~known, 7:11] = LEVEL
    spin = np.zeros(len(rows)) if turns_with_spin else np.nan_to_num(rows[:, 13])
    steps = np.diff(rows[:, 0]) * (spin[:-1] + spin[1:]) / 2.0
    rows[:, 14] = np.concatenate([[0.0], np.cumsum(steps)])
    wind_is_known = wind_is_known and bool(np.isfinite(rows[:, 15:]).all())
    return ShownFlight(name, result, Trajectory(rows, trajectory.diameter), landed, wind_is_known)


def thinned(trajectory: Trajectory, most: int = MOST_SAMPLES) -> Trajectory:
    """Return at most `most` samples, evenly spread, with the first and the last."""
    n = len(trajectory)
    if n <= most:
        return trajectory
    chosen = np.unique(np.linspace(0, n - 1, most).round().astype(int))
    return Trajectory(trajectory.rows[chosen], trajectory.diameter)


def curve_labels(system: System) -> list[tuple[str, str]]:
    """Return the names and units of the curves of a flight, in the order of `document`."""
    return [
        ('height', system.length),
        ('airspeed', system.speed),
        ('angle of attack', '°'),
        ('spin', system.spin),
        ('pitch', '°'),
        ('roll', '°'),
    ]


def document(flight: ShownFlight, system: System, most: int = MOST_SAMPLES) -> dict[str, Any]:
    """Return a flight as values that JSON knows.

    Positions [m] and quaternions x, y, z, w are those of `disc` in `map`, one after the other in
    flat lists. `spin` is the angle of `disc_body` in `disc` about z up [rad], not reduced to one
    turn, so that a page can interpolate it for any spin rate. Curves are in units of `system`;
    null where a value does not exist. Those of predictions come last, see `predicted.curves`.
    A longer flight is thinned to `most` samples.
    """
    t = thinned(flight.trajectory, most)
    up = frames.map_from_paper(t.position)
    wind = frames.map_from_paper(t.wind)
    euler = np.degrees(np.unwrap(t.euler, axis=0))
    curves = (
        system.number(up[:, 2], 'm'),
        system.number(t.airspeed, 'm/s'),
        np.degrees(t.alpha),
        system.number(t.spin, 'rad/s'),
        euler[:, 1],
        euler[:, 0],
    )
    has_wind = flight.wind_is_known and bool(np.any(wind != 0.0))
    values: dict[str, Any] = {
        'name': flight.name,
        'result': flight.result,
        'diameter': t.diameter,
        'landed': flight.landed,
        't': plain(t.t - t.t[0], _PLACES['t']),
        'position': plain(up, _PLACES['position']),
        'attitude': plain(frames.message_quaternion(t.attitude), _PLACES['attitude']),
        'spin': plain(-np.asarray(t.spin_angle), _PLACES['spin']),
        'wind': plain(wind, _PLACES['wind']) if has_wind else None,
        'curves': [plain(curve, _PLACES['curve']) for curve in curves],
    }
    if flight.predictions is not None:
        values['curves'] += predicted.curves(flight.predictions, t.t - t.t[0], system)
        values['predictions'] = predicted.document(flight.predictions, most)
    return values
