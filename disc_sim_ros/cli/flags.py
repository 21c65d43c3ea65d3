"""The flags of a throw, which several programs share, and what they mean together."""

import argparse
import math
from pathlib import Path
from typing import Any

from disc_sim_ros.cli.arguments import Parser, add_components, add_quantity, path
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, flight, launch, theory, thrower
from disc_sim_ros.physics.disc import AERODYNAMICS, GROUND_CONTACTS
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.frames import paper_from_map
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.quantities import (
    ADVANCE_RATIO,
    AIR,
    ALTITUDE,
    CONTROL,
    DURATION,
    LAUNCH,
    MEAN_WIND,
    SAMPLE_RATE,
    STEP,
    TEMPERATURE,
    THROWER,
    TIMING,
    WIND,
)
from disc_sim_ros.ros.sim.parameters import PARAMETER_OF

PAPER = 'Crowther & Potts, Sports Engineering 10 (2007) 3-21'
PUBLISH_RATE: float = TIMING['publish_rate'].default  # Hz at most, in bags: as of sim_node

# The flag of each quantity of a launch.
LAUNCH_FLAGS = {name: f'--{name.replace("_", "-")}' for name in LAUNCH}
LAUNCH_FLAGS |= {'angle_of_attack': '--alpha', ADVANCE_RATIO.name: '--advance-ratio'}
# Quantities of sim_node that a flag gives, and how a message says so.
_GIVEN_BY = {
    'physics_rate': (STEP.name, ', which means a physics_rate'),
    'publish_rate': (SAMPLE_RATE.name, ''),
}


class Discs(argparse.Action):
    """Collects the values of several `--disc` in `discs`; `disc` is the first."""

    def __call__(self, _: object, chosen: argparse.Namespace, value: Any, *__: object) -> None:
        """Add a value."""
        chosen.discs = [*getattr(chosen, 'discs', ()), value]
        chosen.disc = chosen.discs[0]


class OneDisc(argparse.Action):
    """Takes one `--disc`, and refuses another, which other programs compare with it."""

    def __call__(self, _: object, chosen: argparse.Namespace, value: Any, *__: object) -> None:
        """Take the value."""
        if hasattr(chosen, 'discs'):
            raise argparse.ArgumentError(self, f'{value!r} is not allowed; give one disc')
        chosen.discs, chosen.disc = (value,), value


def add_disc(p: Parser, *, several: bool = False) -> None:
    """Add the flags of the disc and of the model; `--disc` may be given several times."""
    what = p.add_argument_group('disc and model')
    what.add_argument(
        '--disc',
        type=path,
        action=Discs if several else OneDisc,
        default=disc_file.DEFAULT_DISC,
        metavar='NAME|FILE.yaml|NUMBERS',
        help=f'{", ".join(disc_file.disc_names())}, your own file, or flight numbers: 11/5/-1/3'
        + ('; give it several times to compare discs' if several else ''),
    )
    what.add_argument(
        '--model', choices=tuple(flight.MODELS), default=flight.Setup.model, help='rigid body'
    )
    what.add_argument(
        '--aero',
        choices=AERODYNAMICS,
        default=argparse.SUPPRESS,
        help="steady coefficients (default: the disc's own)",
    )
    what.add_argument(
        '--moment-axes',
        choices=tuple(flight.MOMENT_AXES),
        default=flight.Setup.moment_axes,
        help='axes in which the moment coefficients act: 3 (body) or 4 (wind)',
    )
    what.add_argument(
        '--ground',
        choices=GROUND_CONTACTS,
        default=argparse.SUPPRESS,
        help='what touches the ground: the centre, as in the paper, or the rim '
        "(default: the disc's own)",
    )
    add_step(what)


def add_step(group: argparse._ActionsContainer) -> None:
    """Add `--step`; without it a flight has error control."""
    text = (
        'even integration steps of RK4 (default: error control, which keeps the landing within '
        '0.01 mm of that of far shorter steps)'
    )
    add_quantity(group, '--step', STEP, text=text, default=None)


def add_launch(p: Parser) -> None:
    """Add the flags of the release."""
    group = p.add_argument_group('launch')
    spin = group.add_mutually_exclusive_group()
    for name, quantity in LAUNCH.items():
        add_quantity(spin if name == 'spin' else group, LAUNCH_FLAGS[name], quantity)
    add_thrower(p)
    add_quantity(
        spin,
        LAUNCH_FLAGS[ADVANCE_RATIO.name],
        ADVANCE_RATIO,
        metavar='R',
        text='spin as r c / (2 speed), where c is the diameter of the disc',
        default=argparse.SUPPRESS,
    )


