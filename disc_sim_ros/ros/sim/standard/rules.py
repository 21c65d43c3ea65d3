"""The rules of simulation_interfaces 1.0 to 2.1, without ROS: states, scopes, filters, answers."""

from enum import IntEnum
import math
import subprocess
from typing import NamedTuple

from disc_sim_ros.arrays import Vector
from disc_sim_ros.errors import brief

MOST_STEPS = 1_000_000  # of one request
LONGEST_MATCH = 1.0  # s until a name is not matched to a regular expression
MOST_MEMORY = 500_000  # KiB for that
SPHERE = 3  # the type of bounds that every simulator has to support
_GREP = f'ulimit -v {MOST_MEMORY}; exec grep -E -q -e "$1"'


class Code(IntEnum):
    """Results of a request, `Result.result`."""

    FEATURE_UNSUPPORTED = 0
    OK = 1
    NOT_FOUND = 2
    INCORRECT_STATE = 3
    OPERATION_FAILED = 4


ALREADY_IN_TARGET_STATE = 101  # a further result of set_simulation_state
INCORRECT_TRANSITION = 103  # the same
INVALID_POSE = 101  # a further result of set_entity_state


class SimState(IntEnum):
    """States of a simulation, `SimulationState.state`."""

    STOPPED = 0
    PLAYING = 1
    PAUSED = 2
    QUITTING = 3


class Scope(IntEnum):
    """What a reset resets, `ResetSimulation.Request.scope`."""

    DEFAULT = 0  # all
    STATE = 2
    ALL = 255


class Feature(IntEnum):
    """What a simulator supports, `SimulatorFeatures.features`."""

    ENTITY_CATEGORIES = 8
    ENTITY_STATE_GETTING = 10
    ENTITY_STATE_SETTING = 11
    ENTITY_INFO_GETTING = 12
    SIMULATION_RESET = 20
    SIMULATION_RESET_STATE = 22
    SIMULATION_STATE_GETTING = 24
    SIMULATION_STATE_SETTING = 25
    SIMULATION_STATE_PAUSE = 26
    STEP_SIMULATION_SINGLE = 31
    STEP_SIMULATION_MULTIPLE = 32
    STEP_SIMULATION_ACTION = 33


class Category(IntEnum):
    """Kinds of entities, `EntityCategory.category`."""

    DYNAMIC_OBJECT = 4


class Answer(NamedTuple):
    """The result of a request.

    Attributes:
        code: One of `Code`, or from 101 on a further one of the service.
        text: The reason if it is not OK.
    """

    code: int = Code.OK
    text: str = ''


DONE = Answer()


def transition(now: SimState, target: int) -> Answer:
    """Return whether a simulation may go from a state into another one."""
    if target not in list(SimState):
        allowed = ', '.join(f'{state.value} ({state.name.lower()})' for state in SimState)
        return Answer(Code.FEATURE_UNSUPPORTED, f'state: {target} is not allowed; give {allowed}')
    if target == now:
        text = f'the simulation is {now.name.lower()} already'
        return Answer(ALREADY_IN_TARGET_STATE, text)
    if (now, target) == (SimState.STOPPED, SimState.PAUSED):
        text = 'a stopped simulation cannot be paused; let it play first'
        return Answer(INCORRECT_TRANSITION, text)
    return DONE


def check_scope(scope: int) -> Answer:
    """Return whether a reset is possible: of the state, or of all that can be reset."""
    if scope == Scope.STATE:
        return DONE
    if scope in {Scope.DEFAULT, Scope.ALL}:
        return Answer(Code.OK, 'the state is reset; simulated time never goes back')
    text = f'scope: {scope} is not possible; give 2 for the state, 0 or 255'
    return Answer(Code.FEATURE_UNSUPPORTED, text)


def check_steps(steps: int, state: SimState) -> Answer:
    """Return whether a number of steps can be made in a state."""
    if state is not SimState.PAUSED:
        text = f'the simulation is {state.name.lower()}, not paused'
        return Answer(Code.OPERATION_FAILED, text)
    if not 1 <= steps <= MOST_STEPS:
        text = f'steps: {steps} is not allowed; give a whole number from 1 to {MOST_STEPS}'
        return Answer(Code.OPERATION_FAILED, text)
    return DONE


def match_name(name: str, pattern: str) -> tuple[Answer, bool]:
    """Return whether a POSIX extended regular expression matches a part of a name.

    `grep` does it, in a process of its own: a regular expression may take for ever, and the
    simulation must not wait for it.
    """
    if not pattern:
        return DONE, True
    command = ['/bin/sh', '-c', _GREP, 'sh', pattern]
    try:
        code = subprocess.run(  # noqa: S603 - the pattern is an argument, not a part of a script
            command,
            input=name.encode(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=LONGEST_MATCH,
            check=False,
        ).returncode
    except (OSError, ValueError, subprocess.TimeoutExpired):
        code = -1
    if code not in {0, 1}:
        text = (
            f'filters.filter: {brief(pattern)} is not allowed; give a regular expression '
            f'(POSIX extended) that is matched within {LONGEST_MATCH:g} s'
        )
        return Answer(Code.OPERATION_FAILED, text), False
    return DONE, code == 0


def overlaps_sphere(plate: float, centre: Vector, sphere: float) -> bool:
    """Return True if a flat round plate and a sphere have a point in common.

    Args:
        plate: Radius of the plate [m].
        centre: Centre of the sphere in axes at the centre of the plate, z normal to it [m].
        sphere: Radius of the sphere [m].
    """
    x, y, z = centre
    return math.hypot(max(math.hypot(x, y) - plate, 0.0), z) <= sphere
