"""One flight from release to landing, without ROS: `fly`, which every offline tool uses."""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
import math
import threading
from typing import Any

import numpy as np

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.disc import AERODYNAMICS, GROUND_CONTACTS, Disc
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.kernels import adaptive, integrator, rotation, stages
from disc_sim_ros.physics.kernels.aerodynamics import Linear
from disc_sim_ros.physics.kernels.equations import (
    BODY,
    CONSTANT_SPIN,
    EXACT,
    PRECESSION,
    SLOWING_PRECESSION,
    WIND,
    Control,
    Plant,
    State,
)
from disc_sim_ros.physics.kernels.integrator import Options
from disc_sim_ros.physics.kernels.jit import note_before
from disc_sim_ros.physics.kernels.rk4 import STABLE, Inputs
from disc_sim_ros.physics.kernels.wind import GUST_INTERVAL, NOISE_COLUMNS, WindData
from disc_sim_ros.physics.launch import Launch, require_above_ground
from disc_sim_ros.physics.trajectory import COLUMNS, Trajectory
from disc_sim_ros.quantities import CONTROL, CONTROL_MOMENT, DURATION, SAMPLE_RATE, STEP

MODELS = {'exact': EXACT, 'constant_spin': CONSTANT_SPIN, 'precession': PRECESSION}
# Precession with the spin slowing down as in the exact model: what estimators fly. Not of the
# paper, so no program offers it.
SLOWING = 'slowing_precession'
_MODEL_NUMBERS = {**MODELS, SLOWING: SLOWING_PRECESSION}
MOMENT_AXES = {'body': BODY, 'wind': WIND}
NO_CONTROL = Control()
MOST_SAMPLES = 5_000_000


@dataclass(frozen=True, kw_only=True)
class Setup:
    """The disc, its surroundings, and how a flight is computed.

    Attributes:
        disc: The disc.
        model: Rigid-body model: 'exact', 'constant_spin' or 'precession'.
        aero: Steady coefficients: 'table' or 'linear'; None for the disc's own.
        moment_axes: Axes in which moment coefficients act: 'body' (axes 3) or 'wind' (axes 4).
        air: Density and gravity.
        wind: Wind and turbulence.
        step: Integration step of RK4 [s]; None for error control, which keeps landings within
            0.01 mm of those of far shorter steps (`kernels.adaptive`).
        ground_contact: What touches the ground: 'centre' (the paper) or 'rim'; None for the
            disc's own.

    Raises:
        ConfigError: A name is unknown, or the disc has no aerodynamics of this kind.
    """

    disc: Disc
    model: str = 'exact'
    aero: str | None = None
    moment_axes: str = 'body'
    air: Air = field(default_factory=Air)
    wind: Wind = field(default_factory=Wind)
    step: float | None = None
    ground_contact: str | None = None

    def __post_init__(self) -> None:
        validation.instance('disc', self.disc, Disc, "load_disc('frisbee')")
        validation.instance('air', self.air, Air, 'Air(density=1.2)')
        validation.instance('wind', self.wind, Wind, 'Wind(mean=(2.0, 0.0, 0.0))')
        if self.model != SLOWING:
            validation.choice('model', self.model, MODELS)
        validation.choice('moment_axes', self.moment_axes, MOMENT_AXES)
        if self.step is not None:
            STEP.check(self.step)
        if self.ground_contact is not None:
            validation.choice('ground_contact', self.ground_contact, GROUND_CONTACTS)
        if self.aero is not None:
            validation.choice('aero', self.aero, AERODYNAMICS)
            if not self.disc.has(self.aero):
                allowed = f'disc {self.disc.name} has no such coefficients'
                raise ConfigError('aero', self.aero, allowed)

    @property
    def has_no_nutation(self) -> bool:
        """Return True if p and q follow the moments without delay."""
        return self.model in {'precession', SLOWING}

    @property
    def lands_on(self) -> str:
        """Return what touches the ground: 'centre' or 'rim'."""
        return self.ground_contact or self.disc.ground_contact

    @property
    def fixed_step(self) -> float:
        """Return the step of a flight in even steps [s]: the given one, or 1 ms."""
        return float(STEP.default if self.step is None else self.step)

    @cached_property
    def corner_plant(self) -> Plant:
        """Return `plant` for flights with error control: see `Disc.corner_rows`."""
        return self.plant._replace(table=self.disc.corner_rows)

    @cached_property
    def plant(self) -> Plant:
        """Return the constants in the form of the compiled equations."""
        disc = self.disc
        return Plant(
            m=float(disc.mass),
            c=float(disc.diameter),
            S=float(disc.area),
            I_x=float(disc.inertia_diametral),
            I_z=float(disc.inertia_axial),
            C_Lp=float(disc.C_Lp),
            C_Mq=float(disc.C_Mq),
            C_Nr=float(disc.C_Nr),
            rho=float(self.air.density),
            g=float(self.air.gravity),
            model=_MODEL_NUMBERS[self.model],
            moment_axes=MOMENT_AXES[self.moment_axes],
            use_linear=(self.aero or disc.aero) == 'linear',
            line=_line(disc),
            table=disc.table_rows,
            spin_terms=disc.spin_terms,
            rim=0.5 * float(disc.diameter) if self.lands_on == 'rim' else 0.0,
        )

    def check_step(self, spin: float, speed: float) -> None:
        """Refuse a step that is too long for the motion of the disc at release.

        Args:
            spin: Spin rate [rad/s].
            speed: Speed over the ground [m/s].

        Raises:
            ConfigError: RK4 would be unstable in steps of the given length.
        """
        if self.step is None:
            return
        if self.has_no_nutation:  # p and q follow the moments without delay
            return
        V = speed + math.hypot(*self.wind.mean)
        steepest = self.disc.steepest_moment(self.aero or self.disc.aero)
        fastest = max(rates(spin, V, self.plant, steepest))
        if self.step * fastest > STABLE:
            allowed = (
                f'at spin {spin:g} rad/s and {V:g} m/s through the air RK4 needs at most '
                f'{STABLE / fastest:.3g} s'
            )
            raise ConfigError(STEP.name, self.step, allowed, STEP.name)

    @cached_property
    def calm_inputs(self) -> Inputs:
        """Return the inputs of the compiled equations without gusts and control inputs."""
        return Inputs(NO_CONTROL, self.wind_data, NO_NOISE)

    @cached_property
    def wind_data(self) -> WindData:
        """Return the wind in the form of the compiled equations."""
        wind = self.wind
        X, Y, Z = (float(component) for component in wind.mean)
        z0 = float(wind.roughness_length)
        per_log = 1.0 / math.log(wind.reference_height / z0) if z0 > 0.0 else 0.0
        horizontal = math.hypot(X, Y)
        x_X, x_Y = (X / horizontal, Y / horizontal) if horizontal > 0.0 else (1.0, 0.0)
        return WindData(X, Y, Z, z0, per_log, float(wind.turbulence), x_X, x_Y)

    def noise(self, duration: float) -> FloatArray:
        """Return the normal numbers that draw the gusts of a flight; none without turbulence."""
        if self.wind.turbulence == 0.0:
            return NO_NOISE
        rows = math.ceil(duration / GUST_INTERVAL) + 3
        generator = np.random.Generator(np.random.Philox(int(self.wind.seed)))
        return generator.standard_normal((rows, NOISE_COLUMNS))


