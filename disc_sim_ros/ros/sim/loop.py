"""The simulation thread: pace by the steady clock, and requests of other threads."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
import threading
import time
from typing import Any

from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.ros import qos
from disc_sim_ros.ros.sim.clock import SimClock
from disc_sim_ros.ros.sim.commands import Commands
from disc_sim_ros.ros.sim.config import SimConfig
from disc_sim_ros.ros.sim.publishers import Outputs
from disc_sim_ros.ros.sim.realtime import Pacer, configure_thread
from disc_sim_ros.ros.sim.simulation import Counts, Simulation, in_seconds

LONGEST_SLEEP = 0.01  # s
LONGEST_WAIT = 0.5  # s of wall time for a request until a message is due
LONGEST_QUANTUM = 1e-3  # s of simulated time between two looks at the command topics, at a pace
FAST_QUANTUM = 0.02  # s of it as fast as possible, where that is no time at all


class SimLoop(threading.Thread):
    """Flies the disc on a thread of its own, at `real_time_factor` times real time.

    Everything happens between two steps: commands at any step; throws, resets and pauses where a
    message is due. Other threads use `submit` and `end`, and read the attributes.

    Attributes:
        pacer: Lateness and slips.
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
        """Prepare the thread; see `Simulation` for the arguments."""
        super().__init__(name='simulation')
        self.pacer = Pacer(config.setup.step, max(config.real_time_factor, 1e-9), 0.0)
        self.paused = False
        self._simulation = Simulation(config, outputs, commands, start, warn)
        self._outputs = outputs
        self._warn = warn
        self._requests: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._wake = threading.Event()
        self._ended = threading.Event()

    # ---- for other threads ----

    @property
    def timeline(self) -> SimClock:
        """Return simulated time."""
        return self._simulation.timeline

    @property
    def commands(self) -> Commands:
        """Return the command topics."""
        return self._simulation.commands

    @property
    def counts(self) -> Counts:
        """Return what has happened so far."""
        return self._simulation.counts

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
        self._with_pace(self._simulation.throw)
        if self.paused:
            self._simulation.publish()
        number = self._simulation.flight
        return f'flight {number}, released at {in_seconds(self.timeline.now)} s'

    def reset(self) -> str:
        """Put the disc back to its launch, at rest; forget commands and the number of flights."""
        self._with_pace(self._simulation.reset)
        if self.paused:
            self._simulation.publish()
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
        self._simulation.poll()
        self._advance(self._simulation.config.steps_per_publish, serve=False)
        return f'now at {in_seconds(self.timeline.now)} s'

    def configure(self, config: SimConfig) -> str:
        """Take changed parameters: wind and pace at once, the rest at the next throw."""
        self._with_pace(lambda: self._simulation.configure(config))
        return ''

    def _with_pace(self, act: Callable[[], None]) -> None:
        """Act, and count steps anew where that has changed their pace."""
        before = self._simulation.config
        act()
        now = self._simulation.config
        if now is not before and _pace(now) != _pace(before):
            self._restart_pacer()

    # ---- the thread ----

    def run(self) -> None:
        """Fly until asked to end."""
        sim = self._simulation
        configure_thread(sim.config.realtime_priority, self._warn)
        sim.publish_wind()
        sim.publish_look()
        self._arrive(serve=True)
        self._restart_pacer()
        while not self._ended.is_set():
            sim.poll()
            if self.paused or self._idle():
                self._wake.wait(LONGEST_SLEEP)
                self._wake.clear()
                self._serve()
                self._restart_pacer()
                self._outputs.tick(self.timeline.now)
            elif self._requests and self._until_message() > LONGEST_WAIT:
                self.timeline.restart(sim.config.physics_rate)  # which makes one due now
                self._arrive(serve=True)
            else:
                self._advance(self._due(), serve=True)

    def _idle(self) -> bool:
        """Say whether time need not go on: as fast as possible, and nothing is in the air."""
        sim = self._simulation
        if sim.config.real_time_factor > 0.0 or not sim.at_message:
            return False  # on to the message that shows the disc where it landed
        return not (sim.flying or sim.expecting)

    def _until_message(self) -> float:
        """Return the wall time until the next message is due [s]."""
        if self._simulation.config.real_time_factor == 0.0:
            return 0.0
        return self.pacer.wait(time.monotonic(), self._simulation.steps_to_message)

    def _due(self) -> int:
        """Return how many steps are due, after sleeping until it is time for some."""
        config = self._simulation.config
        if config.real_time_factor == 0.0:
            time.sleep(0)  # lets other threads run
            return self._quantum(FAST_QUANTUM)
        quantum = self._quantum(LONGEST_QUANTUM)
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

    def _quantum(self, longest: float) -> int:
        """Return how many steps to make between two looks at the command topics."""
        config = self._simulation.config
        return max(1, min(config.steps_per_publish, round(longest / config.setup.step)))

    def _advance(self, steps: int, *, serve: bool) -> None:
        """Make steps, stopping at each where a command begins or ends or a message is due."""
        sim, restarts = self._simulation, self.pacer.restarts
        while steps > 0:
            made = sim.leap(steps)
            self.pacer.made(made)
            steps -= made
            if sim.at_message:
                paused = self.paused
                self._arrive(serve=serve)
                if self.paused != paused or self.pacer.restarts != restarts:
                    return
            else:
                self._outputs.tick(self.timeline.now, patience=qos.CLOCK_PERIOD)

    def _arrive(self, *, serve: bool) -> None:
        """Do what happens where a message is due: requests, throws, then the messages."""
        if serve:
            self._serve()
        self._with_pace(self._simulation.arrive)

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
        factor = max(config.real_time_factor, 1e-9)
        self.pacer.restart(config.setup.step, factor, time.monotonic())


def _pace(config: SimConfig) -> tuple[float, float, float]:
    return config.physics_rate, config.publish_rate, config.real_time_factor
