"""Close the loop from `odom`: steer a thrown disc to land at a given point, in unknown wind.

    .venv/bin/python examples/steer_to_target.py --target 26 0 --roll 10 --wind 0 -3 0

Fifty times a second the pilot computes the landing of the disc and changes its plan to bring the
landing to the target. The plan is two pairs of the paper's C_L and C_M, one for now and one for
later. The pilot knows the disc but not the wind, which it estimates from the deviation of the disc
from the expected flight.
"""

import argparse
from dataclasses import replace
import math
import sys

from geometry_msgs.msg import Vector3, Vector3Stamped
from nav_msgs.msg import Odometry
import numpy as np
from rclpy.context import Context
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
import yaml

from disc_sim_ros import Control, Disc, DiscSimError, FlightSimulator, Setup, State, Wind, fly
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.cli import flags
from disc_sim_ros.cli.arguments import Parser
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.ros.messages import release_from_odometry
from disc_sim_ros.ros.qos import COMMAND_QOS, LATCHED_QOS
from disc_sim_ros.topics import CMD_COEFFICIENTS, CONFIGURATION, ODOM, Frames
import session
from session import Flier

PERIOD = 0.02  # s, between two plans
LIMIT = 0.05  # of C_L and C_M; the paper's spiral turn takes 0.1
FIRST_LEG = 1.2  # s after the release the second pair takes over
LAST_LEG = 0.3  # s; later, the second pair always lies this far ahead
PROBE = 2e-4  # change of a coefficient for the numerical derivative
SCALE = 0.02  # a coefficient of this size weighs as much as a metre
DAMPING = (0.05, 0.5, 5.0)  # m^2: from a bold step to a cautious one
GOOD_ENOUGH = 0.05  # m
COARSE, FINE = 0.02, 0.005  # s, integration steps: to the landing, and between two plans
WIND_SPREAD = 3.0  # m/s, before the first measurement
WIND_DRIFT = 0.01  # m/s from one plan to the next
VELOCITY_NOISE = 0.01  # m/s
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)  # old states are useless


class WindEstimator:
    """Estimates the horizontal wind by a Kalman filter on changes of the velocity.

    Attributes:
        wind: Estimate, earth axes (x forward, y right) [m/s], shape (2,).
    """

    def __init__(self, disc: Disc) -> None:
        self._setup = Setup(disc=disc, step=FINE)
        self.wind = np.zeros(2)
        self._P = WIND_SPREAD**2 * np.eye(2)

    def update(self, before: State, command: FloatArray, seconds: float, after: State) -> None:
        """Update the estimate from two states and the command that acted between them."""
        steps = round(seconds / FINE)

        def velocity(wind: FloatArray) -> FloatArray:
            sim = simulator(self._setup, before, wind, command)
            sim.advance(steps)
            return np.array(sim.state[3:6])

        expected = velocity(self.wind)
        probes = 0.1 * np.eye(2)  # m/s
        H = np.column_stack([(velocity(self.wind + d) - expected) / 0.1 for d in probes])
        S = H @ self._P @ H.T + VELOCITY_NOISE**2 * np.eye(3)
        K = self._P @ H.T @ np.linalg.inv(S)
        self.wind = self.wind + K @ (np.array(after[3:6]) - expected)
        self._P = (np.eye(2) - K @ H) @ self._P + WIND_DRIFT**2 * np.eye(2)


class Pilot:
    """Plans the commands that bring a disc to a target.

    Attributes:
        plan: C_L, C_M for now and C_L, C_M for later, shape (4,).
        expected: Expected landing with this plan, earth axes [m], shape (2,).
    """

    def __init__(self, disc: Disc, target: FloatArray) -> None:
        """Plan for a disc and a target in earth axes (x forward, y right) [m], shape (2,)."""
        self._setup = Setup(disc=disc, step=COARSE)
        self._estimator = WindEstimator(disc)
        self._target = target
        self._before: tuple[float, State] | None = None
        self.plan = np.zeros(4)
        self.expected = target

    @property
    def wind(self) -> FloatArray:
        """Return the estimated wind, earth axes [m/s], shape (2,)."""
        return self._estimator.wind

    def command(self, time: float, s: State) -> FloatArray:
        """Return C_L and C_M from now on, shape (2,).

        Args:
            time: Since the release [s].
            s: State of the disc; its spin angle has no effect.
        """
        if self._before is not None:
            then, state = self._before
            self._estimator.update(state, self.plan[:2], time - then, s)
            if then < FIRST_LEG <= time:
                self.plan[:2] = self.plan[2:]
        self._before = (time, s)
        leg = FIRST_LEG - time if time < FIRST_LEG else LAST_LEG
        self._improve(s, max(leg, COARSE))
        return self.plan[:2]

    def _improve(self, s: State, leg: float) -> None:
        """Improve the plan by damped Gauss-Newton steps."""
        at = self._landing(s, leg, self.plan)
        for _ in range(2):
            miss = self._target - at
            if math.hypot(*miss) < GOOD_ENOUGH:
                break
            probes = PROBE * np.eye(4)
            moved = [(self._landing(s, leg, self.plan + d) - at) / PROBE for d in probes]
            J = SCALE * np.column_stack(moved)
            for damping in DAMPING:
                step = SCALE * np.linalg.solve(J.T @ J + damping * np.eye(4), J.T @ miss)
                plan = np.clip(self.plan + step, -LIMIT, LIMIT)
                landing = self._landing(s, leg, plan)
                if math.hypot(*(self._target - landing)) < math.hypot(*miss):
                    self.plan, at = plan, landing
                    break
            else:
                break
        self.expected = at

    def _landing(self, s: State, leg: float, plan: FloatArray) -> FloatArray:
        sim = simulator(self._setup, s, self.wind, plan[:2])
        sim.advance(round(leg / COARSE))
        sim.control = Control(*plan[2:].tolist(), 0.0)
        for _ in range(20):  # at most 20 s
            if sim.landed:
                return np.array(sim.touch[:2])
            sim.advance(50)
        return np.array(sim.state[:2])


