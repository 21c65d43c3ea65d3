"""The flags of a throw, which `fly` and `demo` share, and what they mean together."""

import argparse
import math
from pathlib import Path

from disc_sim_ros.cli.arguments import Parser, number
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, flight, launch, theory
from disc_sim_ros.physics.disc import AERODYNAMICS
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.frames import paper_from_map
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.quantities import LAUNCH

PAPER = 'Crowther & Potts, Sports Engineering 10 (2007) 3-21'
DEFAULT_DISC = 'frisbee'
PUBLISH_RATE = 200.0  # Hz at most, in bags: as sim_node does by default

# Flag, field of Launch, metavar, help.
LAUNCH_FLAGS = (
    ('--speed', 'speed', 'M/S', 'speed over the ground'),
    ('--pitch', 'pitch', 'DEG', 'nose up positive'),
    ('--roll', 'roll', 'DEG', 'right edge down positive'),
    ('--yaw', 'yaw', 'DEG', 'right of +x positive'),
    ('--alpha', 'angle_of_attack', 'DEG', 'velocity below the x axis of the disc'),
    ('--sideslip', 'sideslip', 'DEG', 'velocity turned right in the plane of the disc'),
    ('--roll-rate', 'roll_rate', 'RAD/S', 'p at release'),
    ('--pitch-rate', 'pitch_rate', 'RAD/S', 'q at release'),
    ('--height', 'height', 'M', 'of the release above the ground'),
)
FLAG_OF = {field: flag for flag, field, _, _ in LAUNCH_FLAGS} | {
    'spin': '--spin',
    'physics_rate': '--step, which means a physics_rate',
    'publish_rate': '--samples',
    'disc': '--disc',
    'model': '--model',
    'aero': '--aero',
    'moment_axes': '--moment-axes',
    'step': '--step',
}


def add_disc(p: Parser) -> None:
    """Add what flies, and how it is computed."""
    what = p.add_argument_group('what flies, and how it is computed')
    what.add_argument(
        '--disc',
        default=DEFAULT_DISC,
        metavar='NAME|FILE.yaml',
        help=f'{", ".join(disc_file.disc_names())}, or your own file',
    )
    what.add_argument('--model', choices=tuple(flight.MODELS), default='exact', help='rigid body')
    what.add_argument(
        '--aero',
        choices=AERODYNAMICS,
        default=argparse.SUPPRESS,
        help="steady coefficients (default: the disc's own)",
    )
    what.add_argument(
        '--moment-axes',
        choices=tuple(flight.MOMENT_AXES),
        default='body',
        help='axes in which the moment coefficients act: 3 (body) or 4 (wind)',
    )
    add_number(what, '--step', 1e-3, 1e-6, 0.1, 's', 'S', 'integration step')


def add_launch(p: Parser) -> None:
    """Add the release."""
    thrown = p.add_argument_group('launch')
    for flag, field, metavar, text in LAUNCH_FLAGS:
        q = LAUNCH[field]
        add_number(thrown, flag, q.default, q.lowest, q.highest, q.unit, metavar, text)
    spin = thrown.add_mutually_exclusive_group()
    q = LAUNCH['spin']
    text = 'clockwise from above positive'
    add_number(spin, '--spin', q.default, q.lowest, q.highest, q.unit, 'RAD/S', text)
    spin.add_argument(
        '--advance-ratio',
        type=number(-100.0, 100.0, ''),
        default=argparse.SUPPRESS,
        metavar='R',
        help='spin as r c / (2 speed) instead, c the diameter; from -100 to 100',
    )


def add_air(p: Parser, title: str) -> argparse._ArgumentGroup:
    """Add controls and air, and return their group."""
    around = p.add_argument_group(title)
    around.add_argument(
        '--control',
        nargs=3,
        type=number(-10.0, 10.0, ''),
        default=(0.0, 0.0, 0.0),
        metavar=('CL', 'CM', 'CN'),
        help='control input coefficients for the whole flight: roll right, nose up, spin up '
        'positive; from -10 to 10 each',
    )
    around.add_argument(
        '--wind',
        nargs=3,
        type=number(-100.0, 100.0, 'm/s'),
        default=(0.0, 0.0, 0.0),
        metavar=('X', 'Y', 'Z'),
        help='where the air moves to; from -100 to 100 m/s each',
    )
    text = 'Dryden gusts (MIL-F-8785C) of a mean wind of this speed at 6 m; 15 is moderate'
    add_number(around, '--turbulence', 0.0, 0.0, 50.0, 'm/s', 'M/S', text)
    around.add_argument(
        '--seed', type=_seed, default=0, metavar='N', help='of the gusts, a whole number from 0'
    )
    add_number(around, '--air-density', 1.225, 0.0, 100.0, 'kg/m^3', 'KG/M3', 'of the air')
    add_number(around, '--gravity', 9.81, 0.0, 100.0, 'm/s^2', 'M/S2', 'of the planet')
    return around


