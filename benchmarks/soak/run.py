"""Fly for a day: does every throw fly and land, is it published, and does nothing grow?

    .venv/bin/python benchmarks/soak/run.py full [--hours 24]
    .venv/bin/python benchmarks/soak/run.py real [--minutes 30]
    .venv/bin/python benchmarks/soak/run.py crowd [--minutes 2]

`full`: a throw every 5 simulated seconds, each in gusts of its own, as fast as the machine can;
every landing is compared, to the last bit, with `fly_many` of the same launch, wind and seed.

`real`: at rate 1, with 50 commands a second, a node that subscribes to all state topics, a
recorder that splits its bag every 5 minutes, and a participant that comes and goes every 10 s; at
the end `analyse_bag --verify` simulates the whole bag again.

`crowd`: ten simulators in one domain, each with a throw of its own; each is stopped once for 5 s.

Each prints a table of results and limits (criteria.py has the reasons), writes the samples as CSV
to --out, and ends with 1 if a limit was exceeded.
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
import csv
from dataclasses import astuple, fields
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any

import criteria
from criteria import Check
import numpy as np
from resources import Sample, sample
from watcher import Values, Watcher

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros.processes import own_domain, started

PERIOD = 5.0  # s from throw to throw; the flight of Fig. 5 takes 3.7
GUSTS = 3.0  # m/s at 6 m, as `wind.turbulence`
START = 60.0  # s
CROWD = 10
STOP = 5.0  # s
SLOW = 10.0  # Hz, of odom where time runs as fast as possible
RATE = 200.0  # Hz

PARAMETERS = {
    'throw_period': PERIOD,
    'start_time': 0.0,
    'auto_throw': False,
    'command_timeout': PERIOD,  # a loaded machine may delay the commands
    'wind.x': 2.0,
    'wind.y': 1.0,
    'wind.turbulence': GUSTS,
}


def main() -> int:
    """Soak; return 0 if all results are allowed."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').partition('\n')[0])
    parser.add_argument('what', choices=('full', 'real', 'crowd'))
    parser.add_argument('--hours', type=float, default=24.0, help='simulated, of full (24)')
    parser.add_argument('--minutes', type=float, help='of real (30) and crowd (2)')
    parser.add_argument('--out', type=Path, default=Path(), help='folder for the samples (here)')
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix='soak_')))
        place = stack, domain, folder
        if chosen.what == 'full':
            checks = full(*place, chosen.hours, chosen.out)
        elif chosen.what == 'real':
            checks = real(*place, chosen.minutes or 30.0, chosen.out)
        else:
            checks = crowd(*place, chosen.minutes or 2.0, chosen.out)
    print(criteria.table(checks))
    return 0 if all(check.kept for check in checks) else 1


def full(stack: ExitStack, domain: int, folder: Path, hours: float, out: Path) -> list[Check]:
    """Throw as fast as possible."""
    watcher = Watcher(domain, rate=SLOW)
    stack.callback(watcher.close)
    parameters = {**PARAMETERS, 'real_time_factor': 0.0, 'publish_rate': SLOW}
    sim = stack.enter_context(started('sim_node', parameters, folder))
    watcher.spin_until(lambda: 'sim_node' in watcher.diagnostics, START, 'sim_node')
    watcher.call('sim_node/throw')
    count, start, samples = round(hours * 3600.0 / PERIOD), time.monotonic(), []
    while len(watcher.named('thrown')) <= count:  # then all earlier throws have landed
        sim.check()
        samples.append(sample(sim.pid, time.monotonic() - start))
        watcher.spin(0.5)
    duration = time.monotonic() - start
    sim.end()
    landed = [event for event in watcher.named('landed') if int(event['flight']) <= count]
    write(out / 'soak_full_sim_node.csv', samples)
    return [
        Check(
            'simulated', f'{hours:g} h in {duration:.0f} s, {hours * 3600.0 / duration:.0f} times'
        ),
        criteria.throws(watcher.named('thrown')[:count], count, PERIOD),
        criteria.landings(landed, watcher.named('failed'), count),
        as_computed(landed, count),
        criteria.evenness(watcher.stamps, count + 1),
        *criteria.resources('sim_node', samples),
    ]


