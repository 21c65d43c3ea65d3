"""A bad disc file is refused in one line that names file, key, value and what is allowed."""

import os
from pathlib import Path
import re

import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file
from physics.disc_files import COLUMNS, yaml_of

FRISBEE = yaml_of('frisbee')
AFTER = FRISBEE.count('\n') + 1  # the line that follows it
AFTER_C_MQ = FRISBEE[: FRISBEE.index('  C_Mq: -0.140')].count('\n') + 2
ROLL_MOMENT = """based_on: frisbee
spin_roll_moment:
  advance_ratio: [0, 1]
  alpha_deg: [-90, 0, 90]
  coefficient: [[0, 0, 0], [0, 0.1, 0]]
"""
TABLE = """based_on: frisbee
table:
  alpha_deg: [-90, 0, 90]
  CL: [0, 0.1, 0]
  CD: [1, 0.1, 1]
  CM: [0, 0, 0]
"""


def changed(text: str, old: str, new: str) -> str:
    assert text.count(old) == 1, f'{old!r} is {text.count(old)} times in the file'
    return text.replace(old, new)


def frisbee(old: str, new: str) -> str:
    return changed(FRISBEE, old, new)


def table(old: str, new: str) -> str:
    return changed(TABLE, old, new)


def roll_moment(old: str, new: str) -> str:
    return changed(ROLL_MOMENT, old, new)


def mass(value: str) -> str:
    return frisbee('mass_kg: 0.175', f'mass_kg: {value}')


def nested(levels: int, per_level: int, first: str, level: str) -> str:
    """Return anchors with aliases of anchors: a few lines that expand to very many values."""
    lines = [f'a0: &a0 {first}']
    for i in range(1, levels):
        aliases = ', '.join([f'*a{i - 1}'] * per_level)
        lines.append(f'a{i}: &a{i} {level.format(aliases)}')
    return '\n'.join(lines) + '\n'


