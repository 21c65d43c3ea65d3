"""SIGKILL, a full disk, a folder that goes away: what was flushed is there."""

import os
from pathlib import Path
import subprocess
import sys
import time

import numpy as np
import pytest
import yaml

from bags.making import everything
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError

RATE = 4000  # Hz
LONGEST_LOSS = 1.0  # s, what is promised
DEADLINE = 60.0  # s
NOISE = Topic(name='/noise', type='std_msgs/msg/String', definition='string data')


def start(folder: Path, max_size: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, Path(__file__).with_name('killed.py'), folder, '0.2', str(RATE)]
    return subprocess.Popen([*command, str(max_size)], stdout=subprocess.PIPE)


def wait_for(condition) -> None:
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_a_killed_writer_loses_at_most_a_second(tmp_path):
    rng = np.random.default_rng(3)
    runs = [(tmp_path / f'bag{n}', 10**9 if n % 2 else 400_000) for n in range(4)]
    for pair in (runs[:2], runs[2:]):
        children = [start(folder, max_size) for folder, max_size in pair]
        try:
            for folder, _ in pair:
                wait_for(lambda folder=folder: counted(folder) > 0)
            until = time.monotonic() + float(rng.uniform(0.0, 0.9))
            while time.monotonic() < until:  # at any moment it is whole
                for folder, _ in pair:
                    counted(folder)
        finally:
            for child in children:
                child.kill()
        for (folder, max_size), child in zip(pair, children, strict=True):
            flushed = int(child.communicate()[0].split()[-1])
            bag = open_bag(folder)
            got = everything(bag)
            # Between two files it is, for a moment.
            assert not bag.complete or max_size < 10**9
            assert len(got) >= flushed > 0
            assert [m[2] for m in got] == list(range(len(got)))  # none is missing in between
            taken = int.from_bytes(folder.with_name(f'{folder.name}.taken').read_bytes(), 'little')
            assert taken - bag.end < LONGEST_LOSS * 1e9
            report = repair(folder, folder.with_name(f'{folder.name} made'))
            made = open_bag(report.target)
            assert made.complete
            assert everything(made) == got


def counted(folder: Path) -> int:
    """The messages that metadata.yaml counts; it can be read at any moment."""
    try:
        text = (folder / 'metadata.yaml').read_text(encoding='utf-8')
    except FileNotFoundError:  # not started yet
        return 0
    return yaml.load(text, Loader=yaml.CSafeLoader)['rosbag2_bagfile_information']['message_count']


# ---- a full disk ----


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 3 MB."""
    folder = tmp_path / 'disk'
    folder.mkdir()
    command = ['mount', '-t', 'tmpfs', '-o', 'size=3m', 'tmpfs', str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, check=False, capture_output=True).returncode:
        pytest.skip('only root may mount a small disk')
    yield folder
    subprocess.run(['umount', '-l', str(folder)], check=True)


@pytest.mark.parametrize('max_size', [None, 500_000])
def test_a_full_disk_leaves_a_whole_bag(small_disk, max_size):
    bag = BagWriter(small_disk / 'bag', flush_period=0.01, max_size=max_size)
    noise = bag.add(NOISE)
    written = []

    def write_on() -> None:
        for n in range(20_000):
            bag.write(noise, os.urandom(725), 10**18 + n, n)
            written.append(n)

    with pytest.raises(BagError, match=r'No space left on device.* are kept.* lost') as caught:
        write_on()
    assert '\n' not in str(caught.value)
    with pytest.raises(BagError, match='No space left'):
        bag.write(noise, b'', 1, 1)
    bag.close()
    opened = open_bag(small_disk / 'bag')
    assert opened.complete
    assert [m[2] for m in everything(opened)] == list(range(opened.message_count))
    assert opened.message_count == bag.message_count
    assert bag.message_count + bag.lost == len(written) + 1
    assert opened.message_count > 2000  # of 3 MB, 725 bytes each, most is used
    assert counted(small_disk / 'bag') == opened.message_count


def test_the_disk_is_full_from_the_start(small_disk):
    command = ['dd', 'if=/dev/zero', f'of={small_disk / "filler"}', 'bs=4k']
    assert b'No space left' in subprocess.run(command, check=False, capture_output=True).stderr
    with pytest.raises(BagError, match='No space left on device'):
        BagWriter(small_disk / 'bag')
    assert not (small_disk / 'bag').exists()


def test_a_file_that_may_not_grow_stays_readable(tmp_path):
    """The system refuses even the end of the file, within a write."""
    code = f"""
import os, resource, signal, sys
from pathlib import Path
from disc_sim_ros.errors import BagError
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
bag = BagWriter(Path({str(tmp_path / 'bag')!r}), flush_period=0.01)
noise = bag.add(Topic(name='/noise', type='std_msgs/msg/String', definition='string data'))
resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, resource.RLIM_INFINITY))
try:
    for n in range(10_000):
        bag.write(noise, os.urandom(725), 10**18 + n, n)
except BagError as error:
    print(error)
try:
    bag.close()
except BagError as error:
    print(error)
print(bag.message_count)
"""
    done = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=True, timeout=DEADLINE
    )
    *errors, count = done.stdout.splitlines()
    assert 'File too large' in errors[0]
    opened = open_bag(tmp_path / 'bag')
    assert opened.message_count == int(count) > 0  # all but the chunk that opened no room
    assert [m[2] for m in everything(opened)] == list(range(int(count)))
    assert counted(tmp_path / 'bag') == int(count)


def test_a_folder_that_goes_away_is_named(tmp_path):
    bag = BagWriter(tmp_path / 'bag', flush_period=3600.0)
    noise = bag.add(NOISE)
    bag.write(noise, b'a', 1, 1)
    (tmp_path / 'bag').rename(tmp_path / 'elsewhere')
    with pytest.raises(BagError, match=r'bag_0\.mcap: .*the folder has been removed'):
        bag.flush()
    with pytest.raises(BagError, match='the folder has been removed'):
        bag.close()
    assert everything(open_bag(tmp_path / 'elsewhere')) == [('/noise', 1, 1, b'a')]