def rates(spin: Any, V: Any, plant: Plant, steepest: float) -> tuple[Any, Any, Any]:
    """Return the rates of nutation, damping and pitching of a disc [1/s], for floats or arrays.

    Args:
        spin: Spin rate [rad/s].
        V: Airspeed [m/s].
        plant: Constants of the flight; any of them may be arrays as well.
        steepest: Largest slope of C_M over the angle of attack, positive [1/rad].
    """
    nutation = abs(spin) * plant.I_z / plant.I_x
    rhoVSc_I = plant.rho * V * plant.S * plant.c / plant.I_x
    damping = 0.25 * rhoVSc_I * plant.c * max(-plant.C_Lp, -plant.C_Mq)
    pitching = (0.5 * rhoVSc_I * V * steepest) ** 0.5
    return nutation, damping, pitching


@dataclass(frozen=True, slots=True)
class Flight:
    """A finished flight; `position`, `drift` and `apex` are in `map` axes.

    Attributes:
        launch: The release.
        setup: The disc, its surroundings and the integration.
        control: Control inputs, held for the whole flight.
        landed: True if it reached the ground; else its time was up in the air.
        time: Time of flight [s].
        end: State at the landing, or at the end of the time.
        apex: Greatest height above the ground [m].
        trajectory: Evenly timed samples, without the landing; empty without a sample rate.
    """

    launch: Launch
    setup: Setup
    control: Control
    landed: bool
    time: float
    end: State
    apex: float
    trajectory: Trajectory

    @property
    def position(self) -> FloatArray:
        """Return the position at the end in `map` axes [m], shape (3,).

        A landing has z = 0, or the height of the centre above the lowest point of the rim.
        """
        x, y, z = frames.map_from_paper(self.end[:3])
        on_centre = self.landed and self.setup.lands_on == 'centre'
        return np.array([x, y, 0.0 if on_centre else z]) + 0.0  # no minus zeros

    @property
    def range(self) -> float:
        """Return the distance over the ground from the release to the end [m]."""
        return math.hypot(self.end.X, self.end.Y)

    @property
    def drift(self) -> float:
        """Return the distance of the end to the left of the launch heading [m]."""
        c, s = rotation.cos_sin_degrees(self.launch.yaw)
        return s * self.end.X - c * self.end.Y