REFUSED = {
    # keys
    'unknown key': (FRISBEE + 'colour: red\n', ["'colour'", 'unknown key', 'mass_kg, diameter_m']),
    'misspelt key': (frisbee('mass_kg:', 'mas_kg:'), ["'mas_kg'", 'did you mean mass_kg?']),
    'key without its unit': (frisbee('mass_kg:', 'mass:'), ["'mass'", 'did you mean mass_kg?']),
    'key of wrong case': (
        frisbee('C_Lp:', 'C_LP:'),
        ["damping.'C_LP'", 'did you mean C_Lp?', 'C_Lp, C_Mq, C_Nr'],
    ),
    'unknown key in a table': (TABLE + '  CN: [0, 0, 0]\n', ["table.'CN'", 'alpha_deg, CL, CD']),
    'number for a key': (FRISBEE + '5: 6\n', ['5', 'unknown key']),
    'list for a key': (FRISBEE + '? [a]\n: 6\n', [f'line {AFTER}', 'not a word']),
    'doubled key': (FRISBEE + 'mass_kg: 0.2\n', [f'line {AFTER}', 'repeated key mass_kg']),
    'doubled key in a section': (
        frisbee('  C_Mq: -0.140', '  C_Mq: -0.140\n  C_Mq: -0.140'),
        [f'line {AFTER_C_MQ}', 'repeated key C_Mq'],
    ),
    'no mass': (frisbee('mass_kg: 0.175', ''), ['mass_kg', 'the key is missing']),
    'no diameter': (frisbee('diameter_m: 0.275', ''), ['diameter_m', 'the key is missing']),
    'no inertia': (
        frisbee('inertia_axial_kg_m2: 2.4e-3', ''),
        ['inertia_axial_kg_m2', 'the key is missing'],
    ),
    'half a line': (frisbee('  CD_0: 0.085\n', ''), ['linear.CD_0', 'the key is missing']),
    'half a table': (
        'based_on: frisbee\ntable: {alpha_deg: [-90, 90], CL: [0, 0], CD: [1, 1]}\n',
        ['table.CM', 'the key is missing'],
    ),
    'half a spin table': (
        roll_moment('  advance_ratio: [0, 1]\n', ''),
        ['spin_roll_moment.advance_ratio', 'the key is missing'],
    ),
    'no aerodynamics at all': (
        'mass_kg: 1\ndiameter_m: 1\ninertia_axial_kg_m2: 0.1\ninertia_diametral_kg_m2: 0.1\n',
        ['aero', 'no coefficients'],
    ),
    # types
    'text for a number': (mass('heavy'), ['mass_kg', "'heavy'", '0.001 to 100 kg']),
    'quoted number': (mass('"0.175"'), ['mass_kg', "'0.175'", '0.001 to 100 kg']),
    'number with its unit': (mass('175 g'), ['mass_kg', "'175 g'", '0.001 to 100 kg']),
    'decimal comma': (mass('0,175'), ['mass_kg', "'0,175'", '0.001 to 100 kg']),
    'hexadecimal': (mass('0x10'), ['mass_kg', "'0x10'", '0.001 to 100 kg']),
    'underscore': (mass('1_0'), ['mass_kg', "'1_0'", '0.001 to 100 kg']),
    'sexagesimal': (mass('1:30'), ['mass_kg', "'1:30'", '0.001 to 100 kg']),
    'date': (mass('2007-01-01'), ['mass_kg', '2007', '0.001 to 100 kg']),
    'bool': (mass('true'), ['mass_kg', 'True', '0.001 to 100 kg']),
    'yes': (mass('yes'), ['mass_kg', 'True', '0.001 to 100 kg']),
    'null': (mass('null'), ['mass_kg', 'None', '0.001 to 100 kg']),
    'nothing': (mass(''), ['mass_kg', 'None', '0.001 to 100 kg']),
    'list': (mass('[0.175]'), ['mass_kg', '[0.175]', '0.001 to 100 kg']),
    'mapping': (mass('{g: 175}'), ['mass_kg', '175', '0.001 to 100 kg']),
    'number for a section': (
        'based_on: frisbee\ndamping: -1\n',
        ['damping', '-1', 'C_Lp, C_Mq, C_Nr'],
    ),
    'list for a section': ('based_on: frisbee\ntable: [1, 2]\n', ['table', 'alpha_deg, CL']),
    'null for a section': ('based_on: frisbee\nspin_side_force:\n', ['spin_side_force', 'None']),
    'number for a description': ('based_on: frisbee\ndescription: 5\n', ['description', 'text']),
    'escape in a description': (
        'based_on: frisbee\ndescription: "a\\e[2Jb"\n',
        ['description', 'control characters'],
    ),
    'unknown aero': ('based_on: frisbee\naero: tabel\n', ['aero', "'tabel'", 'table, linear']),
    'bool for aero': ('based_on: frisbee\naero: on\n', ['aero', 'True', 'table, linear']),
    'aero that the disc has not': (
        'based_on: wraith\naero: linear\n',
        ['aero', "'linear'", 'holds table'],
    ),
    'based on nothing known': ('based_on: ufo\n', ['based_on', "'ufo'", 'frisbee, ']),
    'based on a file': ('based_on: other.yaml\n', ['based_on', "'other.yaml'", 'frisbee, ']),
    'based on a list': ('based_on: [frisbee]\n', ['based_on', "['frisbee']", 'frisbee, ']),
    # values
    'nan': (mass('.nan'), ['mass_kg', 'nan', '0.001 to 100 kg']),
    'inf': (mass('.inf'), ['mass_kg', 'inf', '0.001 to 100 kg']),
    'minus inf': (mass('-.INF'), ['mass_kg', '-inf', '0.001 to 100 kg']),
    'too large for a float': (mass('1e400'), ['mass_kg', 'inf', '0.001 to 100 kg']),
    'many digits': (mass('9' * 5000), ['mass_kg', '0.001 to 100 kg']),
    'no mass to speak of': (mass('0'), ['mass_kg', '0', '0.001 to 100 kg']),
    'negative mass': (mass('-0.175'), ['mass_kg', '-0.175', '0.001 to 100 kg']),
    'negative diameter': (
        frisbee('diameter_m: 0.275', 'diameter_m: -1'),
        ['diameter_m', '-1', '0.01 to 5 m'],
    ),
    'negative area': ('based_on: frisbee\narea_m2: -1\n', ['area_m2', '-1', 'number > 0']),
    'zero inertia': (
        frisbee('inertia_diametral_kg_m2: 1.2e-3', 'inertia_diametral_kg_m2: 0'),
        ['inertia_diametral_kg_m2', '0', 'number > 0'],
    ),
    'impossible inertia': (
        frisbee('inertia_axial_kg_m2: 2.4e-3', 'inertia_axial_kg_m2: 2.5e-3'),
        ['inertia_axial_kg_m2', '0.0025', 'twice', '0.0024 kg m^2'],
    ),
    'positive damping': (
        frisbee('C_Mq: -0.140', 'C_Mq: 1.40'),
        ['damping.C_Mq', '1.4', '<= 0'],
    ),
    'nan for damping': (frisbee('C_Mq: -0.140', 'C_Mq: .nan'), ['damping.C_Mq', 'nan', 'finite']),
    'negative least drag': (
        frisbee('CD_0: 0.085', 'CD_0: -0.085'),
        ['linear.CD_0', '-0.085', '>= 0'],
    ),
    'negative induced drag': (
        frisbee('CD_alpha_per_rad2: 3.30', 'CD_alpha_per_rad2: -3.30'),
        ['linear.CD_alpha_per_rad2', '-3.3', '>= 0'],
    ),
    'text for a slope': (
        frisbee('CL_alpha_per_rad: 3.09', 'CL_alpha_per_rad: steep'),
        ['linear.CL_alpha_per_rad', "'steep'", 'finite number'],
    ),
    # tables
    'unsorted angles': (
        table('[-90, 0, 90]', '[-90, 90, 0]'),
        ['table.alpha_deg[2]', '0', 'ascend', '90'],
    ),
    'doubled angle': (
        table('[-90, 0, 90]', '[-90, -90, 90]'),
        ['table.alpha_deg[1]', '-90', 'ascend'],
    ),
    'one row': (table('[-90, 0, 90]', '[0]'), ['table.alpha_deg', '[0', 'at least 2']),
    'no row': (table('[-90, 0, 90]', '[]'), ['table.alpha_deg', '[]', 'at least 2']),
    'number for a column': (table('[-90, 0, 90]', '0'), ['table.alpha_deg', '0', 'a list']),
    'ragged column': (
        table('CL: [0, 0.1, 0]', 'CL: [0, 0.1]'),
        ['table.CL', '2 rows', 'alpha_deg has 3 rows'],
    ),
    'long column': (
        table('CM: [0, 0, 0]', 'CM: [0, 0, 0, 0]'),
        ['table.CM', '4 rows', 'alpha_deg has 3 rows'],
    ),
    'steep dive left out': (
        table('[-90, 0, 90]', '[-80, 0, 90]'),
        ['table.alpha_deg[0]', '-80', '-90 to 90'],
    ),
    'flat fall left out': (
        table('[-90, 0, 90]', '[-90, 0, 89.9]'),
        ['table.alpha_deg[-1]', '89.9', '-90 to 90'],
    ),
    'negative drag': (
        table('CD: [1, 0.1, 1]', 'CD: [1, -0.1, 1]'),
        ['table.CD[1]', '-0.1', '>= 0'],
    ),
    'text in a column': (
        table('CL: [0, 0.1, 0]', 'CL: [0, much, 0]'),
        ['table.CL[1]', "'much'", 'finite number'],
    ),
    'gap in a column': (
        table('CL: [0, 0.1, 0]', 'CL: [0, ~, 0]'),
        ['table.CL[1]', 'None', 'finite number'],
    ),
    'nan in a column': (
        table('CL: [0, 0.1, 0]', 'CL: [0, .nan, 0]'),
        ['table.CL[1]', 'nan', 'finite number'],
    ),
    'list in a column': (
        table('CL: [0, 0.1, 0]', 'CL: [0, [0.1], 0]'),
        ['table.CL[1]', '[0.1]', 'finite number'],
    ),
    # spin tables
    'spin table without no spin': (
        roll_moment('[0, 1]', '[0.5, 1]'),
        ['spin_roll_moment.advance_ratio[0]', '0.5', 'must be 0'],
    ),
    'spin table with negative spin': (
        roll_moment('[0, 1]', '[-1, 1]'),
        ['spin_roll_moment.advance_ratio[0]', '-1', 'must be 0'],
    ),
    'unsorted spin': (
        roll_moment('[0, 1]', '[0, -1]'),
        ['spin_roll_moment.advance_ratio[1]', '-1', 'ascend'],
    ),
    'unsorted angles of a spin table': (
        roll_moment('[-90, 0, 90]', '[90, 0, -90]'),
        ['spin_roll_moment.alpha_deg[1]', '0', 'ascend'],
    ),
    'moment without spin': (
        roll_moment('[[0, 0, 0]', '[[0, 0.1, 0]'),
        ['spin_roll_moment.coefficient[0]', '0.1', 'must be 0'],
    ),
    'spin table with too few rows': (
        roll_moment('[[0, 0, 0], [0, 0.1, 0]]', '[[0, 0, 0]]'),
        ['spin_roll_moment.coefficient', '2 rows of 3 numbers'],
    ),
    'ragged spin table': (
        roll_moment('[0, 0.1, 0]', '[0, 0.1]'),
        ['spin_roll_moment.coefficient[1]', '2 numbers', '2 rows of 3 numbers'],
    ),
    'flat spin table': (
        roll_moment('[[0, 0, 0], [0, 0.1, 0]]', '[0, 0.1]'),
        ['spin_roll_moment.coefficient[0]', '0', 'list'],
    ),
    'text in a spin table': (
        roll_moment('[0, 0.1, 0]', '[0, much, 0]'),
        ['spin_roll_moment.coefficient[1][1]', "'much'", 'finite number'],
    ),
    # files
    'open bracket': ('mass_kg: [1\n', ['line 2', 'YAML']),
    'tab': ('mass_kg: 1\n\tdiameter_m: 1\n', ['line 2', 'YAML']),
    'two colons': ('mass_kg: 1: 2\n', ['line 1', 'YAML']),
    'two documents': ('a: 1\n---\nb: 2\n', ['line 2', 'YAML']),
    'unknown alias': ('mass_kg: *a\n', ['line 1', 'YAML']),
    'Python object': ('mass_kg: !!python/object:os.system {}\n', ['line 1', 'YAML']),
    'impossible date': (mass('2007-13-45'), ['month', 'YAML']),
    'empty file': ('', ['None', 'keys and values']),
    'only comments': ('# a disc\n', ['None', 'keys and values']),
    'list for a file': ('- 1\n- 2\n', ['[1.0, 2.0]', 'keys and values']),
    'text for a file': ('frisbee\n', ["'frisbee'", 'keys and values']),
    'set for a file': ('!!set {mass_kg}\n', ['mass_kg', 'keys and values']),
    'zero byte': (b'mass_kg: \0\n', ['special characters', 'YAML']),
    'binary': (bytes(range(256)), ['not UTF-8 text']),
    'Latin-1': ('description: Schüssel\n'.encode('latin-1'), ['not UTF-8 text']),
    'UTF-16': (FRISBEE.encode('utf-16'), ['not UTF-8 text']),
    'large file': (FRISBEE + '#' * 200_000, ['at most 131072 bytes']),
    # malicious files
    'aliases of aliases': (nested(30, 9, '[lol]', '[{}]'), ["'a0'", 'unknown key']),
    'merges of merges': (nested(30, 9, '{k: 1}', '{{<<: [{}]}}'), ['line 2', '<<']),
    'list that holds itself': (mass('&a [*a]'), ['mass_kg', '0.001 to 100 kg']),
    'deep lists': ('[' * 20_000, ['nested too deep', 'YAML']),
    'deep mappings': ('{a: ' * 10_000, ['nested too deep', 'YAML']),
    'deep items': ('- ' * 20_000, ['nested too deep', 'YAML']),
    'endless sexagesimal': (mass('1:' * 50_000 + '1'), ['mass_kg', '0.001 to 100 kg']),
    'endless text': (mass('x' * 100_000), ['mass_kg', 'xxx', '0.001 to 100 kg']),
    'endless key': (FRISBEE + '? ' + 'x' * 100_000 + '\n: 1\n', ['xxx', 'unknown key']),
    'escape in a key': (FRISBEE + '"\\e[2J\\n": 1\n', [r'\x1b[2J\n', 'unknown key']),
}


