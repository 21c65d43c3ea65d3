"""The parameters by default and in files, for the tests."""

from pathlib import Path

from disc_sim_ros.ros.sim.parameters import TABLE

ROOT = Path(__file__).parents[2]
DEFAULTS = {spec.name: spec.default for spec in TABLE}
SPECS = {spec.name: spec for spec in TABLE}
NUMBERS = [
    spec
    for spec in TABLE
    if isinstance(spec.default, int | float) and not isinstance(spec.default, bool)
]
# With these, any one number may be at the end of its range.
LENIENT = {
    'ground': False,
    'launch.spin': 0.0,
    'launch.speed': 0.0,
    'publish_rate': 10.0,
    'wind.reference_height': 1e3,
}
DISC_FILE = """\
based_on: frisbee
mass_kg: {mass}
"""


def flat(nested: dict, prefix: str = '') -> dict[str, object]:
    """Return a parameter file's nested keys with dots."""
    values = {}
    for key, value in nested.items():
        values |= (
            flat(value, f'{prefix}{key}.') if isinstance(value, dict) else {prefix + key: value}
        )
    return values


def as_lists(values: dict[str, object]) -> dict[str, object]:
    return {name: list(x) if isinstance(x, tuple) else x for name, x in values.items()}
