"""Error control suits every flight; a refused sweep leaves nothing."""

import pytest

from disc_sim_ros.cli import optimise, sweep


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
def test_sweep_flies_the_extremes(arguments, tmp_path, capsys):
    assert sweep.main([*arguments, '--duration', '1', '--output', str(tmp_path / 'a.csv')]) == 0
    assert 'lost' not in capsys.readouterr().out


def test_optimise_flies_without_a_step(capsys):
    flags = ('--speed', '100', '--air-density', '20', '--duration', '2')
    assert optimise.main([*flags, '--seed', '1']) == 0
    assert '--step' not in capsys.readouterr().out


def test_a_refused_sweep_leaves_nothing(tmp_path, capsys):
    path = tmp_path / 'a.csv'
    words = ['--scatter', 'C_Mq=100', '--count', '100', '--output', str(path)]
    with pytest.raises(SystemExit) as end:
        sweep.main([*words, '--step', '0.01'])
    assert end.value.code == 2
    assert 'needs at most' in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert sweep.main(words) == 0, 'the name is free'