def refusal(name: str) -> str:
    """Return the message of the refusal, after checks that it is short and safe on a terminal."""
    with pytest.raises(ConfigError) as error:
        disc_file.load_disc(name)
    message = str(error.value)
    assert message.isprintable(), 'one line, no control characters'
    assert len(message) < 400
    return message


@pytest.mark.timeout(60)  # each takes well below 1 s, or never ends
@pytest.mark.parametrize(('content', 'fragments'), REFUSED.values(), ids=REFUSED)
def test_a_bad_file_is_refused_with_file_key_value_and_what_is_allowed(
    user_file, content, fragments
):
    message = refusal(user_file(content))
    assert 'mine.yaml' in message
    for fragment in fragments:
        assert fragment in message


@pytest.mark.parametrize('key', re.findall(r'^(\w+): \d', FRISBEE, re.MULTILINE))
@pytest.mark.parametrize('value', ['0', '-1', '.nan', '.inf', 'x', 'false', '[]', ''])
def test_every_property_is_checked(user_file, key, value):
    text = re.sub(rf'^{key}: .*$', f'{key}: {value}', FRISBEE, flags=re.MULTILINE)
    assert f'mine.yaml: {key}: ' in refusal(user_file(text))


@pytest.mark.parametrize('key', ['C_Lp', 'C_Mq', 'C_Nr'])
@pytest.mark.parametrize('value', ['1e-9', '.nan', '-.inf', 'x', 'false', '[]', ''])
def test_every_damping_is_checked(user_file, key, value):
    text = f'based_on: frisbee\ndamping:\n  {key}: {value}\n'
    assert f'mine.yaml: damping.{key}: ' in refusal(user_file(text))


