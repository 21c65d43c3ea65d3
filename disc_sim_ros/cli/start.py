"""Entry points of the executables. They import little: Ctrl-C may come while a program loads.

A node handles its signals itself, see `node_program`.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import signal
import threading
from types import FrameType
from typing import Protocol


class Program(Protocol):
    """The `main` of a program."""

    def __call__(self, arguments: Sequence[str] | None = None, prog: str = ...) -> int:
        """Run the program under the name `prog` and return its exit code."""


@contextmanager
def ended_by_ctrl_c() -> Iterator[None]:
    """Let Ctrl-C end the process at once: compiled code runs no Python signal handler.

    A shell shows that as exit code 130. Where SIGINT is ignored, as in the background of a shell,
    it stays so.
    """
    before = signal.getsignal(signal.SIGINT)
    main = threading.current_thread() is threading.main_thread()
    if not main or before == signal.SIG_IGN:
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


_AGAIN = 0.01  # s from a look whether an import has ended to the next
_IMPORT = {'importlib._bootstrap', '_frozen_importlib'}  # the module of the import statement


def _interrupt(_: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt; within an import, look again a little later.

    Packages that import what they may do without catch every exception, such as trimesh and numba:
    Ctrl-C was lost there.
    """
    while frame is not None:
        if frame.f_globals.get('__name__') in _IMPORT:
            signal.setitimer(signal.ITIMER_REAL, _AGAIN)
            return
        frame = frame.f_back
    raise KeyboardInterrupt


@contextmanager
def _interrupts_after_imports() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt outside imports alone, where Python would raise it."""
    if signal.getsignal(signal.SIGINT) != signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _interrupt)
    # By way of SIGINT: another handler may stand there, such as that of `ctrl_c_waits`.
    before = signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGINT))
    waiting = False
    try:
        yield
    finally:
        waiting = signal.setitimer(signal.ITIMER_REAL, 0.0)[0] > 0.0
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGALRM, before)
    if waiting:
        raise KeyboardInterrupt


def run(load: Callable[[], Callable[[], int]]) -> int:
    """Import a program, run it and return its exit code; Ctrl-C never shows a traceback.

    Args:
        load: Imports the program and returns its `main`.
    """
    try:
        with ended_by_ctrl_c():
            main = load()
        with _interrupts_after_imports():
            return main()
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    finally:
        if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # for what Python does at its end


def load_fly() -> Program:
    """Import `fly`."""
    from disc_sim_ros.cli import fly  # noqa: PLC0415

    return fly.main


def load_sweep() -> Program:
    """Import `sweep`."""
    from disc_sim_ros.cli import sweep  # noqa: PLC0415

    return sweep.main


def load_optimise() -> Program:
    """Import `optimise`."""
    from disc_sim_ros.cli import optimise  # noqa: PLC0415

    return optimise.main


def load_identify() -> Program:
    """Import `identify`."""
    from disc_sim_ros.cli import identify  # noqa: PLC0415

    return identify.main


def load_demo() -> Program:
    """Import `demo`."""
    from disc_sim_ros.cli import demo  # noqa: PLC0415

    return demo.main


def load_predict() -> Program:
    """Import `predict`."""
    from disc_sim_ros.cli import predict  # noqa: PLC0415

    return predict.main


def load_analyse_bag() -> Program:
    """Import `analyse_bag`."""
    from disc_sim_ros.cli import analyse_bag  # noqa: PLC0415

    return analyse_bag.main


def load_repair_bag() -> Program:
    """Import `repair_bag`."""
    from disc_sim_ros.cli import repair_bag  # noqa: PLC0415

    return repair_bag.main


def load_paper_figures() -> Program:
    """Import `paper_figures`."""
    from disc_sim_ros.cli import paper_figures  # noqa: PLC0415

    return paper_figures.main


def load_disc_sim() -> Callable[[], int]:
    """Import `disc-sim`."""
    from disc_sim_ros.cli import disc_sim  # noqa: PLC0415

    return disc_sim.main


def fly() -> int:
    """Run `fly`."""
    return run(load_fly)


def sweep() -> int:
    """Run `sweep`."""
    return run(load_sweep)


def optimise() -> int:
    """Run `optimise`."""
    return run(load_optimise)


def identify() -> int:
    """Run `identify`."""
    return run(load_identify)


def demo() -> int:
    """Run `demo`."""
    return run(load_demo)


def predict() -> int:
    """Run `predict`."""
    return run(load_predict)


def analyse_bag() -> int:
    """Run `analyse_bag`."""
    return run(load_analyse_bag)


def repair_bag() -> int:
    """Run `repair_bag`."""
    return run(load_repair_bag)


def paper_figures() -> int:
    """Run `paper_figures`."""
    return run(load_paper_figures)


def disc_sim() -> int:
    """Run `disc-sim`."""
    return run(load_disc_sim)
