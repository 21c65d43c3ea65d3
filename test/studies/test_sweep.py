"""Sweeps: the flights of `fly`, the same for any executor, and kept once they are finished."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
import contextlib
from dataclasses import replace
import json
import multiprocessing
import os
from pathlib import Path
import pickle
import shutil
import signal
import subprocess
import sys
import time
import warnings

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pyarrow as pa
from pyarrow import parquet
import pytest

from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.studies import executors, storage, tables
from disc_sim_ros.studies.runner import InterruptedSweepError, collect, sweep
from disc_sim_ros.studies.scatter import Normal, Uniform
from disc_sim_ros.studies.study import Study

FRISBEE = disc_file.load_disc('frisbee')
SETUP = Setup(disc=FRISBEE, step=0.02)
STUDY = Study(
    setup=SETUP,
    scatter={'speed': Normal(1.0, 15.0), 'pitch': Normal(2.0), 'spin': Normal(2.0, 31.0)},
    correlations={('speed', 'spin'): 0.5},
    count=600,
    seed=3,
)


@pytest.fixture(scope='module')
def expected() -> tables.Columns:
    return collect(STUDY)


def assert_same(actual: tables.Columns, expected: tables.Columns) -> None:
    assert list(actual) == list(expected)
    for name, values in expected.items():
        assert_array_equal(actual[name], values, err_msg=name)


def read(path: Path) -> tables.Columns:
    names = ['index', 'speed_m_s', 'pitch_deg', 'spin_rad_s', 'status', 'time_s', 'x_m', 'y_m',
             'z_m', 'range_m', 'drift_m', 'apex_m', 'end_speed_m_s', 'end_spin_rad_s']  # fmt: skip
    pieces = list(tables.chunks(path, names))
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in names}


# ---- flights ----


def test_each_flight_is_the_same_as_that_of_fly():
    setup = Setup(
        disc=FRISBEE, step=0.01, wind=Wind(mean=(2.0, -1.0, 0.0), turbulence=4.0, seed=9)
    )
    study = Study(
        setup=setup, launch=Launch(height=1.2), control=Control(C_M=0.002),
        vary={'pitch': [5.0, 12.0]}, scatter={'speed': Normal(2.0), 'yaw': Uniform(-20.0, 20.0)},
        count=3,
    )  # fmt: skip
    flights = collect(study)
    for i in range(6):
        wind = Wind(mean=(2.0, -1.0, 0.0), turbulence=4.0, seed=int(flights['gust_seed'][i]))
        launch = Launch(
            speed=flights['speed_m_s'][i], pitch=flights['pitch_deg'][i],
            yaw=flights['yaw_deg'][i], height=1.2,
        )  # fmt: skip
        alone = fly(launch, Setup(disc=FRISBEE, step=0.01, wind=wind), control=study.control)
        row = [
            flights[name][i] for name in ('time_s', 'x_m', 'y_m', 'range_m', 'drift_m', 'apex_m')
        ]
        one = [alone.time, *alone.position[:2], alone.range, alone.drift, alone.apex]
        # The two are compiled apart, and may round differently in the last bits.
        assert_allclose(row, one, rtol=1e-9, atol=1e-9)
        assert flights['end_spin_rad_s'][i] == pytest.approx(alone.end.r, rel=1e-9)


def test_an_advance_ratio_follows_the_speed():
    flights = collect(Study(setup=SETUP, vary={'speed': [10.0, 16.0]}, advance_ratio=0.3))
    for i, speed in enumerate((10.0, 16.0)):
        spin = 2.0 * speed * 0.3 / FRISBEE.diameter
        alone = fly(Launch(speed=speed, spin=spin), SETUP)
        assert flights['range_m'][i] == pytest.approx(alone.range, rel=1e-9)
    varied = collect(Study(setup=SETUP, vary={'advance_ratio': [0.3]}))
    assert varied['range_m'][0] == pytest.approx(
        fly(Launch(spin=2.0 * 15.0 * 0.3 / FRISBEE.diameter), SETUP).range, rel=1e-9
    )


def test_the_wind_and_the_disc_can_be_varied():
    flights = collect(Study(setup=SETUP, vary={'wind_x': [-3.0, 3.0], 'mass': [0.15, 0.175]}))
    for i, (x, mass) in enumerate(((-3.0, 0.15), (-3.0, 0.175), (3.0, 0.15), (3.0, 0.175))):
        keys = disc_file.disc_document(FRISBEE) | {'mass_kg': mass}
        setup = Setup(
            disc=disc_file.disc_from_document('other', keys),
            step=0.02,
            wind=Wind(mean=(x, 0.0, 0.0)),
        )
        assert flights['x_m'][i] == pytest.approx(fly(Launch(), setup).position[0], rel=1e-9)


# ---- executors ----


@pytest.mark.parametrize('batch', [37, 599, 8192])
def test_the_flights_do_not_depend_on_the_batch(expected, batch):
    assert_same(collect(STUDY, batch=batch), expected)


def test_the_flights_are_the_same_in_threads_of_an_executor(expected):
    with ThreadPoolExecutor(3) as pool:
        assert_same(collect(STUDY, executor=pool, batch=50), expected)


def test_the_flights_are_the_same_in_processes(expected, tmp_path):
    with executors.opened('processes', 2) as (pool, workers):
        assert workers == 2
        path = sweep(STUDY, tmp_path / 'a.parquet', executor=pool, batch=50)
    assert_same(read(path), expected)


def test_the_flights_are_the_same_in_a_dask_cluster(expected):
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # Dask's own, about sockets and its dashboard
        with executors.opened('dask', 2) as (pool, workers):
            assert type(pool).__name__ == 'ClientExecutor'
            assert workers == 2
            assert_same(collect(STUDY, executor=pool, batch=50), expected)


@pytest.mark.filterwarnings('ignore')  # Dask's own
def test_a_scheduler_that_does_not_answer_is_reported_in_one_line(monkeypatch):
    monkeypatch.setattr(executors, '_PATIENCE', 0.5)
    opening = executors.opened('dask=tcp://127.0.0.1:9')
    with pytest.raises(ConfigError, match='no scheduler answers'):
        opening.__enter__()


def test_an_error_of_a_worker_survives_pickling():
    error = pickle.loads(pickle.dumps(ConfigError('step', 0.02, 'at most 0.01 s')))
    assert (error.thing, error.value, error.allowed) == ('step', 0.02, 'at most 0.01 s')
    assert str(error) == 'step: 0.02 is not allowed; at most 0.01 s'


# ---- files ----


@pytest.mark.parametrize('name', ['a.parquet', 'a.csv'])
def test_a_file_holds_every_flight_and_the_whole_study(expected, tmp_path, name):
    path = sweep(STUDY, tmp_path / name, batch=256)
    assert_same(read(path), expected)
    assert not path.with_name(f'{name}.parts').exists()
    stored = tables.stored_study(path)
    assert stored['seed'] == 3
    assert stored['scatter']['speed'] == {'normal': [15.0, 1.0]}
    disc = disc_file.disc_from_document('again', stored['disc_file'])
    assert disc_file.disc_document(disc) == disc_file.disc_document(FRISBEE)


def test_parquet_has_units_words_and_a_row_group_for_each_batch(tmp_path):
    path = sweep(STUDY, tmp_path / 'a.parquet', batch=256)
    with parquet.ParquetFile(path) as file:
        assert file.num_row_groups == 3
        table = file.read()
    assert table['status'].to_pylist()[:2] == ['landed', 'landed']
    assert table['index'].to_pylist() == list(range(600))


def test_an_existing_file_is_overwritten_only_with_force(tmp_path):
    path = sweep(STUDY, tmp_path / 'a.parquet')
    before = path.read_bytes()
    with pytest.raises(ConfigError, match='--force'):
        sweep(STUDY, path)
    assert path.read_bytes() == before
    assert sweep(STUDY, path, resume=True).read_bytes() == before  # already finished
    other = Study(setup=SETUP, vary={'pitch': [1.0, 2.0]})
    with pytest.raises(ConfigError, match='holds another study'):
        sweep(other, path, resume=True)
    assert sweep(other, path, force=True).stat().st_size != len(before)


# ---- interruptions ----


def stopped_sweep(path: Path, *, after: int) -> None:
    """Start a sweep, and press Ctrl-C when `after` flights are kept."""

    def progress(done: int, total: int) -> None:
        if done >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(STUDY, path, batch=50, progress=progress)


def test_a_part_whose_count_ctrl_c_prevents_is_counted_all_the_same(tmp_path, monkeypatch):
    write_whole = storage.write_whole

    def interrupted_after_writing(path: Path, content: bytes) -> None:
        write_whole(path, content)
        if path.name.startswith('0000000002'):
            raise KeyboardInterrupt

    monkeypatch.setattr(storage, 'write_whole', interrupted_after_writing)
    counts = []
    with pytest.raises(KeyboardInterrupt):
        sweep(STUDY, tmp_path / 'a.parquet', batch=50, progress=lambda *n: counts.append(n[0]))
    parts = list((tmp_path / 'a.parquet.parts').glob('*.parquet'))
    assert counts[-1] == 50 * len(parts) >= 150


class Counter(ThreadPoolExecutor):
    """Two threads, and the futures of all that they were given."""

    def __init__(self):
        super().__init__(2)
        self.futures = []

    def submit(self, *call):
        self.futures.append(super().submit(*call))
        return self.futures[-1]


def test_batches_that_fly_at_ctrl_c_are_kept(tmp_path):
    calls = []

    def progress(done: int, total: int) -> None:
        calls.append(done)
        if len(calls) == 2:  # the first call is for what is resumed
            raise KeyboardInterrupt

    slow = replace(STUDY, setup=replace(SETUP, step=1e-4))  # a batch takes 0.1 s
    with Counter() as executor, pytest.raises(KeyboardInterrupt):
        sweep(slow, tmp_path / 'a.parquet', batch=50, executor=executor, progress=progress)
    flown = [f for f in executor.futures if not f.cancelled()]
    assert 2 <= len(flown) < len(executor.futures)
    parts = list((tmp_path / 'a.parquet.parts').glob('*.parquet'))
    assert len(parts) == len(flown)


def test_a_resumed_sweep_keeps_its_flights_and_ends_as_an_uninterrupted_one(expected, tmp_path):
    path = tmp_path / 'a.parquet'
    stopped_sweep(path, after=200)
    parts = sorted((tmp_path / 'a.parquet.parts').glob('*.parquet'))
    assert len(parts) >= 4
    times = {part: part.stat().st_mtime_ns for part in parts}
    parts[-1].write_bytes(parts[-1].read_bytes()[:100])  # a part torn by a power failure
    progress_calls = []

    def progress(done: int, total: int) -> None:
        progress_calls.append(done)
        complete = parts[:-1]
        assert {part: part.stat().st_mtime_ns for part in complete} == {
            part: times[part] for part in complete
        }

    with pytest.raises(ConfigError, match='--resume continues'):
        sweep(STUDY, path)
    sweep(STUDY, path, resume=True, progress=progress)
    assert progress_calls[0] == 50 * (len(parts) - 1)
    assert_same(read(path), expected)


def test_resuming_another_study_is_refused_with_the_differences(tmp_path):
    path = tmp_path / 'a.parquet'
    stopped_sweep(path, after=100)
    other = Study(
        setup=Setup(disc=FRISBEE, step=0.01), scatter=STUDY.scatter, count=600, seed=4,
        correlations=STUDY.correlations,
    )  # fmt: skip
    with pytest.raises(ConfigError, match=r'step 0\.02, now 0\.01; seed 3, now 4$'):
        sweep(other, path, resume=True)
    with pytest.raises(ConfigError, match='batch 50, now 60'):
        sweep(STUDY, path, resume=True, batch=60)


def test_two_sweeps_into_one_file_are_refused(tmp_path):
    path = tmp_path / 'a.parquet'

    def progress(done: int, total: int) -> None:
        with pytest.raises(ConfigError, match='another process'):
            sweep(STUDY, path, resume=True)

    sweep(STUDY, path, progress=progress)
    assert path.exists()


def test_a_killed_worker_loses_only_its_batches(expected, tmp_path):
    path = tmp_path / 'a.parquet'
    pool = ProcessPoolExecutor(2, mp_context=multiprocessing.get_context('spawn'))

    def progress(done: int, total: int) -> None:
        if done >= 150:
            for process in list(pool._processes.values()):
                with contextlib.suppress(ProcessLookupError):  # killed at the last call
                    os.kill(process.pid, signal.SIGKILL)

    with pytest.raises(InterruptedSweepError, match='a worker died'):
        sweep(STUDY, path, executor=pool, batch=50, ahead=4, progress=progress)
    pool.shutdown()
    kept = len(list((tmp_path / 'a.parquet.parts').glob('*.parquet')))
    assert 3 <= kept < 12
    progress_calls = []
    sweep(STUDY, path, resume=True, progress=lambda done, _: progress_calls.append(done))
    assert progress_calls[0] == 50 * kept
    assert_same(read(path), expected)


@contextlib.contextmanager
def small_disk(folder: Path, size: int):
    """Mount a disk of `size` bytes; needs root."""
    folder.mkdir()
    command = ['mount', '-t', 'tmpfs', '-o', f'size={size}', 'tmpfs', str(folder)]
    if os.geteuid() != 0 or shutil.which('mount') is None:
        pytest.skip('mounting a small disk needs root')
    if subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip('this container does not allow mounting')
    try:
        yield
    finally:
        subprocess.run(['umount', str(folder)], check=True)


def test_a_full_disk_is_reported_in_one_line_and_finished_flights_are_kept(expected, tmp_path):
    disk = tmp_path / 'disk'
    with small_disk(disk, 64 * 1024):
        path = disk / 'a.parquet'
        with pytest.raises(DiscSimError, match='No space left on device'):
            sweep(STUDY, path, batch=50)
        kept = list((disk / 'a.parquet.parts').glob('*.parquet'))
        assert 1 <= len(kept) < 12
        assert {tables.rows_of(part) for part in kept} == {50}
        progress_calls = []
        subprocess.run(['mount', '-o', 'remount,size=4m', str(disk)], check=True)
        sweep(STUDY, path, resume=True, progress=lambda done, _: progress_calls.append(done))
        assert progress_calls[0] == 50 * len(kept)
        assert_same(read(path), expected)


@pytest.mark.parametrize(
    'text', ['', '[]', 'null', '{}', '{"batch": 1e999}', '{"batch": 0}', '[' * 99999]
)
def test_a_damaged_note_of_an_unfinished_sweep_is_refused_in_one_line(tmp_path, text):
    path = tmp_path / 'a.parquet'
    stopped_sweep(path, after=50)
    (note,) = tmp_path.rglob('*.json')
    note.write_text(text, encoding='utf-8')
    with pytest.raises(ConfigError, match=r'--force starts again') as refused:
        sweep(STUDY, path, resume=True)
    assert '\n' not in str(refused.value)
    sweep(STUDY, path, force=True)


def test_a_disk_that_fills_up_at_the_end_keeps_the_parts(expected, tmp_path):
    disk = tmp_path / 'disk'
    with small_disk(disk, 4 * 1024 * 1024):
        path = disk / 'a.parquet'

        def progress(done: int, total: int) -> None:
            if done == total:
                with contextlib.suppress(OSError), (disk / 'filler').open('wb', 0) as file:
                    while True:
                        file.write(bytes(4096))

        with pytest.raises(DiscSimError, match='No space left on device'):
            sweep(STUDY, path, batch=50, progress=progress)
        assert not path.exists()
        (disk / 'filler').unlink()
        sweep(STUDY, path, resume=True)
        assert_same(read(path), expected)


def test_a_killed_program_leaves_its_finished_flights(expected, tmp_path):
    path = tmp_path / 'a.parquet'
    script = f"""
