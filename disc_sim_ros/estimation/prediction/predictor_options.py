"""The configuration of a predictor from quantities with the names of `quantities.PREDICTION`."""

from collections.abc import Mapping, Sequence
import math

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.prediction.predictor import PredictorConfig
from disc_sim_ros.estimation.prediction.prior import Gaussian, ThrowPrior, disc_offsets, disc_shape
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import map_from_paper


def predictor_config(setups: Sequence[Setup], values: Mapping[str, float]) -> PredictorConfig:
    """Return a configuration.

    Args:
        setups: Disc, air, ground contact, and the mean wind that is expected; of each disc that
            may be thrown.
        values: In the ranges of `quantities.PREDICTION`, all of them.

    Raises:
        ConfigError: Two discs have one name.
    """
    names = [setup.disc.name for setup in setups]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError('discs', name, 'give each disc once')
    first, *others = [(setup, _prior(setup, values)) for setup in setups]
    return PredictorConfig(
        setup=first[0],
        prior=first[1],
        others=tuple(others),
        opposite_spin=values['opposite_spin'],
        position_sigma=values['position_sigma'],
        attitude_sigma=math.radians(values['attitude_sigma']),
        ground_height=values['ground_height'],
    )


def _prior(setup: Setup, values: Mapping[str, float]) -> ThrowPrior:
    wind_x, wind_y, _ = map_from_paper(setup.wind.mean)
    return ThrowPrior(
        speed=Gaussian(values['throw_speed'], values['throw_speed_sigma']),
        spin=Gaussian(values['throw_spin'], values['throw_spin_sigma']),
        wind_x=Gaussian(float(wind_x), values['wind_sigma']),
        wind_y=Gaussian(float(wind_y), values['wind_sigma']),
        offsets=disc_offsets(setup.disc, values['disc_uncertainty']),
        shape=disc_shape(values['disc_uncertainty']),
    )
