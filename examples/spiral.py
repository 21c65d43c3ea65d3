"""Fly the paper's two manoeuvres by commands from another node: spiral turn and spiral roll.

    .venv/bin/python examples/spiral.py turn
    .venv/bin/python examples/spiral.py roll

A constant rolling moment, C_L = 0.1, holds the nose of a spinning disc up: a banked disc flies a
turn without end (Fig. 11). A constant pitching moment, C_M = 0.2, rolls the disc without end
(Fig. 12). The node renews its command on `cmd_coefficients`, as a controller on another machine
would.
"""

import argparse
from dataclasses import dataclass
import math
import sys

from geometry_msgs.msg import Vector3, Vector3Stamped
from rclpy.context import Context

from disc_sim_ros import DiscSimError, load_disc
from disc_sim_ros.cli.arguments import Parser
from disc_sim_ros.physics.theory import spin_rate
from disc_sim_ros.ros.qos import COMMAND_QOS, STATE_QOS
from disc_sim_ros.topics import APPLIED_COEFFICIENTS, CMD_COEFFICIENTS
import session
from session import Flier

RATE = 50.0  # Hz
TIMEOUT = 10.0  # s of simulated time; the paper's moment is constant even if a renewal is late


@dataclass(frozen=True)
class Manoeuvre:
    """A launch with a constant command, from the caption of a figure."""

    command: tuple[float, float, float]  # C_L, C_M, C_N
    advance_ratio: float
    launch: dict[str, float]  # m/s, degrees; the height [m] leaves room for the manoeuvre


MANOEUVRES = {
    'turn': Manoeuvre(
        (0.1, 0.0, 0.0),
        0.5,
        {'speed': 13.5, 'roll': -45.0, 'pitch': -30.0, 'angle_of_attack': 5.0, 'height': 20.0},
    ),
    'roll': Manoeuvre(
        (0.0, 0.2, 0.0),
        0.34,
        {'speed': 19.0, 'pitch': -20.0, 'angle_of_attack': -3.0, 'height': 50.0},
    ),
}


class Commander(Flier):
    """Renews one command from before the throw to the landing."""

    def __init__(self, command: tuple[float, float, float], context: Context) -> None:
        super().__init__('commander', context)
        C_L, C_M, C_N = command
        self._message = Vector3Stamped(vector=Vector3(x=C_L, y=C_M, z=C_N))
        self._publisher = self.create_publisher(Vector3Stamped, CMD_COEFFICIENTS, COMMAND_QOS)
        self._applied: list[Vector3Stamped] = []
        self.create_subscription(
            Vector3Stamped, APPLIED_COEFFICIENTS, self._applied.append, STATE_QOS
        )
        self.create_timer(1.0 / RATE, lambda: self._publisher.publish(self._message))

    def is_ready(self) -> bool:
        """Return True if the command acts already, so that it acts from the release on."""
        return super().is_ready() and self._message.vector in [m.vector for m in self._applied]


def parameters(manoeuvre: Manoeuvre) -> dict[str, object]:
    """Return the parameters of sim_node for the launch of a manoeuvre."""
    diameter = load_disc('frisbee').diameter
    spin = spin_rate(manoeuvre.advance_ratio, diameter, manoeuvre.launch['speed'])
    launch = {**manoeuvre.launch, 'spin': spin}
    return {f'launch.{name}': value for name, value in launch.items()} | {
        'command_timeout': TIMEOUT
    }


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = Parser(prog='spiral', description="Fly the paper's Fig. 11 or 12 by commands.")
    parser.add_argument('manoeuvre', choices=tuple(MANOEUVRES))
    session.add_options(parser)
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Fly once; return 0 after a landing."""
    options = parse(arguments)
    manoeuvre = MANOEUVRES[options.manoeuvre]
    folder = session.folder_of(options, f'spiral_{options.manoeuvre}')
    try:
        with session.recorded(parameters(manoeuvre), folder / 'bag', options.pace) as context:
            commander = Commander(manoeuvre.command, context)
            landing = commander.fly()
            commander.destroy_node()
    except (DiscSimError, RuntimeError) as error:
        print(f'spiral: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    session.show(folder)
    x, y = float(landing['landing_x_m']), float(landing['landing_y_m'])
    print(f'{options.manoeuvre}: landed at x {x:.2f} m, y {y:.2f} m', end=', ')
    print(f'{math.hypot(x, y):.2f} m away, after {float(landing["flight_time_s"]):.2f} s')
    return 0


if __name__ == '__main__':
    sys.exit(main())
