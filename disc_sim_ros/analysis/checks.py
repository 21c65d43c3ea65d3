"""Checks and measures of a motion that need no model of the body."""

from dataclasses import dataclass, replace
import math

import numpy as np
from scipy.spatial.transform import Rotation

from disc_sim_ros.analysis.flights import velocities
from disc_sim_ros.analysis.odometry import Motion, usable
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.units import NANOSECONDS

UNIT = 1e-3  # largest deviation of a quaternion from length 1; sim_node takes the same
FITTING = 0.05  # of the speed; largest difference of velocity and differences of position
NO_TURN = (0.0, 0.0, 0.0, 1.0)  # x, y, z, w


@dataclass(frozen=True)
class Stamps:
    """How the stamps of a flight follow each other.

    Attributes:
        count: Messages.
        rate: Messages a second [Hz]: as configured, else by the usual distance; 0 for one message.
        longest: Longest distance [s].
        missing: Messages that are missing in between where stamps are even.
        repeated: Stamps that are the same as the one before.
        backwards: Stamps that are before the one before.
        before: Messages that are missing before the first, where it is known what begins then.
        after: Messages that are missing after the last, where it is known what ends then.
    """

    count: int
    rate: float
    longest: float
    missing: int
    repeated: int
    backwards: int
    before: int = 0
    after: int = 0

    @property
    def even(self) -> bool:
        """Return True if each stamp follows the one before at the usual distance."""
        return not (self.missing or self.repeated or self.backwards)

    @property
    def all_missing(self) -> int:
        """Return how many messages are missing, in between and at both ends."""
        return self.before + self.missing + self.after


@dataclass(frozen=True)
class Check:
    """One check of a motion.

    Attributes:
        name: What is checked.
        value: What was measured.
        text: The same for people.
        passed: True if the value is within its limit.
    """

    name: str
    value: float
    text: str
    passed: bool


def stamps_of(motion: Motion, rate: float | None = None) -> Stamps:
    """Return how the stamps of a motion follow each other.

    Args:
        motion: The motion.
        rate: The rate at which its messages were published [Hz]; None for the usual one.
    """
    steps = np.diff(motion.stamps)
    ahead = steps[steps > 0]
    if not len(ahead):
        repeated, backwards = int((steps == 0).sum()), int((steps < 0).sum())
        return Stamps(len(motion), rate or 0.0, 0.0, 0, repeated, backwards)
    usual = NANOSECONDS / rate if rate else float(np.median(ahead))
    return Stamps(
        count=len(motion),
        rate=NANOSECONDS / usual,
        longest=float(ahead.max()) / NANOSECONDS,
        missing=int(np.maximum(np.rint(ahead / usual) - 1, 0).sum()),
        repeated=int((steps == 0).sum()),
        backwards=int((steps < 0).sum()),
    )


def checks(motion: Motion) -> list[Check]:
    """Return the checks that any motion must pass: stamps, quaternions, velocity and position."""
    stamps = stamps_of(motion)
    worst = float(np.abs(np.linalg.norm(motion.quaternion, axis=1) - 1.0).max())
    results = [
        Check(
            'stamps',
            float(stamps.backwards + stamps.repeated),
            f'{stamps.backwards} go back, {stamps.repeated} repeat, {stamps.missing} are missing',
            not (stamps.backwards or stamps.repeated),
        ),
        Check('quaternion_norm', worst, _norm_text(motion, worst), worst <= UNIT),
    ]
    if motion.has_twist and len(motion) > 2:
        results.append(_twist_check(motion))
    return results


def _norm_text(motion: Motion, worst: float) -> str:
    unset = len(motion) - int(usable(motion.quaternion).sum())
    if unset:
        return f'{unset} of {len(motion)} messages have no attitude, such as quaternions of 0'
    return f'within {worst:.1e} of 1'