@pytest.mark.parametrize('column', COLUMNS)
@pytest.mark.parametrize('value', ['.nan', '-.inf', 'x', 'false', '[]', ''])
def test_every_column_is_checked(user_file, column, value):
    text = re.sub(rf'{column}: \[\S+,', f'{column}: [{value or "~"},', TABLE)
    assert f'mine.yaml: table.{column}[0]: ' in refusal(user_file(text))


@pytest.mark.parametrize(
    ('name', 'fragments'),
    [
        ('frisbe', ["'frisbe'", 'did you mean frisbee?', 'wraith', '.yaml']),
        ('', ["''", 'frisbee', '.yaml']),
        ('.yaml', ["'.yaml'", 'frisbee']),
        ('/', ["'/'", 'frisbee']),
        ('../discs/frisbee', ['discs/frisbee', 'frisbee_linear']),
        ('Frisbee', ["'Frisbee'", 'did you mean frisbee?']),
        ('frisbee_low_damping', ['it is called frisbee now', 'frisbee_as_printed']),
        ('nowhere.yaml', ["'nowhere.yaml'", 'cannot read it', 'No such file']),
        ('nowhere/mine.yaml', ['cannot read it', 'No such file']),
        ('a\nb\x1b[2J.yaml', [r'a\nb\x1b[2J.yaml', 'cannot read it']),
        ('a\0b.yaml', ['cannot read it']),
        ('x' * 300 + '.yaml', ['cannot read it', 'too long']),
        ('x' * 100_000, ['xxx', 'frisbee']),
    ],
)
def test_a_missing_disc_is_refused(name, fragments):
    message = refusal(name)
    for fragment in fragments:
        assert fragment in message