import os, signal, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from test_sweep import STUDY, sweep
def progress(done, total):
    if done >= 150:
        os.kill(os.getpid(), signal.SIGKILL)
sweep(STUDY, {str(path)!r}, batch=50, progress=progress)
"""
    ended = subprocess.run([sys.executable, '-c', script], check=False, timeout=120)
    assert ended.returncode == -signal.SIGKILL
    started = time.monotonic()
    progress_calls = []
    sweep(STUDY, path, resume=True, progress=lambda done, _: progress_calls.append(done))
    assert time.monotonic() - started < 30.0
    assert progress_calls[0] == 150
    assert_same(read(path), expected)


def test_a_csv_file_has_its_study_in_a_file_beside_it(tmp_path):
    path = sweep(Study(setup=SETUP, vary={'pitch': [5.0, 10.0]}), tmp_path / 'b.csv')
    lines = path.read_text().splitlines()
    assert lines[0].startswith('index,pitch_deg,status,time_s,x_m')
    assert len(lines) == 3
    assert json.loads((tmp_path / 'b.csv.json').read_text())['vary'] == {'pitch': [5.0, 10.0]}


def test_a_larger_file_needs_no_more_memory_to_read(tmp_path):
    table = pa.table(
        {f'c{j}': x for j, x in enumerate(np.random.default_rng(0).random((8, 16384)))}
    )
    groups, path = 60, tmp_path / 'large.parquet'
    with parquet.ParquetWriter(path, table.schema) as writer:
        for _ in range(groups):
            writer.write_table(table)
    before, peak, total = pa.total_allocated_bytes(), 0, 0
    for chunk in tables.chunks(path, table.schema.names):
        peak = max(peak, pa.total_allocated_bytes() - before)
        total += len(chunk['c0'])
    assert total == groups * 16384
    assert peak < 0.5 * groups * table.nbytes  # a few groups, of 60; all of them would be 1.0