def refuse_launch(chosen: argparse.Namespace, by: str) -> None:
    """Refuse flags of the release, except its height, beside a flag that gives releases.

    Raises:
        ConfigError: There is one; `by` is the flag that gives them.
    """
    given = {
        LAUNCH_FLAGS[n]: getattr(chosen, n)
        for n, q in LAUNCH.items()
        if n != 'height' and getattr(chosen, n) != q.default
    }
    for name in ('throw', *THROWER, ADVANCE_RATIO.name):
        if hasattr(chosen, name):
            given[f'--{name.replace("_", "-")}'] = getattr(chosen, name)
    for flag, value in given.items():
        raise ConfigError(flag, value, f'{by} gives the releases')


def add_thrower(p: Parser) -> None:
    """Add the flags of a release in the words of disc golf."""
    group = p.add_argument_group(
        "a thrower's words",
        'In place of --pitch, --roll, --alpha and the sign of --spin. Numbers take units: 60mph, '
        '1200rpm, 5ft, 90km/h.',
    )
    group.add_argument(
        '--throw',
        choices=tuple(thrower.THROWS),
        default=argparse.SUPPRESS,
        help='right or left hand, backhand or forehand: gives the sense of the spin',
    )
    for name, quantity in THROWER.items():
        flag = f'--{name.replace("_", "-")}'
        add_quantity(group, flag, quantity, default=argparse.SUPPRESS)


def add_air(p: Parser, title: str) -> argparse._ArgumentGroup:
    """Add the flags of the control inputs and of the air, and return their group."""
    group = p.add_argument_group(title)
    text = (
        'control input coefficients for the whole flight: right edge down, nose up and clockwise '
        'from above positive'
    )
    add_components(group, '--control', list(CONTROL.values()), ('CL', 'CM', 'CN'), text)
    text = 'velocity of the air in map axes'
    add_components(group, '--wind', list(MEAN_WIND.values()), ('X', 'Y', 'Z'), text)
    add_quantity(group, '--turbulence', WIND['turbulence'])
    add_quantity(group, '--seed', WIND['gust_seed'], dest='seed')
    add_density(group)
    return group


def add_density(group: argparse._ActionsContainer) -> None:
    """Add the flags of density and gravity."""
    add_quantity(group, '--air-density', AIR['air_density'])
    for quantity in (ALTITUDE, TEMPERATURE):
        add_quantity(group, f'--{quantity.name}', quantity, default=argparse.SUPPRESS)
    add_quantity(group, '--gravity', AIR['gravity'])


def add_duration(group: argparse._ActionsContainer) -> None:
    """Add `--duration`, at least as long as the shortest step."""
    add_quantity(group, '--duration', DURATION.within(STEP.lowest))


def add_no_ground(group: argparse._ActionsContainer) -> None:
    """Add `--no-ground`."""
    group.add_argument(
        '--no-ground', action='store_true', help='continue below z = 0, for the whole --duration'
    )


def thrown(chosen: argparse.Namespace) -> tuple[launch.Launch, flight.Setup]:
    """Return the launch and the setup that the flags describe.

    Raises:
        ConfigError: The flags contradict each other; `in_flags` returns it with the flag.
    """
    disc = disc_file.load_disc(chosen.disc)
    spin = sense(chosen) * chosen.spin
    if hasattr(chosen, 'advance_ratio'):
        if chosen.speed == 0.0 and chosen.advance_ratio != 0.0:
            raise ConfigError('--advance-ratio', chosen.advance_ratio, 'at --speed 0 give --spin')
        ratio = sense(chosen) * chosen.advance_ratio
        spin = theory.spin_rate(ratio, disc.diameter, chosen.speed)
    values = {name: getattr(chosen, name) for name in LAUNCH} | {'spin': spin}
    values |= _thrower_angles(chosen, spin)
    setup = flight.Setup(
        disc=disc,
        model=chosen.model,
        aero=getattr(chosen, 'aero', None),
        moment_axes=chosen.moment_axes,
        air=air_of(chosen),
        wind=Wind(
            mean=tuple(paper_from_map(chosen.wind).tolist()),
            turbulence=chosen.turbulence,
            seed=chosen.seed,
        ),
        step=chosen.step,
        ground_contact=getattr(chosen, 'ground', None),
    )
    return launch.Launch(**values), setup