def simulator(setup: Setup, s: State, wind: FloatArray, command: FloatArray) -> FlightSimulator:
    """Return a simulator that continues from a state in a horizontal wind with a command."""
    around = replace(setup, wind=Wind(mean=(float(wind[0]), float(wind[1]), 0.0)))
    sim = FlightSimulator(around, s)
    sim.control = Control(*command.tolist(), 0.0)
    return sim


class Navigator(Flier):
    """A node around a Pilot: odometry in, coefficients out.

    Attributes:
        pilot: Exists from the throw on.
    """

    def __init__(self, target: tuple[float, float], context: Context) -> None:
        super().__init__('navigator', context)
        self.pilot: Pilot | None = None
        self._target = frames.paper_from_map((*target, 0.0))[:2]
        self._frames = Frames()
        self._received = False
        self._released = self._planned = 0  # ns
        self._command = self.create_publisher(Vector3Stamped, CMD_COEFFICIENTS, COMMAND_QOS)
        self.create_subscription(String, CONFIGURATION, self._on_throw, LATCHED_QOS)
        self.create_subscription(Odometry, ODOM, self._on_odometry, NEWEST)

    def is_ready(self) -> bool:
        """Return True if the simulator takes commands and its odometry arrives."""
        return super().is_ready() and self._command.get_subscription_count() > 0 and self._received

    def _on_throw(self, configuration: String) -> None:
        """Make a pilot for the thrown disc, whose properties are published with the throw."""
        document = yaml.safe_load(configuration.data)
        disc = disc_file.disc_from_document(document['disc'], document['disc_file'])
        self.pilot = Pilot(disc, self._target)
        self._released = self._planned = 0

    def _on_odometry(self, odometry: Odometry) -> None:
        self._received = True
        speed = odometry.twist.twist.linear
        now = odometry.header.stamp.sec * 10**9 + odometry.header.stamp.nanosec
        at_rest = not (speed.x or speed.y or speed.z)
        if self.pilot is None or at_rest or now < self._planned + PERIOD * 1e9:
            return
        self._released = self._released or now
        self._planned = now
        state = release_from_odometry(odometry, self._frames)
        C_L, C_M = self.pilot.command((now - self._released) * 1e-9, state).tolist()
        self._command.publish(Vector3Stamped(vector=Vector3(x=C_L, y=C_M)))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = Parser(prog='steer_to_target', description='Steer a thrown disc to a given point.')
    parser.add_argument(
        '--target',
        nargs=2,
        type=float,
        default=(26.0, 0.0),
        metavar=('X', 'Y'),
        help='where to land, m in map: x forward, y left (default 26 0)',
    )
    session.add_options(parser)
    flags.add_disc(parser)
    flags.add_launch(parser)
    flags.add_air(parser, 'air')
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Fly once; return 0 after a landing."""
    options = parse(arguments)
    folder = session.folder_of(options, 'steer_to_target')
    try:
        launch, setup = flags.thrown(options)
        parameters = flags.parameters(options, launch, setup)
        with session.recorded(parameters, folder / 'bag', options.pace) as context:
            navigator = Navigator(tuple(options.target), context)
            landing = navigator.fly()
            navigator.destroy_node()
    except (DiscSimError, RuntimeError) as error:
        print(f'steer_to_target: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    unsteered = fly(launch, setup).position
    session.show(folder)
    x, y = float(landing['landing_x_m']), float(landing['landing_y_m'])
    wind = frames.map_from_paper((*navigator.pilot.wind, 0.0))
    print(f'unsteered, it misses by {math.dist(unsteered[:2], options.target):.2f} m')
    print(f'steered, it lands at x {x:.2f} m, y {y:.2f} m', end=', ')
    print(f'{math.dist((x, y), options.target):.2f} m from the target')
    print(f'the estimated wind at the end: x {wind[0]:.2f} m/s, y {wind[1]:.2f} m/s')
    return 0


if __name__ == '__main__':
    sys.exit(main())
