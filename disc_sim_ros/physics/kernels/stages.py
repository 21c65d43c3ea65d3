"""The work space of one flight with error control: its rates of change and its nutation.

An array of SPACE numbers, shape (SPACE,), or (SPACE, WIDTH) for SIMD vectors. First the rates of
change at the seven stages of a step, 14 numbers each; then the turn of the nutation up to each
stage, as cosine and sine; then what `nutation.remember` keeps from step to step.
"""

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.simd import element
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE, load_state, store_state

STAGES = 7
TURNS = STATE_SIZE * STAGES
MEMORY = TURNS + 2 * STAGES
SPACE = MEMORY + 5


@inline
def rate(K: FloatArray, stage: int) -> State:
    """Return the rate of change at a stage."""
    return load_state(K, STATE_SIZE * stage)


@inline
def put(K: FloatArray, stage: int, k: State) -> None:
    """Write the rate of change at a stage."""
    store_state(K, STATE_SIZE * stage, k)


@inline
def cos(K: FloatArray, stage: int) -> float:
    """Return the cosine of the turn of the nutation up to a stage."""
    c: float = element(K, TURNS + 2 * stage)
    return c


@inline
def sin(K: FloatArray, stage: int) -> float:
    """Return the sine of the turn of the nutation up to a stage."""
    s: float = element(K, TURNS + 2 * stage + 1)
    return s


@inline
def carry(K: FloatArray, other: FloatArray) -> None:
    """Write what a step begins with to another work space."""
    for i in range(STATE_SIZE):
        other[i] = K[i]
    for i in range(MEMORY, SPACE):
        other[i] = K[i]
