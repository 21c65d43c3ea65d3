"""Discs and small helpers that the physics tests share."""

import dataclasses

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.environment import Air

FRISBEE = disc_file.load_disc('frisbee')
AS_PRINTED = disc_file.load_disc('frisbee_as_printed')
VACUUM = Air(density=0.0)
NO_GRAVITY = Air(density=0.0, gravity=0.0)


def drag_only(disc: Disc, drag: float) -> Disc:
    """The same disc with nothing but a constant drag coefficient."""
    line = dataclasses.replace(
        disc.linear, CL_0=0.0, CL_alpha=0.0, CD_0=drag, CD_alpha=0.0, CM_0=0.0, CM_alpha=0.0
    )
    return dataclasses.replace(disc, aero='linear', linear=line, C_Lp=0.0, C_Mq=0.0, C_Nr=0.0)


def constant_moment(disc: Disc, moment: float, damping: float = 0.0) -> Disc:
    """The same disc with neither lift nor drag, but a constant pitching moment coefficient."""
    line = dataclasses.replace(
        disc.linear, CL_0=0.0, CL_alpha=0.0, CD_0=0.0, CD_alpha=0.0, CM_0=moment, CM_alpha=0.0
    )
    return dataclasses.replace(
        disc, aero='linear', linear=line, C_Lp=damping, C_Mq=damping, C_Nr=0.0
    )
