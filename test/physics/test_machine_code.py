"""Calls of machine code: arguments of all kinds arrive, and a start that is warm is short."""

from concurrent.futures import ThreadPoolExecutor
import os
import subprocess
import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest

from disc_sim_ros.physics.kernels import code_cache, jit, machine_code

pytestmark = pytest.mark.skipif(not jit.COMPILED, reason='plain Python has no machine code')


class Inner(NamedTuple):
    """Two kinds of numbers."""

    whole: int
    flag: bool


class Outer(NamedTuple):
    """A tuple in a tuple, and an array."""

    x: float
    inner: Inner
    table: np.ndarray


class Answer(NamedTuple):
    """What a kernel returns."""

    total: float
    inner: Inner
    whole: bool


def add(outer, factor, results):
    total = 0.0
    for row in outer.table:
        for value in row:
            total += value * factor
    results[0] = total
    if outer.inner.flag:
        total += outer.x
    return Answer(total, Inner(outer.inner.whole + 1, not outer.inner.flag), total > 10.0)


@pytest.fixture(scope='module')
def kernel(tmp_path_factory):
    """A kernel in a cache of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('NUMBA_CACHE_DIR', str(tmp_path_factory.mktemp('cache')))
        yield jit.entry(add)


def outer_of(table):
    return Outer(0.5, Inner(2**60, flag=True), table)


TABLE = np.arange(12.0).reshape(3, 4)
READ_ONLY = TABLE.copy()
READ_ONLY.flags.writeable = False


@pytest.mark.parametrize(
    'table',
    [TABLE, TABLE[:, ::2], TABLE[::-1], np.asfortranarray(TABLE), READ_ONLY, TABLE[:0],
     TABLE.astype(np.int32)],
    ids=['whole', 'columns', 'backwards', 'Fortran', 'read-only', 'empty', 'int32'],
)  # fmt: skip
def test_arrays_of_any_shape_arrive_and_results_come_back(kernel, table):
    expected, result = np.zeros(1), np.zeros(1)
    plain = add(outer_of(table), 2.0, expected)
    for _ in range(2):
        answer = kernel(outer_of(table), 2.0, result)
        assert answer == plain
        assert [type(x) for x in (answer, answer.inner, answer.whole)] == [Answer, Inner, bool]
        assert result[0] == expected[0]


def test_an_int_in_place_of_a_float_is_another_version(kernel):
    """Machine code for floats would read the bits of an int as a float."""
    results = np.zeros(1)
    assert kernel(outer_of(TABLE), 3, results).total == kernel(outer_of(TABLE), 3.0, results).total
    assert results[0] == 3.0 * TABLE.sum()
    with pytest.raises(TypeError, match='NoneType'):
        kernel(outer_of(TABLE), None, results)
    with pytest.raises(TypeError, match='str'):
        kernel(outer_of(TABLE), 'x', results)


def test_numpy_numbers_are_numbers(kernel):
    results = np.zeros(1)
    outer = Outer(np.float64(0.5), Inner(np.int64(7), np.bool_(True)), TABLE)  # noqa: FBT003
    assert kernel(outer, np.float64(2.0), results) == add(outer, 2.0, results)


def test_what_a_call_changes_in_an_array_the_next_call_sees(kernel):
    """Arguments that are the same object as in the last call are not written again."""
    table, results = np.ones((2, 2)), np.zeros(1)
    outer = outer_of(table)
    assert kernel(outer, 1.0, results).total == 4.5
    table[0, 0] = 11.0
    assert kernel(outer, 1.0, results).total == 14.5
    assert kernel(outer, 2.0, results).total == 28.5
    assert kernel(outer_of(table[:1]), 2.0, results).total == 24.5
    assert kernel(outer, 2.0, np.zeros(1)).total == 28.5
    assert results[0] == 24.0  # the last call wrote to another array


def test_numba_itself_compiles_and_calls_other_functions_meanwhile_and_after(kernel):
    """Entries are compiled without being loaded into numba; other functions must be."""
    plain = [numba.njit(eval(f'lambda x: x + {i}.0')) for i in range(8)]
    calling = numba.njit(lambda outer, factor, results: kernel(outer, factor, results).total)
    tables = [TABLE.astype(kind) for kind in ('i1', 'i2', 'u1', 'u2', 'u4', 'f4')]
    with ThreadPoolExecutor(2) as pool:
        sums = pool.map(lambda f: f(0.5), plain)
        totals = pool.map(lambda t: kernel(outer_of(t), 2.0, np.zeros(1)).total, tables)
        assert list(sums) == [i + 0.5 for i in range(8)]
        assert list(totals) == [add(outer_of(TABLE), 2.0, np.zeros(1)).total] * len(tables)
    results = np.zeros(1)
    for table in (TABLE, TABLE.astype('i1')):
        expected = add(outer_of(table), 2.0, np.zeros(1)).total
        assert calling(outer_of(table), 2.0, results) == expected
    assert results[0] == 2.0 * TABLE.sum()


def test_threads_do_not_share_arguments(kernel):
    tables = [np.full((20, 20), float(i)) for i in range(50)]
    kernel(outer_of(tables[0]), 1.0, np.zeros(1))

    def total(i):
        return [kernel(outer_of(tables[i]), 1.0, np.zeros(1)).total for _ in range(50)]

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(total, range(50))) == [[400.0 * i + 0.5] * 50 for i in range(50)]


def test_a_large_array_is_not_kept_after_the_call(kernel):
    table = np.zeros((1000, 100))
    kernel(outer_of(table), 1.0, np.zeros(1))
    assert sys.getrefcount(table) == 2


def test_a_function_that_this_machine_lacks_costs_a_compilation(tmp_path, monkeypatch, caplog):
    """As after an update of the C library."""
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
    assert jit.entry(triple)(2.0) == 6.0
    (file,) = tmp_path.rglob('*.code')
    place = code_cache.place(triple)
    key = f'{("d",)} {machine_code.processor()}'
    (symbol, result, _), *code = place.read(key)
    place.write(key, [symbol, result, ['no_such_function']], code)
    again = jit.entry(triple)
    assert again(2.0) == 6.0
    assert again.hits == 0
    assert 'no_such_function' in caplog.messages[0]
    assert file.is_file()


def test_a_numba_with_other_parts_compiles_in_memory(tmp_path, monkeypatch, caplog):
    """Machine code is taken from parts of numba that it does not promise to keep."""

    def changed(*_):
        raise AttributeError('no such part')

    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
    jit.import_compiler()
    monkeypatch.setattr('disc_sim_ros.physics.kernels.compiler.compile_entry', changed)
    tripled = jit.entry(triple)
    assert [tripled(2.0), tripled(3.0)] == [6.0, 9.0]
    assert caplog.messages == [
        'triple: numba compiles it in memory (AttributeError: no such part)'
    ]
    assert not list(tmp_path.rglob('*.code'))


def triple(x):
    return 3.0 * x


PROGRAM = """
import sys
from disc_sim_ros.cli import fly
fly.main([])
slow = {'numba', 'scipy', 'matplotlib', 'rclpy', 'pandas'} & set(sys.modules)
print(sorted(slow), file=sys.stderr)
"""


def test_a_warm_fly_imports_no_compiler_and_nothing_else_that_is_slow():
    command = [sys.executable, '-c', PROGRAM]
    environment = {**os.environ, 'NUMBA_DISABLE_JIT': '0'}
    environment.pop('NUMBA_CACHE_DIR', None)  # of the fixture: an empty cache
    for _ in range(2):  # the first may compile
        done = subprocess.run(
            command, capture_output=True, text=True, check=True, timeout=200, env=environment
        )
    assert 'landed' in done.stdout
    assert done.stderr.splitlines() == ['[]']
