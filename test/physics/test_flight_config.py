"""What a bag holds of a flight comes back equal: configuration, landing, event names and times."""

from dataclasses import fields, is_dataclass, replace
import itertools
import math
import struct

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
import yaml

from disc_sim_ros import __version__, topics
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, flight_config
from disc_sim_ros.physics.disc import AERODYNAMICS
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import MODELS, MOMENT_AXES, Setup
from disc_sim_ros.physics.flight_config import EventKey, FlightConfig, Key, Landing
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.quantities import LARGEST_SEED
from sample_discs import FRISBEE

DISCS = [disc_file.load_disc(name) for name in disc_file.disc_names()]
WINDS = (
    Wind(),
    Wind(mean=(2.0, -1.0, 0.1), turbulence=8.0, seed=LARGEST_SEED),
    Wind(mean=(1 / 3, 0.0, -1e-300), roughness_length=0.03, reference_height=7.7, seed=3),
)
RELEASE = Launch(speed=14.7, roll=-12.3, roll_rate=2.0, height=1.1).state()


def config(setup=None, release=RELEASE, **changes) -> FlightConfig:
    of_flight = {
        'flight': 3,
        'physics_rate': 3000.0,
        'publish_rate': 150.0,
        'ground': True,
        'command_timeout': 0.1,
    } | changes
    setup = setup or Setup(disc=FRISBEE)
    setup = replace(setup, step=1.0 / of_flight['physics_rate'])
    return FlightConfig(setup=setup, release=release, **of_flight)


def back(recorded: FlightConfig) -> FlightConfig:
    """Return a flight that was written and read again."""
    document = flight_config.document_of(flight_config.configuration_text(recorded))
    assert document is not None
    return flight_config.from_document(document)


def bits(value):
    """Return a value with the bits of its floats in their place, so that == compares them."""
    match value:
        case float():
            return struct.pack('<d', value)
        case np.ndarray():
            return value.dtype.str, value.shape, value.tobytes()
        case tuple() if hasattr(value, '_fields'):
            return {name: bits(x) for name, x in zip(value._fields, value, strict=True)}
        case tuple():
            return tuple(map(bits, value))
    if is_dataclass(value):
        return {f.name: bits(getattr(value, f.name)) for f in fields(value)}
    return value


def recorded_bits(recorded: FlightConfig) -> dict:
    """Return the bits of what is recorded: the aerodynamics by name, a wind of -0 as 0."""
    setup = recorded.setup
    wind = replace(setup.wind, mean=tuple(x + 0.0 for x in setup.wind.mean))
    setup = replace(setup, aero=setup.aero or setup.disc.aero, wind=wind)
    return bits(replace(recorded, setup=setup))


# ---- configuration ----


@pytest.mark.parametrize('disc', DISCS, ids=lambda disc: disc.name)
def test_every_disc_model_and_wind_comes_back_to_the_bit(disc):
    kinds = (None, *(kind for kind in AERODYNAMICS if disc.has(kind)))
    count = 0
    for model, aero, axes, wind in itertools.product(MODELS, kinds, MOMENT_AXES, WINDS):
        setup = Setup(
            disc=disc, model=model, aero=aero, moment_axes=axes, wind=wind,
            air=Air(density=1.1234567890123457, gravity=9.7),
        )  # fmt: skip
        recorded = config(setup, ground=aero is None)
        again = back(recorded)
        assert recorded_bits(again) == recorded_bits(recorded)
        assert bits(again.setup.plant) == bits(recorded.setup.plant)  # with its tables
        count += 1
    assert count >= len(MODELS) * 2 * len(MOMENT_AXES) * len(WINDS)


finite = st.floats(allow_nan=False, allow_infinity=False)


setups = st.builds(
    Setup,
    disc=st.just(FRISBEE),
    air=st.builds(Air, density=st.floats(0.0, 100.0), gravity=st.floats(0.0, 100.0)),
    wind=st.builds(
        Wind,
        mean=st.tuples(*[st.floats(-100.0, 100.0)] * 3),
        turbulence=st.floats(0.0, 50.0),
        seed=st.integers(0, LARGEST_SEED),
    ),
)


@settings(deadline=None, max_examples=200)
@given(
    setup=setups,
    release=st.builds(State, *[finite] * len(State._fields)),
    physics_rate=st.floats(10.0, 1e6),
    publish_rate=st.floats(1e-3, 1e4),
)
def test_any_number_comes_back_to_the_bit(setup, release, physics_rate, publish_rate):
    recorded = config(setup, release, physics_rate=physics_rate, publish_rate=publish_rate)
    assert recorded_bits(back(recorded)) == recorded_bits(recorded)


@settings(deadline=None)
@given(name=st.text(max_size=20).filter(str.isprintable))  # what a disc file may hold
def test_any_name_comes_back(name):
    description = ' '.join(f'on: {name}'.split())  # as a disc file gives it
    recorded = config(Setup(disc=replace(FRISBEE, name=name, description=description)))
    disc = back(recorded).setup.disc
    assert (disc.name, disc.description) == (name, description)


def test_the_bits_are_compared():
    """A comparison that could not fail would prove nothing."""
    changed = config(release=RELEASE._replace(X=math.nextafter(RELEASE.X, 1.0)))
    assert recorded_bits(changed) != recorded_bits(config())
    assert recorded_bits(config(command_timeout=0.2)) != recorded_bits(config())
    heavier = Setup(disc=replace(FRISBEE, mass=math.nextafter(FRISBEE.mass, 1.0)))
    assert recorded_bits(config(heavier)) != recorded_bits(config())


