"""Coverage-guided fuzzing of what comes from outside; docs/trust.md tells what it found.

    .venv/bin/pip install atheris
    nice -n 19 .venv/bin/python benchmarks/fuzz/run.py all --seconds 600

Each target runs in a process of its own under atheris (libFuzzer): Python code is instrumented,
compiled physics runs as it is. The first input of each finding is kept as a file, its traceback in
the log, and fuzzing goes on; a hang or a crash ends the target. `--input FILE` runs one file
again. Exit code 1 where something was found.
"""

import argparse
from collections.abc import Callable
import importlib
from pathlib import Path
import random
import re
import subprocess
import sys
import tempfile
import traceback

TARGETS = {
    'disc_files': 'YAML disc files, loaded and flown 100 steps',
    'ros_messages': 'commands, wind and throws as CDR, accepted and flown 100 steps',
    'configurations': 'recorded configurations, flown again for 0.1 s',
    'throw_files': 'CSV files of throws and of a TechDisc, flight numbers, read and flown',
    'tracker_messages': 'measurements of predictor_node as CDR, among those of a throw',
    'mcap_files': 'MCAP files, opened, read, decoded, repaired',
    'bag_metadata': 'metadata.yaml and such records, of a bag that is read and repaired',
    'flight_bags': 'bags of real flights, damaged, through `analyse_bag --verify`',
}
SLOWEST = 20  # s for one input; slower is a hang
_MEMORY = 2048  # MB
KERNELS = Path(__file__).parents[2] / 'disc_sim_ros/physics/kernels'
# What numba compiles; instrumented it would be no longer what flies.
COMPILED = (
    *(f'disc_sim_ros.physics.kernels.{path.stem}' for path in KERNELS.glob('*.py')),
    'disc_sim_ros.physics.sampled',
    'disc_sim_ros.estimation.prediction.lanes',
)
INSTRUMENTED = ('disc_sim_ros', 'mcap', 'mcap_ros2')  # and what a target names beside
MORE_INSTRUMENTED = {'disc_files': ('yaml',)}  # it makes all else ten times slower
LONGEST = 1 << 20  # bytes of an input


def main(arguments: list[str] | None = None) -> int:
    """Fuzz one target or all, one after the other."""
    p = argparse.ArgumentParser(description=__doc__, formatter_class=_Formatter)
    p.add_argument('target', choices=(*TARGETS, 'all'), help='; '.join(map(': '.join, _about())))
    p.add_argument('--seconds', type=int, default=600, metavar='S', help='for each target [s]')
    p.add_argument('--corpus', type=Path, metavar='DIR', help='kept inputs (default: none kept)')
    p.add_argument('--findings', type=Path, default=Path('fuzz_findings'), metavar='DIR')
    p.add_argument('--input', type=Path, metavar='FILE', help='run the target once on this file')
    p.add_argument('--seed', type=int, default=1, metavar='N')
    p.add_argument('--inside', action='store_true', help=argparse.SUPPRESS)
    chosen = p.parse_args(arguments)
    if chosen.target == 'all' and chosen.input is not None:
        p.error('--input: name the target that is to take it')
    if chosen.input is not None:
        _target(chosen.target).one(chosen.input.read_bytes())
        print(f'{chosen.target}: nothing wrong with {chosen.input}')
        return 0
    if chosen.inside:
        _fuzz(chosen)
    names = TARGETS if chosen.target == 'all' else (chosen.target,)
    return max(_watch(name, chosen) for name in names)


def _about() -> list[tuple[str, str]]:
    return list(TARGETS.items())


class _Formatter(argparse.RawDescriptionHelpFormatter):
    """Keeps the lines of the description."""


