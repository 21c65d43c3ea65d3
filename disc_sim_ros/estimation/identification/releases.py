"""A measured release as what is believed of the first state of a throw."""

from dataclasses import astuple, dataclass, fields, replace

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import local
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.thrower import Release

_STEP = 1e-4  # of the differences, in m/s, degrees and rad/s
_RATE_ERROR = 5.0  # rad/s, of the roll and pitch rate: the direction of a wobble is not measured
_HEADING_ERROR = 20.0  # degrees; a path tells the heading far better
_LEAST = 1e-3  # deviation of what no error of a release moves


@dataclass(frozen=True, kw_only=True)
class ReleaseErrors:
    """Standard errors of a measured release, named as in `Release`.

    Attributes:
        speed: [m/s].
        launch_angle, nose, hyzer: [degrees].
        spin: [rad/s].
    """

    speed: float
    launch_angle: float
    nose: float
    hyzer: float
    spin: float


def release_state(
    release: Release, disc: Disc, position: FloatArray, velocity: FloatArray
) -> tuple[Release, FloatArray]:
    """Return the release with the heading of a path, and its state.

    Args:
        release: The measured release; its heading is not used.
        disc: Gives the inertias.
        position: Of the first state, earth axes 1 [m], shape (3,).
        velocity: Gives the heading, earth axes 1 [m/s], shape (3,).

    Returns:
        The release, and its state in the paper's axes, shape (14,).
    """
    heading = float(np.degrees(np.arctan2(velocity[1], velocity[0])))
    turned = replace(release, heading=heading)
    return turned, _state(turned, disc, position)


def release_covariance(
    release: Release, disc: Disc, errors: ReleaseErrors, position_errors: FloatArray
) -> FloatArray:
    """Return the covariance of the first state in local coordinates, shape (11, 11).

    Args:
        release: The release, with a heading that is known to 20 degrees.
        disc: Gives the inertias.
        errors: Of the release.
        position_errors: Standard errors of the position [m], shape (3,).
    """
    names = [*(field.name for field in fields(ReleaseErrors)), 'heading']
    deviations = np.array([*astuple(errors), _HEADING_ERROR])
    origin = np.zeros(3)
    centre = _state(release, disc, origin)
    slopes = np.empty((local.SIZE, len(names)))
    for j, name in enumerate(names):
        changed = replace(release, **{name: getattr(release, name) + _STEP})
        slopes[:, j] = local.difference(centre, _state(changed, disc, origin))[0] / _STEP
    others = [*position_errors, *[_LEAST] * 5, _RATE_ERROR, _RATE_ERROR, _LEAST]
    covariance: FloatArray = (slopes * deviations**2) @ slopes.T + np.diag(np.square(others))
    return covariance


def _state(release: Release, disc: Disc, position: FloatArray) -> FloatArray:
    state = np.array(release.launch(disc, 1.0).state())
    state[:3] = position
    return state
