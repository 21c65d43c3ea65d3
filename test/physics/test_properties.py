"""Properties of all flights over the whole envelope: every disc, model, wind and control."""

import dataclasses
import math

from hypothesis import assume, event, given
from hypothesis import strategies as st
import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics.flight import NO_CONTROL, Setup, fly
from disc_sim_ros.physics.kernels.equations import NO_DIRECTION, PRECESSION, Velocity, derivative
from disc_sim_ros.physics.simulator import FlightSimulator
from envelope import (
    CONTROLS,
    flown,
    launches,
    number,
    require_direction,
    resolved,
    setups,
    thorough,
    winds,
)


@thorough(120)
@given(launches(), setups(wind=winds()), CONTROLS, number(1e-4, 0.1, 1e-3), st.booleans())
def test_every_flight_is_finite_or_refused(launch, setup, control, step, ground):
    """A flight is refused, ends with an error, or is finite in every number."""
    setup = dataclasses.replace(setup, step=step)
    duration = 200 * step
    try:
        flight = fly(
            launch, setup, control=control, duration=duration, ground=ground,
            sample_rate=min(20 / duration, 1e5),
        )  # fmt: skip
    except (ConfigError, IntegrationError) as error:
        event(type(error).__name__)
        return
    t = flight.trajectory
    assert np.all(np.isfinite(t.rows))
    assert all(map(math.isfinite, (*flight.end, flight.time, flight.range, flight.apex)))
    assert_allclose(np.linalg.norm(t.attitude, axis=1), 1.0, atol=1e-12)
    assert 0.0 <= flight.time <= duration
    assert flight.landed or flight.time == duration
    if flight.landed:
        on_rim = flight.setup.lands_on == 'rim'
        highest = setup.disc.diameter / 2 if on_rim else 0.0
        assert -1e-9 * on_rim <= flight.position[2] <= highest + 1e-9 * on_rim
    assert flight.apex >= -flight.end.Z


@thorough(40)
@given(launches(height=(0.0, 3.0)), setups(wind=winds()), CONTROLS, st.integers(1, 40))
def test_single_steps_make_the_same_flight_to_the_bit(launch, setup, control, chunk):
    """Also if the step cannot follow: both simulators raise, in the same state."""
    steps = 120
    try:
        sim = FlightSimulator(setup, launch.state())
    except ConfigError:
        with pytest.raises(ConfigError):
            fly(launch, setup, control=control)
        return
    sim.control = control
    # The precession model completes the state at release, with the present control inputs.
    at_once = FlightSimulator(setup, launch.state())
    at_once.control = control
    try:
        for _ in range(0, steps, chunk):
            sim.advance(min(chunk, steps - sim.steps))
        at_once.advance(steps)
    except IntegrationError:
        with pytest.raises(IntegrationError):
            at_once.advance(steps)
        assert at_once.state == sim.state
        return
    assert at_once.state == sim.state
    assert at_once.landed == sim.landed


RESOLVED = 0.4  # rad a step: twice that at release


class Mirrored(Setup):
    """A setup whose gusts to the right come from the left."""

    def noise(self, duration):
        return super().noise(duration) * (1, -1, -1, 1, 1)


@thorough(60)
@given(launches(), setups(wind=winds()), CONTROLS)
def test_the_mirrored_throw_flies_the_mirrored_path(launch, setup, control):
    """Exactly: every product only changes its sign, with gusts and control inputs too."""
    fields = {field.name: getattr(setup, field.name) for field in dataclasses.fields(setup)}
    X, Y, Z = setup.wind.mean
    other = Mirrored(**fields | {'wind': dataclasses.replace(setup.wind, mean=(X, -Y, Z))})
    names = ('roll', 'yaw', 'sideslip', 'spin', 'roll_rate')
    back = dataclasses.replace(launch, **{name: -getattr(launch, name) for name in names})
    odd = {name: -getattr(control, name) for name in ('C_L', 'C_N', 'L', 'N')}
    a = flown(launch, setup, 0.1, control)
    b = flown(back, other, 0.1, control._replace(**odd))
    assert np.array_equal(b.position, a.position * (1, -1, 1))
    assert np.array_equal(b.velocity, a.velocity * (1, -1, 1))
    assert np.array_equal(b.rates, a.rates * (-1, 1, -1))


