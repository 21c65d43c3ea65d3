"""The sample bag is small, complete, flies again bit for bit, and its page lists its topics."""

import json
import re

from rosbags.highlevel import AnyReader

from disc_sim_ros.cli import analyse_bag
from package.sources import ROOT

BAG = ROOT / 'samples/fig5'
PAGE = (ROOT / 'docs/sample_bag.md').read_text(encoding='utf-8')
LARGEST = 300_000  # bytes


def test_it_is_small():
    assert sum(path.stat().st_size for path in BAG.iterdir()) <= LARGEST


def test_it_flies_again_to_the_last_bit(capsys):
    assert analyse_bag.main([str(BAG), '--verify', '--json']) == 0
    (flight,) = json.loads(capsys.readouterr().out)['discs'][0]['flights']
    assert flight['verification']['re_flight']['exact'] is True


def test_an_independent_reader_counts_what_the_page_lists():
    rows = re.findall(r'^\| (`/.*?) \| (.*?) \|', PAGE, re.MULTILINE)
    listed = {
        topic: {int(n) for n in re.findall(r'\d+', count)}
        for names, count in rows
        for topic in re.findall(r'`(/\w+)`', names)
    }
    with AnyReader([BAG]) as reader:
        counts = {topic: info.msgcount for topic, info in reader.topics.items() if info.msgcount}
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
    assert set(counts) == set(listed)
    assert {t: n for t, n in counts.items() if n not in listed[t]} == {}