def fly(
    launch: Launch,
    setup: Setup,
    *,
    control: Control = NO_CONTROL,
    duration: float = DURATION.default,
    ground: bool = True,
    sample_rate: float = SAMPLE_RATE.default,
) -> Flight:
    """Fly a disc from its release to the ground.

    Args:
        launch: The release.
        setup: The disc, the model, the air and the step.
        control: Control inputs, held for the whole flight.
        duration: Longest time of flight [s].
        ground: End where the centre or the rim (`Setup.ground_contact`) crosses z = 0 from above;
            else fly for `duration`.
        sample_rate: Samples per second of the trajectory [1/s]; 0 for none.

    Returns:
        The flight; the landing is located to better than 1e-9 s of the computed solution. Samples
        are computed as exactly as steps are: each is a shorter step.

    Raises:
        ConfigError: A value is out of range, the step is too long for the spin, or the release is
            underground.
        IntegrationError: The disc turned or moved faster than the step can follow.
    """
    rows = check_flight(launch, setup, duration, ground=ground, sample_rate=sample_rate)
    samples = np.empty((rows, COLUMNS)) if rows else _NO_SAMPLES
    if control is NO_CONTROL and setup.wind.turbulence == 0.0:
        inputs = setup.calm_inputs
    else:
        inputs = Inputs(checked_control(control), setup.wind_data, setup.noise(duration))
    options = _options(setup.fixed_step, float(duration), ground, float(sample_rate))
    if setup.step is None:
        result = adaptive.integrate_adaptive(
            launch.state(), setup.corner_plant, inputs, options, samples, _of_thread.space
        )
    else:
        result = integrator.integrate(launch.state(), setup.plant, inputs, options, samples)
    if result.status == integrator.LOST:
        raise lost(result.t, setup.step)
    return Flight(
        launch=launch,
        setup=setup,
        control=control,
        landed=result.status == integrator.LANDED,
        time=result.t,
        end=result.state,
        apex=frames.flip(result.apex_Z),
        trajectory=Trajectory(samples[: result.samples], setup.disc.diameter),
    )


@lru_cache(
    maxsize=64, typed=True
)  # the same object again need not be written again, see `machine_code`
def _options(step: float, duration: float, ground: bool, sample_rate: float) -> Options:
    return Options(step, duration, ground, sample_rate)


class _OfThread(threading.local):
    """Memory that compiled code works in; each thread has its own."""

    def __init__(self) -> None:
        self.space = np.empty(stages.SPACE)


_of_thread = _OfThread()
_NO_SAMPLES = np.empty((0, COLUMNS))


def check_setup(setup: Setup) -> None:
    """Refuse what is no Setup.

    Raises:
        ConfigError: It is something else.
    """
    validation.instance('setup', setup, Setup, "Setup(disc=load_disc('frisbee'))")


def check_flight(
    launch: Launch, setup: Setup, duration: float, *, ground: bool, sample_rate: float
) -> int:
    """Check the arguments of `fly` together, and return the greatest number of its samples.

    Raises:
        ConfigError: As `fly`.
    """
    validation.instance('launch', launch, Launch, 'Launch(speed=18.0)')
    check_setup(setup)
    DURATION.check(duration)
    SAMPLE_RATE.check(sample_rate)
    setup.check_step(launch.spin, launch.speed)
    if ground:
        require_above_ground(launch.height)
    rows = math.floor(duration * sample_rate * (1 + 1e-12)) + 1 if sample_rate > 0.0 else 0
    if rows > MOST_SAMPLES:
        allowed = f'at most {MOST_SAMPLES} samples a flight'
        raise ConfigError(SAMPLE_RATE.name, sample_rate, allowed, SAMPLE_RATE.name)
    return rows


def lost(t: float, step: float | None) -> IntegrationError:
    """Return the error for a flight that the step [s] could not follow at time `t` [s]."""
    if step is None:
        return IntegrationError(
            f'at t = {t:.6g} s the disc turned or moved faster than error control can follow, '
            f'{STABLE / adaptive.SOUND:,.0f} rad/s; try a given, shorter step'
        )
    return IntegrationError(
        f'at t = {t:.6g} s the disc turned or moved faster than steps of {step:g} s can follow; '
        'try a shorter step'
    )


def first_call_note() -> str:
    """Return one line for users on why the next `fly` takes long; '' if it does not."""
    return note_before(adaptive.integrate_adaptive, seconds=12)


def _line(disc: Disc) -> Linear:
    """Return the lines in the form of the compiled equations; zeros if the disc has none."""
    line = disc.linear
    if line is None:
        return Linear(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Linear(*(float(getattr(line, name)) for name in Linear._fields))


def checked_control(control: Control) -> Control:
    """Return the control inputs as floats in their allowed range.

    Raises:
        ConfigError: A number is out of its range in `quantities`.
    """
    inputs = [q.check(getattr(control, name), f'control {name}') for name, q in _INPUTS.items()]
    return Control._make([*inputs, int(control.axes)])


_INPUTS = dict(zip(Control._fields, (CONTROL | CONTROL_MOMENT).values(), strict=False))


NO_NOISE = np.empty((0, NOISE_COLUMNS))
