"""The parameters of predictor_node, checked together, without ROS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

from disc_sim_ros.arrays import Vector
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.prediction.predictor import PredictorConfig
from disc_sim_ros.estimation.prediction.predictor_options import predictor_config
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import flip_yz, quaternion_from_euler
from disc_sim_ros.physics.kernels.rotation import Quaternion
from disc_sim_ros.quantities import LAUNCH, MEAN_WIND, POSITION, PREDICTION, PREDICTOR_NODE
from disc_sim_ros.ros.parameter_spec import ParameterSpec, checked, spec_of

SOURCES = ('point', 'pose', 'pose_with_covariance', 'odom')
_ZEROS = (0.0, 0.0, 0.0)

PREDICTOR_GROUPS: Mapping[str, Sequence[ParameterSpec]] = {
    'What flies': (
        ParameterSpec('disc', 'ultrastar', 'fixed', 'Disc, as for `sim_node`.'),
        ParameterSpec(
            'discs',
            '',
            'fixed',
            'Discs of which one is thrown; measurements tell how likely each is. Empty: `disc`.',
            constraint='discs as for `disc`, separated by spaces, or a list',
            listed=True,
        ),
        *(spec_of(quantity, 'fixed') for quantity in PREDICTION.values()),
        ParameterSpec(
            'wind', _ZEROS, 'fixed', 'Wind that is expected, in `map`.', MEAN_WIND['wind_x']
        ),
    ),
    'Measurements': (
        ParameterSpec(
            'sources',
            'point pose pose_with_covariance',
            'fixed',
            'Which topics are measurements: `measured_point`, `measured_pose`, '
            '`measured_pose_with_covariance`, `odom`.',
            constraint=f'words of {", ".join(SOURCES)}, separated by spaces, or a list',
            listed=True,
        ),
        ParameterSpec(
            'measurement_frame',
            'map',
            'fixed',
            'Frame of the measurements; others are refused. An empty frame is this one.',
        ),
        ParameterSpec(
            'frame_position',
            _ZEROS,
            'fixed',
            'Origin of `measurement_frame` in `map`.',
            POSITION,
        ),
        ParameterSpec(
            'frame_rotation',
            _ZEROS,
            'fixed',
            'Roll, pitch and yaw of `measurement_frame` in `map`, about x, y and z up.',
            LAUNCH['yaw'],
        ),
        spec_of(PREDICTOR_NODE['added_noise'], 'fixed'),
    ),
    'Output': (
        spec_of(PREDICTOR_NODE['ellipse_rate'], 'fixed'),
        spec_of(PREDICTOR_NODE['predicted_path_rate'], 'fixed'),
        spec_of(PREDICTOR_NODE['intercept_height'], 'fixed'),
        ParameterSpec(
            'intercept_plane_normal',
            _ZEROS,
            'fixed',
            'Normal, of any length, in `map`, of a plane in which `intercept` is, in place of a '
            'height; 0, 0, 0: the height.',
            PREDICTOR_NODE['intercept_plane_normal'],
        ),
        ParameterSpec(
            'intercept_plane_point',
            _ZEROS,
            'fixed',
            'A point of this plane, in `map`.',
            POSITION,
        ),
    ),
}
PREDICTOR_TABLE = tuple(spec for group in PREDICTOR_GROUPS.values() for spec in group)


@dataclass(frozen=True)
class Plane:
    """Where a disc is to be caught: a plane in `map`.

    Attributes:
        normal: Of any length.
        point: A point of the plane [m].
        both_ways: Also where the path crosses it in the direction of the normal.
    """

    normal: Vector
    point: Vector
    both_ways: bool


@dataclass(frozen=True)
class NodeConfig:
    """All parameters of predictor_node, see PREDICTOR_TABLE.

    Attributes:
        predictor: Of the estimator.
        sources: Names of SOURCES.
        frame: Frame of the measurements.
        position: Its origin in `map` [m].
        rotation: Its rotation in `map`, a quaternion, scalar first.
        added_noise: Standard deviation of what is added to each coordinate [m].
        ellipse_period: Time between two ellipses [s].
        path_rate: Points of `predicted_path` a second [Hz]; 0: no path.
        plane: Where `intercept` is.
    """

    predictor: PredictorConfig
    sources: tuple[str, ...]
    frame: str
    position: tuple[float, float, float]
    rotation: Quaternion
    added_noise: float
    ellipse_period: float
    path_rate: float
    plane: Plane


def node_config(values: Mapping[str, object]) -> NodeConfig:
    """Return the configuration from the values of parameters, with defaults for the others.

    Raises:
        ConfigError: A value is not allowed.
    """
    v: dict[str, Any] = checked(values, PREDICTOR_TABLE)
    sources = tuple(v['sources'].split())
    for name in sources:
        if name not in SOURCES:
            raise ConfigError('sources', name, f'choose from {", ".join(SOURCES)}')
    if not sources:
        raise ConfigError('sources', '', f'choose from {", ".join(SOURCES)}')
    wind = Wind(mean=flip_yz(v['wind']))
    names = v['discs'].split() or [v['disc']]
    setups = [Setup(disc=disc_file.load_disc(name), wind=wind) for name in names]
    roll, pitch, yaw = v['frame_rotation']
    return NodeConfig(
        predictor=predictor_config(setups, {name: v[name] for name in PREDICTION}),
        sources=sources,
        frame=v['measurement_frame'],
        position=v['frame_position'],
        rotation=quaternion_from_euler(roll, pitch, yaw),
        added_noise=v['added_noise'],
        ellipse_period=1.0 / v['ellipse_rate'],
        path_rate=v['predicted_path_rate'],
        plane=_plane(v),
    )


def _plane(v: Mapping[str, Any]) -> Plane:
    """Return the plane of `intercept`: of its normal if one is given, else of its height."""
    normal, point = v['intercept_plane_normal'], v['intercept_plane_point']
    if any(normal):
        return Plane(normal, point, both_ways=True)
    if any(point):
        raise ConfigError('intercept_plane_normal', normal, 'give the normal of the plane')
    return Plane((0.0, 0.0, 1.0), (0.0, 0.0, v['intercept_height']), both_ways=False)


def is_plain(config: NodeConfig) -> bool:
    """Return True if measurements need no transform."""
    return not any(config.position) and math.isclose(config.rotation[0], 1.0, abs_tol=1e-12)
