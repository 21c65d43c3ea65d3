"""`--units us` of every program prints what it prints in metric units, in feet, mph and rpm."""

import re

import pytest

from disc_sim_ros.cli import analyse_bag, fly, optimise, predict, sweep

FACTORS = {('m', 'ft'): 0.3048, ('m/s', 'mph'): 0.44704, ('rad/s', 'rpm'): 3.14159265359 / 30.0}
NUMBER = r'[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?'
METRIC = re.compile(rf'({NUMBER}) (m/s|rad/s|m)(?![\w/])')
US = re.compile(rf'({NUMBER}) (mph|rpm|ft)\b')
ROW = re.compile(rf'(?:range|drift|apex) +(m|ft)((?: +{NUMBER})+)')
WORDS = {
    fly: ('--wind', '3', '1', '0', '--turbulence', '5', '--seed', '1', '--height', '1.5'),
    sweep: ('--vary', 'pitch=0:20:5', '--scatter', 'speed=1', '--scatter', 'spin=2', '--count',
            '5', '--seed', '1'),
    optimise: ('--for', 'accuracy', '--target', '20', '3', '--scatter', 'speed=0.5', '--count',
               '5', '--seed', '1', '--pitch', '12', '--roll', '5', '--yaw', '-20'),
}  # fmt: skip


def lengths_and_rates(text, system):
    """Return each number of the text that has a unit, with it: (number, decimals, unit)."""
    lines = [line for line in text.splitlines() if not line.lstrip().startswith('wrote')]
    numbers = []
    for line in lines:
        pairs = (METRIC if system == 'metric' else US).findall(line)
        row = ROW.search(line)
        if row:
            pairs = [(number, row[1]) for number in row[2].split()]
        numbers += [(float(n), len(n.partition('.')[2]), unit) for n, unit in pairs]
    return numbers


def require_equal(metric, us):
    assert len(metric) == len(us) > 3
    for (a, a_digits, a_unit), (b, b_digits, b_unit) in zip(metric, us, strict=True):
        factor = FACTORS[a_unit, b_unit]
        rounding = 0.51 * (10.0**-a_digits + factor * 10.0**-b_digits)
        # A number in the form of `g` has six figures at most.
        assert a == pytest.approx(b * factor, abs=rounding, rel=1e-5)


@pytest.mark.parametrize('program', WORDS, ids=lambda p: p.__name__.rpartition('.')[2])
def test_the_numbers_are_the_same_in_both_systems(program, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    texts = {}
    for system in ('metric', 'us'):
        force = ('--output', f'{system}.csv') if program is sweep else ()
        assert program.main([*WORDS[program], *force, '--units', system]) == 0
        texts[system] = capsys.readouterr().out
    assert not METRIC.search(re.sub(r'(?m)^ *(wrote|again).*', '', texts['us']))
    require_equal(*(lengths_and_rates(text, system) for system, text in texts.items()))
    if program is sweep:  # data stay in SI units
        first, second = ((tmp_path / f'{name}.csv').read_bytes() for name in ('metric', 'us'))
        assert first == second


def test_a_bag_is_told_in_both_systems(tmp_path, capsys):
    bag = tmp_path / 'bag'
    assert fly.main([*WORDS[fly], '--duration', '0.5', '--bag', str(bag)]) == 0
    capsys.readouterr()
    texts = {}
    for system in ('metric', 'us'):
        assert analyse_bag.main([str(bag), '--units', system]) == 0
        texts[system] = capsys.readouterr().out
    assert not METRIC.search(texts['us'])
    require_equal(*(lengths_and_rates(text, system) for system, text in texts.items()))


def test_a_prediction_is_told_in_both_systems(tmp_path, capsys):
    short = ['--speed', '14', '--pitch', '-2', '--height', '1']  # of 1 s
    assert fly.main(['--bag', str(tmp_path / 'bag'), '--wind', '3', '1', '0', *short]) == 0
    capsys.readouterr()
    texts = {}
    for system in ('metric', 'us'):
        assert predict.main([str(tmp_path / 'bag'), '--units', system]) == 0
        texts[system] = capsys.readouterr().out
    numbers = [lengths_and_rates(text, system) for system, text in texts.items()]
    assert len(numbers[0]) == 4
    require_equal(*numbers)
    head = 'watched s   x ft     y ft     sigma x, y ft    miss ft'
    assert texts['us'].splitlines()[3].strip() == head
    rows = [[line.split() for line in text.splitlines()[4:-1]] for text in texts.values()]
    for metric, us in zip(*rows, strict=True):
        assert metric[0] == us[0]
        for a, b in zip(metric[1:], us[1:], strict=True):
            assert float(a) == pytest.approx(0.3048 * float(b), abs=0.007)  # both rounded
