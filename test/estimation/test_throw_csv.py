"""Files of throws as people and spreadsheets write them."""

import numpy as np
import pytest

from disc_sim_ros import csv_table
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation import throw_csv

HEAD = ('throw', 't_s', 'x_m', 'y_m', 'z_m')
ROWS = [(n, k / 10, k + 0.25, -k / 8, 1.5) for n in (1, 2) for k in range(4)]


def text(separator=',', *, comma=False, end='\n', head=HEAD) -> str:
    rows = [[str(x).replace('.', ',') if comma else str(x) for x in row] for row in ROWS]
    return ''.join(separator.join(line) + end for line in [head, *rows])


PLAIN = text()


def read(tmp_path, content: str, encoding: str = 'utf-8') -> throw_csv.MeasuredThrows:
    file = tmp_path / 'W\u00fcrfe im M\u00e4rz.csv'
    file.write_bytes(content.encode(encoding))
    return throw_csv.read(file)


@pytest.mark.parametrize(
    'content',
    [
        PLAIN,
        text(end='\r\n'),
        text(end='\r'),
        '\ufeff' + PLAIN,
        text(';'),
        text(';', comma=True, end='\r\n'),
        'sep=;\n' + text(';', comma=True),
        'sep=\t\n' + text('\t'),
        text('\t', comma=True),
        text(', '),
        text('  ,'),
        '# indoors\n\n' + PLAIN.replace('\n2,', '\n\n# the second\n2,'),
        PLAIN + ',,,,\n , ,,, \n',
        text(end=',,\n'),
        PLAIN.replace('1,0.0', '"1","0.0"'),
        text(';', comma=True).replace('1,25', '"1,25"'),
    ],
    ids=lambda content: ascii(content[:20]),
)
def test_a_file_reads_the_same_however_its_cells_are_separated(tmp_path, content):
    measured = read(tmp_path, content)
    assert measured.unread == ()
    assert list(measured.throws) == ['1', '2']
    for n, columns in measured.throws.items():
        t, position = columns['position']
        rows = np.array([row for row in ROWS if row[0] == int(n)])
        np.testing.assert_array_equal(t, rows[:, 1])
        np.testing.assert_array_equal(position, rows[:, 2:])


@pytest.mark.parametrize(
    ('content', 'message'),
    [
        (text(head=[name.upper() for name in HEAD]), r'did you mean t_s for T_S\?'),
        (
            text(head=('throw', 't_s', 'X_M', 'Y_M', 'Z_M')),
            'did you mean x_m for X_M, y_m for Y_M',
        ),
        (text(head=('throw', 't', 'x', 'y', 'z')), 'it needs a column t_s, the time in s$'),
        (
            text(head=('throw', 't_s', 'x_m', 'z_m', 'y')),
            'position needs x_m, y_m, z_m: it has no y_m',
        ),
        (text(head=('throw', 't_s', 'qx', 'qy', 'qz')), 'attitude needs .* it has no qw'),
        (text(head=('throw', 't_s', 'x_m', 'y_m', 'x_m')), 'name each column once'),
        (text(comma=True), 'line 2: .* semicolons between the cells'),
        (PLAIN.replace('2,0.1', ',0.1'), "line 7: throw: '' .* name"),
        (text(';', comma=True).replace('3,25', '1.003,25'), "line 5: x_m: '1.003,25' .* finite"),
        (PLAIN.replace('1,0.2', '1,1_2'), "line 4: t_s: '1_2' .* finite number, or nothing"),
        (PLAIN.replace('1,0.2', '1,nan'), "line 4: t_s: 'nan' .* finite number, or nothing"),
        (PLAIN.replace('1,0.2', '1,"0.2'), "line 4: '2 cells' .* has 5"),
        ('1,0.2\n', 'it needs a column t_s'),
        (PLAIN.splitlines()[0], 'no row has a measurement'),
        ('# nothing\n', 'the file is empty'),
    ],
)
def test_a_file_that_cannot_be_read_is_refused_in_one_line(tmp_path, content, message):
    with pytest.raises(ConfigError, match=message) as refused:
        read(tmp_path, content)
    assert '\n' not in str(refused.value)


def test_text_that_is_not_utf_8_is_refused(tmp_path):
    for encoding in ('utf-16', 'latin-1'):
        with pytest.raises(ConfigError, match='no text in UTF-8'):
            read(tmp_path, '# W\u00fcrfe\n' + PLAIN, encoding)


def test_columns_that_are_not_read_are_named(tmp_path):
    head = (*HEAD[:2], 'p_deg_s', *HEAD[2:])
    lines = [','.join(head)] + [','.join(map(str, (*r[:2], 7, *r[2:]))) for r in ROWS]
    measured = read(tmp_path, '\n'.join(lines))
    assert measured.unread == ('p_deg_s',)
    assert list(measured.throws['1']) == ['position']


def test_a_row_of_several_lines_is_named_by_its_first(tmp_path):
    file = tmp_path / 'notes.csv'
    file.write_text('a,b\n1,"two\nlines"\n# none\n\n3,4\n5\n', encoding='utf-8')
    table = csv_table.read(file, 'FILE')
    rows = table.rows()
    assert [next(rows), next(rows)] == [(2, ['1', 'two\nlines']), (6, ['3', '4'])]
    with pytest.raises(ConfigError, match=r"line 7: '1 cells' .* has 2"):
        next(rows)
