"""Pages of recorded flights: `analyse_bag --html`, also of recordings that lack values."""

from pathlib import Path
import re

import numpy as np
import pytest

from disc_sim_ros import Launch, Setup, fly, load_disc
from disc_sim_ros.cli import analyse_bag
from disc_sim_ros.physics.trajectory import Trajectory
from disc_sim_ros.units import SYSTEMS
from disc_sim_ros.view import shown
from view.test_page import data_of

pytest.importorskip('trimesh')
BAG = Path(__file__).parents[1] / 'data/recorded_by_0_1_0'
KNOWN = {'landed': True, 'wind_is_known': True, 'turns_with_spin': False}


@pytest.fixture(scope='module')
def trajectory():
    return fly(Launch(), Setup(disc=load_disc('frisbee')), sample_rate=200.0).trajectory


def test_analyse_bag_writes_a_page_of_each_flight(tmp_path, capsys):
    path = tmp_path / 'bag.html'
    assert analyse_bag.main([str(BAG), '--html', str(path)]) == 0
    captured = capsys.readouterr()
    assert captured.out.splitlines()[-1].startswith(f'wrote {path}, ')
    values = data_of(path.read_bytes())
    assert values['title'] == BAG.name
    heading = re.findall(r'flight (\d+):', captured.out)
    assert [t['name'].rpartition(' ')[2] for t in values['tracks']] == heading
    assert all(t['t'][-1] > 0.0 and t['t'] == sorted(t['t']) for t in values['tracks'])


def test_the_document_stays_alone_on_stdout(tmp_path, capsys):
    analyse_bag.main([str(BAG), '--json'])
    alone = capsys.readouterr().out
    analyse_bag.main([str(BAG), '--json', '--html', str(tmp_path / 'x.html')])
    assert capsys.readouterr().out == alone


def test_the_spin_angle_is_the_integral_of_the_spin(trajectory):
    rows = trajectory.rows.copy()
    rows[:, 14] = 0.0  # as in a bag
    recorded = shown.of_recording(Trajectory(rows, 0.275), 'x', '', **KNOWN)
    # The trapezoid rule at 200 Hz for a spin that falls by 3 % in 3.7 s.
    assert recorded.trajectory.spin_angle == pytest.approx(trajectory.spin_angle, abs=1e-4)


def test_an_attitude_that_turns_with_the_spin_is_not_turned_again(trajectory):
    turning = KNOWN | {'turns_with_spin': True}
    recorded = shown.of_recording(trajectory, 'x', '', **turning)
    assert not recorded.trajectory.spin_angle.any()


def test_a_recording_may_lack_values(trajectory):
    rows = trajectory.rows.copy()
    rows[5, 1:4] = np.nan
    rows[:, 7:14] = np.nan
    rows[:, 15:] = np.nan
    recorded = shown.of_recording(Trajectory(rows, 0.275), 'x', '', **KNOWN)
    values = shown.document(recorded, SYSTEMS['metric'])
    assert len(values['t']) == len(rows) - 1
    assert None not in values['position'] + values['attitude'] + values['spin']
    assert values['wind'] is None
    assert values['curves'][3] == [None] * (len(rows) - 1)


def test_a_recording_without_positions_is_refused(trajectory):
    rows = trajectory.rows.copy()
    rows[:, 1] = np.nan
    with pytest.raises(ValueError, match='no sample has a position'):
        shown.of_recording(Trajectory(rows, 0.275), 'x', '', **KNOWN)