def real(stack: ExitStack, domain: int, folder: Path, minutes: float, out: Path) -> list[Check]:
    """Throw, command, subscribe and record at rate 1."""
    watcher = Watcher(domain, rate=RATE)
    stack.callback(watcher.close)
    bag = folder / 'bag'
    parameters = {**PARAMETERS, 'publish_rate': RATE}
    sim = stack.enter_context(started('sim_node', parameters, folder))
    recording = {'bag': str(bag), 'max_duration_s': 300.0}
    recorder = stack.enter_context(started('recorder_node', recording, folder))
    for name in ('pilot', 'subscriber', 'guests'):
        stack.enter_context(role(name))
    watcher.spin_until(lambda: len(watcher.diagnostics) == 2, START, 'both nodes')
    watcher.spin_until(lambda: '/odom' in recorder.log.read_text(), START, 'a recorder of odom')
    watcher.call('sim_node/throw')
    processes = {'sim_node': sim, 'recorder_node': recorder}
    samples: dict[str, list[Sample]] = {name: [] for name in processes}
    start = time.monotonic()
    while time.monotonic() < start + minutes * 60.0:
        for name, process in processes.items():
            process.check()
            samples[name].append(sample(process.pid, time.monotonic() - start))
        watcher.spin(1.0)
    count = len(watcher.named('thrown'))
    watcher.spin_until(lambda: len(watcher.named('thrown')) > count, START, 'one throw more')
    recorder_diagnostics = dict(watcher.diagnostics['recorder_node'])
    recorder.end()
    sim.end()
    for name, taken in samples.items():
        write(out / f'soak_real_{name}.csv', taken)
    write(out / 'soak_real_seconds.csv', watcher.seconds)
    landed = [event for event in watcher.named('landed') if int(event['flight']) <= count]
    return [
        criteria.throws(watcher.named('thrown')[:count], count, PERIOD),
        criteria.landings(landed, watcher.named('failed'), count),
        criteria.evenness(watcher.stamps, count + 1),
        criteria.drift(watcher.seconds),
        *criteria.pace(watcher.seconds),
        criteria.losses(recorder_diagnostics),
        verified(bag, out),
        *(check for name, taken in samples.items() for check in criteria.resources(name, taken)),
    ]


def crowd(stack: ExitStack, domain: int, folder: Path, minutes: float, out: Path) -> list[Check]:
    """Throw ten discs side by side, and stop each once."""
    speeds = {f'/disc_{n}': 12.0 + 0.5 * n for n in range(CROWD)}
    watcher = Watcher(domain, namespaces=list(speeds))
    stack.callback(watcher.close)
    sims = {}
    for space, speed in speeds.items():
        own = folder / space[1:]
        own.mkdir()
        parameters = {'launch.speed': speed, 'throw_period': PERIOD, 'publish_rate': 50.0}
        place = ('-r', f'__ns:={space}')
        sims[space] = stack.enter_context(started('sim_node', parameters, own, *place))
    watcher.spin_until(lambda: len(watcher.diagnostics) == CROWD, START, 'all simulators')
    samples: dict[str, list[Sample]] = {space: [] for space in sims}
    start = time.monotonic()
    while time.monotonic() < start + minutes * 60.0 - CROWD * STOP:
        for space, sim in sims.items():
            sim.check()
            samples[space].append(sample(sim.pid, time.monotonic() - start))
        watcher.spin(1.0)
    before = {space: slipped(watcher, space) for space in sims}
    for sim in sims.values():
        os.kill(sim.pid, signal.SIGSTOP)
        watcher.spin(STOP)
        os.kill(sim.pid, signal.SIGCONT)
    watcher.spin(2 * PERIOD)
    least = min(slipped(watcher, space) - before[space] for space in sims)
    for space, taken in samples.items():
        write(out / f'soak_crowd_{space[1:]}.csv', taken)
    reported = f'at least {least:.2f} s reported as slipped'
    return [
        Check(f'each stopped for {STOP:g} s', reported, f'{STOP - 1.0:g} s', least > STOP - 1.0),
        side_by_side(watcher, speeds),
        *(check for space in sims for check in criteria.resources(space[1:], samples[space])),
    ]


