"""What `identify` is given: its throws, the prior, and the errors of the instruments."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from disc_sim_ros import validation
from disc_sim_ros.cli import measured_file
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import flight
from disc_sim_ros.quantities import IDENTIFICATION

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from disc_sim_ros.estimation.identification.problem import Prior
    from disc_sim_ros.estimation.identification.releases import ReleaseErrors
    from disc_sim_ros.estimation.identification.throws import Throw
    from disc_sim_ros.estimation.throw_csv import Columns
    from disc_sim_ros.physics.thrower import Release

USED = ('position', 'attitude', 'gyro')  # unless --use says otherwise


def throws(chosen: argparse.Namespace, setup: flight.Setup) -> 'list[Throw]':
    """Return the throws of all files, with their measured releases."""
    from disc_sim_ros.estimation.identification.measured import (  # noqa: PLC0415
        Instruments,
        check_different,
        throw_from,
    )
    from disc_sim_ros.estimation.throw_csv import GROUPS, label  # noqa: PLC0415

    instruments = Instruments(
        gravity=setup.air.gravity,
        camera_height=getattr(chosen, 'camera_height', None),
        largest_acceleration=getattr(chosen, 'accelerometer_range', float('inf')),
        spin=getattr(chosen, 'spin', None),
    )
    used = _listed(chosen, 'use') or list(USED)
    for name in used:
        validation.choice('--use', name, GROUPS)
    measured: dict[str, dict] = {}  # type: ignore[type-arg]
    names = [Path(source).name for source in chosen.throws]
    for source, short in zip(chosen.throws, names, strict=True):
        of = short if names.count(short) == 1 else source  # files of two folders
        for throw, columns in _read(source, chosen.prog).items():
            name = label(throw)
            full = name if len(chosen.throws) == 1 else f'{of} {name}'
            if full in measured:
                raise ConfigError('throws', source, 'it is given twice')
            measured[full] = {k: v for k, v in columns.items() if k in {*used, 'camera'}}
            if not measured[full]:
                allowed = f'it has {", ".join(columns) or "no measurement"}, not {", ".join(used)}'
                raise ConfigError('throws', full, f'{allowed} (--use)')
    check_different(measured)
    releases = _releases(chosen, len(measured))
    return [
        throw_from(name, columns, setup.disc, instruments, release)
        for (name, columns), release in zip(measured.items(), releases, strict=True)
    ]


def _releases(
    chosen: argparse.Namespace, count: int
) -> 'Sequence[tuple[Release, ReleaseErrors] | None]':
    """Return the measured release of each throw with its errors, None without."""
    if not hasattr(chosen, 'techdisc'):
        return [None] * count
    from disc_sim_ros.analysis import techdisc  # noqa: PLC0415
    from disc_sim_ros.estimation.identification.releases import ReleaseErrors  # noqa: PLC0415

    rows = techdisc.throws(chosen.techdisc)
    if len(rows) != count:
        allowed = f'it has {len(rows)} releases, THROWS have {count} throws: give a row for each'
        raise ConfigError('--techdisc', chosen.techdisc, allowed)
    errors = ReleaseErrors(
        speed=chosen.release_speed_error,
        launch_angle=chosen.release_angle_error,
        nose=chosen.release_angle_error,
        hyzer=chosen.release_hyzer_error,
        spin=chosen.release_spin_error,
    )
    return [(row.release, errors) for row in rows]


def refuse_unused(
    chosen: argparse.Namespace, noise: 'Mapping[str, float]', throws: 'Sequence[Throw]'
) -> None:
    """Refuse flags about instruments that measured no throw.

    Raises:
        ConfigError: There is one, such as `--accelerometer-range` without `--use acceleration`.
    """
    kinds = {o.kind: None for throw in throws for o in throw.observations}  # in their order
    about = {f'--noise {kind}': (kind, value) for kind, value in noise.items()}
    for name, kind in (('camera_height', 'camera'), ('accelerometer_range', 'acceleration')):
        if hasattr(chosen, name):
            about[f'--{name.replace("_", "-")}'] = kind, getattr(chosen, name)
    for flag, (kind, value) in about.items():
        if kind not in kinds:
            allowed = f'these throws use {", ".join(kinds)}, not {kind}'
            raise ConfigError(flag, value, allowed)


def free(chosen: argparse.Namespace) -> list[str] | None:
    """Return the coefficients of `--free`, checked before anything is compiled."""
    from disc_sim_ros.estimation.identification import coefficients  # noqa: PLC0415

    names = _listed(chosen, 'free')
    if names is not None:
        coefficients.chosen(names)
    return names


def noise(chosen: argparse.Namespace) -> dict[str, float]:
    """Return the standard errors of `--noise` by instrument."""
    from disc_sim_ros.estimation.identification.observations import NOISE  # noqa: PLC0415

    of_each = {}
    for word in _listed(chosen, 'noise') or []:
        name, _, number = word.partition('=')
        validation.choice('--noise', name, NOISE)
        if name in of_each:
            raise ConfigError('--noise', name, 'name each instrument once')
        value = validation.as_number(number)
        try:
            of_each[name] = IDENTIFICATION['noise'].check(value)
        except ConfigError as error:
            raise ConfigError(f'--noise {name}', value, error.allowed) from None
    return of_each


def prior(chosen: argparse.Namespace) -> 'Prior':
    """Return what is believed of coefficients, wind and camera before the throws."""
    import numpy as np  # noqa: PLC0415

    from disc_sim_ros.estimation.identification.coefficients import NAMES  # noqa: PLC0415
    from disc_sim_ros.estimation.identification.problem import Prior  # noqa: PLC0415
    from disc_sim_ros.quantities import COEFFICIENT_SPREAD  # noqa: PLC0415

    return Prior(
        np.array([COEFFICIENT_SPREAD[name] for name in NAMES]),
        wind=tuple(chosen.wind),
        wind_deviation=chosen.wind_error,
        foot=tuple(chosen.camera_at),
        foot_deviation=chosen.camera_error,
    )


def _read(source: str, prog: str) -> 'Mapping[str, Columns]':
    """Return the measurements of each throw of a file or a bag."""
    if Path(source).suffix.lower() == '.csv':
        return measured_file.read(source, 'THROWS', prog)
    from disc_sim_ros.analysis import measured_flights  # noqa: PLC0415
    from disc_sim_ros.bags.reader import open_bag  # noqa: PLC0415

    return measured_flights.measured(open_bag(source))


def _listed(chosen: argparse.Namespace, name: str) -> list[str] | None:
    """Return the words of a flag that takes several, or None."""
    text = getattr(chosen, name, None)
    return None if text is None else [word.strip() for word in text.split(',') if word.strip()]
