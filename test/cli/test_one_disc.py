"""Programs that compute with one disc refuse another; the last one was taken without a word."""

import pytest

from disc_sim_ros.cli import demo, identify, optimise, sweep


@pytest.mark.parametrize('program', [demo, identify, optimise, sweep])
def test_a_second_disc_is_refused(program, capsys):
    words = ['throws.csv'] if program is identify else []
    with pytest.raises(SystemExit) as ended:
        program.parser().parse_args([*words, '--disc', 'wraith', '--disc', 'roc'])
    assert ended.value.code == 2
    line = capsys.readouterr().err
    assert line.endswith(": error: --disc: 'roc' is not allowed; give one disc\n")
    assert line.count('\n') == 1
    assert program.parser().parse_args([*words, '--disc', 'wraith']).disc == 'wraith'
