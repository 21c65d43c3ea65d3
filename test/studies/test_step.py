"""A step that is not given suits every flight; a refused sweep leaves nothing."""

import pytest

from disc_sim_ros.cli import optimise, sweep
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.studies.flying import STEPS, good_step
from disc_sim_ros.studies.runner import collect
from disc_sim_ros.studies.scatter import Normal
from disc_sim_ros.studies.study import Study

SETUP = Setup(disc=load_disc('frisbee'), step=STEPS[-1])


@pytest.mark.parametrize(
    'arguments',
    [
        ('--vary', 'pitch=0:9:9', '--wind', '90', '90', '0', '--speed', '200'),
        ('--vary', 'spin=0:1000:500'),
        ('--vary', 'air_density=1,100'),
        ('--vary', 'pitching_factor=1,10', '--speed', '100'),
        ('--vary', 'inertia_diametral=0.00121,0.01'),
        ('--scatter', 'C_Mq=100', '--count', '20'),
        ('--scatter', 'speed=300', '--count', '20'),
    ],
    ids=lambda words: words[1],
)
def test_sweep_chooses_a_step_for_the_extremes(arguments, tmp_path, capsys):
    assert sweep.main([*arguments, '--duration', '1', '--output', str(tmp_path / 'a.csv')]) == 0
    assert 'lost' not in capsys.readouterr().out


def test_the_chosen_step_is_as_long_as_it_may_be():
    """The extremes together are a bound of every flight, and one step longer may be refused."""
    study = Study(setup=SETUP, vary={'C_Mq': (-1.0, -100.0)})
    step = good_step(SETUP, study.fastest_spin, study.fastest_rate)
    assert step < 1e-3
    fly_many({'C_Mq': -100.0}, Setup(disc=SETUP.disc, step=step), duration=0.1)
    longer = STEPS[STEPS.index(step) - 2]
    with pytest.raises(ConfigError, match='step'):
        fly_many({'C_Mq': -100.0}, Setup(disc=SETUP.disc, step=longer), duration=0.1)


def test_usual_throws_have_the_step_of_their_nutation():
    study = Study(setup=SETUP, scatter={'speed': Normal(1.0)}, count=10)
    step = good_step(SETUP, study.fastest_spin, study.fastest_rate)
    assert step == good_step(SETUP, study.fastest_spin)
    assert len(collect(study)['range_m']) == 10


def test_optimise_chooses_a_step_for_the_extremes(capsys):
    flags = ('--speed', '100', '--air-density', '20', '--duration', '2')
    assert optimise.main([*flags, '--seed', '1']) == 0
    assert '--step 0.0005' in capsys.readouterr().out


def test_a_refused_sweep_leaves_nothing(tmp_path, capsys):
    path = tmp_path / 'a.csv'
    words = ['--scatter', 'C_Mq=100', '--count', '100', '--output', str(path)]
    with pytest.raises(SystemExit) as end:
        sweep.main([*words, '--step', '0.01'])
    assert end.value.code == 2
    assert 'needs at most' in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert sweep.main(words) == 0, 'the name is free'
