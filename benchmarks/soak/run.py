"""Fly for a day: is every throw flown, landed and told, and does nothing grow?

    .venv/bin/python benchmarks/soak/run.py full [--hours 24]
    .venv/bin/python benchmarks/soak/run.py real [--minutes 30]
    .venv/bin/python benchmarks/soak/run.py crowd [--minutes 2]

`full`: a throw every 5 simulated seconds, each in gusts of its own, as fast as the machine can;
every landing is compared, to the last bit, with `fly_many` of the same launch, wind and seed.

`real`: at rate 1, steered by 50 commands a second, recorded by recorder_node, with a participant
that comes and goes every 10 s; at the end `analyse_bag --verify` flies the whole bag again.

`crowd`: ten simulators in one domain, each with a throw of its own; each is stopped once for 5 s.
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
import csv
from dataclasses import astuple, fields
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
from resources import Sample, growth, problems, sample
from watcher import Watcher

from disc_sim_ros.core import catalogue
from disc_sim_ros.core.air import Wind
from disc_sim_ros.core.ensemble import fly_many
from disc_sim_ros.core.flight import Setup, fly
from disc_sim_ros.core.launch import Launch
from disc_sim_ros.nodes import live

PERIOD = 5.0  # s from throw to throw; the flight of Fig. 5 takes 3.7
GUSTS = 3.0  # m/s at 6 m, as `wind.turbulence`
MOST_DRIFT = 0.005  # s against the monotonic clock; a message is on its way for less
WINDOW = 10.0  # s; the quickest message in it tells the offset of the clocks
GUEST_EVERY = 10.0  # s
START = 60.0  # s
PATIENCE = 30  # windows
CROWD = 10
STOP = 5.0  # s

Values = dict[str, str]  # of an event

PARAMETERS = {
    'throw_period': PERIOD,
    'start_time': 0.0,
    'publish_rate': 50.0,
    'command_timeout': PERIOD,  # who commands here also makes guests, which takes a while
    'wind.x': 2.0,
    'wind.y': 1.0,
    'wind.turbulence': GUSTS,
}


def main() -> int:
    """Soak; return 0 where nothing was found."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').partition('\n')[0])
    parser.add_argument('what', choices=('full', 'real', 'crowd'))
    parser.add_argument('--hours', type=float, default=24.0, help='simulated, of full (24)')
    parser.add_argument('--minutes', type=float, help='of real (30) and crowd (2)')
    parser.add_argument('--out', type=Path, default=Path(), help='folder for the samples (here)')
    chosen = parser.parse_args()
    with ExitStack() as stack:
        domain = stack.enter_context(live.own_domain())
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix='soak_')))
        place = stack, domain, folder
        if chosen.what == 'full':
            found = list(full(*place, chosen.hours, chosen.out))
        elif chosen.what == 'real':
            found = list(real(*place, chosen.minutes or 30.0, chosen.out))
        else:
            found = list(crowd(*place, chosen.minutes or 2.0, chosen.out))
    print('\n'.join(f'FOUND: {problem}' for problem in found) or 'found nothing')
    return 1 if found else 0


def full(stack: ExitStack, domain: int, folder: Path, hours: float, out: Path) -> Iterator[str]:
    """Throw as fast as possible, and yield what is wrong."""
    watcher = Watcher(domain)
    stack.callback(watcher.close)
    waiting = {**PARAMETERS, 'real_time_factor': 0.0, 'auto_throw': False, 'publish_rate': 10.0}
    sim = stack.enter_context(live.started('sim_node', waiting, folder))
    watcher.spin_until(lambda: 'sim_node' in watcher.told, START, 'sim_node')
    watcher.call('sim_node/throw')
    count, begun, samples = round(hours * 3600.0 / PERIOD), time.monotonic(), []
    while len(watcher.named('thrown')) <= count:  # then all before have landed
        sim.check()
        samples.append(sample(sim.pid, time.monotonic() - begun))
        watcher.spin(0.5)
    took = time.monotonic() - begun
    sim.end()
    landed = [event for event in watcher.named('landed') if int(event['flight']) <= count]
    print(
        f'{count} throws, {hours:g} h in {took:.0f} s: {hours * 3600.0 / took:.0f} times real time'
    )
    yield from releases(watcher, watcher.named('thrown')[:count], count)
    yield from differences(landed, count)
    yield from resources(out, 'full', {'sim_node': samples})


