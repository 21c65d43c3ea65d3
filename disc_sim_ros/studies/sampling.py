"""Samples of the unit cube: sample i depends only on the seed and on i, in any batch."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.threads import ctrl_c_waits

RANDOM, SOBOL = 'random', 'sobol'
METHODS = (RANDOM, SOBOL)
_BLOCK = 4096  # samples per value of the counter
_BITS = 30  # binary digits of a Sobol number, as in scipy
_SCRAMBLING = 2**63  # Philox keys from here on are for scrambles, lower ones for samples
_LEAST = 2.0**-54  # half of the smallest step of a random double; instead of the sample 0

IntArray = NDArray[np.int64]


def unit_samples(
    method: str, dimensions: int, seed: int, start: int, stop: int, *, count: int
) -> FloatArray:
    """Return samples `start` to `stop` of the open unit cube, shape (stop - start, dimensions).

    Args:
        method: 'random' (Philox; each dimension has a stream of its own) or 'sobol' (scrambled by
            a random linear matrix and a digital shift).
        dimensions: Dimensions of the cube.
        seed: Seed of the streams or of the scramble, from 0.
        start: First sample.
        stop: The sample after the last.
        count: Samples of the whole ensemble. It changes no sample, only the size of the tables.
    """
    if method == SOBOL:
        return _sobol(dimensions, seed, np.arange(start, stop), max(count - 1, 1).bit_length())
    points = np.empty((stop - start, dimensions))
    for block in range(start // _BLOCK, -(-stop // _BLOCK)):
        first = block * _BLOCK
        inside = slice(max(start - first, 0), min(stop - first, _BLOCK))
        rows = slice(first + inside.start - start, first + inside.stop - start)
        for j in range(dimensions):
            generator = np.random.Generator(
                np.random.Philox(key=[seed, j], counter=[0, block, 0, 0])
            )
            points[rows, j] = generator.random(_BLOCK)[inside]
    return np.maximum(points, _LEAST)


def _sobol(dimensions: int, seed: int, index: IntArray, bits: int) -> FloatArray:
    """Return Sobol points by index: each bit of its Gray code flips one set of binary digits."""
    basis, shift = _scrambled_basis(dimensions, seed, bits)
    gray = index ^ (index >> 1)
    digits = np.broadcast_to(shift, (len(index), dimensions)).copy()
    for j in range(bits):
        digits[(gray >> j) & 1 == 1] ^= basis[j]
    return np.asarray((digits + 0.5) * 2.0**-_BITS, dtype=float)


@lru_cache(maxsize=8)
def _scrambled_basis(dimensions: int, seed: int, bits: int) -> tuple[IntArray, IntArray]:
    """Return the digits that each bit flips, shape (bits, dimensions), and those of point 0.

    Source: random linear scrambling of Matousek, J. Complexity 14 (1998) 527-556.
    """
    digit = np.arange(_BITS)
    basis = (_sobol_basis(dimensions, bits)[..., None] >> (_BITS - 1 - digit)) & 1
    shift = np.empty(dimensions, dtype=np.int64)
    for j in range(dimensions):
        generator = np.random.Generator(np.random.Philox(key=[seed, _SCRAMBLING + j]))
        lower = np.tril(generator.integers(0, 2, (_BITS, _BITS)), -1) + np.eye(_BITS, dtype=int)
        basis[:, j] = basis[:, j] @ lower.T & 1
        shift[j] = generator.integers(0, 2**_BITS)
    return (basis << (_BITS - 1 - digit)).sum(axis=-1), shift


@lru_cache(maxsize=1)
def load_sobol() -> Any:
    """Return `scipy.stats.qmc`, which has read its Sobol table once, with Ctrl-C held back.

    The compiled code of scipy prints a KeyboardInterrupt there, and goes on with half a table.
    """
    with ctrl_c_waits():
        from scipy.stats import qmc  # noqa: PLC0415 - it takes a second, and only Sobol needs it

        qmc.Sobol(1, scramble=False)
    return qmc


@lru_cache(maxsize=8)
def _sobol_basis(dimensions: int, bits: int) -> IntArray:
    """Return the direction numbers of scipy's Sobol sequence, shape (bits, dimensions)."""
    sequence = load_sobol().Sobol(dimensions, scramble=False)
    basis = np.zeros((bits, dimensions), dtype=np.int64)
    for j in range(bits):
        sequence.fast_forward(2**j - sequence.num_generated)
        point = np.rint(sequence.random(1)[0] * 2.0**_BITS).astype(np.int64)
        # The Gray code of 2^j has the bits j and j - 1.
        basis[j] = point ^ basis[j - 1] if j else point
    return basis