def thrown(chosen: argparse.Namespace) -> tuple[launch.Launch, flight.Setup]:
    """Return what the flags mean.

    Raises:
        ConfigError: They are not allowed together; `flag_of` says for which flag.
    """
    disc = disc_file.load_disc(chosen.disc)
    spin = chosen.spin
    if hasattr(chosen, 'advance_ratio'):
        if chosen.speed == 0.0 and chosen.advance_ratio != 0.0:
            raise ConfigError('--advance-ratio', chosen.advance_ratio, 'at --speed 0 give --spin')
        spin = theory.spin_rate(chosen.advance_ratio, disc.diameter, chosen.speed)
    values = {field: getattr(chosen, _dest(flag)) for flag, field, _, _ in LAUNCH_FLAGS}
    setup = flight.Setup(
        disc=disc,
        model=chosen.model,
        aero=getattr(chosen, 'aero', None),
        moment_axes=chosen.moment_axes,
        air=Air(density=chosen.air_density, gravity=chosen.gravity),
        wind=Wind(
            mean=tuple(paper_from_map(chosen.wind).tolist()),
            turbulence=chosen.turbulence,
            seed=chosen.seed,
        ),
        step=chosen.step,
    )
    return launch.Launch(spin=spin, **values), setup


def control_of(chosen: argparse.Namespace) -> Control:
    """Return the control inputs."""
    return Control(*chosen.control)


def parameters(
    chosen: argparse.Namespace, release: launch.Launch, setup: flight.Setup
) -> dict[str, bool | float | str]:
    """Return the parameters of a sim_node that flies the same.

    Raises:
        ConfigError: A step that is no number of steps a second.
    """
    rate = _reciprocal(setup.step)
    if rate is None:
        near = 1.0 / round(1.0 / setup.step)
        allowed = f'nodes and bags need a whole number of steps a second; near is {near:.12g}'
        raise ConfigError('--step', setup.step, allowed)
    disc = (
        chosen.disc if chosen.disc in disc_file.disc_names() else str(Path(chosen.disc).absolute())
    )
    x, y, z = chosen.wind
    return {
        'disc': disc,
        'model': setup.model,
        'aero': setup.aero or '',
        'moment_axes': setup.moment_axes,
        'physics_rate': rate,
        'publish_rate': rate / math.ceil(rate / PUBLISH_RATE),
        'air_density': setup.air.density,
        'gravity': setup.air.gravity,
        **{f'launch.{field}': float(getattr(release, field)) for field in LAUNCH},
        'wind.x': x,
        'wind.y': y,
        'wind.z': z,
        'wind.turbulence': setup.wind.turbulence,
        'wind.seed': setup.wind.seed,
    }


def flag_of(error: ConfigError, chosen: argparse.Namespace) -> str:
    """Return the flag that an error is about, or what it calls the thing itself."""
    flag = FLAG_OF.get(error.thing, error.thing)
    if flag == '--spin' and hasattr(chosen, 'advance_ratio'):
        return '--advance-ratio, which means a spin'
    return flag


def add_number(
    group: argparse._ActionsContainer,
    flag: str,
    default: float,
    lowest: float,
    highest: float,
    unit: str,
    metavar: str,
    text: str,
) -> None:
    """Add a flag that takes a number in a range."""
    group.add_argument(
        flag,
        type=number(lowest, highest, unit),
        default=default,
        metavar=metavar,
        help=f'{text}; from {lowest:g} to {highest:g} {unit}',
    )


def _reciprocal(step: float) -> float | None:
    """Return the whole rate whose step this is to the last bit, or None."""
    rate = float(round(1.0 / step))
    return rate if 1.0 / rate == step else None


def _seed(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) >= 2**63:
        allowed = f'give a whole number from 0 to {2**63 - 1}'
        raise argparse.ArgumentTypeError(f'{text!r} is not allowed; {allowed}')
    return int(text)


def _dest(flag: str) -> str:
    return flag.removeprefix('--').replace('-', '_')
