"""A flight in single steps, with control on the way: the one mutable object of `physics`."""

from collections.abc import Callable
from dataclasses import replace
import math
from typing import Any

import numpy as np

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import (
    NO_CONTROL,
    NO_NOISE,
    Setup,
    check_setup,
    checked_control,
    lost,
)
from disc_sim_ros.physics.kernels import integrator
from disc_sim_ros.physics.kernels.equations import Control, Plant, State, Velocity
from disc_sim_ros.physics.kernels.integrator import (
    INTEGRATOR_STATE_SIZE,
    LANDED,
    LOST,
    Observation,
)
from disc_sim_ros.physics.kernels.jit import note_before
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE
from disc_sim_ros.physics.kernels.wind import GUST_INTERVAL, NOISE_COLUMNS, WindData, wind_at
from disc_sim_ros.physics.launch import Launch, require_above_ground

_GUST = slice(1 + STATE_SIZE, 4 + STATE_SIZE)  # in an IntegratorState
NOTHING = Observation(*(0.0,) * 12)  # of a disc at rest, in a hand or on the ground
_FIRST_GUSTS = 1000  # rows of noise drawn at first; doubled when a flight outlasts them


class FlightSimulator:
    """Flies one disc in whole steps, equal to those of `flight.fly` to the bit.

    Control inputs and wind change between steps and are held from the next step on. After a
    landing the disc stays where it fell, and steps only pass time.

    Attributes:
        setup: The disc, its surroundings and the integration; its wind is the present one.
        ground: True if the flight ends where the centre or the rim crosses z = 0 from above.
        release: State at release.
        steps: Steps since the release, also after the landing.
        landed: True if the disc lies on the ground.
        touch_time: Time of the landing since the release [s].
        touch: State at the landing, before the disc came to rest.
    """

    def __init__(self, setup: Setup, release: State, *, ground: bool = True) -> None:
        """Release a disc; see `Launch.state`.

        Raises:
            ConfigError: The release is underground, or the step too long for the spin.
        """
        check_setup(setup)
        validation.instance('release', release, State, 'Launch(speed=18.0).state()')
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
        self._flight = np.zeros(INTEGRATOR_STATE_SIZE)
        self._flight[1 : 1 + STATE_SIZE] = release
        self._landing = np.empty(STATE_SIZE)
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
        return self.steps * self.setup.fixed_step

    @property
    def wind(self) -> Velocity:
        """Return the wind at the disc, gusts included, earth axes 1."""
        gust = Velocity(*self._flight[_GUST].tolist())
        return wind_at_disc(self._state, gust, self.setup)

    def observe(self) -> Observation:
        """Return the present rates of change, and the aerodynamic force and moment.

        All are 0 for a disc that lies on the ground.
        """
        if self.landed:
            return NOTHING
        setup, fields = self.setup, np.empty(len(NOTHING))
        integrator.observe(self._flight, setup.plant, self._control, setup.wind_data, fields)
        return Observation(*fields.tolist())

    @property
    def control(self) -> Control:
        """Return the control inputs that are held from the next step on."""
        return self._control

    @control.setter
    def control(self, control: Control) -> None:
        self.take(checked_control(control))

    def take(self, control: Control) -> None:
        """Hold control inputs without a check: floats in the range of `checked_control`."""
        self._control = control

    def set_wind(self, wind: Wind) -> None:
        """Change the wind from the next step on; the seed stays until the next release.

        Raises:
            ConfigError: Turbulence would start or end in flight.
        """
        if (wind.turbulence > 0.0) != (self.setup.wind.turbulence > 0.0) and self.steps > 0:
            allowed = 'it starts or ends at a release'
            raise ConfigError('turbulence', wind.turbulence, allowed, 'turbulence')
        seed = self.setup.wind.seed
        self.setup = replace(self.setup, wind=replace(wind, seed=seed))

    def advance(self, steps: int) -> None:
        """Fly some whole steps.

        Raises:
            IntegrationError: The disc turned or moved faster than the step can follow; the state
                stays at the last sound one.
        """
        if self.landed:
            self.steps += steps
            return
        # `advance_steps` completes a release. Twice would change the last bits.
        if self.steps == 0:
            self._flight[1 : 1 + STATE_SIZE] = self.release
        setup = self.setup
        status, t = integrator.advance_steps(
            self._flight,
            steps,
            setup.plant,
            self._control,
            setup.wind_data,
            self._noise_until(self.steps + steps),
            setup.fixed_step,
            self.ground,
            self._landing,
        )
        if status == LANDED:
            self.landed = True
            self.touch_time = t
            self.touch = State(*self._landing.tolist())
            # At rest where it landed, without velocity and rates, in the attitude of the landing.
            Z = self.touch.Z if self.setup.lands_on == 'rim' else 0.0
            self._state = self.touch._replace(Z=Z, VX=0.0, VY=0.0, VZ=0.0, p=0.0, q=0.0, r=0.0)
        else:
            self._state = State(*self._flight[1 : 1 + STATE_SIZE].tolist())
        if status == LOST:
            raise lost(t, setup.fixed_step)
        self.steps += steps

    def step_arguments(
        self, steps: int
    ) -> tuple[FloatArray, Plant, WindData, FloatArray, float, bool, FloatArray]:
        """Return what `integrator.advance_steps` needs for some steps, except for the control.

        For a disc in the air with a step made. Compiled code that makes steps with them changes
        the arrays, and is followed by `count`.
        """
        setup = self.setup
        noise = self._noise_until(self.steps + steps)
        step = setup.fixed_step
        return (
            self._flight, setup.plant, setup.wind_data, noise, step, self.ground, self._landing
        )  # fmt: skip

    def count(self, steps: int) -> None:
        """Count steps that were made with `step_arguments`, or that passed after the landing."""
        self.steps += steps
        if not self.landed:
            self._state = State(*self._flight[1 : 1 + STATE_SIZE].tolist())

    def _noise_until(self, step: int) -> FloatArray:
        """Return the gust noise of all steps up to `step`: the numbers that `fly` draws."""
        if self.setup.wind.turbulence == 0.0:
            return NO_NOISE
        rows = math.ceil(step * self.setup.fixed_step / GUST_INTERVAL) + 3
        while len(self._noise) < rows:
            more = max(_FIRST_GUSTS, len(self._noise))
            noise = self._random.standard_normal((more, NOISE_COLUMNS))
            self._noise = np.concatenate([self._noise, noise])
        return self._noise


def wind_at_disc(state: State, gust: Velocity, setup: Setup) -> Velocity:
    """Return the wind at the disc, gust included, earth axes 1."""
    return wind_at(state.Z, gust, setup.wind_data)


def first_call_note(*more: Callable[..., Any], seconds: int = 10) -> str:
    """Return one line for users on why `warm_up` or steps take long; '' if they do not.

    Args:
        more: Other compiled functions that are called.
        seconds: How long the compilation of all of them takes, about [s].
    """
    return note_before(integrator.advance_steps, integrator.observe, *more, seconds=seconds)


def warm_up() -> None:
    """Load or compile every function that a simulator calls, so that no step waits for it."""
    sim = FlightSimulator(Setup(disc=disc_file.load_disc('frisbee')), Launch().state())
    sim.advance(1)
    sim.observe()
