"""The simulation thread: throws, commands, and what is published when."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
import math
import threading
import time
from typing import Any

from disc_sim_ros.core import axes
from disc_sim_ros.core.air import Wind
from disc_sim_ros.core.equations import DISC_AIR, State, Velocity
from disc_sim_ros.core.errors import ConfigError, DiscSimError, IntegrationError
from disc_sim_ros.core.simulator import NOTHING, FlightSimulator
from disc_sim_ros.nodes import conversions, topics
from disc_sim_ros.nodes.commands import Commands, Held, due
from disc_sim_ros.nodes.configuration import configuration_text
from disc_sim_ros.nodes.imu import ImuErrors
from disc_sim_ros.nodes.outputs import Outputs
from disc_sim_ros.nodes.pacer import Pacer
from disc_sim_ros.nodes.punctual import make_punctual
from disc_sim_ros.nodes.sim_config import SimConfig
from disc_sim_ros.nodes.timeline import NANOSECONDS, Timeline

LONGEST_SLEEP = 0.01  # s
LONGEST_WAIT = 0.5  # s of wall time for a request until a message is due
LONGEST_QUANTUM = 1e-3  # s of simulated time between two looks at the command topics
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


class SimLoop(threading.Thread):
    """Flies the disc on a thread of its own, at `real_time_factor` times real time.

    Everything happens between two steps: commands at any step; throws, resets and pauses where a
    message is due. Other threads use `submit` and `end`, and read the attributes.

    Attributes:
        timeline: Simulated time.
        pacer: Lateness and slips.
        commands: The command topics.
        counts: What has happened so far.
        paused: Whether time stands still.
    """

    def __init__(
        self,
        config: SimConfig,
        outputs: Outputs,
        commands: Commands,
        start: int,
        warn: Callable[..., None],
    ) -> None:
        """Prepare the thread.

        `start` is the first stamp [ns]; `warn(text, about)` logs a line, now and then about the
        same thing.
        """
        super().__init__(name='simulation')
        self.timeline = Timeline(start, config.physics_rate)
        self.pacer = Pacer(config.setup.step, max(config.real_time_factor, 1e-9), 0.0)
        self.commands = commands
        self.counts = Counts()
        self.paused = False
        self._outputs = outputs
        self._warn = warn
        self._config = self._next_config = config
        self._requests: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._wake = threading.Event()
        self._ended = threading.Event()
        self._held = Held()
        self._wind = config.setup.wind
        self._sim: FlightSimulator | None = None
        self._resting = at_rest(config.launch.state())
        self._imu_errors = ImuErrors(config.imu, 0)
        self._flight = 0  # number since the start or the last reset
        self._released = start
        self._throw_at: float = start if config.auto_throw else math.inf

    # ---- for other threads ----

    def submit(self, action: Callable[[], str]) -> Future[str]:
        """Have `action` called between two steps; return what will be its result."""
        future: Future[str] = Future()
        self._requests.append((action, future))
        self._wake.set()
        return future

    def end(self) -> None:
        """Ask the thread to end; `join` waits for it."""
        self._ended.set()
        self._wake.set()

    # ---- actions for `submit` ----

    def throw(self) -> str:
        """Let the disc go as configured; one in flight is taken out of the air."""
        self._throw(None)
        return f'flight {self._flight}, released at {in_seconds(self.timeline.now)} s'

    def reset(self) -> str:
        """Put the disc back to its launch, at rest; forget commands and the number of flights."""
        self._take_config()
        self._sim = None
        self._resting = at_rest(self._config.launch.state())
        self._throw_at = math.inf
        self._flight = 0
        self.commands.forget()
        self._let_go()
        self._blow(self._config.setup.wind)
        self._outputs.begin_path()
        self._event('reset', 'the disc is back at its launch, at rest', {})
        if self.paused:
            self._publish()
        return 'the disc is back at its launch, at rest; ~/throw lets it go'

    def pause(self) -> str:
        """Let time stand still."""
        self.paused = True
        return f'time stands still at {in_seconds(self.timeline.now)} s'

    def resume(self) -> str:
        """Let time go on."""
        self.paused = False
        return 'time goes on'

    def step(self) -> str:
        """Go on to the next message while time stands still.

        Raises:
            ConfigError: Time does not stand still.
        """
        if not self.paused:
            raise ConfigError('~/step', 'a running simulation', 'pause it first by ~/pause')
        self._poll()
        self._advance(self._config.steps_per_publish, serve=False)
        return f'now at {in_seconds(self.timeline.now)} s'

    def configure(self, config: SimConfig) -> str:
        """Take changed parameters: wind and pace at once, the rest at the next throw."""
        before, self._next_config = self._next_config, config
        changed = {name: getattr(config, name) for name in _AT_ONCE}
        self._config = replace(self._config, **changed)
        old, new = before.setup.wind, config.setup.wind
        if replace(new, turbulence=old.turbulence, seed=old.seed) != old:
            self._blow(new)  # gusts wait for the next throw, and do not undo a commanded wind
        if config.throw_period != before.throw_period and self._flight:
            self._throw_at = self._after_period()
        if config.real_time_factor != before.real_time_factor:
            self._restart_pacer()
        return ''

    # ---- the thread ----

    def run(self) -> None:
        """Fly until asked to end."""
        make_punctual(self._config.realtime_priority, self._warn)
        self._publish_wind()
        self._arrive(serve=True)
        self._restart_pacer()
        while not self._ended.is_set():
            self._poll()
            if self.paused or self._idle():
                self._wake.wait(LONGEST_SLEEP)
                self._wake.clear()
                self._serve()
                self._restart_pacer()
                self._outputs.tick(self.timeline.now)
            elif self._requests and self._until_message() > LONGEST_WAIT:
                self.timeline.restart(self._config.physics_rate)  # which makes one due now
                self._arrive(serve=True)
            else:
                self._advance(self._due(), serve=True)

    def _idle(self) -> bool:
        """Say whether time need not go on: as fast as possible, and nothing is in the air."""
        if self._config.real_time_factor > 0.0:
            return False
        if self.timeline.steps % self._config.steps_per_publish:
            return False  # on to the message that shows the disc where it landed
        flying = self._sim is not None and not self._sim.landed
        return not (flying or self._throw_at < math.inf or self.commands.throw.waiting)

    def _until_message(self) -> float:
        """Return the wall time until the next message is due [s]."""
        if self._config.real_time_factor == 0.0:
            return 0.0
        every = self._config.steps_per_publish
        return self.pacer.wait(time.monotonic(), every - self.timeline.steps % every)

    def _due(self) -> int:
        """Return how many steps are due, after sleeping until it is time for some."""
        config = self._config
        quantum = max(1, min(config.steps_per_publish, round(LONGEST_QUANTUM / config.setup.step)))
        if config.real_time_factor == 0.0:
            time.sleep(0)  # lets other threads run
            return quantum
        wait = self.pacer.wait(time.monotonic(), quantum)
        if wait > 0.0:
            if self._requests:
                self._wake.clear()
            time.sleep(min(wait, LONGEST_SLEEP))
        slips = self.pacer.slips
        steps = self.pacer.due(time.monotonic())
        if self.pacer.slips > slips:
            self._warn(
                f'the machine held the simulation up; it has fallen {self.pacer.slipped:.3f} s '
                'behind the wall clock in all and does not make up for it'
            )
        return steps

    def _advance(self, steps: int, *, serve: bool) -> None:
        """Make steps, stopping at each where a command begins or ends or a message is due."""
        time_, every = self.timeline, self._config.steps_per_publish
        restarts = self.pacer.restarts
        while steps > 0:
            self._change()
            change = min(self.commands.next_time(), self._held.next_time())
            n = min(steps, every - time_.steps % every)
            if change < math.inf:
                n = min(n, max(time_.step_at(int(change)) - time_.steps, 1))
            self._fly(n)
            time_.steps += n
            self.pacer.made(n)
            steps -= n
            if time_.steps % every == 0:
                paused = self.paused
                self._arrive(serve=serve)
                if self.paused != paused or self.pacer.restarts != restarts:
                    return
            else:
                self._outputs.tick(time_.now, patience=topics.CLOCK_PERIOD)

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
            self._warn(f'flight {self._flight} ended: {error}')
            self._event('failed', str(error), {}, bad=True)
            return
        if sim.landed and not was_landed:
            self._tell_landing(sim)

    def _arrive(self, *, serve: bool) -> None:
        """Do what happens where a message is due: requests, throws, then the messages."""
        if serve:
            self._serve()
        now = self.timeline.now
        release = due(self.commands.throw, now)
        if release is not None:
            self._throw(release)
        elif now >= self._throw_at:
            self._throw(None)
        self._publish()

    def _serve(self) -> None:
        while self._requests:
            action, future = self._requests.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(action())
            except DiscSimError as error:
                future.set_exception(error)

    # ---- throws ----

    def _throw(self, release: State | None) -> None:
        """Let the disc go, from the configured launch or from a commanded state."""
        self._take_config()
        config = self._config
        gusts = config.setup.wind
        wind = replace(
            self._wind, turbulence=gusts.turbulence, seed=(gusts.seed + self._flight) % 2**63
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
        sim.take(self._held.control)
        self._sim = sim
        self._imu_errors = ImuErrors(config.imu, self._flight)
        self._flight += 1
        self.counts.throws += 1
        self._released = self.timeline.now
        self._throw_at = self._after_period()
        out = self._outputs
        out.begin_path()
        text = configuration_text(config, setup, sim.release, self._flight)
        out.released(self._released, sim.state, text, setup.disc.diameter)
        self._publish_wind()
        self._publish_held()
        speed = math.hypot(*sim.state[3:6])
        values = {'flight': self._flight, 'speed_m_s': speed, 'spin_rad_s': sim.state.r}
        self._event('thrown', f'{speed:.2f} m/s, spin {sim.state.r:.2f} rad/s', values)
        if self.paused:
            self._publish()

    def _after_period(self) -> float:
        """Return when to throw again [ns], or infinity."""
        period = self._config.throw_period
        return self._released + round(period * NANOSECONDS) if period > 0.0 else math.inf

    def _take_config(self) -> None:
        """Make the newest parameters those of the flight that begins."""
        before, self._config = self._config, self._next_config
        now = self._config
        if (now.physics_rate, now.publish_rate) != (before.physics_rate, before.publish_rate):
            self.timeline.restart(now.physics_rate)
            self._restart_pacer()

    def _tell_landing(self, sim: FlightSimulator) -> None:
        self.counts.landings += 1
        touch, release = sim.touch, sim.release
        distance = math.hypot(touch.X - release.X, touch.Y - release.Y)
        x, y, _ = axes.turned((touch.X, touch.Y, touch.Z))
        values = {
            'stamp_s': in_seconds(self._released + round(sim.touch_time * NANOSECONDS)),
            'flight': self._flight,
            'flight_time_s': sim.touch_time,
            'range_m': distance,
            'landing_x_m': x,
            'landing_y_m': y,
            'spin_rad_s': touch.r,
        }
        self._event('landed', f'{distance:.2f} m in {sim.touch_time:.3f} s', values)

    # ---- commands and wind ----

    def _poll(self) -> None:
        self.commands.poll(
            self.timeline.now,
            lambda topic: self._warn(f'{topic.name} dropped: {topic.reason}', topic.name),
        )

    def _change(self) -> None:
        """Let commands and wind begin or end that do so at the present step."""
        now = self.timeline.now
        until = now + round(self._config.command_timeout * NANOSECONDS)
        moment, coefficients = self._held.expired(now)
        if moment:
            self._hold_moment(_NO_MOMENT, math.inf)
        if coefficients:
            self._hold_coefficients(_NO_COEFFICIENTS, math.inf)
        if moment or coefficients:
            self.counts.expired += 1
            self._event('command expired', 'a command was not renewed and fell to zero', {})
        new_moment = due(self.commands.moment, now)
        if new_moment is not None:
            self._hold_moment(new_moment, until)
        new_coefficients = due(self.commands.coefficients, now)
        if new_coefficients is not None:
            self._hold_coefficients(new_coefficients, until)
        mean = due(self.commands.wind, now)
        if mean is not None:
            self._blow(replace(self._wind, mean=mean))

    def _hold_moment(self, moment: tuple[float, float, float, int], until: float) -> None:
        before = self._held.control
        self._held.set_moment(moment, until)
        if self._held.control != before:
            self._outputs.moment_applied(self.timeline.now, moment)
            self._steer()

    def _hold_coefficients(self, values: tuple[float, float, float], until: float) -> None:
        before = self._held.control
        self._held.set_coefficients(values, until)
        if self._held.control != before:
            self._outputs.coefficients_applied(self.timeline.now, values)
            self._steer()

    def _let_go(self) -> None:
        self._hold_moment(_NO_MOMENT, math.inf)
        self._hold_coefficients(_NO_COEFFICIENTS, math.inf)

    def _steer(self) -> None:
        if self._sim is not None:
            self._sim.take(self._held.control)

    def _blow(self, wind: Wind) -> None:
        """Change mean and profile of the wind now; turbulence and seed wait for the next throw."""
        self._wind = wind
        if self._sim is not None:
            turbulence = self._sim.setup.wind.turbulence
            self._sim.set_wind(replace(wind, turbulence=turbulence))
        self._publish_wind()

    # ---- messages ----

    def _publish(self) -> None:
        out, sim, now = self._outputs, self._sim, self.timeline.now
        out.tick(now)
        s = self._resting if sim is None else sim.state
        out.motion(now, s)
        if out.quantities_heard:
            wind = Velocity(*self._wind.mean) if sim is None else sim.wind
            out.quantities_of(conversions.quantities(s, wind, self._config.setup.disc.diameter))
        if out.imu.heard or out.aero_wrench.heard:
            seen = NOTHING if sim is None else sim.observe()
            if out.aero_wrench.heard:
                out.loads(now, (*axes.turned(seen[6:9]), *axes.turned(seen[9:12])))
            if out.imu.heard:
                errors, g = self._imu_errors, self._config.setup.air.gravity
                exact = conversions.imu(s, seen[:3], seen[3:6], errors.offset, g)
                out.measured(now, errors.of(exact, self._sample()))
        rate = self._config.path_rate
        if sim is None or sim.landed or rate == 0.0:
            return
        if self._sample() % max(1, round(self._config.publish_rate / rate)) == 0:
            out.extend_path(now, s)

    def _sample(self) -> int:
        """Return the number of messages since the release."""
        elapsed = (self.timeline.now - self._released) * self._config.publish_rate
        return round(elapsed / NANOSECONDS)

    def _publish_wind(self) -> None:
        mean = axes.map_from_paper(self._wind.mean) + 0.0
        self._outputs.wind_applied(self.timeline.now, mean.tolist())

    def _publish_held(self) -> None:
        """Tell again what acts already, for who records from this throw on."""
        c, now = self._held.control, self.timeline.now
        if any((c.L, c.M, c.N)):
            self._outputs.moment_applied(now, (c.L, c.M, c.N, c.axes))
        if any((c.C_L, c.C_M, c.C_N)):
            self._outputs.coefficients_applied(now, (c.C_L, c.C_M, c.C_N))

    def _event(self, name: str, text: str, values: dict[str, Any], *, bad: bool = False) -> None:
        stamp = {'stamp_s': in_seconds(self.timeline.now)}
        self._outputs.event(name, text, stamp | values, bad=bad)

    def _restart_pacer(self) -> None:
        factor = max(self._config.real_time_factor, 1e-9)
        self.pacer.restart(self._config.setup.step, factor, time.monotonic())


def in_seconds(nanoseconds: int) -> str:
    """Return a time in seconds, exact: as floats, times of today have steps of 240 ns."""
    return f'{nanoseconds // NANOSECONDS}.{nanoseconds % NANOSECONDS:09d}'


def at_rest(s: State) -> State:
    """Return the state of a disc that is held where it is."""
    return s._replace(VX=0.0, VY=0.0, VZ=0.0, p=0.0, q=0.0, r=0.0, sigma=0.0)
