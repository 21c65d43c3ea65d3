"""Landings of the filmed Wraith throws over the stated errors of release and wind."""

import math

import numpy as np

from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.ensemble import Landings, fly_many
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.thrower import angles

# As the authors state them (head of the file), read as standard deviations: of the speed [m/s],
# the path, the roll, the nose and the heading [degrees], the spin [rad/s], and of the wind, along
# and across [m/s].
SPEED, PATH, ROLL, NOSE, YAW, SPIN, WIND = 0.6, 2.0, 5.0, 2.0, 2.0, 2.0, 1.0
INSIDE_90 = -2.0 * math.log(0.1)  # greatest squared distance in the 90 % ellipse of a normal law


def ensemble(release: Launch, wind: tuple[float, float, float], disc: Disc, n: int) -> Landings:
    """Fly n throws with errors drawn about the measured release and wind (in `map`)."""
    draw = np.random.Generator(np.random.PCG64(1)).standard_normal((8, n))
    turned = [
        angles(release.pitch + path, nose, -release.roll + roll, yaw=release.yaw + yaw)
        for path, roll, nose, yaw in zip(
            PATH * draw[1], ROLL * draw[2], NOSE * draw[3], YAW * draw[4], strict=True
        )
    ]
    return fly_many(
        {
            'speed': release.speed + SPEED * draw[0],
            **{name: [t[name] for t in turned] for name in turned[0]},
            'spin': release.spin + SPIN * draw[5],
            'height': release.height,
            'wind_x': wind[0] + WIND * draw[6],
            'wind_y': wind[1] + WIND * draw[7],
        },
        Setup(disc=disc),
    )


def squared_distance(landings: Landings, x: float, y: float) -> float:
    """Return the squared distance of a point from the mean, in standard deviations."""
    points = np.array([landings.x, landings.y])
    away = np.array([x, y]) - points.mean(axis=1)
    return float(away @ np.linalg.solve(np.cov(points), away))
