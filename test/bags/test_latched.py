"""Each file of a split bag can begin with the latched messages of before."""

import gc
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

from mcap.reader import make_reader
import pytest
from rosbags.rosbag2 import Reader
import yaml
import zstandard

from bags.making import ODOMETRIES, ODOMETRY, START, STEP, STRING, everything, text, topic
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.topic import Qos
from disc_sim_ros.bags.writer import BagWriter

LATCHED = Qos(durability='transient_local', depth=1)


def write(folder: Path, count: int, **options) -> BagWriter:
    """/configuration, latched, once, and again at 150; /static of two publishers; /odom always."""
    with BagWriter(folder, repeat_latched=True, **options) as bag:
        about = bag.add(topic('/configuration', STRING, LATCHED))
        static = bag.add(topic('/static', STRING, LATCHED, LATCHED, Qos()))
        odom = bag.add(topic('/odom', ODOMETRY, Qos()))
        plain = bag.add(topic('/plain', STRING, Qos()))
        bag.write(about, text('first'), START, START - 100)
        bag.write(static, text('a'), START, START - 90)
        bag.write(static, text('b'), START, START - 80)
        bag.write(plain, text('not latched'), START, START)
        for n in range(count):
            bag.write(odom, ODOMETRIES[n % 500], START + n * STEP, START)
            if n == 150:
                bag.write(about, text('second'), START + n * STEP, START + 7)
    return bag


def expected(count: int) -> list[tuple]:
    messages = [
        ('/configuration', START, START - 100, text('first')),
        ('/static', START, START - 90, text('a')),
        ('/static', START, START - 80, text('b')),
        ('/plain', START, START, text('not latched')),
    ]
    for n in range(count):
        messages.append(('/odom', START + n * STEP, START, ODOMETRIES[n % 500]))
        if n == 150:
            messages.append(('/configuration', START + n * STEP, START + 7, text('second')))
    return messages


def test_each_further_file_begins_with_the_latched_messages(tmp_path):
    bag = write(tmp_path / 'bag', 400, max_duration=0.1)
    assert len(bag.files) == 4
    for number, path in enumerate(bag.files):
        first = START + number * 100 * STEP
        alone = open_bag(path)
        assert alone.complete
        assert alone.start == first  # the original log times would make the file a long one
        got = [(m.topic, m.log_time, m.publish_time, m.data) for m in alone.raw()]
        latest = ('first', START - 100) if number < 2 else ('second', START + 7)
        assert got[:3] == [
            ('/configuration', first, latest[1], text(latest[0])),
            ('/static', first, START - 90, text('a')),
            ('/static', first, START - 80, text('b')),
        ]
        assert sum(m[0] == '/plain' for m in got) == (number == 0)
        assert sum(m[0] == '/odom' for m in got) == 100


def test_the_whole_bag_has_each_message_once(tmp_path):
    bag = write(tmp_path / 'bag', 400, max_duration=0.1)
    opened = open_bag(tmp_path / 'bag')
    assert opened.complete
    assert everything(opened) == expected(400)
    counts = {'/configuration': 2, '/static': 2, '/odom': 400, '/plain': 1}
    assert {t.name: t.message_count for t in opened.topics} == counts
    assert bag.counts == counts
    assert bag.message_count == opened.message_count == 405
    # metadata.yaml counts what is in the files, as other readers do.
    root = yaml.safe_load((tmp_path / 'bag/metadata.yaml').read_text(encoding='utf-8'))
    assert root['rosbag2_bagfile_information']['message_count'] == 405 + 9
    with Reader(tmp_path / 'bag') as reader:
        assert reader.message_count == sum(1 for _ in reader.messages()) == 405 + 9


def test_repeats_stay_repeats_in_a_repaired_bag(tmp_path):
    write(tmp_path / 'bag', 400, max_duration=0.1)
    path = tmp_path / 'bag/bag_1.mcap'
    path.write_bytes(path.read_bytes()[:-60])  # written anew; the others are copied
    report = repair(tmp_path / 'bag', tmp_path / 'made')
    assert report.message_count == 405 + 9
    assert everything(open_bag(tmp_path / 'made')) == expected(400)
    with (tmp_path / 'made/made_1.mcap').open('rb') as file:
        assert next(make_reader(file).iter_messages())[1].topic == '/configuration'


def test_repeats_of_compressed_files_are_left_out(tmp_path):
    write(tmp_path / 'bag', 400, max_duration=0.1)
    for path in (tmp_path / 'bag').glob('*.mcap'):
        packed = zstandard.ZstdCompressor().compress(path.read_bytes())
        path.with_name(f'{path.name}.zstd').write_bytes(packed)
        path.unlink()
    bag = open_bag(tmp_path / 'bag')
    gc.collect()
    assert everything(bag) == expected(400)


