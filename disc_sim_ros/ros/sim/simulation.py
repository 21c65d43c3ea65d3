"""A disc in simulated time: throws, commands, wind, and what is published when."""

from collections.abc import Callable
from dataclasses import replace
import math

from disc_sim_ros import topics
from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.flight_config import (
    EventKey,
    FlightConfig,
    configuration_text,
    exact_seconds,
)
from disc_sim_ros.physics.kernels.equations import State, Velocity
from disc_sim_ros.physics.kernels.integrator import Observation
from disc_sim_ros.physics.simulator import NOTHING, FlightSimulator
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.sim import events
from disc_sim_ros.ros.sim.clock import SimClock
from disc_sim_ros.ros.sim.commands import Commands, CommandTopic, pop_due
from disc_sim_ros.ros.sim.config import SimConfig
from disc_sim_ros.ros.sim.events import Counts, Event
from disc_sim_ros.ros.sim.imu import ImuErrors
from disc_sim_ros.ros.sim.inputs import Inputs
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.units import NANOSECONDS

FAR = NANOSECONDS  # a command further ahead is probably stamped by another clock
_AT_ONCE = ('real_time_factor', 'command_timeout', 'throw_period', 'path_rate')


class Simulation:
    """Flies the disc from message to message. It does not wait: the caller sets the pace.

    Attributes:
        clock: Simulated time.
        commands: The command topics.
        inputs: The control inputs and the wind.
        counts: Numbers of events so far.
        publishers: The topics that it publishes.
        imu_errors: The errors of the IMU in the present flight.
        config: The parameters in force; some of the newest wait for the next throw.
        flight: Number of the last flight since the start or a reset, from 1.
    """

    def __init__(
        self,
        config: SimConfig,
        publishers: Publishers,
        commands: Commands,
        start: int,
        warn: Callable[[str, str], None],
        *,
        inform: Callable[..., None] = lambda *_: None,
    ) -> None:
        """Hold the disc at its launch.

        Args:
            config: The parameters.
            publishers: The topics to publish.
            commands: The command topics to poll.
            start: The first stamp [ns].
            warn: `warn(text, about)` logs a line, throttled for each `about`.
            inform: The same for what is no problem: releases and landings.
        """
        self.clock = SimClock(start, config.physics_rate)
        self.commands = commands
        self.counts = Counts()
        self.publishers = publishers
        self.config = self._next_config = config
        self.inputs = Inputs(commands, publishers, self.clock, config.setup.wind)
        self._warn = warn
        self._inform = inform
        self._asked = False  # whether the sender is on use_sim_time
        self._sim: FlightSimulator | None = None
        self._resting = at_rest(config.launch.state())
        self.imu_errors = ImuErrors(config.imu, 0, config.publish_period)
        self.flight = 0
        self._released = start  # later by the jumps of time since [ns]
        self._throw_at: float = start if config.auto_throw else math.inf

    # ---- state ----

    @property
    def flying(self) -> bool:
        """Return True if the disc is in the air."""
        return self._sim is not None and not self._sim.landed

    @property
    def awaiting_throw(self) -> bool:
        """Return True if a throw is scheduled."""
        return self._throw_at < math.inf or bool(self.commands.throw.waiting)

    @property
    def next_throw(self) -> float:
        """Return the stamp from which a message is one of a throw [ns], or inf."""
        waiting = self.commands.throw.waiting
        return min(self._throw_at, waiting[0][0]) if waiting else self._throw_at

    @property
    def throw_due(self) -> bool:
        """Return True if a throw with the configured launch is due."""
        return self.clock.now >= self._throw_at

    @property
    def state(self) -> State:
        """Return the present state."""
        return self._resting if self._sim is None else self._sim.state

    def observe(self) -> Observation:
        """Return the present rates of change and loads; zeros for a disc at rest."""
        return NOTHING if self._sim is None else self._sim.observe()

    @property
    def steps_to_message(self) -> int:
        """Return the steps to the next message: a whole period where one is due now."""
        every = self.config.steps_per_publish
        return every - self.clock.steps % every

    @property
    def at_message(self) -> bool:
        """Return True if a message is due at the present step."""
        return self.clock.steps % self.config.steps_per_publish == 0

    @property
    def flight_simulator(self) -> FlightSimulator | None:
        """Return the flight, which may have landed; None before the first one."""
        return self._sim

    @property
    def wind(self) -> Velocity:
        """Return the wind at the disc, gusts included, earth axes 1."""
        return Velocity(*self.inputs.wind.mean) if self._sim is None else self._sim.wind

    @property
    def steps_to_path(self) -> int:
        """Return the steps to the next message that adds a point to the path; 0 if none does."""
        every = self._messages_per_point
        if every == 0:
            return 0
        steps = self.steps_to_message
        number = self._sample(self.clock.at(self.clock.steps + steps))
        return steps + -number % every * self.config.steps_per_publish

    @property
    def steps_per_point(self) -> int:
        """Return the steps from point to point of the path; 0 if none is added."""
        return self._messages_per_point * self.config.steps_per_publish

    @property
    def _messages_per_point(self) -> int:
        """Return the messages from point to point of the path, or 0."""
        rate = self.config.path_rate
        if not self.flying or rate == 0.0:
            return 0
        return max(1, round(self.config.publish_rate / rate))

    # ---- time ----

    def advance(self, most: int) -> int:
        """Make steps, up to the next command, expiry or message.

        Args:
            most: Steps to make at most, 1 or more.

        Returns:
            The number of steps made.
        """
        clock = self.clock
        if self.inputs.expire(self._sim):
            self.counts.expired += 1
            self._publish_event(events.COMMAND_EXPIRED)
        self.inputs.apply_due(self.config.command_timeout, self._sim)
        change = self.inputs.next_change()
        n = min(most, self.steps_to_message)
        if change < math.inf:
            n = min(n, max(clock.step_at(int(change)) - clock.steps, 1))
        self._fly(n)
        clock.steps += n
        return n

    def jump(self, shift: int, cause: str) -> None:
        """Move simulated time forward without a step; it is an event, for exact re-flights.

        Stamps of the flight and of its next periodic throw move along. Commands and their
        expiry are stamped by the wall clock and do not.

        Args:
            shift: How far [ns].
            cause: Why time was behind, see `events.time_jumped`.
        """
        self.clock.jump(shift)
        self._released += shift
        self._throw_at += shift
        self.counts.jumps += 1
        self.counts.jumped += shift
        self._publish_event(events.time_jumped(shift, cause))

    def publish_step(self) -> None:
        """Throw if it is time for that, then publish the state: where a message is due."""
        now = self.clock.now
        release = pop_due(self.commands.throw, now)
        if release is not None:
            self._throw_commanded(release)
        elif self.throw_due:
            self.throw()
        self.publish()

    def _fly(self, steps: int) -> None:
        sim = self._sim
        if sim is None:
            return
        was_landed = sim.landed
        try:
            sim.advance(steps)
        except IntegrationError as error:
            self.counts.failures += 1
            self._resting = at_rest(sim.state)
            self._sim = None
            self._warn(f'flight {self.flight} ended: {error}', topics.FlightEvent.FAILED)
            self._publish_event(events.failed(error))
            return
        if sim.landed and not was_landed:
            self._publish_landing(sim)

    # ---- throws ----

    def throw(self, release: State | None = None, source: str = 'launch') -> None:
        """Release the disc, from the configured launch or from another state.

        Args:
            release: The state; None for the configured launch.
            source: What asked for the throw, see `events.thrown`.

        Raises:
            ConfigError: The release is underground, or too fast for the step.
        """
        self._take_config()
        config = self.config
        gusts = config.setup.wind
        wind = replace(
            self.inputs.wind, turbulence=gusts.turbulence, seed=(gusts.seed + self.flight) % 2**63
        )
        setup = replace(config.setup, wind=wind)
        sim = FlightSimulator(setup, release or config.launch.state(), ground=config.ground)
        sim.take(self.inputs.active.control)
        replaced = self.flight if self.flying else 0
        self._sim = sim
        self.imu_errors = ImuErrors(config.imu, self.flight, config.publish_period)
        self.flight += 1
        self.counts.throws += 1
        self._released = self.clock.now
        self._throw_at = self._after_period()
        self.publishers.clear_path()
        recorded = FlightConfig(
            setup=setup,
            release=sim.release,
            flight=self.flight,
            physics_rate=config.physics_rate,
            publish_rate=config.publish_rate,
            ground=config.ground,
            command_timeout=config.command_timeout,
        )
        text = configuration_text(recorded)
        self.publishers.publish_release(self._released, sim.state, text, setup.disc.diameter)
        self.inputs.publish_wind()
        self.inputs.publish_control()
        event = events.thrown(sim.state, self.flight, source, replaced=replaced)
        self._publish_event(event)
        self._inform(f'flight {self.flight} thrown: {event.text}', event.name)

    def _throw_commanded(self, release: State) -> None:
        try:
            self.throw(release, topics.THROW)
        except ConfigError as error:
            self.commands.throw.drop_accepted(str(error))
            self._warn(f'throw dropped: {error}', topics.THROW)

    def hold(self, state: State) -> None:
        """Put the disc somewhere, at rest; a flight ends, and a throw that is due is off."""
        self._sim = None
        self._resting = at_rest(state)
        if self.throw_due:
            self._throw_at = math.inf
        self.publish_markers()

    def reset(self, *, rearm: bool = False) -> None:
        """Put the disc at its launch, at rest; discard commands and count flights from 1 again.

        Args:
            rearm: Throw as soon as time goes on, if `auto_throw` says so, as after a start.
        """
        self._take_config()
        self._sim = None
        self._resting = at_rest(self.config.launch.state())
        self._throw_at = self.clock.now if rearm and self.config.auto_throw else math.inf
        self.flight = 0
        self.inputs.reset(self.config.setup.wind)
        self.publishers.clear_path()
        self.publish_markers()
        self._publish_event(events.RESET)

    def configure(self, config: SimConfig) -> None:
        """Take changed parameters: wind and pace at once, the rest at the next throw."""
        before, self._next_config = self._next_config, config
        changed = {name: getattr(config, name) for name in _AT_ONCE}
        self.config = replace(self.config, **changed)
        old, new = before.setup.wind, config.setup.wind
        # A change of gusts alone does not undo a commanded wind.
        if replace(new, turbulence=old.turbulence, seed=old.seed) != old:
            self.inputs.set_wind(new, self._sim)
        if config.throw_period != before.throw_period and self.flight:
            self._throw_at = self._after_period()

    def _after_period(self) -> float:
        """Return the stamp of the next periodic throw [ns], or inf."""
        period = self.config.throw_period
        return self._released + round(period * NANOSECONDS) if period > 0.0 else math.inf

    def _take_config(self) -> None:
        """Make the newest parameters those of the flight that begins."""
        before, self.config = self.config, self._next_config
        now = self.config
        if (now.physics_rate, now.publish_rate) != (before.physics_rate, before.publish_rate):
            self.clock.restart(now.physics_rate)

    def _publish_landing(self, sim: FlightSimulator) -> None:
        self.counts.landings += 1
        event = events.landed(sim, self.flight, self._released)
        self._publish_event(event)
        self._inform(f'flight {self.flight} landed: {event.text}', event.name)
        self.publishers.publish_landing(
            sim.release, sim.touch, sim.setup.disc.diameter, event.text
        )

    # ---- messages ----

    def poll(self, *, ask: bool = False) -> None:
        """Take the commands that have arrived.

        Args:
            ask: Warn once if a command is far ahead: simulated time is not the wall clock.
        """
        now = self.clock.now
        self.commands.poll(now, self._warn_of_drop)
        if ask and not self._asked and self.commands.any_waiting:
            lead, name = self.commands.furthest(now)
            if lead > FAR:
                self._asked = True
                self._warn(
                    f'{name}: a command waits {lead / NANOSECONDS:.3f} s until its stamp; '
                    'is the sender on use_sim_time?',
                    'lead',
                )

    def take(self, topic: CommandTopic, message: bytes) -> None:
        """Accept or drop the serialised message of a command that was taken."""
        self.commands.take(topic, message, self.clock.now, self._warn_of_drop)

    def _warn_of_drop(self, topic: CommandTopic) -> None:
        self._warn(f'{topic.name} dropped: {topic.reason}', topic.name)

    def publish(self) -> None:
        """Publish the present state on the topics that have subscribers."""
        out, now = self.publishers, self.clock.now
        out.publish_clock(now)
        s = self.state
        out.publish_motion(now, s)
        if out.quantities_have_subscribers:
            diameter = self.config.setup.disc.diameter
            out.publish_quantities(messages.quantities(s, self.wind, diameter))
        if out.imu.has_subscribers or out.aero_wrench.has_subscribers:
            observed = self.observe()
            if out.aero_wrench.has_subscribers:
                force, moment = frames.flip_yz(observed[6:9]), frames.flip_yz(observed[9:12])
                out.publish_aero_wrench(now, (*force, *moment))
            if out.imu.has_subscribers:
                errors, g = self.imu_errors, self.config.setup.air.gravity
                exact = messages.imu(s, observed[:3], observed[3:6], errors.offset, g)
                out.publish_imu(now, errors.add_to(exact, self._sample(now)))
        every = self._messages_per_point
        if every and self._sample(now) % every == 0:
            out.extend_path(now, s)

    def publish_markers(self) -> None:
        """Publish the markers of the disc that waits for its throw."""
        self.publishers.publish_markers(self._resting, self.config.setup.disc.diameter)

    def _sample(self, stamp: int) -> int:
        """Return the number of messages from the release to a stamp [ns]."""
        elapsed = (stamp - self._released) * self.config.publish_rate
        return round(elapsed / NANOSECONDS)

    def _publish_event(self, event: Event) -> None:
        """Publish an event, stamped with the present time unless it has a stamp of its own."""
        values = {EventKey.STAMP: exact_seconds(self.clock.now)} | event.values
        self.publishers.publish_event(event.name, event.text, values, is_error=event.is_error)


def at_rest(s: State) -> State:
    """Return the state of a disc that is held where it is."""
    return s._replace(VX=0.0, VY=0.0, VZ=0.0, p=0.0, q=0.0, r=0.0, sigma=0.0)
