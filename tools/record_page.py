#!/usr/bin/env python3
"""Record the page of a throw as a moving picture: docs/throw.webp, at the top of README.

    .venv/bin/python tools/record_page.py            # needs Chromium

The page is that of `fly --html`; the browser shows it time by time, at real speed, and each
picture is what the page draws.
"""

import argparse
from io import BytesIO
from pathlib import Path
import sys
import tempfile

from PIL import Image

import browser
from disc_sim_ros import Launch, Setup, Wind, fly, load_disc
from disc_sim_ros.view.page import page
from disc_sim_ros.view.shown import of_flight
from disc_sim_ros.view.system import SYSTEMS

ROOT = Path(__file__).parents[1]
RATE = 25.0  # pictures a second
SIZE = (720, 560)  # of the window, pixels
REST = 1.0  # s that the last picture stays
DRAWN = 'new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => r())))'


def recorded_page() -> bytes:
    """Return the page of the throw of the paper's Fig. 5, and the same in a side wind."""
    flights = {
        'calm': Setup(disc=load_disc('frisbee')),
        'wind 3 m/s from the left': Setup(
            disc=load_disc('frisbee'), wind=Wind(mean=(0.0, 3.0, 0.0))
        ),
    }
    system = SYSTEMS['metric']
    tracks = [
        of_flight(fly(Launch(height=1.0), setup, sample_rate=200.0), name, system)
        for name, setup in flights.items()
    ]
    return page(tracks, "The throw of the paper's Fig. 5, from 1 m", system)


def pictures(file: Path) -> list[Image.Image]:
    """Return what the page shows at each time."""
    with browser.Browser(*SIZE) as tab:
        tab.open(file)
        tab.wait('discView.ready')
        tab.value('discView.play(false), discView.choose(1)')
        count = int(tab.value('discView.duration()') * RATE) + 1
        images = []
        for k in range(count):
            tab.value(f'discView.seek({k / RATE})')
            tab.value(DRAWN)
            images.append(Image.open(BytesIO(tab.picture())).convert('RGB'))
        if tab.problems:
            sys.exit(f'the page reports {tab.problems}')
    return images


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--output', type=Path, default=ROOT / 'docs' / 'throw.webp')
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / 'throw.html'
        file.write_bytes(recorded_page())
        first, *others = pictures(file)
    step = round(1000.0 / RATE)
    durations = [step] * len(others) + [round(1000.0 * REST)]
    first.save(
        chosen.output, save_all=True, append_images=others, duration=durations, loop=0,
        quality=48, method=6,
    )  # fmt: skip
    sys.stdout.write(f'{chosen.output}: {chosen.output.stat().st_size / 1e6:.2f} MB\n')


if __name__ == '__main__':
    main()
