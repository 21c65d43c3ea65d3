"""`fly`: the files that it writes, completely or not at all."""

from collections.abc import Callable, Iterator
import errno
import os
from pathlib import Path
import signal
import subprocess
import sys
import threading
import xml.etree.ElementTree as ET

from matplotlib import image
import pytest

from cli.fly_command import ARRAYS, Result, refused, table_of
from disc_sim_ros.cli import output
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.physics import flight

pytestmark = pytest.mark.usefixtures('compiled')


@pytest.mark.parametrize(
    'arguments',
    [('--samples', 50), ('--samples', 7.7, '--speed', 0, '--height', 3)],
    ids=['numbers', 'no advance ratio at first'],
)
def test_the_csv_holds_the_numbers_of_the_document(fly, document, tmp_path, arguments):
    path = tmp_path / 'flight.csv'
    result = fly('--csv', path, *arguments)
    assert (result.code, result.err) == (0, '')
    head, rows = table_of(path)
    flown = document(*arguments)
    columns = {}
    for name, shape in ARRAYS.items():
        if shape:
            quantity, unit = name.split('_', 1)
            for i, axis in enumerate('xyz'):
                columns[f'{quantity}_{axis}_{unit}'] = [row[i] for row in flown[name]]
        else:
            columns[name] = flown[name]
    assert head == list(columns)
    assert rows == [list(row) for row in zip(*columns.values(), strict=True)]
    assert f'{path}, {len(rows)} rows' in result.out


def test_files_are_sampled_by_default(fly, tmp_path):
    fly('--csv', tmp_path / 'x.csv')
    _, rows = table_of(tmp_path / 'x.csv')
    assert [row[0] for row in rows] == [k / 100 for k in range(len(rows))]


def test_a_png_opens(fly, tmp_path):
    name = 'A.b c.PNG'
    result = fly('--plot', tmp_path / name)
    assert (result.code, result.err) == (0, '')
    assert str(tmp_path / name) in result.out
    with (tmp_path / name).open('rb') as file:
        pixels = image.imread(file, format='png')
    assert pixels.shape[:2] == (9 * 120, 11 * 120)
    assert pixels[..., :3].std() > 0.05  # something is drawn


def test_an_svg_is_xml(fly, tmp_path):
    fly('--plot', tmp_path / 'x.svg')
    assert ET.parse(tmp_path / 'x.svg').getroot().tag == '{http://www.w3.org/2000/svg}svg'


def test_a_pdf_is_one(fly, tmp_path):
    fly('--plot', tmp_path / 'x.pdf')
    content = (tmp_path / 'x.pdf').read_bytes()
    assert content.startswith(b'%PDF-')
    assert content.rstrip().endswith(b'%%EOF')


@pytest.mark.parametrize(
    'arguments',
    [
        ('--speed', 0),
        ('--speed', 0, '--spin', 0, '--gravity', 0, '--duration', 1),
        ('--samples', 0.001),
        ('--no-ground', '--duration', 10),
        ('--pitch', 90, '--roll', 180),
    ],
    ids=['lands at once', 'stays where it is', 'one sample', 'underground', 'straight up'],
)
def test_unusual_flights_can_be_drawn(fly, tmp_path, arguments):
    result = fly('--plot', tmp_path / 'x.png', *arguments)
    assert (result.code, result.err) == (0, '')
    assert (tmp_path / 'x.png').stat().st_size > 10_000


@pytest.mark.parametrize('ending', ['png', 'svg'])
def test_discs_with_unusual_names_can_be_drawn(fly, tmp_path, ending):
    """A dollar starts mathematics in matplotlib, and its font lacks some scripts."""
    name = os.fsdecode(b'$\\frac$ 100 % & <b>_^{ \xe9\xa3\x9b \xff')
    path = tmp_path / f'{name}.yaml'
    path.write_text('based_on: frisbee\n', encoding='utf-8')
    assert fly('--disc', path, '--plot', tmp_path / f'x.{ending}').code == 0


CSV = ('--samples', 10, '--csv')


@pytest.fixture(params=['--csv', '--plot'])
def write(request) -> Callable[..., tuple[object, ...]]:
    """Return the arguments that write a file, as CSV or as a plot; one function writes both."""
    return lambda path, *more: (request.param, path, '--samples', 10, *more)


@pytest.fixture
def old(tmp_path) -> Path:
    """Return an existing file; it ends in .png, so that --csv and --plot may write it."""
    path = tmp_path / 'flight.png'
    path.write_bytes(b'precious')
    return path


def test_an_existing_file_is_replaced_and_keeps_its_permissions(fly, write, old):
    old.chmod(0o640)
    assert fly(*write(old)).code == 0
    assert old.read_bytes() != b'precious'
    assert old.stat().st_mode & 0o777 == 0o640
    assert list(old.parent.iterdir()) == [old]


def test_a_new_file_has_the_permissions_of_any_new_file(fly, tmp_path):
    (tmp_path / 'other').touch()
    assert fly(*CSV, tmp_path / 'new.png').code == 0
    assert (tmp_path / 'new.png').stat().st_mode == (tmp_path / 'other').stat().st_mode


def test_a_linked_file_is_replaced_and_the_link_stays(fly, old, tmp_path):
    folder = tmp_path / 'links'
    folder.mkdir()
    (folder / 'link.png').symlink_to('../flight.png')
    assert fly(*CSV, folder / 'link.png').code == 0
    assert (folder / 'link.png').is_symlink()
    assert old.read_bytes() != b'precious'
    assert len(list(folder.iterdir())) == 1


