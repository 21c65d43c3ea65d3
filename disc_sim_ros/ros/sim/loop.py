"""The simulation thread: it keeps pace with the steady clock and serves other threads."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import closing, nullcontext
import threading
import time
from typing import Any, TypeVar

from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics.flight_config import exact_seconds
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.integrator import Observation
from disc_sim_ros.ros import qos
from disc_sim_ros.ros.sim.clock import SimClock
from disc_sim_ros.ros.sim.commands import Commands
from disc_sim_ros.ros.sim.compiled_loop import (
    LONGEST_QUANTUM,
    LONGEST_SLEEP,
    UNWATCHED_QUANTUM,
    compiled_loop,
)
from disc_sim_ros.ros.sim.config import SimConfig
from disc_sim_ros.ros.sim.events import Counts, replacement
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.ros.sim.realtime import Pacer, configure_thread
from disc_sim_ros.ros.sim.simulation import Simulation

LONGEST_WAIT = 0.5  # s of wall time that a request waits for the next message
FAST_QUANTUM = 0.02  # s of simulated time, as fast as possible, where it takes almost no wall time
LONGEST_BATCH = 0.02  # s of wall time for steps, until other requests have their turn
_Result = TypeVar('_Result')
_SLOWEST = 1e-9  # the pacer's real-time factor where there is no pace


class SimLoop(threading.Thread):
    """Flies the disc on its own thread, at `real_time_factor` times real time.

    Everything happens between two steps: commands at any step; throws, resets and pauses where a
    message is due. Other threads call `submit` and `end`, and read the attributes.

    Attributes:
        pacer: Lateness and slips.
        paused: Whether simulated time stands still.
        stopped: Whether the disc waits at its start, paused, since `stop`.
    """

    def __init__(
        self,
        config: SimConfig,
        publishers: Publishers,
        commands: Commands,
        start: int,
        warn: Callable[[str, str], None],
        *,
        wall: Callable[[], int] | None = None,
        inform: Callable[..., None] = lambda *_: None,
    ) -> None:
        """Prepare the thread; see `Simulation` for the other arguments.

        Args:
            config: The parameters.
            publishers: The topics to publish.
            commands: The command topics to poll.
            start: The first stamp [ns].
            warn: `warn(text, about)` logs a line, throttled for each `about`.
            wall: Returns the wall clock [ns] that stamps follow at a real-time factor of 1; None
                where they count from a time of their own.
            inform: Logs a line that reports no problem.
        """
        super().__init__(name='simulation')
        self.pacer = Pacer(config.setup.fixed_step, max(config.real_time_factor, _SLOWEST), 0.0)
        self.paused = self.stopped = False
        self._simulation = Simulation(config, publishers, commands, start, warn, inform=inform)
        self._publishers = publishers
        self._warn = warn
        self._wall = wall
        self._requests: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._wake = threading.Event()
        self._ended = threading.Event()
        self._compiled = compiled_loop(self._simulation, publishers)

    # ---- for other threads ----

    @property
    def clock(self) -> SimClock:
        """Return simulated time."""
        return self._simulation.clock

    @property
    def commands(self) -> Commands:
        """Return the command topics."""
        return self._simulation.commands

    @property
    def config(self) -> SimConfig:
        """Return the parameters in force."""
        return self._simulation.config

    @property
    def counts(self) -> Counts:
        """Return the numbers of events so far."""
        return self._simulation.counts

    def submit(self, action: Callable[[], _Result]) -> Future[_Result]:
        """Call `action` on the simulation thread, between two steps; return its future result."""
        future: Future[_Result] = Future()
        self._requests.append((action, future))
        self.interrupt()
        return future

    def end(self) -> None:
        """Ask the thread to end; `join` waits for it."""
        self._ended.set()
        self.interrupt()

    def interrupt(self) -> None:
        """Let the thread look at what has changed: subscribers, requests."""
        self._wake.set()
        if self._compiled is not None:
            self._compiled.interrupt()

    # ---- actions for `submit` ----

    def throw(self) -> str:
        """Release the disc as configured; this ends a flight that is in the air."""
        sim = self._simulation
        ended = f'; {replacement(sim.flight)}' if sim.flying else ''
        self._keeping_pace(sim.throw)
        self.stopped = False
        if self.paused:
            sim.publish()
        return f'flight {sim.flight}, released at {exact_seconds(self.clock.now)} s{ended}'

    def reset(self) -> str:
        """Put the disc at its launch, at rest; discard commands and count flights from 1 again."""
        self._keeping_pace(self._simulation.reset)
        if self.paused:
            self._simulation.publish()
        return 'the disc is at its launch, at rest; ~/throw releases it'

    def pause(self) -> str:
        """Stop simulated time."""
        self.paused = True
        return f'paused at {exact_seconds(self.clock.now)} s'

    def resume(self) -> str:
        """Let simulated time go on, from the wall clock if it follows that."""
        if self.paused:
            self.paused = self.stopped = False
            self._follow_wall('pause')
            self._begin()
        return f'resumed at {exact_seconds(self.clock.now)} s'

    def step(self) -> str:
        """Advance to the next message while paused.

        Raises:
            ConfigError: The simulation is not paused.
        """
        if not self.paused:
            raise ConfigError('~/step', 'a running simulation', 'pause it first by ~/pause')
        self._step()
        return f'stepped to {exact_seconds(self.clock.now)} s'

    def steps(self, most: int) -> int:
        """Advance by some messages while paused, until `LONGEST_BATCH` of wall time is over.

        Args:
            most: Messages at most, 1 or more.

        Returns:
            The number of messages, at least 1.

        Raises:
            ConfigError: The simulation is not paused.
        """
        if not self.paused or self.stopped:
            state = 'stopped' if self.stopped else 'running'
            raise ConfigError('steps', f'a {state} simulation', 'pause it first')
        end, done = time.monotonic() + LONGEST_BATCH, 0
        while done < most:
            self._step()
            done += 1
            if time.monotonic() >= end:
                break
        return done

    def restart(self) -> None:
        """Begin again as after the start; with `auto_throw` the disc flies once time goes on."""
        self._keeping_pace(lambda: self._simulation.reset(rearm=True))
        if self.paused:
            self._simulation.publish()

    def stop(self) -> None:
        """Pause and begin again as after the start."""
        self.paused = True
        self.restart()
        self.stopped = True

    def snapshot(self) -> tuple[int, State, Observation]:
        """Return the present stamp [ns], the state, and its rates of change."""
        sim = self._simulation
        return sim.clock.now, sim.state, sim.observe()

    def place(self, state: State, *, release: bool, source: str) -> None:
        """Put the disc into a state.

        Args:
            state: The state.
            release: Fly on from there; otherwise the disc is held there, unless it is in the air.
            source: What asked for it.

        Raises:
            ConfigError: The state is too fast for the step, or underground.
        """
        sim = self._simulation
        if release or sim.flying:
            self._keeping_pace(lambda: sim.throw(state, source))
        else:
            sim.hold(state)
        self.stopped = False
        if self.paused:
            sim.publish()

    def _begin(self) -> None:
        """Throw before time goes on, if a throw is due since a reset."""
        if self._simulation.throw_due:
            self._publish_step(serve=False)

    def _step(self) -> None:
        """Advance to the next message."""
        self.stopped = False
        self._begin()
        self._simulation.poll()
        self._advance(self._simulation.config.steps_per_publish, serve=False)

    def configure(self, config: SimConfig) -> str:
        """Take changed parameters: wind and pace at once, the rest at the next throw."""
        self._keeping_pace(lambda: self._simulation.configure(config))
        return ''

    def _keeping_pace(self, act: Callable[[], None]) -> None:
        """Act, and restart the pacer if that has changed the pace."""
        before = self._simulation.config
        act()
        now = self._simulation.config
        if now is not before and _pace(now) != _pace(before):
            self._restart_pacer()
            if now.real_time_factor != before.real_time_factor and not self.paused:
                self._follow_wall('change of real_time_factor')

    # ---- the thread ----

    def run(self) -> None:
        """Fly until asked to end."""
        sim = self._simulation
        configure_thread(sim.config.realtime_priority, lambda text: self._warn(text, 'priority'))
        sim.inputs.publish_wind()
        sim.publish_markers()
        self._publish_step(serve=True)
        self._restart_pacer()
        with closing(self._compiled) if self._compiled else nullcontext():
            self._fly()

    def _fly(self) -> None:
        sim = self._simulation
        while not self._ended.is_set():
            if self._fly_compiled():
                continue  # it polls, too
            sim.poll(ask=not self.follows_wall)
            if self.paused or self._idle():
                self._wake.wait(LONGEST_SLEEP)
                self._wake.clear()
                self._serve()
                self._restart_pacer()
                self._publishers.publish_clock(self.clock.now)
            elif self._requests and self._time_to_message() > LONGEST_WAIT:
                self.clock.restart(sim.config.physics_rate)  # then a message is due now
                self._publish_step(serve=True)
            else:
                self._advance(self._wait_for_steps(), serve=True)

    def _fly_compiled(self) -> bool:
        """Fly in compiled code, at a pace; return False if the next step is not for that."""
        if self._compiled is None or self.paused or not self._simulation.config.real_time_factor:
            return False
        self._compiled.rearm()
        if self._requests or self._ended.is_set():
            return False
        return self._compiled.run(self.pacer)

    def _idle(self) -> bool:
        """Return True if time need not go on: as fast as possible, and no flight to show."""
        sim = self._simulation
        if sim.config.real_time_factor > 0.0 or not sim.at_message:
            return False  # on to the message that shows the disc where it landed
        return not (sim.flying or sim.awaiting_throw)

    def _time_to_message(self) -> float:
        """Return the wall time until the next message is due [s]."""
        if self._simulation.config.real_time_factor == 0.0:
            return 0.0
        return self.pacer.wait(time.monotonic(), self._simulation.steps_to_message)

    def _wait_for_steps(self) -> int:
        """Return how many steps are due, after sleeping until it is time for some."""
        config = self._simulation.config
        if config.real_time_factor == 0.0:
            time.sleep(0)  # lets other threads run
            return self._quantum(FAST_QUANTUM)
        watched = self._simulation.commands.have_publishers or self._publishers.clock_is_followed
        quantum = self._quantum(LONGEST_QUANTUM if watched else UNWATCHED_QUANTUM)
        wait = self.pacer.wait(time.monotonic(), quantum)
        if wait > 0.0:
            if self._requests:
                self._wake.clear()
            time.sleep(min(wait, LONGEST_SLEEP))
        slips = self.pacer.slips
        steps = self.pacer.due(time.monotonic(), quantum)
        if self.pacer.slips > slips:
            jumped = self._follow_wall('slip', steps)
            self._warn(
                'the machine or the middleware stalled the simulation, which does not make up '
                'for it; '
                + ('stamps jump to the wall clock; ' if jumped else '')
                + f'{self.pacer.slipped:.3f} s behind the wall clock in all',
                'slip',
            )
        return steps

    @property
    def follows_wall(self) -> bool:
        """Return True if simulated time is the wall clock, not a time of its own."""
        return self._wall is not None and self._simulation.config.real_time_factor == 1.0

    def _follow_wall(self, cause: str, steps: int = 0) -> bool:
        """Let simulated time jump to the wall clock if it is behind that by a step or more.

        Args:
            cause: See `Simulation.jump`.
            steps: Steps that are due and not yet made.

        Returns:
            True if it jumped. It never jumps back.
        """
        if self._wall is None or not self.follows_wall:
            return False
        clock = self.clock
        shift = self._wall() - clock.at(clock.steps + steps)
        if shift < max(clock.period, 1):
            return False
        self._simulation.jump(shift, cause)
        return True

    def _quantum(self, longest: float) -> int:
        """Return how many steps to make until the next poll of the command topics."""
        sim = self._simulation
        return max(1, min(sim.steps_to_message, round(longest / sim.config.setup.fixed_step)))

    def _advance(self, steps: int, *, serve: bool) -> None:
        """Make steps, stopping at each where a command begins or ends or a message is due."""
        sim, restarts = self._simulation, self.pacer.restarts
        while steps > 0:
            done = sim.advance(steps)
            self.pacer.count(done)
            steps -= done
            if sim.at_message:
                paused = self.paused
                self._publish_step(serve=serve)
                if self.paused != paused or self.pacer.restarts != restarts:
                    return
            else:
                self._publishers.publish_clock(self.clock.now, delay=qos.CLOCK_PERIOD)

    def _publish_step(self, *, serve: bool) -> None:
        """Do what happens where a message is due: requests, throws, then the messages."""
        if serve:
            self._serve()
        self._keeping_pace(self._simulation.publish_step)

    def _serve(self) -> None:
        while self._requests:
            action, future = self._requests.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(action())
            except DiscSimError as error:
                future.set_exception(error)

    def _restart_pacer(self) -> None:
        config = self._simulation.config
        factor = max(config.real_time_factor, _SLOWEST)
        self.pacer.restart(config.setup.fixed_step, factor, time.monotonic())


def _pace(config: SimConfig) -> tuple[float, float, float]:
    return config.physics_rate, config.publish_rate, config.real_time_factor
