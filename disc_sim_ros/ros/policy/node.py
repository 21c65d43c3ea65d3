"""`policy_node`: flies a learned policy on a sim_node, in real time or in lockstep."""

from collections.abc import Sequence
import math
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Vector3, Vector3Stamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from disc_sim_ros import topics
from disc_sim_ros.arrays import Vector
from disc_sim_ros.envs.pilot import Pilot
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.physics.flight_config import EventKey, nanoseconds_of
from disc_sim_ros.ros import node_main, parameters, qos
from disc_sim_ros.ros.policy.options import POLICY_TABLE, policy_config
from disc_sim_ros.units import NANOSECONDS

PATIENCE = 60.0  # s for each answer of the simulator in lockstep; also for its start
_RETRY = 0.5  # s; a simulator that has not yet matched a client drops its answer
_NOTHING = (0.0, 0.0, 0.0)
_ENDINGS = (topics.FlightEvent.LANDED, topics.FlightEvent.RESET, topics.FlightEvent.FAILED)


class PolicyNode(Node):
    """Subscribes to the disc and publishes the commands of a pilot.

    In lockstep it pauses the simulator and throws. Then it repeats: it publishes a command, steps
    the simulator to the next message, and waits until the command and the new state have
    arrived. So no wall clock has an effect on the flight.

    Raises:
        ConfigError: A parameter is not allowed.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Subscribe; `start` begins a flight in lockstep."""
        super().__init__('policy_node', **kwargs)
        parameters.declare(self, POLICY_TABLE)
        parameters.refuse_unused(self)
        config = policy_config(parameters.values(self, POLICY_TABLE))
        self._pilot = Pilot(config.policy, config.target)
        self._lockstep = config.lockstep
        self._paused = self._thrown = self._ended = False
        self._failure = self._landing = ''
        self._sent = self._applied = _NOTHING
        self._state: tuple[int, tuple[float, ...]] = (-1, ())  # newest odometry
        self._released = -1  # stamp of the newest release [ns]
        self._ending = -1, ''  # stamp [ns] and name of the newest event that ends a flight
        self._since = time.monotonic()
        self._command = self.create_publisher(
            Vector3Stamped, topics.CMD_COEFFICIENTS, qos.COMMAND_QOS
        )
        for kind, name, take, profile in (
            (Vector3Stamped, topics.APPLIED_COEFFICIENTS, self._on_applied, qos.STATE_QOS),
            (Odometry, topics.RELEASE, self._on_release, qos.LATCHED_QOS),
            (DiagnosticStatus, topics.FLIGHT_EVENTS, self._on_event, qos.LATCHED_QOS),
            (Odometry, topics.ODOM, self._on_odometry, qos.STATE_QOS),
        ):
            self.create_subscription(kind, name, take, profile)
        # The clients come last: once the simulator answers, it has matched the subscriptions.
        self._pause = self.create_client(SetBool, 'sim_node/pause')
        self._throw = self.create_client(Trigger, 'sim_node/throw')
        self._step = self.create_client(Trigger, 'sim_node/step')
        if config.lockstep:
            self.create_timer(_RETRY, self._watch, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def start(self) -> None:
        """Say what happens."""
        x, y = self._pilot.target
        how = 'in lockstep' if self._lockstep else 'as soon as a disc is thrown'
        self.get_logger().info(f'steering to x {x:g} m, y {y:g} m, {how}')

    @property
    def is_working(self) -> bool:
        """Return False once the flight in lockstep has ended."""
        return not (self._ended or self._failure)

    def stop(self) -> str:
        """Return where the disc landed in lockstep.

        Raises:
            DiscSimError: The simulator did not answer.
        """
        if self._failure:
            raise DiscSimError(self._failure)
        return self._landing if self._lockstep else ''

    # ---- messages ----

    def _on_release(self, message: Odometry) -> None:
        stamp, numbers = _read(message)
        if self._lockstep and (not self._thrown or stamp < self._state[0]):
            return  # of an earlier throw
        self._released = stamp
        self._send(self._pilot.release(stamp, numbers))

    def _on_event(self, message: DiagnosticStatus) -> None:
        name = topics.event_of(message.name)
        if name in _ENDINGS:
            values = {pair.key: pair.value for pair in message.values}
            self._ending = nanoseconds_of(values.get(EventKey.STAMP, '')) or 0, name
            if self._state[1]:
                self._go_on()

    def _on_odometry(self, message: Odometry) -> None:
        self._state = _read(message)
        self._go_on()

    def _on_applied(self, message: Vector3Stamped) -> None:
        v = message.vector
        self._applied = v.x, v.y, v.z
        if self._lockstep:
            self._go_on()

    def _go_on(self) -> None:
        """Act on the newest state, in lockstep once the last command has acted."""
        stamp, numbers = self._state
        last = self._pilot.last
        if last is None or (self._lockstep and self._applied != self._sent):
            return
        if any(numbers[7:]):  # velocity and rates
            control = self._pilot.update(stamp, numbers)
            if control is not None:
                self._send(control)
        elif stamp > last and self._ending[0] >= self._released:  # a disc may also be put back
            self._end(numbers)

    def _end(self, numbers: tuple[float, ...]) -> None:
        self._pilot.land()
        ending = self._ending[1]
        if ending == topics.FlightEvent.LANDED:
            x, y = numbers[:2]
            miss = math.dist((x, y), self._pilot.target)
            self._landing = f'landed at x {x:.2f} m, y {y:.2f} m, {miss:.2f} m from the target'
        else:
            self._landing = f'the flight ended without a landing: {ending}'
        self.get_logger().info(self._landing)
        self._ended = self._lockstep

    def _send(self, control: Vector) -> None:
        C_L, C_M, C_N = self._sent = control
        self._command.publish(Vector3Stamped(vector=Vector3(x=C_L, y=C_M, z=C_N)))
        if self._lockstep:
            self._since = time.monotonic()
            self._call(self._step, Trigger.Request())

    # ---- lockstep ----

    def _watch(self) -> None:
        """Pause the simulator, then throw; end if it does not answer."""
        if time.monotonic() - self._since > PATIENCE:
            self._failure = f'the simulator did not answer within {PATIENCE:g} s'
        elif (
            not self._paused
            and self._pause.service_is_ready()
            and self._command.get_subscription_count()
        ):
            answer = self._pause.call_async(SetBool.Request(data=True))
            answer.add_done_callback(self._on_paused)

    def _on_paused(self, _: Any) -> None:
        if not self._paused:
            self._paused = self._thrown = True
            self._call(self._throw, Trigger.Request())

    def _call(self, client: Any, request: Any) -> None:
        client.call_async(request).add_done_callback(self._check)

    def _check(self, future: Any) -> None:
        if not future.result().success:
            self._failure = future.result().message


def _read(message: Odometry) -> tuple[int, tuple[float, ...]]:
    """Return the stamp [ns] and the numbers of an odometry, in the order of `frames.odometry`."""
    p, q = message.pose.pose.position, message.pose.pose.orientation
    v, w = message.twist.twist.linear, message.twist.twist.angular
    stamp = message.header.stamp
    numbers = (p.x, p.y, p.z, q.x, q.y, q.z, q.w, v.x, v.y, v.z, w.x, w.y, w.z)
    return stamp.sec * NANOSECONDS + stamp.nanosec, numbers


def main(args: Sequence[str] | None = None) -> int:
    """Steer until Ctrl-C or SIGTERM; in lockstep, until the landing.

    Returns:
        The exit code: 0, 1 if the simulator did not answer, 2 for bad arguments or parameters.
    """
    return node_main.run('policy_node', PolicyNode, args)


if __name__ == '__main__':
    sys.exit(main())
