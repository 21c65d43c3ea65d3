"""What `repair_bag` claims of a bag: "whole" and "lost nothing" only where that is known."""

from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest

from bags.making import everything
from disc_sim_ros.analysis.bag_analysis import doubts_of
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter

A, B = (
    Topic(name=name, type='std_msgs/msg/String', definition='string data') for name in ['/a', '/b']
)
COUNT = 600


@pytest.fixture
def bag(tmp_path):
    """A bag of two topics in several files."""
    folder = tmp_path / 'bag'
    with BagWriter(folder, max_size=20_000, compression='none') as writer:
        ids = [writer.add(topic) for topic in (A, B)]
        for n in range(COUNT):
            writer.write(ids[n % 2], bytes(200), n + 1, n + 1)
    assert len(files(folder)) > 3
    return folder


def files(folder: Path) -> list[Path]:
    return sorted(folder.glob('*.mcap'), key=lambda path: int(path.stem.rpartition('_')[2]))


def edit(folder: Path, old: str, new: str, which: int = 0) -> None:
    """Replace one occurrence of a text in metadata.yaml."""
    path = folder / 'metadata.yaml'
    parts = path.read_text().split(old)
    path.write_text(old.join(parts[: which + 1]) + new + old.join(parts[which + 1 :]))


def test_a_bag_in_which_nothing_is_wrong_is_whole(bag, tmp_path):
    report = repair(bag, tmp_path / 'made')
    assert report.was_whole
    assert report.unknown == report.losses == ()
    assert 'the bag was whole' in report.summary()


def test_of_a_killed_recorder_it_says_that_the_end_is_not_known(tmp_path):
    """The messages of the last moment were in its memory alone."""
    folder = tmp_path / 'killed'
    program = Path(__file__).with_name('killed.py')
    child = subprocess.Popen([sys.executable, program, folder, '0.5', '2000', '1000000000'])
    taken = Path(f'{folder}.taken')
    try:
        end = time.monotonic() + 60.0
        while not (folder / 'metadata.yaml').is_file() or not open_bag(folder).message_count:
            assert time.monotonic() < end
            time.sleep(0.01)
        time.sleep(0.1)  # less than the flush period
    finally:
        child.send_signal(signal.SIGKILL)
        child.wait()
    last = int.from_bytes(taken.read_bytes(), 'little')
    assert open_bag(folder).end < last  # so something was lost, and nothing on the disk tells it
    report = repair(folder, tmp_path / 'made')
    assert not report.was_whole
    assert report.losses == ()
    assert report.unknown == (
        'killed_0.mcap has no end: what was not on the disk when its recorder ended',
    )
    summary = report.summary()
    assert '  lost  nothing of what is there\n  not known: killed_0.mcap has no end' in summary


def test_without_metadata_the_number_of_files_is_not_known(bag, tmp_path):
    files(bag)[-1].unlink()
    (bag / 'metadata.yaml').unlink()
    report = repair(bag, tmp_path / 'made')
    assert not report.was_whole
    assert report.losses == ()
    assert report.unknown == ('without metadata.yaml: whether files followed the last',)
    assert '  lost  nothing\n' not in report.summary()
    files(bag)[0].unlink()  # it had a number, but how much was in it is not known
    report = repair(bag, tmp_path / 'made again')
    assert '  lost  an unknown amount\n    bag_0.mcap: the file is missing' in report.summary()


@pytest.mark.parametrize(
    'changes',
    [
        [
            ('message_count: 300', 'message_count: 301', 0),
            ('message_count: 300', 'message_count: 299', 0),
        ],
        [('type: std_msgs/msg/String', 'type: std_msgs/msg/Bool', 0)],
    ],
    ids=['counts', 'type'],
)
def test_a_bag_whose_metadata_disagrees_with_its_files_is_not_whole(bag, tmp_path, changes):
    """Also where the sum of its counts is right."""
    for change in changes:
        edit(bag, *change)
    opened = open_bag(bag)
    assert opened.message_count == COUNT
    assert not opened.complete
    report = repair(bag, tmp_path / 'made')
    assert not report.was_whole
    assert 'mended: metadata.yaml was missing, or not that of these files' in report.summary()
    made = open_bag(tmp_path / 'made')
    assert made.complete
    assert everything(made) == everything(opened)
    assert {info.name: (info.type, info.message_count) for info in made.topics} == {
        '/a': ('std_msgs/msg/String', 300),
        '/b': ('std_msgs/msg/String', 300),
    }


def test_a_repaired_bag_still_says_what_was_lost(bag, tmp_path):
    """The copy is complete; that messages were lost is a doubt of its flights all the same."""
    lost = files(bag)[1]
    lost.unlink()
    report = repair(bag, tmp_path / 'made')
    assert len(report.losses) == 1
    made = open_bag(tmp_path / 'made')
    assert made.complete
    assert made.custom_data['lost before the repair'] == str(report.losses[0])
    assert doubts_of(made) == (f'lost before the repair: {report.losses[0]}',)
    again = repair(tmp_path / 'made', tmp_path / 'again')
    assert again.was_whole
    assert open_bag(tmp_path / 'again').custom_data == made.custom_data