def _watch(name: str, chosen: argparse.Namespace) -> int:
    """Run one target in a process of its own; say how it went; return 1 after a finding."""
    chosen.findings.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as kept:
        corpus = kept if chosen.corpus is None else str(chosen.corpus / name)
        Path(corpus).mkdir(parents=True, exist_ok=True)
        command = [
            sys.executable, __file__, name, '--inside', '--seconds', str(chosen.seconds),
            '--seed', str(chosen.seed), '--corpus', corpus, '--findings', str(chosen.findings),
        ]  # fmt: skip
        log = chosen.findings / f'{name}.log'
        with log.open('wb') as file:
            code = subprocess.run(command, stdout=file, stderr=file, check=False).returncode
    text = log.read_text(errors='replace')
    runs = re.findall(r'number_of_executed_units: (\d+)', text)
    cover = re.findall(r'cov: (\d+) ft: (\d+) corp: (\d+)', text)
    edges, features, inputs = cover[-1] if cover else ('?', '?', '?')
    slow = re.findall(r'slowest_unit_time_sec: (\d+)', text)
    findings = re.findall(r'^FOUND (.*)$', text, re.MULTILINE)
    if code != 0:
        findings.append(f'the process ended with {code}')
    print(
        f'{name}: {runs[-1] if runs else "?"} inputs in {chosen.seconds} s, {edges} edges, '
        f'{features} features, {inputs} kept, slowest {slow[-1] if slow else "?"} s: '
        f'{f"{len(findings)} FOUND, see {log}" if findings else "no findings"}',
        flush=True,
    )
    for line in findings:
        print(f'  {line}', flush=True)
    return int(bool(findings))


def _target(name: str) -> object:
    sys.path.insert(0, str(Path(__file__).parent))
    return importlib.import_module(name)


def _fuzz(chosen: argparse.Namespace) -> None:
    """Hand the target to libFuzzer, which ends the process."""
    import atheris  # noqa: PLC0415 - only here is it needed

    more = MORE_INSTRUMENTED.get(chosen.target, ())
    with atheris.instrument_imports(include=(*INSTRUMENTED, *more), exclude=COMPILED):
        target = _target(chosen.target)
    corpus = Path(chosen.corpus)
    for number, data in enumerate(target.seeds()):
        (corpus / f'seed_{number}').write_bytes(data)
    words = Path(tempfile.mkdtemp()) / 'words'
    words.write_text(''.join(f'"{_escaped(word)}"\n' for word in target.WORDS))
    options = [
        sys.argv[0], str(corpus), f'-max_total_time={chosen.seconds}', f'-timeout={SLOWEST}',
        f'-rss_limit_mb={_MEMORY}', f'-seed={chosen.seed}', f'-dict={words}',
        '-print_final_stats=1', f'-max_len={LONGEST}',
        f'-artifact_prefix={chosen.findings / chosen.target}_',
    ]  # fmt: skip
    one = _Kept(target, chosen.findings)
    atheris.Setup(options, one, custom_mutator=_mutator(atheris, target.mutate))
    atheris.Fuzz()


class _Kept:
    """A target that keeps the first input of each finding and goes on."""

    def __init__(self, target: object, folder: Path) -> None:
        self._target = target
        self._folder = folder
        self._known: set[str] = set()

    def __call__(self, data: bytes) -> None:
        try:
            self._target.one(data)
        except Exception as error:  # whatever it is, it is a finding
            where = _where(error)
            if where in self._known:
                return
            self._known.add(where)
            file = self._folder / f'{self._target.NAME}_{len(self._known)}'
            file.write_bytes(data)
            sys.stderr.write(f'FOUND {file}: {where}: {" ".join(str(error).split())[:200]}\n')
            traceback.print_exc()


def _where(error: Exception) -> str:
    """Return the kind of an error and the innermost line of this project that it came from."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if '/site-packages/' not in f.filename]
    last = (ours or frames)[-1]
    return f'{type(error).__name__} at {Path(last.filename).name}:{last.lineno}'


def _mutator(atheris: object, mutate: Callable[[bytes, random.Random], bytes | None]) -> object:
    """Return a mutator: two in three times by the structure of the input, else by its bytes."""

    def mutated(data: bytes, most: int, seed: int) -> bytes:
        rng = random.Random(seed)  # noqa: S311 - to mutate
        changed = mutate(data, rng) if rng.random() < 2 / 3 else None
        if changed is None or len(changed) > most:
            return atheris.Mutate(data, min(most, 2 * len(data) + 64))
        return changed

    return mutated


def _escaped(word: str) -> str:
    return ''.join(f'\\x{byte:02x}' for byte in word.encode())


if __name__ == '__main__':
    sys.exit(main())
