"""The whole envelope as hypothesis strategies: launches, discs, models, winds, commands.

Launches are drawn from `quantities.LAUNCH`, with the ends of the ranges and the corners of the
flow among them.
"""

import dataclasses
import math

from hypothesis import HealthCheck, assume, event, reject, settings
from hypothesis import strategies as st
import numpy as np

from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import MODELS, MOMENT_AXES, NO_CONTROL, Setup, fly
from disc_sim_ros.physics.kernels.equations import DISC, DISC_AIR, DISC_BODY, Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.quantities import LAUNCH, STEP

DISCS = {name: disc_file.load_disc(name) for name in disc_file.disc_names()}
ANGLES = (0.0, 90.0, -90.0, 180.0, -180.0, 89.999, 1e-9, -1e-300)


def thorough(examples):
    """The same examples in every run; nothing is slow but the first compilation."""
    return settings(
        max_examples=examples, deadline=None, derandomize=True, database=None,
        suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
    )  # fmt: skip


def number(lowest, highest, *special):
    inside = [x for x in (0.0, lowest, highest, *special) if lowest <= x <= highest]
    return st.one_of(st.floats(lowest, highest), st.sampled_from(inside))


def launches(**bounds):
    """Launches over the ranges of the table; `bounds` narrow some of them."""
    limits = {name: bounds.get(name, (q.lowest, q.highest)) for name, q in LAUNCH.items()}
    special = {
        name: ANGLES for name, q in LAUNCH.items() if q.unit == 'degrees'
    } | {'spin': (31.416, -31.416, 1e-9), 'speed': (1e-9, 15.0)}  # fmt: skip
    return st.builds(
        Launch, **{k: number(low, high, *special.get(k, ())) for k, (low, high) in limits.items()}
    )


CALM = st.just(Wind())


@st.composite
def setups(draw, *, wind=CALM, axes=tuple(MOMENT_AXES), models=tuple(MODELS)):
    disc = DISCS[draw(st.sampled_from(sorted(DISCS)))]
    aero = draw(st.sampled_from([kind for kind in ('table', 'linear') if disc.has(kind)]))
    return Setup(
        disc=disc,
        aero=aero,
        model=draw(st.sampled_from(models)),
        moment_axes=draw(st.sampled_from(axes)),
        wind=draw(wind),
        step=STEP.default,
    )


@st.composite
def winds(draw, *, gusts=True):
    z0 = draw(number(0.0, 10.0, 1e-6, 0.03))
    return Wind(
        mean=tuple(draw(number(-100.0, 100.0)) for _ in range(3)),
        roughness_length=z0,
        reference_height=draw(number(max(2.0 * z0, 0.1), 1000.0, 10.0)),
        turbulence=draw(number(0.0, 50.0)) if gusts else 0.0,
        seed=draw(st.integers(0, 2**63 - 1)),
    )


COEFFICIENT, MOMENT = number(-10.0, 10.0, 0.01), number(-1000.0, 1000.0, 0.01)
CONTROLS = st.builds(
    Control, *[COEFFICIENT] * 3, *[MOMENT] * 3, st.sampled_from([DISC, DISC_BODY, DISC_AIR])
)


def resolved(setup, launch, share=0.05):
    """The setup with a step that is a `share` of the fastest time scale, if there is one."""
    fastest = fastest_rate(setup, launch)
    return dataclasses.replace(setup, step=min(1e-3, max(1e-6, share / max(fastest, 1e-6))))


def fastest_rate(setup, launch):
    """The fastest of spin, nutation, rates, damping and pitch stiffness at release [rad/s]."""
    disc = setup.disc
    fine = dataclasses.replace(setup, step=1e-6)
    sim = FlightSimulator(fine, launch.state(), ground=False)
    V = launch.speed + math.hypot(*setup.wind.mean)
    stiffness = setup.air.density * V * disc.area * disc.diameter / disc.inertia_diametral
    slope = disc.steepest_moment(setup.aero or disc.aero)
    return max(
        abs(sim.state.p),
        abs(sim.state.q),
        abs(launch.spin) * max(1.0, disc.inertia_axial / disc.inertia_diametral),
        0.25 * stiffness * disc.diameter * max(-disc.C_Lp, -disc.C_Mq),
        math.sqrt(0.5 * stiffness * V * slope),
    )


def flown(launch, setup, duration, control=NO_CONTROL, samples=20):
    """The samples of a flight; one that no step can follow does not count as an example."""
    try:
        return fly(
            launch, setup, control=control, duration=duration, ground=False,
            sample_rate=samples / duration,
        ).trajectory  # fmt: skip
    except (ConfigError, IntegrationError) as error:
        event(type(error).__name__)
        reject()


def require_direction(t):
    """Drop flights in which the flow comes from straight above or below.

    There its direction in the plane of the disc turns over within 0.006 degrees: rounding decides
    which way, and no order of a method holds. test_special_attitudes.py has what holds there.
    """
    assume(np.abs(t.alpha).max() < math.radians(88.0))