def test_a_split_by_hand_repeats_when_the_next_message_comes(tmp_path):
    with BagWriter(tmp_path / 'bag', repeat_latched=True) as bag:
        about = bag.add(topic('/configuration', STRING, LATCHED))
        odom = bag.add(topic('/odom', ODOMETRY))
        bag.write(about, text('a'), 5, 5)
        bag.split()
        bag.write(odom, ODOMETRIES[0], 9, 9)
        bag.flush()
        assert bag.flushed == bag.message_count == 2
        bag.split()
    files = [open_bag(path) for path in bag.files]
    assert [f.message_count for f in files] == [1, 2, 0]
    assert [(m.topic, m.log_time) for m in files[1].raw()] == [('/configuration', 9), ('/odom', 9)]


def test_without_the_option_nothing_is_repeated(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        about = bag.add(topic('/configuration', STRING, LATCHED))
        bag.write(about, text('a'), 5, 5)
        bag.split()
        bag.write(about, text('b'), 9, 9)
    assert [open_bag(path).message_count for path in bag.files] == [1, 1]


def test_large_latched_messages_do_not_fill_small_files(tmp_path):
    with BagWriter(
        tmp_path / 'bag', repeat_latched=True, max_size=20_000, compression='none'
    ) as bag:
        small = bag.add(topic('/small', STRING, LATCHED))
        large = bag.add(topic('/large', STRING, LATCHED))
        odom = bag.add(topic('/odom', ODOMETRY))
        bag.write(small, text('a'), START, START)
        bag.write(large, text('x' * 30_000), START, START)
        for n in range(200):
            bag.write(odom, ODOMETRIES[n], START + n, START)
    assert 5 < len(bag.files) < 50  # not one for each message
    for path in bag.files[1:]:
        names = [m.topic for m in open_bag(path).raw()]
        assert names[0] == '/small'
        assert '/large' not in names
    assert open_bag(tmp_path / 'bag').message_count == 202


def test_a_publisher_that_becomes_known_later_is_repeated_as_well(tmp_path):
    with BagWriter(tmp_path / 'bag', repeat_latched=True) as bag:
        about = bag.add(topic('/configuration', STRING))
        bag.update(about, topic('/configuration', STRING, LATCHED))
        bag.write(about, text('a'), 5, 5)
        bag.update(about, topic('/configuration', STRING, LATCHED, LATCHED))
        bag.write(about, text('b'), 6, 6)
        bag.split()
        bag.write(about, text('c'), 9, 9)
    [_, second] = [open_bag(path) for path in bag.files]
    assert [m.data for m in second.raw()] == [text('a'), text('b'), text('c')]


@pytest.mark.parametrize('max_duration', [0.05, 0.2])
def test_sim_time_that_is_set_back_again_and_again_still_splits(tmp_path, max_duration):
    """Each round is shorter than a file may be, so that no log time ever ends a file."""
    with BagWriter(tmp_path / 'bag', max_duration=max_duration, flush_period=3600.0) as bag:
        odom = bag.add(topic('/odom', ODOMETRY))
        for _ in range(20):
            for n in range(40):
                bag.write(odom, ODOMETRIES[n], START + n * STEP, START)
            bag.flush()
    total = 20 * 0.04
    assert total / max_duration / 2 < len(bag.files) <= total / max_duration + 1
    assert open_bag(tmp_path / 'bag').message_count == 800


def test_a_killed_recorder_leaves_no_message_twice(tmp_path):
    """The kill may come between the repeated messages and the first new one."""
    code = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[1])!r})
from bags.test_latched import *
bag = BagWriter({str(tmp_path / 'bag')!r}, repeat_latched=True, flush_period=0.01)
about = bag.add(topic('/configuration', STRING, LATCHED))
odom = bag.add(topic('/odom', ODOMETRY))
bag.write(about, text('a' * 1000), 1, 1)
for n in range(10**6):
    bag.write(odom, ODOMETRIES[n % 500], 10 + n, n)
    if n % 20 == 0:
        bag.split()
        print(n, flush=True)
"""
    child = subprocess.Popen([sys.executable, '-c', code], stdout=subprocess.PIPE)
    for line in child.stdout:
        if int(line) >= 200:
            break
    time.sleep(0.013)
    os.kill(child.pid, signal.SIGKILL)
    child.communicate()
    for folder in ('bag', 'made'):
        got = everything(open_bag(tmp_path / folder))
        assert [m[0] for m in got].count('/configuration') == 1
        numbers = [m[2] for m in got if m[0] == '/odom']
        assert numbers == list(range(len(numbers)))
        if folder == 'bag':
            repair(tmp_path / 'bag', tmp_path / 'made')
    shutil.rmtree(tmp_path / 'bag')
