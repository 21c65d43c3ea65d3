"""CPU time of what the first start of `sim_node` on a machine compiles, function by function.

numba infers types and writes LLVM's code in Python; LLVM makes machine code of it. Both hold
numba's compiler lock, so that threads do not share the work.

usage: benchmarks/compilation.py
"""

from collections.abc import Callable
import os
import tempfile
import time
from typing import Any


def main() -> None:
    """Compile into an empty cache and print a table."""
    with tempfile.TemporaryDirectory() as cache:
        os.environ['XDG_CACHE_HOME'] = cache
        os.environ.pop('NUMBA_CACHE_DIR', None)
        start = time.process_time()
        from disc_sim_ros.physics.kernels import jit  # noqa: PLC0415 - after the cache is set

        jit.import_compiler()
        print(f'imports {time.process_time() - start:.2f} s')
        measure()


def measure() -> None:
    """Compile what `sim_node` calls, and print a line for each function."""
    from llvmlite import binding  # noqa: PLC0415 - numba comes after the cache is set
    from numba.core import codegen, event  # noqa: PLC0415

    from disc_sim_ros.physics.kernels import compiler  # noqa: PLC0415
    from disc_sim_ros.ros.sim import compiled_loop  # noqa: PLC0415

    llvm = [0.0]
    timed(codegen.CPUCodeLibrary, '_optimize_functions', llvm)
    timed(codegen.JITCodeLibrary, '_optimize_final_module', llvm)
    timed(binding.ModuleRef, 'link_in', llvm)
    timed(binding.TargetMachine, 'emit_object', llvm)
    compile_entry = compiler.compile_entry

    def compile_and_print(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        start, llvm[0] = time.process_time(), 0.0
        with event.install_recorder('numba:compile') as recorder:
            result = compile_entry(function, arguments)
        seconds = time.process_time() - start
        count = sum(happened.is_start for _, happened in recorder.buffer)
        print(
            f'{function.__name__:16s} {seconds:6.2f} s, {llvm[0]:.2f} s of it LLVM, '
            f'{count} functions, {len(result[1]) // 1024} kB'
        )
        return result

    compiler.compile_entry = compile_and_print
    start = time.process_time()
    compiled_loop.warm_up()
    print(f'all of it {time.process_time() - start:.2f} s')


def timed(cls: type, name: str, seconds: list[float]) -> None:
    """Let a method of numba add its CPU time to `seconds`."""
    method = getattr(cls, name)

    def measured(*arguments: Any, **named: Any) -> Any:
        start = time.process_time()
        try:
            return method(*arguments, **named)
        finally:
            seconds[0] += time.process_time() - start

    setattr(cls, name, measured)


if __name__ == '__main__':
    main()