def test_the_document_has_the_keys_and_the_axes_of_map():
    wind = Wind(mean=(1.0, 2.0, 3.0))
    text = flight_config.configuration_text(
        config(Setup(disc=FRISBEE, wind=wind, ground_contact='rim'))
    )
    document = yaml.safe_load(text)
    assert list(document) == [value for name, value in vars(Key).items() if name.isupper()]
    assert document[Key.VERSION] == __version__
    assert [document[Key.WIND][axis] for axis in 'xyz'] == [1.0, -2.0, -3.0]
    assert document[Key.RELEASE] == RELEASE._asdict()


@pytest.mark.parametrize(
    'text',
    [
        '', '{', 'disc: 3', '[1, 2]', '- disc', 'hello', 'release: {X: 1}\nwind: {}',
        flight_config.configuration_text(config()).replace('model: exact\n', ''),
        flight_config.configuration_text(config()).replace('  VX:', '  V:'),
        flight_config.configuration_text(config()).replace('  X: 0.0', '  X: far'),
        flight_config.configuration_text(config()).replace('  X: 0.0', f'  X: {10**400}'),
    ],
)  # fmt: skip
def test_another_text_is_not_a_configuration(text):
    assert flight_config.document_of(text) is None


@pytest.mark.parametrize(
    ('key', 'value'),
    [
        (Key.DISC_FILE, None),
        (Key.DISC_FILE, {'mass_kg': 'heavy'}),
        (Key.MODEL, 'magic'),
        (Key.AERO, 3),
        (Key.MOMENT_AXES, None),
        (Key.PHYSICS_RATE, 0),
        (Key.PHYSICS_RATE, 10**400),
        (Key.PHYSICS_RATE, math.nan),
        (Key.PUBLISH_RATE, -1.0),
        (Key.PUBLISH_RATE, 'fast'),
        (Key.AIR_DENSITY, -1.0),
        (Key.GRAVITY, []),
        (Key.WIND, {'x': 1.0, 'y': 0.0, 'z': 0.0, 'temperature': 3.0}),
        (Key.WIND, {'x': 1000.0, 'y': 0.0, 'z': 0.0}),
        (Key.RELEASE, {}),
        (Key.COMMAND_TIMEOUT, 'soon'),
        (Key.FLIGHT, []),
    ],
)
def test_a_document_with_a_wrong_value_is_refused_in_one_line(key, value):
    document = flight_config.document_of(flight_config.configuration_text(config()))
    flight_config.from_document(document)
    for wrong in ({**document, key: value}, {k: v for k, v in document.items() if k != key}):
        if key in {Key.COMMAND_TIMEOUT, Key.FLIGHT} and key not in wrong:
            continue  # a flight can be flown without these
        with pytest.raises(ConfigError) as refused:
            flight_config.from_document(wrong)
        assert '\n' not in str(refused.value)


def test_a_recording_without_a_command_timeout_is_flown():
    document = flight_config.document_of(flight_config.configuration_text(config()))
    short = {k: v for k, v in document.items() if k not in {Key.COMMAND_TIMEOUT, Key.VERSION}}
    recorded = flight_config.from_document(short)
    assert recorded.command_timeout is None
    assert recorded.version == 'None'


# ---- events ----


def landed() -> FlightSimulator:
    sim = FlightSimulator(Setup(disc=FRISBEE), Launch(yaw=30.0).state())
    sim.advance(10_000)
    assert sim.landed
    return sim


def test_a_landing_comes_back_from_its_text():
    sim = landed()
    landing = flight_config.landing_of(sim)
    values = {name: str(x) for name, x in landing._asdict().items()}
    assert flight_config.landing_from(values) == landing
    assert landing.flight_time_s == sim.touch_time
    assert (landing.landing_x_m, landing.landing_y_m) == (sim.touch.X, -sim.touch.Y)
    assert landing.range_m == math.hypot(sim.touch.X, sim.touch.Y)
    assert landing.spin_rad_s == sim.touch.r > 0.0


@pytest.mark.parametrize('name', Landing._fields)
def test_a_landing_without_a_number_is_none(name):
    values = dict.fromkeys(Landing._fields, '1.0')
    assert flight_config.landing_from(values | {name: 'far'}) is None
    del values[name]
    assert flight_config.landing_from(values) is None


@given(st.integers(0, 2**63 - 1))
def test_times_come_back_exactly(nanoseconds):
    text = flight_config.exact_seconds(nanoseconds)
    assert flight_config.nanoseconds_of(text) == nanoseconds
    assert float(text) == pytest.approx(nanoseconds / 1e9)


@pytest.mark.parametrize('text', ['', '1', '1.5', '-1.000000000', '1.0000000000', 'soon', '1e9'])
def test_another_text_is_not_a_time(text):
    assert flight_config.nanoseconds_of(text) is None


@pytest.mark.parametrize('event', topics.FlightEvent)
@pytest.mark.parametrize('node', ['sim_node', 'red/sim_node', 'a: b'])
def test_the_name_of_an_event_comes_back(event, node):
    assert topics.event_of(topics.event_title(node, event)) == event


def test_keys_of_events_are_told_apart():
    keys = [value for name, value in vars(EventKey).items() if name.isupper()]
    assert len(set(keys)) == len(keys)
