"""The numbers of observations and actions: name, unit, bounds and meaning of each."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float32Array = NDArray[np.float32]


class Component(NamedTuple):
    """One number of an observation or of an action."""

    name: str
    unit: str
    lowest: float
    highest: float
    meaning: str


def bounds(components: tuple[Component, ...]) -> tuple[Float32Array, Float32Array]:
    """Return the lowest and the highest values, each of shape (n,)."""
    low = np.array([c.lowest for c in components], dtype=np.float32)
    high = np.array([c.highest for c in components], dtype=np.float32)
    return low, high


def vector(name: str, unit: str, most: float, meaning: str) -> tuple[Component, ...]:
    """Return the components x, y, z of a vector in `map`, between -most and most."""
    return tuple(
        Component(f'{name}_{axis}', unit, -most, most, f'{meaning}, {axis} of `map`')
        for axis in 'xyz'
    )
