"""SIMD vectors compute what floats compute, to the bit, in vector registers."""

import math
import operator

from llvmlite import binding
import numba
import numpy as np
import pytest

from disc_sim_ros.physics.kernels import jit, simd
from disc_sim_ros.physics.kernels.equations import arctangent
from disc_sim_ros.physics.kernels.simd import (
    WIDTH,
    any_of,
    at,
    element,
    floor,
    store,
    table_row,
    where,
)

compiled = pytest.mark.skipif(not jit.COMPILED, reason='SIMD is compiled only')
if jit.COMPILED:
    jit.import_compiler()
SPECIAL = [0.0, -0.0, 1.0, -1.5, math.inf, -math.inf, math.nan, 1e-310]
PAIRS = [(x, y) for x in SPECIAL for y in SPECIAL]
NAMES = (
    'add', 'sub', 'mul', 'div', 'min', 'max', 'less', 'within', 'outside', 'numbers', 'root',
    'minus', 'angle', 'libm',
)  # fmt: skip


def every(x, y):
    """Compute all that has a name in NAMES; one function compiles four times as fast as each."""
    return (
        x + y,
        x - y,
        x * y,
        x / y,
        min(x, y, 0.5),
        max(x, y, -1.0),
        where(x < y, 1.0, 0.0),
        where((x >= y) & (x <= 1.0), x, y),
        where((x > y) | (x < -1.0), 2, y),
        2 * x - 1 + 0.5 * y / 3,
        math.sqrt(abs(x) + y * y),
        -x + floor(min(max(y, -3.0), 3.0)),
        arctangent(y, abs(x)),
        math.cos(min(x, 1.0)) + math.log(max(y, 1.0)) + math.sin(0.1 * y),
    )


def numbers(count=50 * WIDTH, seed=1):
    x, y = np.random.default_rng(seed).normal(0.0, 2.0, (2, count))
    x[: len(PAIRS)], y[: len(PAIRS)] = np.transpose(PAIRS)
    return x, y


@compiled
def test_each_lane_is_rounded_as_a_single_float():
    act = numba.njit(every, error_model='numpy')

    @numba.njit(error_model='numpy')
    def one_by_one(x, y, results):
        for i in range(len(x)):
            k = 0
            for value in numba.literal_unroll(act(x[i], y[i])):
                results[k, i] = value
                k += 1  # noqa: SIM113 - numba unrolls no enumerate

    @numba.njit(error_model='numpy')
    def side_by_side(x, y, results):
        for i in range(len(x)):
            k = 0
            for value in numba.literal_unroll(act(element(x, i), element(y, i))):
                store(results[k], i, value)
                k += 1  # noqa: SIM113 - numba unrolls no enumerate

    x, y = numbers()
    expected = np.empty((len(NAMES), len(x)))
    results = np.empty((len(NAMES), len(x) // WIDTH, WIDTH))
    one_by_one(x, y, expected)
    side_by_side(x.reshape(-1, WIDTH), y.reshape(-1, WIDTH), results)
    for name, lanes, single in zip(NAMES, results.reshape(expected.shape), expected, strict=True):
        np.testing.assert_array_equal(lanes, single, err_msg=name)
        number = ~np.isnan(single)
        signs = np.signbit(lanes)[number], np.signbit(single)[number]
        np.testing.assert_array_equal(*signs, err_msg=name)


@compiled
def test_each_lane_reads_its_own_row():
    @numba.njit
    def read(tables, grid, i, j, results):
        row = table_row(tables, element(i, 0))
        for k in range(8):
            store(results, k, row[k])
        store(results, 8, at(grid, element(i, 0), element(j, 0)))
        return any_of(element(i, 0) > 3.0), any_of(element(i, 0) > 4.0)

    rng = np.random.default_rng(2)
    tables = rng.normal(size=(5, 8 * WIDTH))
    grid = rng.normal(size=(5, 3))
    i = rng.integers(0, 5, (1, WIDTH)).astype(float)
    i[0, 0] = 4.0
    j = rng.integers(0, 3, (1, WIDTH)).astype(float)
    results = np.empty((9, WIDTH))
    assert read(tables, grid, i, j, results) == (True, False)
    for lane in range(WIDTH):
        row = int(i[0, lane])
        np.testing.assert_array_equal(results[:8, lane], tables[row, 8 * lane : 8 * lane + 8])
        assert results[8, lane] == grid[row, int(j[0, lane])]


@compiled
@pytest.mark.skipif(
    not binding.get_host_cpu_features().get('avx2', False), reason='no AVX2 in this processor'
)
def test_simd_vectors_are_in_vector_registers():
    @numba.njit
    def multiply(x):
        store(x, 0, element(x, 0) * element(x, 0))

    multiply(np.ones((1, WIDTH)))
    (machine_code,) = multiply.inspect_asm().values()
    products = [line for line in machine_code.splitlines() if 'vmulpd' in line]
    assert products
    assert all('ymm' in line or 'zmm' in line for line in products)


def test_arctangent_agrees_with_the_library():
    y, x = numbers(4000, seed=3)
    usual = np.isfinite(x) & np.isfinite(y) & (np.abs(x) != 1e-310) & (np.abs(y) != 1e-310)
    for b, a in zip(y[usual].tolist(), np.abs(x[usual]).tolist(), strict=True):
        expected = math.atan2(b, a)
        # Three roundings of numbers up to pi / 2, of which each is at most 1.1e-16.
        assert arctangent(b, a) == pytest.approx(expected, rel=4e-16, abs=0.0)
    assert arctangent(0.0, 0.0) == 0.0
    assert arctangent(1.0, 0.0) == math.pi / 2
    assert arctangent(-1.0, 0.0) == -math.pi / 2
    assert math.isnan(arctangent(math.nan, 1.0))


def test_plain_functions_work_on_floats():
    assert where(True, 1.0, 2.0) == 1.0  # noqa: FBT003
    assert any_of(operator.gt(2.0, 1.0))
    assert (floor(-0.5), floor(2.0)) == (-1.0, 2.0)
    table = np.arange(16.0).reshape(2, 8)
    assert table_row(table, 1.0) == tuple(range(8, 16))
    assert simd.at(table, 1.0, 2.0) == 10.0