def sense(chosen: argparse.Namespace) -> int:
    """Return 1 or -1, by which `--throw` multiplies the spin."""
    if not hasattr(chosen, 'throw'):
        return 1
    given = getattr(chosen, ADVANCE_RATIO.name, chosen.spin)
    if given < 0.0:
        raise ConfigError('--throw', chosen.throw, 'it gives the sense of the spin: give no minus')
    return thrower.THROWS[chosen.throw]


def _thrower_angles(chosen: argparse.Namespace, spin: float) -> dict[str, float]:
    """Return the angles of a launch that `--launch-angle`, `--nose` and `--hyzer` mean."""
    given = {name: getattr(chosen, name) for name in THROWER if hasattr(chosen, name)}
    if not given:
        return {}
    for name, replaced in (('hyzer', 'roll'), ('nose', 'angle_of_attack'), *_OTHERS):
        if name in given and getattr(chosen, replaced) != LAUNCH[replaced].default:
            flag = LAUNCH_FLAGS[replaced]
            raise ConfigError(
                f'--{name.replace("_", "-")}', given[name], f'give no {flag} with it'
            )
    nose = given.get('nose', 0.0)
    return thrower.angles(
        given.get('launch_angle', chosen.pitch - nose),
        nose,
        given.get('hyzer', 0.0),
        yaw=chosen.yaw,
        clockwise=spin >= 0.0,
    )


_OTHERS = (('launch_angle', 'pitch'), ('hyzer', 'sideslip'), ('nose', 'sideslip'))


def air_of(chosen: argparse.Namespace) -> Air:
    """Return the air by its density, or by altitude and temperature."""
    given = [name for name in (ALTITUDE.name, TEMPERATURE.name) if hasattr(chosen, name)]
    if not given:
        return Air(density=chosen.air_density, gravity=chosen.gravity)
    if chosen.air_density != AIR['air_density'].default:
        raise ConfigError('--air-density', chosen.air_density, f'give no --{given[0]} with it')
    return thrower.air_at(
        getattr(chosen, ALTITUDE.name, ALTITUDE.default),
        getattr(chosen, TEMPERATURE.name, None),
        gravity=chosen.gravity,
    )


def control_of(chosen: argparse.Namespace) -> Control:
    """Return the control inputs of `--control`."""
    return Control(*chosen.control)


def parameters(
    chosen: argparse.Namespace, release: launch.Launch, setup: flight.Setup
) -> dict[str, bool | float | str]:
    """Return the parameters of a sim_node that flies the same flight in even steps.

    Raises:
        ConfigError: The step does not divide a second into a whole number of steps.
    """
    rate = _reciprocal(setup.fixed_step)
    if rate is None:
        near = 1.0 / round(1.0 / setup.fixed_step)
        allowed = f'nodes and bags need a whole number of steps a second; near is {near:.12g}'
        raise ConfigError('--step', setup.fixed_step, allowed, STEP.name)
    disc = chosen.disc
    if disc_file.is_file(disc):
        disc = str(Path(disc).absolute())
    quantities: dict[str, float] = {
        'air_density': setup.air.density,
        'gravity': setup.air.gravity,
        **{name: float(getattr(release, name)) for name in LAUNCH},
        **dict(zip(MEAN_WIND, chosen.wind, strict=True)),
        'turbulence': setup.wind.turbulence,
        'gust_seed': setup.wind.seed,
    }
    return {
        'disc': disc,
        'model': setup.model,
        'aero': setup.aero or '',
        'moment_axes': setup.moment_axes,
        'ground_contact': setup.ground_contact or '',
        'physics_rate': rate,
        'publish_rate': rate / math.ceil(rate / PUBLISH_RATE),
        **{PARAMETER_OF[name]: value for name, value in quantities.items()},
    }


def in_flags(error: ConfigError, chosen: argparse.Namespace, parser: Parser) -> ConfigError:
    """Return an error under the name of the flag that gave the refused value.

    Args:
        error: The error, of a quantity or an argument of the physics.
        chosen: The values of the flags.
        parser: Names the flags.
    """
    if error.quantity == 'spin' and hasattr(chosen, ADVANCE_RATIO.name):
        flag = LAUNCH_FLAGS[ADVANCE_RATIO.name]
        return error.named(f'{flag}, which means a spin')
    name, meaning = _GIVEN_BY.get(error.quantity, ('', ''))
    flag = parser.flag_of(name)
    return error.named(f'{flag}{meaning}') if flag else parser.in_flags(error)


def _reciprocal(step: float) -> float | None:
    """Return the whole rate whose step this is to the last bit, or None."""
    rate = float(round(1.0 / step))
    return rate if 1.0 / rate == step else None
