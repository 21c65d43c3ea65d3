"""What `predict` claims of throws that were not measured to the end, or with holes."""

import json

import pytest

from disc_sim_ros.cli import predict
from disc_sim_ros.estimation.prediction.prior import ThrowPrior
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from estimation.synthetic_throws import throw

RATE = 15.0  # Hz of the measurements
LATE = 1.0 / RATE + 1e-9  # s, at most from the last measurement to any time


@pytest.fixture(scope='module')
def flown():
    return throw(Setup(disc=load_disc('ultrastar')), ThrowPrior(), 10, rate=RATE)  # of 2.4 s


@pytest.fixture
def follow(flown, tmp_path, capsys):
    """Run `predict` on the measurements that are kept: text, and the document of the throw."""

    def run(keep):
        file = tmp_path / 'throw.csv'
        begin = flown.time[0]
        rows = [
            f'{t},{x},{y},{z}\n'
            for t, (x, y, z) in zip(flown.time, flown.position, strict=True)
            if keep(t - begin)
        ]
        file.write_text('t_s,x_m,y_m,z_m\n' + ''.join(rows))
        assert predict.main([str(file), '--disc-uncertainty', '0']) == 0
        text = capsys.readouterr().out
        assert predict.main([str(file), '--disc-uncertainty', '0', '--json']) == 0
        (document,) = json.loads(capsys.readouterr().out)['throws']
        return text, document

    return run


def test_a_throw_that_was_measured_to_the_end_has_misses(follow):
    text, document = follow(lambda _: True)
    assert document['to_the_landing']
    assert ', lands at ' in text
    assert 'miss m' in text
    assert 'nothing measured' not in text
    rows = document['predictions']
    assert all(r['miss_m'] == r['from_last_m'] for r in rows)
    assert all(r['watched_s'] - r['measured_until_s'] < LATE for r in rows)


def test_a_throw_that_was_measured_in_part_has_no_miss(follow, flown):
    """Its last prediction is not where it landed."""
    text, document = follow(lambda t: t < 1.02)
    assert not document['to_the_landing']
    rows = document['predictions']
    assert rows[-1]['from_last_m'] < 0.1  # of itself, so to say
    x, y = document['landing_m']
    assert abs(x - flown.landing[0]) + abs(y - flown.landing[1]) > 0.1  # m, off the landing
    assert {r['miss_m'] for r in rows} == {None}
    assert ', would land at ' in text
    assert 'lands at' not in text
    assert 'miss m' not in text
    assert ': no miss is known' in text


def test_a_prediction_that_is_older_than_its_row_is_told(follow):
    text, document = follow(lambda t: not 0.55 < t < 1.2)
    (row,) = (r for r in document['predictions'] if r['watched_s'] == 1.0)
    assert row['measured_until_s'] == pytest.approx(0.55, abs=LATE)
    assert text.count('nothing measured since') == 1