def test_a_link_to_a_missing_file_creates_the_file(fly, tmp_path):
    (tmp_path / 'link.png').symlink_to('real.png')
    assert fly(*CSV, tmp_path / 'link.png').code == 0
    assert (tmp_path / 'link.png').is_symlink()
    assert (tmp_path / 'real.png').stat().st_size > 100


def test_a_relative_name_in_a_folder_with_spaces(fly, write, tmp_path, monkeypatch):
    folder = tmp_path / 'a folder'
    folder.mkdir()
    monkeypatch.chdir(folder)
    assert fly(*write('a flight.png')).code == 0
    assert [path.name for path in folder.iterdir()] == ['a flight.png']


def test_a_file_that_cannot_be_written_is_refused_before_the_flight(
    fly, write, tmp_path, monkeypatch
):
    monkeypatch.setattr(flight, 'fly', lambda *_, **__: pytest.fail('it flew'))
    (tmp_path / 'file').touch()
    (tmp_path / 'folder.png').mkdir()
    (tmp_path / 'circle.png').symlink_to('circle.png')
    for path, reason in (
        ('missing/x.png', 'missing does not exist'),
        ('file/x.png', 'file does not exist'),
        ('folder.png', 'this is a folder'),
        ('circle.png', 'circle'),
        ('x' * 300 + '.png', 'too long'),
    ):
        result = fly(*write(tmp_path / path))
        refused(result, f'{write("")[0]}: ', reason)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {'file', 'folder.png', 'circle.png'}


def test_a_read_only_folder_and_a_read_only_file_are_refused(fly, write, old, tmp_path):
    closed = tmp_path / 'closed'
    closed.mkdir()
    closed.chmod(0o555)
    old.chmod(0o444)
    if os.access(closed, os.W_OK):
        pytest.skip('this user may write everything')
    refused(fly(*write(closed / 'x.png')), 'no permission', str(closed))
    refused(fly(*write(old)), 'no permission', str(old))
    assert old.read_bytes() == b'precious'


def test_a_full_device_is_refused(fly):
    refused(fly('--csv', '/dev/full'), '--csv', "'/dev/full'", 'No space left')


@pytest.fixture
def full_disk(tmp_path) -> Iterator[Path]:
    """Mount a file system of 16 kB."""
    folder = tmp_path / 'disk'
    folder.mkdir()
    command = ['mount', '-t', 'tmpfs', '-o', 'size=16k', 'none', str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, check=False, capture_output=True).returncode:
        pytest.skip('mounting is not allowed')
    yield folder
    subprocess.run(['umount', str(folder)], check=True)


def test_a_full_disk_leaves_only_the_existing_file(fly, write, full_disk):
    old = full_disk / 'flight.png'
    old.write_bytes(b'precious')
    refused(fly(*write(old), '--samples', 500), 'No space left', 'flight.png')
    assert old.read_bytes() == b'precious'
    assert list(full_disk.iterdir()) == [old]


@pytest.mark.parametrize(
    'failure', [OSError(errno.ENOSPC, 'No space left on device'), KeyboardInterrupt()]
)
def test_a_write_that_fails_leaves_the_existing_file(fly, old, monkeypatch, failure):
    def fail(_: int) -> None:
        assert len(list(old.parent.iterdir())) == 2  # the older and the half-written new one
        raise failure

    monkeypatch.setattr(os, 'fsync', fail)
    result = fly(*CSV, old)
    if isinstance(failure, OSError):
        refused(result, 'No space left', 'flight.png')
    else:
        assert result == Result(130, '', '')
    assert old.read_bytes() == b'precious'
    assert list(old.parent.iterdir()) == [old]


def test_a_killed_program_leaves_the_existing_file(old):
    script = (
        'import os, sys\n'
        'from disc_sim_ros.cli import output\n'
        'os.fsync = lambda _: os.kill(os.getpid(), 9)\n'
        'output.write_whole("--csv", sys.argv[1], b"new" * 10_000)\n'
    )
    ended = subprocess.run([sys.executable, '-c', script, str(old)], check=False)
    assert ended.returncode == -signal.SIGKILL
    assert old.read_bytes() == b'precious'


def test_leftovers_of_a_killed_program_do_not_disturb_the_next_run(old, monkeypatch):
    """In a container each run may have the same process id."""
    monkeypatch.setattr(os, 'fsync', lambda _: (_ for _ in ()).throw(OSError(5, 'broken')))
    monkeypatch.setattr(Path, 'unlink', lambda *_, **__: None)
    for _ in range(2):
        with pytest.raises(DiscSimError, match='broken'):
            output.write_whole('--csv', str(old), b'new')
    monkeypatch.undo()
    assert len(list(old.parent.iterdir())) == 3
    output.write_whole('--csv', str(old), b'new')
    assert old.read_bytes() == b'new'


def test_a_file_name_of_the_greatest_length_can_be_written(tmp_path):
    path = tmp_path / ('x' * 251 + '.csv')
    output.write_whole('--csv', str(path), b'new')
    assert path.read_bytes() == b'new'


@pytest.mark.timeout(60)  # a pipe opened in the wrong order blocks forever
def test_a_named_pipe_takes_a_csv(fly, tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    received = []
    reader = threading.Thread(target=lambda: received.append((tmp_path / 'pipe').read_bytes()))
    reader.start()
    assert fly('--csv', tmp_path / 'pipe').code == 0
    reader.join()
    fly('--csv', tmp_path / 'x.csv')
    assert received == [(tmp_path / 'x.csv').read_bytes()]
    assert (tmp_path / 'pipe').is_fifo()