def _twist_check(motion: Motion) -> Check:
    """Compare velocities with differences of position, in the frame that fits better."""
    t = (motion.stamps - motion.stamps[0]) / NANOSECONDS
    dt = np.diff(t)
    good = dt > 0.0
    measured = np.diff(motion.position, axis=0)[good] / dt[good, None]
    speed = float(np.median(np.linalg.norm(measured, axis=1))) if good.any() else 0.0
    if not speed:
        return Check('velocity', 0.0, 'nothing moves', passed=True)
    misfit = {}
    for frame, velocity in (
        (motion.child or 'the body', rotate(motion)),
        (motion.frame or 'the pose', motion.numbers[:, 7:10]),
    ):
        mean = 0.5 * (velocity[1:] + velocity[:-1])[good]
        misfit[frame] = float(np.median(np.linalg.norm(mean - measured, axis=1))) / speed
    own = motion.child or 'the body'
    text = f'off the differences of position by {misfit[own]:.2%} of the speed (median)'
    other = motion.frame or 'the pose'
    if misfit[own] > FITTING >= misfit.get(other, math.inf):
        text += f'; it is given in {other}, where it has {misfit[other]:.2%}'
    return Check('velocity', misfit[own], text, misfit[own] <= FITTING)


def rotate(motion: Motion) -> FloatArray:
    """Return the velocities of Odometry in `frame` [m/s], shape (n, 3)."""
    velocity: FloatArray = _rotation(motion).apply(motion.numbers[:, 7:10])
    return velocity


def with_twist(motion: Motion) -> Motion:
    """Return a motion with a twist: the recorded one, or one by differences of the poses.

    Rates by differences are those of the frame itself. If the body turns by more than half a turn
    between messages, they are too small. A message without an attitude gets that of the message
    before, or of the first that has one; if none has, no turn.
    """
    motion = _oriented(motion)
    if motion.has_twist:
        return motion
    rotation = _rotation(motion)
    linear = rotation.apply(velocities(motion), inverse=True)
    angular = np.zeros((len(motion), 3))
    if len(motion) > 1:
        dt = np.maximum(np.diff(motion.stamps), 1)[:, None] / NANOSECONDS
        angular[:-1] = (rotation[:-1].inv() * rotation[1:]).as_rotvec() / dt
        angular[-1] = angular[-2]
    numbers = np.hstack([motion.numbers, linear, angular])
    return replace(motion, numbers=numbers)


def ground_crossing(motion: Motion) -> tuple[float, FloatArray] | None:
    """Return the time [s after the first message] and place of the last descent through z = 0.

    The place has shape (3,) [m]; both are interpolated between two messages. None if the motion
    does not descend through z = 0.
    """
    z = motion.position[:, 2]
    below = np.flatnonzero((z[:-1] > 0.0) & (z[1:] <= 0.0))
    if not len(below):
        return None
    i = int(below[-1])
    share = float(z[i] / (z[i] - z[i + 1]))
    t = (motion.stamps[i : i + 2] - motion.stamps[0]) / NANOSECONDS
    place = motion.position[i] + share * (motion.position[i + 1] - motion.position[i])
    return float(t[0] + share * (t[1] - t[0])), place


def turns_with_spin(motion: Motion) -> bool:
    """Return True if the frame of a motion is fixed to the spinning body, so that it turns too."""
    if not motion.has_twist or len(motion) < 2:
        return False
    dt = float(np.median(np.diff(motion.stamps))) / NANOSECONDS
    rate = float(np.median(motion.numbers[:, 12]))
    if dt <= 0.0 or abs(rate * dt) > math.pi or abs(rate) < 1.0:
        return False
    rotation = _rotation(motion)
    of_frame = float(np.median((rotation[:-1].inv() * rotation[1:]).as_rotvec()[:, 2])) / dt
    return abs(of_frame - rate) < abs(of_frame)


def _oriented(motion: Motion) -> Motion:
    """Return a motion in which every message has an attitude; see `with_twist`."""
    good = usable(motion.quaternion)
    if good.all():
        return motion
    numbers = motion.numbers.copy()
    if not good.any():
        numbers[:, 3:7] = NO_TURN
    else:
        before = np.maximum.accumulate(np.where(good, np.arange(len(good)), -1))
        numbers[:, 3:7] = numbers[np.where(before < 0, np.argmax(good), before), 3:7]
    return replace(motion, numbers=numbers)


def _rotation(motion: Motion) -> Rotation:
    good = usable(motion.quaternion)[:, None]
    return Rotation.from_quat(np.where(good, motion.quaternion, NO_TURN))
