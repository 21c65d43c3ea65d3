"""CSV files of `identify` and of a TechDisc, flight numbers: refused in one line, or usable."""

import random
import re

import flown
import scratch

from disc_sim_ros.analysis import techdisc
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation import throw_csv
from disc_sim_ros.estimation.identification import measured
from disc_sim_ros.estimation.prediction import replay
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup

NAME = 'throw_files'
WORDS = (
    'throw', 't_s', 'x_m', 'y_m', 'z_m', 'qx,qy,qz,qw', 'p_rad_s,q_rad_s,r_rad_s',
    'fx_m_s2,fy_m_s2,fz_m_s2', 'speedMph', 'speedKmh', 'speedMps', 'spinRpm', 'launchAngle',
    'noseAngle', 'hyzerAngle', 'wobbleAngle', 'throwType', 'rhbh', 'forehand', '11/5/-1/3', '/',
    'nan', 'inf', '1e308', '-1e-308', '1_0', '"', '""', '\x00', '\ufeff', ',', '#',
)  # fmt: skip
_NUMBERS = (
    '', '0', '-0', '1', '-1', '1e308', '-1e308', '5e-324', 'nan', 'inf', '9e9', '\u0661', '1_0',
)  # fmt: skip
_NUMBER = re.compile(r'-?\d+(\.\d+)?')
_DISC = disc_file.load_disc('frisbee')
_FILE = scratch.folder() / 'throws.csv'


def seeds() -> list[bytes]:
    """Return one valid text of each kind and more, each after a byte that names its kind."""
    times = [k / 50 for k in range(40)]
    flat = ''.join(f'{t},{14 * t:.3f},{0.1 * t:.3f},{1 + 3 * t - 3 * t * t:.3f}\n' for t in times)
    rows = ''.join(
        f'{name},{t},{14 * t:.3f},0,1,0,0,0,1,0.5,-0.5,31.4,0.1,0.2,-9\n'
        for name in ('a', 'b') for t in times
    )  # fmt: skip
    head = 'throw,t_s,x_m,y_m,z_m,qx,qy,qz,qw,p_rad_s,q_rad_s,r_rad_s,fx_m_s2,fy_m_s2,fz_m_s2\n'
    sensor = 'speedMph,spinRpm,launchAngle,noseAngle,hyzerAngle,wobbleAngle,throwType\n'
    sensor += '60.1,1150,8.2,-1.5,12,3.1,backhand\n55,-1050,12,0,-20,,rhfh\n'
    texts = [(0, f't_s,x_m,y_m,z_m\n{flat}'), (0, head + rows), (1, sensor), (2, '11/5/-1/3')]
    return [bytes([kind]) + text.encode() for kind, text in texts]


def one(data: bytes) -> None:
    """Read one text as the programs read it, and use what is accepted."""
    if not data:
        return
    try:
        (_measured, _sensor, _numbers)[data[0] % 3](data[1:])
    except ConfigError as error:
        if '\n' in str(error):
            raise AssertionError(f'not one line: {error}') from None


def _measured(data: bytes) -> None:
    _FILE.write_bytes(data)
    throws = throw_csv.read(_FILE).throws
    for name, columns in throws.items():
        kept = {kind: values for kind, values in columns.items() if kind != 'acceleration'}
        throw = measured.throw_from(name, kept, _DISC, measured.Instruments(9.81, 8.0))
        if not throw.observations:
            raise AssertionError(f'{name}: a throw without a measurement')
        replay.measurements_of(name, columns)


def _sensor(data: bytes) -> None:
    _FILE.write_bytes(data)
    for throw in techdisc.throws(_FILE)[:5]:
        launch = throw.release.launch(_DISC, 1.0)
        flown.fly_on(Setup(disc=_DISC), launch.state())


def _numbers(data: bytes) -> None:
    text = data.decode(errors='replace')
    if '\x00' in text or text.endswith(('.yaml', '.yml')):
        return  # the name of a file
    disc = disc_file.load_disc(text)
    if disc_file.disc_document(
        disc_file.disc_from_document(disc.name, disc_file.disc_document(disc))
    ) != disc_file.disc_document(disc):
        raise AssertionError('the document of a disc makes another disc')


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Change numbers, cells and lines of a text."""
    text = data[1:].decode(errors='replace')
    for _ in range(rng.randint(1, 3)):
        places = list(_NUMBER.finditer(text))
        what = rng.random()
        if places and what < 0.6:
            place = rng.choice(places)
            new = rng.choice(_NUMBERS) if rng.random() < 0.7 else str(rng.uniform(-2e3, 2e3))
            text = text[: place.start()] + new + text[place.end() :]
        else:
            lines = text.split('\n')
            at = rng.randrange(len(lines))
            if what < 0.7:
                lines.insert(at, rng.choice(lines))
            elif what < 0.8:
                del lines[at]
            elif what < 0.9:
                cells = lines[at].split(',')
                rng.shuffle(cells)
                lines[at] = ','.join(cells)
            else:
                lines[at] += rng.choice((',', '"', '1' * 140_000, ' ', '\r', '\x00'))
            text = '\n'.join(lines)
    return data[:1] + text.encode(errors='surrogateescape')
