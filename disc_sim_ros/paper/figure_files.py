"""Files of one figure: pictures, CSV, and what the report says of it."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import time
from types import ModuleType

from disc_sim_ros.files import write_whole
from disc_sim_ros.paper import crosscheck, style
from disc_sim_ros.paper.style import DARK, LIGHT, Look

FORMATS = ('png', 'svg')


@dataclass(frozen=True)
class Written:
    """What one figure left behind.

    Attributes:
        key: Its name for `--only`.
        title: Its title.
        conditions: Model, damping and moment axes.
        findings: What came out, in sentences.
        files: Names of its files.
        example: Which flight was integrated a second time.
        distance: How far the second integration is from it at most [m].
        seconds: Time that it took [s].
    """

    key: str
    title: str
    conditions: str
    findings: tuple[str, ...]
    files: tuple[str, ...]
    example: str
    distance: float
    seconds: float


def stem(key: str) -> str:
    """Return how the files of a figure start: fig05, models, roll_rate."""
    return f'fig{int(key):02d}' if key.isdigit() else key


def picture(key: str, kind: str, look: Look) -> str:
    """Return the name of a picture."""
    return f'{stem(key)}{"_dark" if look is DARK else ""}.{kind}'


def write(
    module: ModuleType, folder: Path, formats: Sequence[str], looks: Sequence[Look]
) -> Written:
    """Compute a figure and write its pictures and its CSV.

    Raises:
        OSError: The system refuses.
    """
    started = time.perf_counter()
    data = module.compute()
    files = [f'{stem(module.KEY)}.csv']
    write_whole(folder / files[0], module.table(data).encode())
    for look in looks:
        figure = module.plot(data, look)
        for kind in formats:
            files.append(picture(module.KEY, kind, look))
            write_whole(folder / files[-1], style.image(figure, kind, look))
    example = module.example(data)
    return Written(
        module.KEY,
        module.TITLE,
        ' '.join(module.CONDITIONS.split()),
        tuple(module.findings(data)),
        tuple(files),
        example.label,
        crosscheck.largest_distance(example.flight),
        time.perf_counter() - started,
    )


def main(module: ModuleType, arguments: list[str] | None = None) -> int:
    """Write one figure alone: `python -m disc_sim_ros.paper.fig05_typical_flight`."""
    parser = argparse.ArgumentParser(description=module.__doc__)
    parser.add_argument('folder', nargs='?', default='paper_figures', help='where to write')
    folder = Path(parser.parse_args(arguments).folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = write(module, folder, FORMATS, (LIGHT, DARK))
    print('\n'.join((written.title, written.conditions, *written.findings, *written.files)))
    return 0
