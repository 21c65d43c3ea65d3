"""The page: the viewer of trimesh with three.js, our controls, and the flights, in one file."""

from collections.abc import Sequence
from html import escape
from importlib import resources
import json
from typing import Any

from disc_sim_ros.errors import DiscSimError, printable
from disc_sim_ros.palette import COLOURS
from disc_sim_ros.quantities import LAUNCH
from disc_sim_ros.threads import ctrl_c_waits
from disc_sim_ros.units import System
from disc_sim_ros.view import predicted
from disc_sim_ros.view.shown import MOST_SAMPLES, ShownFlight, curve_labels, document

TRIMESH = (5, 6)  # from and below: the page uses names of its viewer that are not promised
MOST_SAMPLES_OF_PAGE = 24_000  # of all flights together: 5 MB
# Forbids every request: the page works from a file, and nothing in it can ask a host.
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    'img-src data: blob:; connect-src data: blob:'
)
_BLACK = {'#000000': '#808080'}  # which a dark page would hide
_LIVE_POLICY = f"{_POLICY} 'self'"  # and the server of the page
_SCRIPTS = (
    'pose.js',
    'scene.js',
    'camera.js',
    'curves.js',
    'predicted.js',
    'live.js',
    'controls.js',
)
# Of the page of a running simulator: least and greatest value, and step.
_SLIDERS = {
    'speed': (5.0, 35.0, 0.5),
    'pitch': (-20.0, 45.0, 1.0),
    'roll': (-60.0, 60.0, 1.0),
    'yaw': (-45.0, 45.0, 1.0),
    'spin': (-150.0, 150.0, 1.0),
    'height': (0.0, 3.0, 0.1),
}


class ViewerMissingError(DiscSimError):
    """The package trimesh is missing, or is a version with another viewer."""


def page(flights: Sequence[ShownFlight], title: str, system: System) -> bytes:
    """Return a page of flights as the bytes of an HTML file that needs no other file.

    If the flights have predictions, it shows them beside the picture, and the miss as a curve.

    Args:
        flights: The flights, at least one; they start together at time 0. All of them have
            predictions, or none.
        title: Heading of the page.
        system: Units of all that people read.

    Raises:
        ViewerMissingError: trimesh is missing or has the wrong version.
        ValueError: There are no flights.
    """
    if not flights:
        raise ValueError('a page needs at least one flight')
    most = max(2, min(MOST_SAMPLES, MOST_SAMPLES_OF_PAGE // len(flights)))
    values = _head(title, system) | {
        'tracks': [document(flight, system, most) for flight in flights],
        'live': None,
    }
    if all(flight.predictions is not None for flight in flights):
        values['labels'] += [list(label) for label in predicted.curve_labels(system)]
        values['camera'] = 'field'
    return assembled(viewer(), title, values).encode()


def live_page(system: System) -> bytes:
    """Return the page that shows running simulators and has sliders to throw, see `ros.live`.

    Args:
        system: Units of all that people read; the sliders have those of `quantities.LAUNCH`.

    Raises:
        ViewerMissingError: trimesh is missing or has the wrong version.
    """
    sliders = [
        {
            'name': name,
            'unit': LAUNCH[name].unit.replace('degrees', '°'),
            'low': low,
            'high': high,
            'step': step,
            'value': LAUNCH[name].default,
        }
        for name, (low, high, step) in _SLIDERS.items()
    ]
    values = _head('Live view', system) | {'tracks': [], 'live': {'sliders': sliders}}
    return assembled(viewer(), 'Live view', values).encode()


def viewer() -> str:
    """Return the page of trimesh with its three.js and the shape of a disc of diameter 1.

    Raises:
        ViewerMissingError: trimesh is missing or has the wrong version.
    """
    wanted = f'trimesh {TRIMESH[0]} (pip install "trimesh>={TRIMESH[0]},<{TRIMESH[1]}")'
    with ctrl_c_waits():  # trimesh takes KeyboardInterrupt for a missing or unsuitable part
        try:
            import trimesh  # noqa: PLC0415 - optional
            from trimesh.viewer.notebook import scene_to_html  # noqa: PLC0415

            from disc_sim_ros.view import shape  # noqa: PLC0415 - imports trimesh
        except ImportError as error:
            raise ViewerMissingError(f'a page needs {wanted}: {error}') from None
        if not TRIMESH[0] <= int(str(trimesh.__version__).partition('.')[0]) < TRIMESH[1]:
            raise ViewerMissingError(f'a page needs {wanted}, not {trimesh.__version__}')
        return str(scene_to_html(shape.scene()))


def assembled(viewer_page: str, title: str, values: dict[str, Any]) -> str:
    """Return the page of trimesh with our style, controls, data and scripts in it."""
    data = json.dumps(values, allow_nan=False, separators=(',', ':')).replace('<', '\\u003c')
    policy = _LIVE_POLICY if values.get('live') else _POLICY
    head = (
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f'<title>{escape(printable(title))}</title><style>{_asset("page.css")}</style></head>'
    )
    scripts = '\n'.join(_asset(name) for name in _SCRIPTS)
    body = (
        f'{_asset("page.html")}<script type="application/json" id="flights">{data}</script>'
        f"<script>(() => {{'use strict';\n{scripts}\n}})();</script></body>"
    )
    start, _, rest = viewer_page.partition('<title>')
    _, title_end, rest = rest.partition('</title>')
    if not title_end or rest.count('</head>') != 1 or not rest.count('</body>'):
        raise ViewerMissingError('the page of trimesh has another form than expected')
    rest = rest.replace('</head>', head, 1)
    before, _, after = rest.rpartition('</body>')
    return before.join((start, body)) + after


def _head(title: str, system: System) -> dict[str, Any]:
    return {
        'title': title,
        'camera': 'follow',
        'units': {'length': system.length, 'speed': system.speed},
        'metresPerLength': 1.0 / system.number(1.0, 'm'),
        'metresPerSecondPerSpeed': 1.0 / system.number(1.0, 'm/s'),
        'colours': [_BLACK.get(colour, colour) for colour in COLOURS],
        'labels': [list(label) for label in curve_labels(system)],
    }


def _asset(name: str) -> str:
    return (resources.files(__package__) / 'assets' / name).read_text(encoding='utf-8')
