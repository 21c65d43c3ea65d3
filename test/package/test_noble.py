"""With the versions of Ubuntu 24.04 and without numba and pyarrow it flies, sweeps and records."""

import csv
from importlib.metadata import distributions
import json
from pathlib import Path
import platform
import re
import sys

from packaging.utils import canonicalize_name
import pytest

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from made_once import made_once
from package import linked
from package.sources import PACKAGE, ROOT
from package.test_install import pip, run

pytestmark = [
    pytest.mark.xdist_group('install'),  # they share a wheel
    pytest.mark.skipif(
        sys.version_info[:2] != (3, 11) or platform.machine() != 'x86_64',
        reason='PyPI has wheels of these versions for Python 3.11 on x86-64 alone',
    ),
]
CONSTRAINTS = ROOT / 'test/package/noble.txt'
OPTIONAL = ('numba', 'llvmlite', 'pyarrow', 'dask')


@pytest.fixture(scope='session')
def noble(tmp_path_factory, wheel) -> Path:
    """Return an environment with exactly the versions of apt, and ROS.

    The packages of apt are installed once; the others are those of this environment. Python
    compiles what it imports, a fifth of what pip would compile here.
    """
    pytest.importorskip('rclpy')

    def install(folder: Path) -> None:
        linked.make(folder)
        wanted = ('--no-compile', '--no-deps', '-r', CONSTRAINTS)
        run(*pip(folder), 'install', *wanted, cwd=folder)

    content = CONSTRAINTS.read_bytes() + sys.version.encode()
    apt = made_once('noble', content, install)
    pinned = {canonicalize_name(line.partition('==')[0]) for line in pins()}
    folder = tmp_path_factory.mktemp('noble')
    prefix = folder / 'prefix'
    linked.make(prefix)
    linked.link(prefix, linked.requirements('jazzy') - pinned)
    linked.link(prefix, pinned, apt)
    wanted = ('--no-compile', '--no-index', '-c', CONSTRAINTS, f'{wheel}[jazzy]')
    run(*pip(prefix), 'install', *wanted, cwd=folder)
    return prefix


def pins() -> list[str]:
    return [line for line in CONSTRAINTS.read_text().splitlines() if '==' in line]


def test_the_versions_are_those_of_apt(noble):
    (site,) = (noble / 'lib').glob('python3*/site-packages')
    versions = {
        canonicalize_name(one.name): one.version for one in distributions(path=[str(site)])
    }
    wanted = dict(line.split('==') for line in pins())
    assert wanted
    assert {name: versions[canonicalize_name(name)] for name in wanted} == wanted
    assert PACKAGE.replace('_', '-') in versions
    assert not set(versions) & set(OPTIONAL)


def test_it_flies_as_compiled(noble, tmp_path):
    document = json.loads(run(noble / 'bin/fly', '--json', cwd=tmp_path))
    landed = fly(Launch(), Setup(disc=disc_file.load_disc('frisbee')))
    assert document['flight_time_s'] == pytest.approx(landed.time, rel=1e-12)


def test_it_sweeps_to_csv_and_names_what_parquet_needs(noble, tmp_path):
    some = ('--scatter', 'speed=1', '--count', '5', '--seed', '1')
    run(noble / 'bin/sweep', *some, cwd=tmp_path)
    with (tmp_path / 'sweep.csv').open(encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    assert [row['status'] for row in rows] == ['landed'] * 5
    assert len({row['speed_m_s'] for row in rows}) == 5
    run(noble / 'bin/sweep', *some, '--output', 'a.parquet', cwd=tmp_path, code=2)


@pytest.mark.ros
def test_a_node_flies_in_real_time_and_its_bag_is_verified(noble, tmp_path):
    # In plain Python steps of 1 ms take most of a core: on a machine under load messages are lost.
    short = ('--step', '0.005', '--height', '0.5', '--pitch', '-2')  # 0.6 s
    shown = run(noble / 'bin/demo', *short, cwd=tmp_path, HOME=str(tmp_path))
    assert re.search(r'recorded \d+ messages of \d+ topics, .*, nothing lost', shown), shown
    assert 'identical to the last bit' in shown
    assert len(list(tmp_path.glob('flights/*/flight.png'))) == 1
