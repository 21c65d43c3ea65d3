"""Arguments of a wrong type, as a script passes them by mistake: refused where they are given."""

from pathlib import Path

import numpy as np
import pytest

from disc_sim_ros import (
    BatchSimulator,
    ConfigError,
    FlightSimulator,
    Launch,
    Setup,
    Wind,
    fly,
    fly_many,
    load_disc,
)
from disc_sim_ros.estimation.prediction.predictor import Measurement

FRISBEE = Setup(disc=load_disc('frisbee'))


@pytest.mark.parametrize(
    ('call', 'message'),
    [
        (lambda: Setup(disc='frisbee'), r"disc: 'frisbee' .* load_disc\('frisbee'\)"),
        (lambda: Setup(disc=FRISBEE.disc, wind=(1.0, 0.0, 0.0)), r'wind: .* the type Wind'),
        (lambda: Setup(disc=FRISBEE.disc, air=1.2), r'air: 1.2 .* the type Air'),
        (lambda: fly({'speed': 18.0}, FRISBEE), r'launch: .* Launch\(speed'),
        (lambda: fly(Launch(), FRISBEE.disc), r'setup: .* the type Setup'),
        (lambda: fly_many([Launch()], FRISBEE), r'launches: .* give columns'),
        (lambda: fly_many({'speed': [17.0]}, None), r'setup: None .* the type Setup'),
        (lambda: FlightSimulator(FRISBEE, Launch()), r'release: .* the type State'),
        (lambda: FlightSimulator('exact', Launch().state()), r"setup: 'exact' .* the type Setup"),
        (lambda: BatchSimulator(FRISBEE.disc, 3), r'setup: .* the type Setup'),
        (lambda: Wind(mean=(1.0, 2.0)), r'wind: \(1.0, 2.0\) .* give 3 numbers'),
        (lambda: Wind(mean='calm'), r"wind: 'calm' .* give 3 numbers"),
        (lambda: Wind(mean=3.0), r'wind: 3 .* give 3 numbers'),
        (lambda: load_disc(11), r'disc: 11 .* give a text'),
        (lambda: Measurement(0.0, (1.0, 2.0)), r'measured position: .* give 3 numbers'),
        (lambda: Measurement(0.0, (1.0, 2.0, 3.0), (0.0, 1.0)), r'measured axis: .* 3 numbers'),
    ],
)
def test_an_argument_of_another_type_is_refused_in_one_line(call, message):
    with pytest.raises(ConfigError, match=f'^{message}') as refused:
        call()
    assert '\n' not in str(refused.value)
    assert len(str(refused.value)) < 300


def test_arrays_and_paths_are_taken(tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text('based_on: frisbee\n', encoding='utf-8')
    assert load_disc(Path(file)).mass == FRISBEE.disc.mass
    windy = Setup(disc=FRISBEE.disc, wind=Wind(mean=np.array([2.0, 1.0, 0.0])))
    same = Setup(disc=FRISBEE.disc, wind=Wind(mean=(2.0, 1.0, 0.0)))
    assert fly(Launch(), windy).end == fly(Launch(), same).end
    one, other = Measurement(0.0, (1.0, 2.0, 3.0)), Measurement(0.0, np.array([1.0, 2.0, 3.0]))
    assert one.position == tuple(other.position)
