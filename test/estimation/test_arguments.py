"""What a script gives to `throw_from` and `identify` is checked as a file is."""

import numpy as np
import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.identification.identify import identify
from disc_sim_ros.estimation.identification.measured import Instruments, throw_from
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup

SETUP = Setup(disc=load_disc('ultrastar'))
T = np.arange(20) / 20
PATH = np.column_stack([15 * T, 0 * T, 1 + 3 * T - 3 * T * T])
KNOWN = Instruments(gravity=9.81, spin=60.0)


@pytest.mark.parametrize(
    ('kind', 't', 'values', 'message'),
    [
        (
            'radar',
            T,
            PATH,
            "instrument: 'radar' .* choose from position, attitude, gyro, acceleration, camera",
        ),
        ('position', T, PATH[:5], r'position: .*\(20,\) and \(5, 3\).* shape \(n, 3\)'),
        ('position', T, PATH[:, :2], r'position: .* values of shape \(n, 3\)'),
        ('attitude', T, PATH, r'attitude: .* values of shape \(n, 4\)'),
        ('position', T[:, np.newaxis], PATH, r'position: .* times of shape \(n,\)'),
        ('position', T, np.where(PATH > 14.0, np.nan, PATH), 'position: .* finite numbers'),
        ('gyro', np.where(T > 0.9, np.inf, T), PATH, 'gyro: .* finite numbers'),
        ('position', T[::-1], PATH, 'sample 2: .* is it of another throw'),
        ('position', np.repeat(T[::2], 2), PATH, 'sample before is at 0 s$'),
    ],
)
def test_columns_that_are_no_measurements_are_refused(kind, t, values, message):
    with pytest.raises(ConfigError, match=message):
        throw_from('1', {kind: (t, values)}, SETUP.disc, KNOWN)


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        ({'free': 'C_D0'}, "free: 'C_D0' .* give a list of names"),
        ({'free': ['C_X']}, "free: 'C_X' .* choose from"),
        ({'noise': {'position': -1.0}}, 'noise of position: -1 .* give a number'),
        ({'noise': {'radar': 1.0}}, "noise: 'radar' .* choose from position"),
        ({'setup': SETUP.disc}, 'setup: .* of the type Setup'),
        ({'throws': []}, 'throws: 0 .* at least one'),
    ],
)
def test_bad_arguments_of_identify_are_refused(options, message):
    """A negative noise was taken as it was."""
    throw = throw_from('1', {'position': (T, PATH)}, SETUP.disc, KNOWN)
    given = {'throws': [throw], 'setup': SETUP} | options
    with pytest.raises(ConfigError, match=message):
        identify(**given)