def test_a_folder_is_refused(tmp_path):
    (tmp_path / 'mine.yaml').mkdir()
    assert 'not a file' in refusal(str(tmp_path / 'mine.yaml'))


@pytest.mark.timeout(60)  # reading it would wait for a writer
def test_a_pipe_is_refused(tmp_path):
    os.mkfifo(tmp_path / 'mine.yaml')
    assert 'not a file' in refusal(str(tmp_path / 'mine.yaml'))


@pytest.mark.timeout(60)  # reading it would fill the memory
def test_an_endless_device_is_refused(tmp_path):
    (tmp_path / 'mine.yaml').symlink_to('/dev/zero')
    assert 'not a file' in refusal(str(tmp_path / 'mine.yaml'))


def test_an_unreadable_file_is_refused(user_file):
    name = user_file(FRISBEE)
    Path(name).chmod(0)
    if os.access(name, os.R_OK):
        pytest.skip('this user may read everything')
    message = refusal(name)
    assert 'mine.yaml' in message
    assert 'Permission denied' in message


def test_a_bad_file_with_a_long_and_odd_name_is_refused_in_one_line(tmp_path):
    folder = tmp_path / ('x' * 200) / 'new\nline\x1b[2J'
    folder.mkdir(parents=True)
    (folder / 'mine.yaml').write_text(mass('-1'), encoding='utf-8')
    assert r'new\nline\x1b[2J/mine.yaml: mass_kg: -1' in refusal(str(folder / 'mine.yaml'))


def test_a_file_name_with_undecodable_bytes_gives_a_printable_name(tmp_path):
    path = tmp_path / os.fsdecode(b'disc\xff.yaml')
    path.write_text(FRISBEE, encoding='utf-8')
    assert disc_file.load_disc(str(path)).name == 'disc?'
