"""Simulated measurements of throws, and sessions of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.identification.coefficients import NAMES, base_of, disc_with
from disc_sim_ros.estimation.identification.observations import (
    ACCELERATION,
    ATTITUDE,
    CAMERA,
    GYRO,
    NOISE,
    POSITION,
    Accelerations,
    Attitudes,
    Camera,
    Gyro,
    Observation,
    Positions,
)
from disc_sim_ros.estimation.identification.problem import Prior, Problem
from disc_sim_ros.estimation.identification.throws import Throw, throw_of
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.frames import flip_yz
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.sampled import default_row, fly_sampled
from disc_sim_ros.quantities import COEFFICIENT_SPREAD, COEFFICIENTS

CAMERA_HEIGHT = 100.0  # m
SHARE = 0.3  # of the spread of discs: how far the true disc lies from the base, one deviation
SPIN_ERROR = 3.0  # rad/s, of the spin that is stated where no gyro measures it


def measured(
    launch: Launch,
    setup: Setup,
    kinds: Sequence[str],
    generator: np.random.Generator,
    *,
    rate: float = 60.0,
    noise: dict[str, float] | None = None,
) -> list[Observation]:
    """Return what instruments measure of a simulated flight, up to its landing.

    Args:
        launch: The release.
        setup: The disc, air and wind, with the step of the flight.
        kinds: The instruments, of `observations.UNITS`.
        generator: Draws the noise, white and normal.
        rate: Measurements of each instrument a second.
        noise: Standard deviations by kind; others are those of `observations.NOISE`.
    """
    deviation = NOISE | (noise or {})
    end = fly(launch, setup).time
    t = np.arange(0.0, end, 1.0 / rate)
    state = np.array(launch.state())[np.newaxis]
    row = default_row(setup)[np.newaxis]
    made: list[Observation] = []
    for kind in kinds:
        zero = np.zeros((1, 2))
        empty = _empty(kind, t, setup.air.gravity)
        times, places = np.unique(empty.sample_times, return_inverse=True)
        sampled = fly_sampled(state, row, setup, times, step=setup.fixed_step, duration=0.0).states
        sampled = sampled[:, places]
        if kind == ATTITUDE:
            made.append(
                Attitudes(t, _shaken(local.disc_axis(sampled[0]), deviation[kind], generator))
            )
            continue
        clean = empty.residuals(sampled, zero)[0]
        value = clean + deviation[kind] * generator.standard_normal(clean.shape)
        made.append(_with(empty, value))
    return made


def _empty(kind: str, t: FloatArray, gravity: float) -> Observation:
    """Return measurements of zero, whose residuals are the predictions."""
    vectors = np.zeros((len(t), 3))
    match kind:
        case _ if kind == POSITION:
            return Positions(t, vectors)
        case _ if kind == GYRO:
            return Gyro(t, vectors)
        case _ if kind == ACCELERATION:
            return Accelerations(t, vectors, gravity)
        case _ if kind == CAMERA:
            return Camera(t, vectors[:, :2], CAMERA_HEIGHT)
    return Attitudes(t, np.tile([0.0, 0.0, 1.0], (len(t), 1)))


def _with(empty: Observation, value: FloatArray) -> Observation:
    """Return measurements with values."""
    match empty:
        case Positions(t=t):
            return Positions(t, value)
        case Gyro(t=t):
            return Gyro(t, value)
        case Accelerations(t=t, gravity=gravity):
            return Accelerations(t, value, gravity)
        case Camera(t=t, height=height):
            return Camera(t, value, height)
    raise TypeError(empty)


def _shaken(axes: FloatArray, deviation: float, generator: np.random.Generator) -> FloatArray:
    """Return unit vectors turned at random by `deviation` about each direction across [rad]."""
    turned = axes + deviation * generator.standard_normal(axes.shape)
    unit: FloatArray = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
    return unit


def session(
    values: FloatArray,
    setup: Setup,
    kinds: Sequence[str],
    generator: np.random.Generator,
    *,
    count: int,
    spin_error: float | None = None,
) -> list[Throw]:
    """Return the throws of `thrown` without their releases."""
    pairs = thrown(values, setup, kinds, generator, count=count, spin_error=spin_error)
    return [throw for throw, _ in pairs]


def thrown(
    values: FloatArray,
    setup: Setup,
    kinds: Sequence[str],
    generator: np.random.Generator,
    *,
    count: int,
    spin_error: float | None = None,
) -> list[tuple[Throw, Launch]]:
    """Return throws of one disc as instruments measure them, each with its true release.

    Args:
        values: Coefficients of the disc, in the order of `coefficients.NAMES`, shape (9,).
        setup: The base disc, the wind and the step.
        kinds: The instruments.
        generator: Draws releases and noise.
        count: Number of throws.
        spin_error: Standard deviation of the spin that is told [rad/s]; None: no spin is told.
    """
    disc = disc_with(base_of(setup), values, 'true', '')
    throws = []
    for k in range(count):
        launch = Launch(
            speed=generator.uniform(14.0, 20.0),
            pitch=generator.uniform(5.0, 15.0),
            roll=generator.uniform(-15.0, 15.0),
            angle_of_attack=generator.uniform(0.0, 8.0),
            spin=generator.uniform(45.0, 75.0),
            height=1.3,
            roll_rate=generator.normal(0.0, 2.0),
            pitch_rate=generator.normal(0.0, 2.0),
        )
        made = measured(launch, replace(setup, disc=disc), kinds, generator)
        spin = None
        if spin_error is not None:
            spin = launch.spin + spin_error * generator.standard_normal()
        throws.append((throw_of(f'throw {k + 1}', made, disc, spin=spin), launch))
    return throws


def drawn(
    seed: int, base: Setup, kinds: Sequence[str], *, count: int
) -> tuple[FloatArray, FloatArray, list[tuple[Throw, Launch]]]:
    """Return a disc and a wind drawn at random, and throws with their true releases.

    Args:
        seed: Of all that is drawn.
        base: The disc about which others are drawn.
        kinds: The instruments.
        count: Number of throws.

    Returns:
        Coefficients of the disc, shape (9,), the wind in `map` [m/s], shape (2,), and the throws.
    """
    generator = np.random.default_rng(seed)
    values = _disc(generator, base)
    wind = generator.normal(0.0, 2.0, 2)
    setup = replace(base, step=5e-4, wind=Wind(mean=flip_yz((*wind, 0.0))))
    error = None if GYRO in kinds else SPIN_ERROR
    return values, wind, thrown(values, setup, kinds, generator, count=count, spin_error=error)


def _disc(generator: np.random.Generator, base: Setup) -> FloatArray:
    """Draw the coefficients of a disc."""
    spread = np.array([COEFFICIENT_SPREAD[name] for name in NAMES])
    values = base_of(base).values + SHARE * spread * generator.standard_normal(len(NAMES))
    low = [COEFFICIENTS[name].lowest for name in NAMES]
    high = [COEFFICIENTS[name].highest for name in NAMES]
    low[NAMES.index('damping')] = 0.2  # a factor near 0 wobbles for ever
    return np.clip(values, low, high)


def problem_of(throws: Sequence[Throw], base: Setup) -> Problem:
    """Return the problem that `identify` solves first."""
    about = base_of(base)
    return Problem(
        setup=base,
        base=about,
        free=tuple(range(len(NAMES))),
        throws=tuple(throws),
        prior=Prior(np.array([COEFFICIENT_SPREAD[name] for name in NAMES])),
        noise=NOISE,
        held=about.values,
    )