def slipped(watcher: Watcher, space: str) -> float:
    """Return the slips that a simulator reports [s]."""
    return float(watcher.diagnostics[f'{space[1:]}/sim_node']['slipped_s'])


def side_by_side(watcher: Watcher, speeds: dict[str, float]) -> Check:
    """Check that every landing is that of `fly` to the last bit: no simulator affects another."""
    count = same = missing = 0
    for space, speed in speeds.items():
        flight = fly(Launch(speed=speed), Setup(disc=disc_file.load_disc('frisbee')))
        landed = watcher.named(f'{space}landed')
        expected = (flight.time, *flight.position[:2])
        same += sum(landing(one) == expected for one in landed)
        numbers = [int(one['flight']) for one in landed]
        missing += numbers[-1] - numbers[0] + 1 - len(numbers)
        count += len(landed)
    measured = f'{same} of {count} identical to `fly`, {missing} missing'
    return Check(
        f'landings of {len(speeds)} simulators', measured, 'all', same == count and not missing
    )


def landing(event: Values) -> tuple[float, ...]:
    """Return time [s] and position [m] of a landing."""
    return tuple(float(event[n]) for n in ('flight_time_s', 'landing_x_m', 'landing_y_m'))


def as_computed(landed: Sequence[Values], count: int) -> Check:
    """Check that every landing is that of `fly_many` to the last bit, with its gusts and seed."""
    wind = Wind(mean=(2.0, -1.0, 0.0), turbulence=GUSTS)
    setup = Setup(disc=disc_file.load_disc('frisbee'), wind=wind, step=1e-3)
    flights = fly_many({'speed': np.full(count, 15.0)}, setup, seeds=np.arange(count))
    landings = {int(event['flight']): landing(event) for event in landed}
    same = sum(
        landings.get(n + 1) == (flights.time[n], flights.x[n], flights.y[n]) for n in range(count)
    )
    return Check(
        'landings as `fly_many` has them', f'{same} to the bit', f'{count}', same == count
    )


def verified(bag: Path, out: Path) -> Check:
    """Check that every flight in the bag is verified to the last bit; otherwise keep the bag."""
    module = ['-m', 'disc_sim_ros.cli.analyse_bag']
    done = subprocess.run(
        [sys.executable, *module, str(bag), '--verify', '--json'],
        capture_output=True,
        text=True,
        check=False,
    )
    what, allowed = 'flights in the bag, simulated again', 'all identical, none missing'
    if done.returncode not in {0, 3}:  # 3: it found a difference
        return Check(what, f'analyse_bag: {done.stderr.strip()}', allowed, kept=False)
    (disc,) = json.loads(done.stdout)['discs']
    flown = [flight['verification']['re_flight'] for flight in disc['flights']]
    missing = sum(flight['messages']['missing'] for flight in disc['flights'])
    same = sum(f['exact'] and f['messages'] == f['identical_messages'] for f in flown)
    files = [path.stat().st_size for path in bag.glob('*.mcap')]
    measured = (
        f'{same} of {len(flown)} identical to the last bit, {missing} messages missing; '
        f'{sum(files) / 2**20:.0f} MiB in {len(files)} files'
    )
    kept = same == len(flown) and not missing and not done.returncode
    if not kept:
        shutil.copytree(bag, out / bag.name)
        (out / 'verified.json').write_text(done.stdout, encoding='utf-8')
    return Check(what, measured, allowed, kept)


@contextmanager
def role(name: str) -> Iterator[None]:
    """Run a role of roles.py while the block runs."""
    process = subprocess.Popen([sys.executable, str(Path(__file__).with_name('roles.py')), name])
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def write(path: Path, rows: Sequence[Any]) -> None:
    """Write dataclasses as CSV."""
    with path.open('w', encoding='utf-8', newline='') as file:
        writer = csv.writer(file)
        writer.writerow([field.name for field in fields(rows[0])])
        writer.writerows(map(astuple, rows))


if __name__ == '__main__':
    sys.exit(main())