def real(stack: ExitStack, domain: int, folder: Path, minutes: float, out: Path) -> Iterator[str]:
    """Throw, steer and record at rate 1, and yield what is wrong."""
    watcher = Watcher(domain, steer=True)
    stack.callback(watcher.close)
    bag = folder / 'bag'
    sim = stack.enter_context(
        live.started('sim_node', {**PARAMETERS, 'auto_throw': False}, folder)
    )
    to = {'bag': str(bag), 'max_duration_s': 300.0}
    recorder = stack.enter_context(live.started('recorder_node', to, folder))
    watcher.spin_until(lambda: len(watcher.told) == 2, START, 'both nodes')
    watcher.call('sim_node/throw')
    first = offset(watcher)
    processes = {'sim_node': sim, 'recorder_node': recorder}
    samples: dict[str, list[Sample]] = {name: [] for name in processes}
    begun = guest = time.monotonic()
    while time.monotonic() < begun + minutes * 60.0:
        for name, process in processes.items():
            process.check()
            samples[name].append(sample(process.pid, time.monotonic() - begun))
        if time.monotonic() > guest + GUEST_EVERY:
            guest = time.monotonic()
            watcher.greet()
        watcher.spin(1.0)
    watcher.spin(PERIOD)  # the last ones land
    last = offset(watcher)
    told = watcher.told['sim_node']
    recorder.end()
    sim.end()
    thrown = watcher.named('thrown')
    print(f'{len(thrown)} throws in {minutes:g} min')
    yield from releases(watcher, thrown, len(thrown))
    drifted, slipped = (b - a for a, b in zip(first, last, strict=True))
    worst = f'late at the last second by up to {float(told["worst_lateness_s"]) * 1e3:.1f} ms'
    print(f'drift {drifted * 1e3:.2f} ms, of it told as slipped {slipped * 1e3:.2f} ms; {worst}')
    print(f'missed deadlines {told["missed_deadlines"]}, slips {told["slips"]}')
    if abs(drifted - slipped) > MOST_DRIFT:
        yield f'time drifted by {drifted:.4f} s, {slipped:.4f} s of it told'
    yield from verified(bag)
    yield from resources(out, 'real', samples)


def crowd(stack: ExitStack, domain: int, folder: Path, minutes: float, out: Path) -> Iterator[str]:
    """Throw ten discs side by side, stop each once, and yield what is wrong."""
    speeds = {f'/disc_{n}': 12.0 + 0.5 * n for n in range(CROWD)}
    watcher = Watcher(domain, namespaces=list(speeds))
    stack.callback(watcher.close)
    sims = {}
    for space, speed in speeds.items():
        own = folder / space[1:]
        own.mkdir()
        parameters = {'launch.speed': speed, 'throw_period': PERIOD, 'publish_rate': 50.0}
        place = ('-r', f'__ns:={space}')
        sims[space] = stack.enter_context(live.started('sim_node', parameters, own, *place))
    watcher.spin_until(lambda: len(watcher.told) == CROWD, START, 'all simulators')
    samples: dict[str, list[Sample]] = {space: [] for space in sims}
    begun = time.monotonic()
    while time.monotonic() < begun + minutes * 60.0 - CROWD * STOP:
        for space, sim in sims.items():
            sim.check()
            samples[space].append(sample(sim.pid, time.monotonic() - begun))
        watcher.spin(1.0)
    for sim in sims.values():
        os.kill(sim.pid, signal.SIGSTOP)
        watcher.spin(STOP)
        os.kill(sim.pid, signal.SIGCONT)
    watcher.spin(2 * PERIOD)
    slipped = [float(values['slipped_s']) for values in watcher.told.values()]
    if min(slipped) < STOP - 1.0:
        yield f'stopped for {STOP:g} s, told of {min(slipped):.2f} s'
    count = 0
    for space, speed in speeds.items():
        flight = fly(Launch(speed=speed), Setup(disc=catalogue.load('frisbee')))
        expected = (flight.time, *flight.position[:2])
        landed = watcher.named(f'{space}landed')
        names = ('flight_time_s', 'landing_x_m', 'landing_y_m')
        same = sum(tuple(float(one[name]) for name in names) == expected for one in landed)
        numbers = [int(one['flight']) for one in landed]
        count += same
        if same < len(landed) or numbers != list(range(numbers[0], numbers[0] + len(landed))):
            yield f'{space}: {len(landed) - same} landings differ, or one is missing: {numbers}'
    print(f'{CROWD} simulators, {count} landings as fly has them, to the last bit')
    yield from resources(out, 'crowd', samples)


