"""Executors by name: processes of this machine, or a Dask cluster."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
import multiprocessing
from multiprocessing import resource_tracker
import os
import signal
import threading
from typing import TYPE_CHECKING, Any, TypeVar

from disc_sim_ros import validation
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.quantities import STUDY
from disc_sim_ros.threads import ctrl_c_waits

if TYPE_CHECKING:
    from queue import SimpleQueue

_T = TypeVar('_T')
THREADS, PROCESSES, DASK = 'threads', 'processes', 'dask'
_PATIENCE = 10.0  # s, longest wait for an answer of a Dask scheduler


@contextmanager
def opened(name: str, workers: int | None = None) -> Iterator[tuple[Executor | None, int]]:
    """Yield an executor for `runner.sweep` and its number of workers.

    Args:
        name: 'threads' (of this process: no executor), 'processes', 'dask' (a temporary cluster
            on this machine) or 'dask=ADDRESS' (a running scheduler).
        workers: Threads or processes; None for one per core. Has no effect with an address.

    Raises:
        ConfigError: An unknown name, or no scheduler answers at the address.
        DiscSimError: Dask is not installed.
    """
    kind, has_address, address = name.partition('=')
    validation.choice('executor', kind, (THREADS, PROCESSES, DASK))
    count = os.process_cpu_count() if hasattr(os, 'process_cpu_count') else os.cpu_count()
    wanted = STUDY['workers'].check(workers or count or 1)
    if has_address and kind != DASK:
        raise ConfigError('executor', name, f'{kind} takes no address')
    if kind == THREADS:
        yield None, wanted
    elif kind == PROCESSES:
        with processes(wanted) as pool:
            yield pool, wanted
    else:
        with _dask(name, address, wanted) as (pool, available):
            yield pool, available


@contextmanager
def processes(workers: int) -> Iterator[Executor]:
    """Yield an executor of new processes, which ignore Ctrl-C and end with this process."""
    # Not forked: a forked process cannot use the threads and locks of numba.
    context = multiprocessing.get_context('spawn')
    with ctrl_c_waits():  # a semaphore that is made and not yet owned would stay behind
        pool = _Processes(workers, mp_context=context, initializer=_begin_worker)
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


class _Processes(ProcessPoolExecutor):
    """Starts its processes undisturbed by Ctrl-C, and with SIGINT blocked until `_begin_worker`.

    A process that starts reads from this one what it has to import. If Ctrl-C ended this process
    in between, or the new one, the new one would show a traceback.
    """

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        with ctrl_c_waits():
            resource_tracker.ensure_running()  # it would unblock SIGINT when it starts
            before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
            try:
                return super().submit(function, *args, **kwargs)
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


def submitted(
    executor: Executor,
    finished: 'SimpleQueue[Future[_T]]',
    function: Callable[..., _T],
    *args: Any,
    **kwargs: Any,
) -> 'Future[_T]':
    """Submit a call to an executor; its future comes out of the queue `finished` at its end.

    Args:
        executor: The executor.
        finished: The queue; wait at it in place of `concurrent.futures.wait` or `as_completed`.
        function: The function.
        args: Its arguments.
        kwargs: Its named arguments.
    """
    with ctrl_c_waits():
        future = executor.submit(function, *args, **kwargs)
        future.add_done_callback(finished.put)
    return future


def _begin_worker() -> None:
    """Ignore Ctrl-C, and end when the parent process ends, even if it is killed."""
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
        available = sum(client.nthreads().values())
        yield stack.enter_context(client.get_executor()), available or workers