def turned(vectors, degrees):
    """Vectors in earth axes, turned right about Z (down)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


@thorough(80)
@given(
    launches(yaw=(-180.0, 180.0)), setups(), winds(gusts=False), CONTROLS, number(-180.0, 180.0)
)
def test_the_heading_turns_all_vectors_and_changes_nothing_else(launch, setup, wind, control, yaw):
    """At every state, and so at every step; test_symmetry.py has whole flights.

    A turn rounds the velocity by some 1e-16. Near alpha = +-90 degrees the direction of the flow
    in the plane of the disc changes by 1e4 times as much.
    """
    tolerance = 32 * np.finfo(float).eps / NO_DIRECTION
    plant, s = setup.plant, launch.state()
    aside = dataclasses.replace(launch, yaw=launch.yaw + yaw).state()
    here = Velocity(*wind.mean)
    there = Velocity(*turned(wind.mean, yaw).tolist())
    a = derivative(s, here, plant, control)
    b = derivative(aside, there, plant, control)
    V = launch.speed + math.hypot(*wind.mean)
    q_inf_S = 0.5 * plant.rho * V**2 * plant.S  # with coefficients up to 10
    largest = plant.g + 10.0 * q_inf_S / plant.m
    assert_allclose(b[3:6], turned(a[3:6], yaw), rtol=0.0, atol=tolerance * largest)
    rates = 10.0 * q_inf_S * plant.c / plant.I_x * (1.0 + max(map(abs, control[:3])))
    if plant.model == PRECESSION:
        return  # the model computes p and q, without a rate of change
    damping = 0.5 * plant.rho * V * plant.S * plant.c**2 * (1.0 + abs(plant.C_Mq)) / plant.I_x
    rates += damping * max(map(abs, s[10:13])) + 2.0 * max(map(abs, s[10:13])) ** 2
    rates += max(map(abs, control[3:6])) / plant.I_x
    assert_allclose(b[10:13], a[10:13], rtol=0.0, atol=tolerance * rates)


def errors(launch, setup, control):
    """Errors against a far finer step: the largest of five steps, and of three a quarter as long.

    The place of a corner of the table or of the wind profile within a step is random: of a single
    step the error may be small by chance, hardly of the largest of five. Flights in
    which control inputs speed up the rotation beyond what the steps resolve do not count.
    """
    setup = resolved(setup, launch, share=0.2)
    h = setup.step
    duration = min(0.1, 100 * h)
    assume(h > 50e-6)
    t = flown(launch, setup, duration, control, samples=400)
    require_direction(t)
    nutation = max(1.0, setup.plant.I_z / setup.plant.I_x)
    assume(h * nutation * np.abs(t.rates).max() < RESOLVED)

    def end(step):
        fine = dataclasses.replace(setup, step=max(step, 1e-6))
        return flown(launch, fine, duration, control, samples=1).rows[-1, 1:14]

    exact = end(h / 48)
    scale = 1.0 + np.abs(exact)

    def worst(*steps):
        return max(np.max(np.abs(end(step) - exact) / scale) for step in steps)

    return worst(h, 0.95 * h, 0.9 * h, 0.85 * h, 0.8 * h), worst(h / 4, h / 5, h / 6)


@thorough(40)
@given(launches(), setups(wind=winds(gusts=False)), CONTROLS)
def test_shorter_steps_converge(launch, setup, control):
    """Second order, at corners, leaves 1/16 at a quarter of the step; 1/2 is required."""
    coarse, fine = errors(launch, setup, control)
    assert fine <= max(coarse / 2, 1e-9)


@thorough(40)
@given(
    launches(
        speed=(5.0, 60.0), angle_of_attack=(-45.0, 45.0), spin=(-300.0, 300.0),
        roll_rate=(-50.0, 50.0), pitch_rate=(-50.0, 50.0),
    ),
    setups().filter(lambda setup: setup.plant.use_linear and not len(setup.disc.spin_terms)),
)  # fmt: skip
def test_shorter_steps_converge_fast_with_smooth_coefficients(launch, setup):
    """Fourth order leaves 1/256 at a quarter of the step; 1/32 is required."""
    coarse, fine = errors(launch, setup, NO_CONTROL)
    event('decisive' if coarse > 32e-9 else 'errors too small to decide')
    assert fine <= max(coarse / 32, 1e-9)
