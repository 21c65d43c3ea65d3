"""Executors by name: processes of this machine, or a Dask cluster."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
import multiprocessing
from multiprocessing import resource_tracker
import os
import signal
import threading
from typing import Any

from disc_sim_ros import validation
from disc_sim_ros.errors import ConfigError, DiscSimError

THREADS, PROCESSES, DASK = 'threads', 'processes', 'dask'
MOST_WORKERS = 1024
_PATIENCE = 10.0  # s to wait for a scheduler of Dask to answer


@contextmanager
def opened(name: str, workers: int | None = None) -> Iterator[tuple[Executor | None, int]]:
    """Yield an executor for `run.sweep` and its number of workers.

    Args:
        name: 'threads' (of this process: no executor), 'processes', 'dask' (a cluster of this
            machine for as long as it takes) or 'dask=ADDRESS' (a scheduler that runs already).
        workers: Threads or processes; None for as many as there are cores. Not for an address.

    Raises:
        ConfigError: An unknown name, or nothing answers at the address.
        DiscSimError: Dask is not installed.
    """
    kind, has_address, address = name.partition('=')
    validation.choice('executor', kind, (THREADS, PROCESSES, DASK))
    count = os.process_cpu_count() if hasattr(os, 'process_cpu_count') else os.cpu_count()
    wanted = validation.whole_number('workers', workers or count or 1, 1, MOST_WORKERS)
    if has_address and kind != DASK:
        raise ConfigError('executor', name, f'{kind} takes no address')
    if kind == THREADS:
        yield None, wanted
    elif kind == PROCESSES:
        with processes(wanted) as pool:
            yield pool, wanted
    else:
        with _dask(name, address, wanted) as (pool, found):
            yield pool, found


@contextmanager
def processes(workers: int) -> Iterator[Executor]:
    """Yield an executor of fresh processes, which leave Ctrl-C to this one and end with it."""
    # Fresh: a copy of this process could not use numba's threads and locks.
    context = multiprocessing.get_context('spawn')
    pool = _Processes(workers, mp_context=context, initializer=_begin_worker)
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


class _Processes(ProcessPoolExecutor):
    """Starts its processes with SIGINT held: none dies of Ctrl-C before `_begin_worker`."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        resource_tracker.ensure_running()  # starting it lets go of what is held
        before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            return super().submit(function, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


@contextmanager
def _dask(name: str, address: str, workers: int) -> Iterator[tuple[Executor, int]]:
    try:
        from distributed import Client, LocalCluster  # noqa: PLC0415 - takes a second
    except ImportError as error:
        raise DiscSimError(
            f'Dask is not installed ({error}); pip install "disc_sim_ros[dask]"'
        ) from None
    cluster: Any = LocalCluster
    new_client: Any = Client
    with ExitStack() as stack:
        where = address or stack.enter_context(
            cluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
        )
        try:
            client = stack.enter_context(new_client(where, timeout=_PATIENCE))
        except (OSError, ValueError) as error:
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            allowed = f'no scheduler answers there ({reason})'
            raise ConfigError('executor', name, allowed) from None
        found = sum(client.nthreads().values())
        yield stack.enter_context(client.get_executor()), found or workers
