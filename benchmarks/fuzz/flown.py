"""What every fuzz target asks of a flight: 100 steps in finite numbers, or an error on purpose."""

import math

from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics.flight import NO_CONTROL, Setup
from disc_sim_ros.physics.kernels.equations import Control, State
from disc_sim_ros.physics.simulator import FlightSimulator, warm_up

STEPS = 100
warm_up()  # or the first input would wait for the compiler, which looks like a hang


def fly_on(setup: Setup, release: State, control: Control = NO_CONTROL) -> None:
    """Fly some steps under control; a refusal and a flight that is lost are answers too.

    Raises:
        AssertionError: A number of the state is not finite, or the attitude is no rotation.
    """
    try:
        sim = FlightSimulator(setup, release, ground=False)
        sim.control = control
    except ConfigError:
        return
    for _ in range(4):
        try:
            sim.advance(STEPS // 4)
        except IntegrationError:
            require_sound(sim.state)
            return
        require_sound(sim.state)


def require_sound(state: State) -> None:
    """Refuse a state that is not finite, or whose quaternion has lost its length."""
    if not all(map(math.isfinite, state)):
        raise AssertionError(f'not finite: {state}')
    length = math.hypot(*state[6:10])
    if abs(length - 1.0) > 1e-9:
        raise AssertionError(f'attitude of length {length!r}: {state}')
