"""A flight that is flown step by step and steered on the way: the one mutable object of `core`."""

from dataclasses import replace
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import NO_CONTROL, NO_NOISE, Setup, checked_control, lost
from disc_sim_ros.physics.kernels import integrator
from disc_sim_ros.physics.kernels.equations import Control, State, Velocity
from disc_sim_ros.physics.kernels.integrator import LANDED, LOST, PROGRESS_SIZE, STATE_SIZE
from disc_sim_ros.physics.kernels.jit import is_compiled
from disc_sim_ros.physics.kernels.wind import GUST_INTERVAL, NOISE_COLUMNS, wind_at
from disc_sim_ros.physics.launch import Launch, require_above_ground

_GUST = slice(1 + STATE_SIZE, 4 + STATE_SIZE)  # in a Progress
NOTHING = integrator.Observed(*(0.0,) * 12)  # acts on a disc that is held or lies
_FIRST_GUSTS = 1000  # drawn at first; the store doubles when a flight outlasts it


class FlightSimulator:
    """Flies one disc in whole steps, the same steps to the bit that `flight.fly` makes.

    Commands and wind change between steps and hold from the next one on. After a landing the disc
    lies where it fell, and steps only pass time.

    Attributes:
        setup: What flies, in what; its wind is the present one.
        ground: Whether the flight ends where z = 0 is crossed from above.
        steps: Steps since the release, also after the landing.
        landed: Whether the disc lies on the ground.
        touch_time: Time of the landing since the release [s].
        touch: State at the landing, before the disc came to rest.
    """

    def __init__(self, setup: Setup, release: State, *, ground: bool = True) -> None:
        """Let a disc go; see `Launch.state`.

        Raises:
            ConfigError: A release underground, or a step too long for the spin.
        """
        setup.check_step(release.r, math.hypot(release.VX, release.VY, release.VZ))
        if ground:
            require_above_ground(frames.flip(release.Z))
        self.setup = setup
        self.ground = ground
        self.release = release
        self.steps = 0
        self.landed = False
        self.touch_time = math.inf
        self._control = NO_CONTROL
        self._flight = np.zeros(PROGRESS_SIZE)
        self._flight[1 : 1 + STATE_SIZE] = release
        self._touch = np.empty(STATE_SIZE)
        self._random = np.random.Generator(np.random.Philox(int(setup.wind.seed)))
        self._noise = NO_NOISE
        self._state = self.touch = release
        self.advance(0)  # completes the state: gust, and p and q of the precession model

    @property
    def state(self) -> State:
        """Return the present state."""
        return self._state

    @property
    def time(self) -> float:
        """Return the time since the release [s]."""
        return self.steps * self.setup.step

    @property
    def wind(self) -> Velocity:
        """Return the wind at the disc, gusts included, earth axes 1."""
        gust = Velocity(*self._flight[_GUST].tolist())
        return wind_at_disc(self._state, gust, self.setup)

    def observe(self) -> integrator.Observed:
        """Return the rates of change and the aerodynamic force and moment right now.

        All are 0 for a disc that lies on the ground, which carries it.
        """
        if self.landed:
            return NOTHING
        setup, seen = self.setup, np.empty(len(NOTHING))
        integrator.observe(
            self._flight,
            setup.plant,
            setup.disc.table_rows,
            setup.disc.spin_terms,
            self._control,
            setup.wind_data,
            seen,
        )
        return integrator.Observed(*seen.tolist())

    @property
    def control(self) -> Control:
        """Return the control inputs that hold from the next step on."""
        return self._control

    @control.setter
    def control(self, control: Control) -> None:
        self.take(checked_control(control))

    def take(self, control: Control) -> None:
        """Hold control inputs that are known to be floats in the range of `checked_control`."""
        self._control = control

    def set_wind(self, wind: Wind) -> None:
        """Change the wind from the next step on; a change of the seed counts at the next release.

        Raises:
            ConfigError: Turbulence would start or end in mid-flight.
        """
        if (wind.turbulence > 0.0) != (self.setup.wind.turbulence > 0.0) and self.steps > 0:
            allowed = 'it starts or ends at a release'
            raise ConfigError('turbulence', wind.turbulence, allowed, 'turbulence')
        seed = self.setup.wind.seed
        self.setup = replace(self.setup, wind=replace(wind, seed=seed))

    def advance(self, steps: int) -> None:
        """Fly some steps on.

        Raises:
            IntegrationError: The disc turned or moved faster than the step can follow; the state
                stays at the last sound one.
        """
        if self.landed:
            self.steps += steps
            return
        if self.steps == 0:  # `run` completes a release: once, because twice moves the last bits
            self._flight[1 : 1 + STATE_SIZE] = self.release
        setup = self.setup
        status, t = integrator.run(
            self._flight,
            steps,
            setup.plant,
            setup.disc.table_rows,
            setup.disc.spin_terms,
            self._control,
            setup.wind_data,
            self._noise_until(self.steps + steps),
            float(setup.step),
            self.ground,
            self._touch,
        )
        if status == LANDED:
            self.landed = True
            self.touch_time = t
            self.touch = State(*self._touch.tolist())
            # At rest where it touched: no velocity, no rates, the attitude as it was.
            self._state = self.touch._replace(Z=0.0, VX=0.0, VY=0.0, VZ=0.0, p=0.0, q=0.0, r=0.0)
        else:
            self._state = State(*self._flight[1 : 1 + STATE_SIZE].tolist())
        if status == LOST:
            raise lost(t, setup.step)
        self.steps += steps

    def _noise_until(self, step: int) -> FloatArray:
        """Return gust noise for all steps up to `step`, the same numbers that `fly` draws."""
        if self.setup.wind.turbulence == 0.0:
            return NO_NOISE
        rows = math.ceil(step * self.setup.step / GUST_INTERVAL) + 3
        while len(self._noise) < rows:
            more = max(_FIRST_GUSTS, len(self._noise))
            noise = self._random.standard_normal((more, NOISE_COLUMNS))
            self._noise = np.concatenate([self._noise, noise])
        return self._noise


def wind_at_disc(state: State, gust: Velocity, setup: Setup) -> Velocity:
    """Return the wind where the disc is, gust included, earth axes 1."""
    return wind_at(state.Z, gust, setup.wind_data)


def is_ready() -> bool:
    """Say whether stepping needs no compilation first."""
    return is_compiled(integrator.run)


def warm_up() -> None:
    """Load or compile all that a simulator calls, so that no step has to wait for it."""
    sim = FlightSimulator(Setup(disc=disc_file.load_disc('frisbee')), Launch().state())
    sim.advance(1)
    sim.observe()
