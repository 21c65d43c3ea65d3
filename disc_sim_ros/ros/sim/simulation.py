"""A disc on its timeline: throws, commands, wind, and what is published when. It keeps no pace."""

from collections.abc import Callable
from dataclasses import dataclass, replace
import math
from typing import Any

from disc_sim_ros import topics
from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight_config import configuration_text
from disc_sim_ros.physics.kernels.equations import DISC_AIR, State, Velocity
from disc_sim_ros.physics.simulator import NOTHING, FlightSimulator
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.sim.clock import NANOSECONDS, SimClock
from disc_sim_ros.ros.sim.commands import ActiveControl, Commands, pop_due
from disc_sim_ros.ros.sim.config import SimConfig
from disc_sim_ros.ros.sim.imu import ImuErrors
from disc_sim_ros.ros.sim.publishers import Outputs

_NO_MOMENT = (0.0, 0.0, 0.0, DISC_AIR)
_NO_COEFFICIENTS = (0.0, 0.0, 0.0)
_AT_ONCE = ('real_time_factor', 'command_timeout', 'throw_period', 'path_rate')


@dataclass
class Counts:
    """What has happened so far, for /diagnostics."""

    throws: int = 0
    landings: int = 0
    failures: int = 0
    expired: int = 0


class Simulation:
    """Flies the disc from message to message; who calls it sets the pace.

    Attributes:
        timeline: Simulated time.
        commands: The command topics.
        counts: What has happened so far.
        outputs: The topics that it publishes.
        config: The parameters that count now; some of the newest wait for the next throw.
        held: The control inputs that act now.
        flight: Number of the last flight since the start or a reset, from 1.
    """

    def __init__(
        self,
        config: SimConfig,
        outputs: Outputs,
        commands: Commands,
        start: int,
        warn: Callable[..., None],
    ) -> None:
        """Hold the disc at its launch.

        `start` is the first stamp [ns]; `warn(text, about)` logs a line, now and then about the
        same thing.
        """
        self.timeline = SimClock(start, config.physics_rate)
        self.commands = commands
        self.counts = Counts()
        self.outputs = outputs
        self.config = self._next_config = config
        self.held = ActiveControl()
        self._warn = warn
        self._wind = config.setup.wind
        self._sim: FlightSimulator | None = None
        self._resting = at_rest(config.launch.state())
        self._imu_errors = ImuErrors(config.imu, 0)
        self.flight = 0
        self._released = start
        self._throw_at: float = start if config.auto_throw else math.inf

    # ---- what it is doing ----

    @property
    def flying(self) -> bool:
        """Say whether the disc is in the air."""
        return self._sim is not None and not self._sim.landed

    @property
    def expecting(self) -> bool:
        """Say whether a throw is due some time."""
        return self._throw_at < math.inf or bool(self.commands.throw.waiting)

    @property
    def steps_to_message(self) -> int:
        """Return the steps to the next message, all of them where one is due now."""
        every = self.config.steps_per_publish
        return every - self.timeline.steps % every

    @property
    def at_message(self) -> bool:
        """Say whether a message is due at the present step."""
        return self.timeline.steps % self.config.steps_per_publish == 0

    # ---- time ----

    def leap(self, most: int) -> int:
        """Make steps, up to where a command begins or ends or a message is due.

        Args:
            most: Steps to make at most, 1 or more.

        Returns:
            The steps made.
        """
        time = self.timeline
        self._change()
        change = min(self.commands.next_time(), self.held.next_time())
        n = min(most, self.steps_to_message)
        if change < math.inf:
            n = min(n, max(time.step_at(int(change)) - time.steps, 1))
        self._fly(n)
        time.steps += n
        return n

    def arrive(self) -> None:
        """Do what happens where a message is due: throws, then the messages."""
        now = self.timeline.now
        release = pop_due(self.commands.throw, now)
        if release is not None:
            self.throw(release)
        elif now >= self._throw_at:
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
            self._warn(f'flight {self.flight} ended: {error}')
            self._event('failed', str(error), {}, bad=True)
            return
        if sim.landed and not was_landed:
            self._tell_landing(sim)

    # ---- throws ----

    def throw(self, release: State | None = None) -> None:
        """Let the disc go, from the configured launch or from a commanded state."""
        self._take_config()
        config = self.config
        gusts = config.setup.wind
        wind = replace(
            self._wind, turbulence=gusts.turbulence, seed=(gusts.seed + self.flight) % 2**63
        )
        setup = replace(config.setup, wind=wind)
        state = release or config.launch.state()
        try:
            sim = FlightSimulator(setup, state, ground=config.ground)
        except ConfigError as error:
            if release is None:
                raise
            self.commands.throw.accepted -= 1
            self.commands.throw.drop(str(error))
            self._warn(f'throw dropped: {error}', topics.THROW)
            return
        sim.take(self.held.control)
        self._sim = sim
        self._imu_errors = ImuErrors(config.imu, self.flight)
        self.flight += 1
        self.counts.throws += 1
        self._released = self.timeline.now
        self._throw_at = self._after_period()
        out = self.outputs
        out.begin_path()
        text = configuration_text(
            setup,
            sim.release,
            self.flight,
            physics_rate=config.physics_rate,
            publish_rate=config.publish_rate,
            ground=config.ground,
            command_timeout=config.command_timeout,
        )
        out.released(self._released, sim.state, text, setup.disc.diameter)
        self.publish_wind()
        self._publish_held()
        speed = math.hypot(*sim.state[3:6])
        values = {
            'flight': self.flight,
            'from': 'launch' if release is None else topics.THROW,
            'speed_m_s': speed,
            'spin_rad_s': sim.state.r,
        }
        self._event('thrown', f'{speed:.2f} m/s, spin {sim.state.r:.2f} rad/s', values)

    def reset(self) -> None:
        """Put the disc back to its launch, at rest; forget commands and the number of flights."""
        self._take_config()
        self._sim = None
        self._resting = at_rest(self.config.launch.state())
        self._throw_at = math.inf
        self.flight = 0
        self.commands.forget()
        self._hold_moment(_NO_MOMENT, math.inf)
        self._hold_coefficients(_NO_COEFFICIENTS, math.inf)
        self._blow(self.config.setup.wind)
        self.outputs.begin_path()
        self.publish_look()
        self._event('reset', 'the disc is back at its launch, at rest', {})

    def configure(self, config: SimConfig) -> None:
        """Take changed parameters: wind and pace at once, the rest at the next throw."""
        before, self._next_config = self._next_config, config
        changed = {name: getattr(config, name) for name in _AT_ONCE}
        self.config = replace(self.config, **changed)
        old, new = before.setup.wind, config.setup.wind
        if replace(new, turbulence=old.turbulence, seed=old.seed) != old:
            self._blow(new)  # gusts wait for the next throw, and do not undo a commanded wind
        if config.throw_period != before.throw_period and self.flight:
            self._throw_at = self._after_period()

    def _after_period(self) -> float:
        """Return when to throw again [ns], or infinity."""
        period = self.config.throw_period
        return self._released + round(period * NANOSECONDS) if period > 0.0 else math.inf

    def _take_config(self) -> None:
        """Make the newest parameters those of the flight that begins."""
        before, self.config = self.config, self._next_config
        now = self.config
        if (now.physics_rate, now.publish_rate) != (before.physics_rate, before.publish_rate):
            self.timeline.restart(now.physics_rate)

    def _tell_landing(self, sim: FlightSimulator) -> None:
        self.counts.landings += 1
        touch, release = sim.touch, sim.release
        distance = math.hypot(touch.X - release.X, touch.Y - release.Y)
        x, y, _ = frames.flip_yz((touch.X, touch.Y, touch.Z))
        values = {
            'stamp_s': in_seconds(self._released + round(sim.touch_time * NANOSECONDS)),
            'flight': self.flight,
            'flight_time_s': sim.touch_time,
            'range_m': distance,
            'landing_x_m': x,
            'landing_y_m': y,
            'spin_rad_s': touch.r,
        }
        text = f'{distance:.2f} m in {sim.touch_time:.3f} s'
        self._event('landed', text, values)
        self.outputs.landed(release, touch, sim.setup.disc.diameter, text)

    # ---- commands and wind ----

    def poll(self) -> None:
        """Take the commands that have arrived."""
        self.commands.poll(
            self.timeline.now,
            lambda topic: self._warn(f'{topic.name} dropped: {topic.reason}', topic.name),
        )

    def _change(self) -> None:
        """Let commands and wind begin or end that do so at the present step."""
        now = self.timeline.now
        until = now + round(self.config.command_timeout * NANOSECONDS)
        moment, coefficients = self.held.expired(now)
        if moment:
            self._hold_moment(_NO_MOMENT, math.inf)
        if coefficients:
            self._hold_coefficients(_NO_COEFFICIENTS, math.inf)
        if moment or coefficients:
            self.counts.expired += 1
            self._event('command expired', 'a command was not renewed and fell to zero', {})
        new_moment = pop_due(self.commands.moment, now)
        if new_moment is not None:
            self._hold_moment(new_moment, until)
        new_coefficients = pop_due(self.commands.coefficients, now)
        if new_coefficients is not None:
            self._hold_coefficients(new_coefficients, until)
        mean = pop_due(self.commands.wind, now)
        if mean is not None:
            self._blow(replace(self._wind, mean=mean))

    def _hold_moment(self, moment: tuple[float, float, float, int], until: float) -> None:
        before = self.held.control
        self.held.set_moment(moment, until)
        if self.held.control != before:
            self.outputs.moment_applied(self.timeline.now, moment)
            self._steer()

    def _hold_coefficients(self, values: tuple[float, float, float], until: float) -> None:
        before = self.held.control
        self.held.set_coefficients(values, until)
        if self.held.control != before:
            self.outputs.coefficients_applied(self.timeline.now, values)
            self._steer()

    def _steer(self) -> None:
        if self._sim is not None:
            self._sim.take(self.held.control)

    def _blow(self, wind: Wind) -> None:
        """Change mean and profile of the wind now; turbulence and seed wait for the next throw."""
        self._wind = wind
        if self._sim is not None:
            turbulence = self._sim.setup.wind.turbulence
            self._sim.set_wind(replace(wind, turbulence=turbulence))
        self.publish_wind()

    # ---- messages ----

    def publish(self) -> None:
        """Publish the present state."""
        out, sim, now = self.outputs, self._sim, self.timeline.now
        out.tick(now)
        s = self._resting if sim is None else sim.state
        out.motion(now, s)
        if out.quantities_heard:
            wind = Velocity(*self._wind.mean) if sim is None else sim.wind
            out.quantities_of(messages.quantities(s, wind, self.config.setup.disc.diameter))
        if out.imu.heard or out.aero_wrench.heard:
            seen = NOTHING if sim is None else sim.observe()
            if out.aero_wrench.heard:
                out.loads(now, (*frames.flip_yz(seen[6:9]), *frames.flip_yz(seen[9:12])))
            if out.imu.heard:
                errors, g = self._imu_errors, self.config.setup.air.gravity
                exact = messages.imu(s, seen[:3], seen[3:6], errors.offset, g)
                out.measured(now, errors.of(exact, self._sample()))
        rate = self.config.path_rate
        if not self.flying or rate == 0.0:
            return
        if self._sample() % max(1, round(self.config.publish_rate / rate)) == 0:
            out.extend_path(now, s)

    def publish_wind(self) -> None:
        """Publish the mean wind that blows."""
        mean = frames.map_from_paper(self._wind.mean) + 0.0
        self.outputs.wind_applied(self.timeline.now, mean.tolist())

    def publish_look(self) -> None:
        """Publish the disc that waits for its throw, to look at."""
        self.outputs.look(self._resting, self.config.setup.disc.diameter)

    def _sample(self) -> int:
        """Return the number of messages since the release."""
        elapsed = (self.timeline.now - self._released) * self.config.publish_rate
        return round(elapsed / NANOSECONDS)

    def _publish_held(self) -> None:
        """Tell again what acts already, for who records from this throw on."""
        c, now = self.held.control, self.timeline.now
        if any((c.L, c.M, c.N)):
            self.outputs.moment_applied(now, (c.L, c.M, c.N, c.axes))
        if any((c.C_L, c.C_M, c.C_N)):
            self.outputs.coefficients_applied(now, (c.C_L, c.C_M, c.C_N))

    def _event(self, name: str, text: str, values: dict[str, Any], *, bad: bool = False) -> None:
        stamp = {'stamp_s': in_seconds(self.timeline.now)}
        self.outputs.event(name, text, stamp | values, bad=bad)


def in_seconds(nanoseconds: int) -> str:
    """Return a time in seconds, exact: as floats, times of today have steps of 240 ns."""
    return f'{nanoseconds // NANOSECONDS}.{nanoseconds % NANOSECONDS:09d}'


def at_rest(s: State) -> State:
    """Return the state of a disc that is held where it is."""
    return s._replace(VX=0.0, VY=0.0, VZ=0.0, p=0.0, q=0.0, r=0.0, sigma=0.0)
