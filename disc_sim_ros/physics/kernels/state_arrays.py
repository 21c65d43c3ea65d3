"""States in arrays: one state, or WIDTH states side by side."""

from typing import Any

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.simd import element, store, where

STATE_SIZE = len(State._fields)


@inline
def load_state(a: FloatArray, i: int) -> State:
    """Return a state whose fields begin at element `i`, or the states whose fields begin at row i.

    Args:
        a: Shape (n,) for floats, or (n, WIDTH) for vectors.
        i: Place of `X`; the other fields follow.
    """
    return State(
        element(a, i),
        element(a, i + 1),
        element(a, i + 2),
        element(a, i + 3),
        element(a, i + 4),
        element(a, i + 5),
        element(a, i + 6),
        element(a, i + 7),
        element(a, i + 8),
        element(a, i + 9),
        element(a, i + 10),
        element(a, i + 11),
        element(a, i + 12),
        element(a, i + 13),
    )


@inline
def store_state(a: FloatArray, i: int, s: State) -> None:
    """Write a state, or a state in each lane, from element or row `i` on; see `load_state`."""
    store(a, i, s.X)
    store(a, i + 1, s.Y)
    store(a, i + 2, s.Z)
    store(a, i + 3, s.VX)
    store(a, i + 4, s.VY)
    store(a, i + 5, s.VZ)
    store(a, i + 6, s.e0)
    store(a, i + 7, s.e1)
    store(a, i + 8, s.e2)
    store(a, i + 9, s.e3)
    store(a, i + 10, s.p)
    store(a, i + 11, s.q)
    store(a, i + 12, s.r)
    store(a, i + 13, s.sigma)


@inline
def select(condition: Any, a: State, b: State) -> State:
    """Return the state `a` in the lanes where the condition holds, else `b`."""
    return State(
        where(condition, a.X, b.X),
        where(condition, a.Y, b.Y),
        where(condition, a.Z, b.Z),
        where(condition, a.VX, b.VX),
        where(condition, a.VY, b.VY),
        where(condition, a.VZ, b.VZ),
        where(condition, a.e0, b.e0),
        where(condition, a.e1, b.e1),
        where(condition, a.e2, b.e2),
        where(condition, a.e3, b.e3),
        where(condition, a.p, b.p),
        where(condition, a.q, b.q),
        where(condition, a.r, b.r),
        where(condition, a.sigma, b.sigma),
    )