def releases(watcher: Watcher, thrown: Sequence[Values], count: int) -> Iterator[str]:
    """Yield throws that are missing, and releases that are not when they are due."""
    numbers = [int(event['flight']) for event in thrown]
    if numbers != list(range(1, count + 1)):
        yield f'{count - len(set(numbers))} throws of {count} not told of'
    first = float(thrown[0]['stamp_s'])
    for event in thrown:
        late = float(event['stamp_s']) - first - PERIOD * (int(event['flight']) - 1)
        if abs(late) > 1e-6:  # stamps of a float in seconds
            yield f'flight {event["flight"]} was released {late:g} s late'
    others = {name for name, _ in watcher.events} - {'thrown', 'landed', 'reset'}
    if others:
        yield f'events: {", ".join(sorted(others))}'


def differences(landed: Sequence[Values], count: int) -> Iterator[str]:
    """Yield landings that the core does not know, and those that are missing."""
    wind = Wind(mean=(2.0, -1.0, 0.0), turbulence=GUSTS)
    setup = Setup(disc=catalogue.load('frisbee'), wind=wind, step=1e-3)
    core = fly_many({'speed': np.full(count, 15.0)}, setup, seeds=np.arange(count))
    due = set((np.flatnonzero(core.time < PERIOD) + 1).tolist())  # the others are thrown again
    told = {int(event['flight']): event for event in landed}
    names = ('flight_time_s', 'landing_x_m', 'landing_y_m')
    same = sum(
        tuple(float(told[n][name]) for name in names)
        == (core.time[n - 1], core.x[n - 1], core.y[n - 1])
        for n in due & told.keys()
    )
    print(f'{len(due)} land within {PERIOD:g} s, {same} told of as fly_many has them, to the bit')
    if same < len(due) or told.keys() - due:
        more = len(told.keys() - due)
        yield f'{len(due) - same} landings are missing or differ, {more} too many'


def offset(watcher: Watcher) -> tuple[float, float]:
    """Return how far simulated time is behind the steady clock, and what is told as slipped [s].

    Of a while in which nothing slips; the quickest message of it tells the first.
    """
    for _ in range(PATIENCE):
        slipped = watcher.told['sim_node']['slipped_s']
        watcher.offsets.clear()
        watcher.spin(WINDOW)
        if watcher.told['sim_node']['slipped_s'] == slipped:
            break
    return min(offset for _, offset in watcher.offsets), float(slipped)


def verified(bag: Path) -> Iterator[str]:
    """Fly a bag again, and yield what differs."""
    command = [
        sys.executable,
        '-m',
        'disc_sim_ros.cli.analyse_bag',
        str(bag),
        '--verify',
        '--json',
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        yield f'analyse_bag ended with {done.returncode}: {done.stderr.strip()}'
        return
    (disc,) = json.loads(done.stdout)['discs']
    flown = [flight['verification']['re_flight'] for flight in disc['flights']]
    missing = sum(flight['messages']['missing'] for flight in disc['flights'])
    same = sum(f['exact'] and f['messages'] == f['identical_messages'] for f in flown)
    size = sum(path.stat().st_size for path in bag.iterdir()) / 2**20
    print(f'bag: {size:.0f} MiB, {same} of {len(flown)} flights identical to the last bit')
    print(f'messages of odom missing: {missing}')
    if same < len(flown) or missing:
        yield f'the bag: {len(flown) - same} flights differ, {missing} messages are missing'


def resources(out: Path, what: str, samples: dict[str, list[Sample]]) -> Iterator[str]:
    """Write the samples, print what they say, and yield what grew."""
    out.mkdir(parents=True, exist_ok=True)
    for name, taken in samples.items():
        with (out / f'soak_{what}_{name.strip("/")}.csv').open('w', newline='') as file:
            writer = csv.writer(file)
            writer.writerow([field.name for field in fields(Sample)])
            writer.writerows(map(astuple, taken))
        first, last = taken[0], taken[-1]
        print(
            f'{name}: {first.memory:.1f} MiB at first, {last.memory:.1f} at last '
            f'({growth(taken):+.2f} once settled); threads {first.threads}, {last.threads}; '
            f'files {first.files}, {last.files}'
        )
        yield from problems(name, taken)


if __name__ == '__main__':
    sys.exit(main())
