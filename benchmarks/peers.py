"""Flights per CPU-second and error beside other simulators of discs, in one run.

python3 -m venv peers && peers/bin/pip install '.[fast]' FrisPy
peers/bin/python benchmarks/peers.py [seconds of each, 3]

FrisPy comes from PyPI and wants an older numpy, hence an environment of its own; without it there
is a line instead. shotshaper is not on PyPI.
Each simulator flies its own disc for 3 s in the air, so that errors are against the same simulator
with a tolerance or a step that is far finer; what they say of the same throw is not compared.
"""

from collections.abc import Callable
import math
import sys
import time

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from lines import Line, number, print_lines

LEAST = 80.0  # times the rate of FrisPy
SPEED, SPIN, HEIGHT, SECONDS = 15.0, 31.416, 50.0, 3.0  # m/s, rad/s, m, s
Point = tuple[float, float, float]


def rate(flight: Callable[[], Point], seconds: float) -> float:
    """Return flights per second of CPU time."""
    flight()
    count, start = 0, time.process_time()
    while time.process_time() < start + seconds:
        flight()
        count += 1
    return count / (time.process_time() - start)


def ours(step: float | None, **inertia: float) -> Callable[[], Point]:
    """Return a flight of this package, with error control where no step is given."""
    document = disc_file.disc_document(disc_file.load_disc('frisbee_as_printed')) | inertia
    setup = Setup(disc=disc_file.disc_from_document('frisbee_as_printed', document), step=step)
    launch = Launch(speed=SPEED, spin=SPIN, height=HEIGHT)

    def flown() -> Point:
        end = fly(launch, setup, duration=SECONDS, ground=False).end
        return end.X, end.Y, end.Z

    return flown


def frispy(inertia: float = 1.0, **solver: float) -> Callable[[], Point]:
    """Return the same throw by FrisPy, with its moments of inertia times a number.

    Raises:
        ImportError: It is not installed.
    """
    from frispy.disc import Disc  # noqa: PLC0415

    pitch = math.radians(15.0)
    disc = Disc(
        z=HEIGHT,
        vx=SPEED * math.cos(pitch),
        vz=SPEED * math.sin(pitch),
        theta=-pitch,
        dgamma=SPIN,
        I_xx=0.001219 * inertia,
        I_zz=0.002352 * inertia,
    )

    def flown() -> Point:
        path, _ = disc.compute_trajectory(flight_time=SECONDS, n_times=2, **solver)
        return float(path['x'][-1]), float(path['y'][-1]), float(path['z'][-1])

    return flown


def main() -> None:
    """Print what was measured."""
    print_lines(lines(float(sys.argv[1]) if len(sys.argv) > 1 else 3.0))


def lines(seconds: float = 3.0) -> tuple[Line, ...]:
    """Measure each simulator for some CPU seconds."""
    mine = rate(ours(0.02), seconds)
    error = math.dist(ours(0.02)(), ours(1e-4)())
    default = rate(ours(None), seconds)
    default_error = math.dist(ours(None)(), ours(1e-4)())
    own_default = f'{number(default)} per CPU-second, {number(default_error * 1e3, 1)} mm off'
    light = {'inertia_axial_kg_m2': 2.4e-3 / 2, 'inertia_diametral_kg_m2': 1.2e-3 / 2}
    moved = math.dist(ours(0.02, **light)(), ours(0.02)())
    own = f'{number(mine)} per CPU-second, {number(error * 1e3, 1)} mm off'
    absent = Line(what='3 s flights', ours=own, beside='shotshaper: not on PyPI, not measured')
    try:
        theirs = rate(frispy(), seconds)
    except ImportError:
        skipped = 'FrisPy: not installed (see benchmarks/peers.py), not measured'
        return (Line(what='3 s flights', ours=own, beside=skipped), absent)
    off = math.dist(frispy()(), frispy(rtol=1e-10, atol=1e-10)())
    budged = math.dist(frispy(inertia=0.5)(), frispy()())
    return (
        Line(
            what='3 s flights',
            ours=own,
            beside=f'FrisPy {number(theirs)}, {number(off * 1e3, 1)} mm off',
            ratio=mine / theirs,
        ),
        Line(
            what='the same by default, with error control',
            ours=own_default,
            beside=f'FrisPy {number(theirs)}, {number(off * 1e3, 1)} mm off',
            ratio=default / theirs,
            bound=f'at least {LEAST:g} times',
            kept=default >= LEAST * theirs,
        ),
        Line(
            what='half the inertia moves the end',
            ours=f'by {moved:.2f} m',
            beside=f'FrisPy by {budged:.2f} m',
        ),
        absent,
    )


if __name__ == '__main__':
    main()
