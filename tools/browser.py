"""A Chromium without a window, driven through its pipe: for tests and recordings of pages.

The messages are those of the Chrome DevTools Protocol, JSON ended by a zero byte, on the file
descriptors 3 and 4 of the browser (`--remote-debugging-pipe`).
"""

import base64
from collections.abc import Iterator
from contextlib import contextmanager, suppress
import json
import os
from pathlib import Path
import select
import shutil
import signal
import subprocess
import tempfile
import time
from typing import Any, Self

PROGRAMS = ('chromium', 'chromium-browser', 'google-chrome')
MISSING = 'no Chromium (on Debian: apt install chromium)'
_FLAGS = (
    '--headless=new', '--no-sandbox', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync', '--disable-quic', '--disable-dev-shm-usage',
    '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist',
    '--hide-scrollbars', '--remote-debugging-pipe',
)  # fmt: skip
_DEADLINE = 60.0  # s for an answer


def program() -> str | None:
    """Return the path of a Chromium, or None; the environment variable CHROMIUM names another."""
    names = (os.environ.get('CHROMIUM', ''), *PROGRAMS)
    return next((path for name in names if name and (path := shutil.which(name))), None)


class BrowserError(Exception):
    """The browser ended, gave no answer in time, or refused a command."""


class Browser:
    """One page in a Chromium without a window.

    Attributes:
        problems: Errors and warnings of the console, exceptions and failed requests, since the
            last `show_as`.
        requests: Addresses that pages have asked for since then.
    """

    def __init__(
        self,
        width: int,
        height: int,
        *,
        phone: bool = False,
        dark: bool = False,
    ) -> None:
        path = program()
        if path is None:
            raise BrowserError(MISSING)
        self.problems: list[str] = []
        self.requests: list[str] = []
        self._number = 0
        self._rest = b''
        self._events: list[dict[str, Any]] = []
        self._folder = tempfile.mkdtemp(prefix='browser_')
        to_read, self._to = os.pipe()
        self._from, to_write = os.pipe()
        command = 'exec "$@" 3<&"$IN" 4>&"$OUT"'
        self._process = subprocess.Popen(  # noqa: S603 - a fixed command
            [
                '/bin/bash', '-c', command, 'sh', path, *_FLAGS,
                f'--user-data-dir={self._folder}', f'--window-size={width},{height}',
                'about:blank',
            ],
            pass_fds=(to_read, to_write),
            env={
                **os.environ, 'IN': str(to_read), 'OUT': str(to_write),
                'TMPDIR': self._folder,  # killed, it leaves the folder of its socket there
            },
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip
        os.close(to_read)
        os.close(to_write)
        self._session = ''
        try:
            self._attach()
            self.show_as(width, height, phone=phone, dark=dark)
        except BaseException:
            self.close()
            raise

    def _attach(self) -> None:
        target = next(
            t for t in self.send('Target.getTargets')['targetInfos'] if t['type'] == 'page'
        )
        attached = self.send('Target.attachToTarget', targetId=target['targetId'], flatten=True)
        self._session = attached['sessionId']
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            self.send(f'{domain}.enable')

    def show_as(
        self, width: int, height: int, *,
        phone: bool = False, dark: bool = False, still: bool = False,
    ) -> None:  # fmt: skip
        """Be a window of this size, or the screen of a phone; forget problems and requests.

        Args:
            width: Of the page [CSS px].
            height: Of the page [CSS px].
            phone: It is touched, and has four pixels for each of CSS.
            dark: The reader prefers dark pages.
            still: The reader prefers pages that do not move by themselves.
        """
        self.problems.clear()
        self.requests.clear()
        self.send(
            'Emulation.setDeviceMetricsOverride',
            width=width, height=height, deviceScaleFactor=2 if phone else 1, mobile=phone,
        )  # fmt: skip
        self.send('Emulation.setTouchEmulationEnabled', enabled=phone)
        scheme = {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}
        motion = {'name': 'prefers-reduced-motion', 'value': 'reduce' if still else ''}
        self.send('Emulation.setEmulatedMedia', features=[scheme, motion])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the browser and remove its folder."""
        with suppress(OSError):
            os.close(self._to)
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait(_DEADLINE)
        with suppress(OSError):
            os.close(self._from)
        deadline = time.monotonic() + _DEADLINE
        while Path(self._folder).exists() and time.monotonic() < deadline:
            # Its other processes write until the signal has reached them.
            shutil.rmtree(self._folder, ignore_errors=True)
            time.sleep(0.01)

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result.

        Raises:
            BrowserError: The browser refused, ended, or gave no answer in time.
        """
        self._number += 1
        message: dict[str, Any] = {'id': self._number, 'method': method, 'params': parameters}
        if self._session:
            message['sessionId'] = self._session
        os.write(self._to, json.dumps(message).encode() + b'\0')
        deadline = time.monotonic() + _DEADLINE
        while time.monotonic() < deadline:
            for answer in self._read(deadline):
                if answer.get('id') == self._number:
                    if 'error' in answer:
                        raise BrowserError(f'{method}: {answer["error"]["message"]}')
                    result: dict[str, Any] = answer['result']
                    return result
        raise BrowserError(f'{method}: no answer after {_DEADLINE:g} s')

    def _read(self, deadline: float) -> list[dict[str, Any]]:
        """Return the answers that have arrived; wait for bytes until the deadline."""
        while time.monotonic() < deadline:
            left = max(deadline - time.monotonic(), 0.0)
            if not select.select([self._from], [], [], left)[0]:
                break
            data = os.read(self._from, 1 << 20)
            if not data:
                raise BrowserError('the browser has ended')
            *whole, self._rest = (self._rest + data).split(b'\0')
            if not whole:
                continue
            messages = [json.loads(part) for part in whole]
            for message in messages:
                self._note(message)
            return messages
        return []

    def _note(self, message: dict[str, Any]) -> None:
        values = message.get('params', {})
        match message.get('method'):
            case 'Runtime.consoleAPICalled' if values['type'] in {'error', 'warning', 'assert'}:
                self.problems.append(' '.join(str(a.get('value', a)) for a in values['args']))
            case 'Runtime.exceptionThrown':
                details = values['exceptionDetails']
                self.problems.append(
                    details.get('exception', {}).get('description', details['text'])
                )
            case 'Log.entryAdded' if values['entry']['level'] in {'error', 'warning'}:
                self.problems.append(values['entry']['text'])
            case 'Network.requestWillBeSent':
                self.requests.append(values['request']['url'][:200])

    @contextmanager
    def before(self, script: str) -> Iterator[None]:
        """Run a script in each page that is opened in this block, before its own."""
        added = self.send('Page.addScriptToEvaluateOnNewDocument', source=script)
        yield
        self.send('Page.removeScriptToEvaluateOnNewDocument', identifier=added['identifier'])

    def open(self, address: Path | str) -> None:
        """Open a file or an address, and wait until the document is loaded."""
        url = address.resolve().as_uri() if isinstance(address, Path) else address
        self.send('Page.navigate', url=url)
        self.wait('document.readyState === "complete" && location.href !== "about:blank"')

    def value(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, awaited if it is a promise.

        Raises:
            BrowserError: It throws.
        """
        answer = self.send(
            'Runtime.evaluate', expression=expression, returnByValue=True, awaitPromise=True
        )
        if 'exceptionDetails' in answer:
            details = answer['exceptionDetails']
            raise BrowserError(details.get('exception', {}).get('description', details['text']))
        return answer['result'].get('value')

    def wait(self, condition: str, seconds: float = _DEADLINE) -> None:
        """Wait until a JavaScript expression is true.

        Raises:
            BrowserError: It is still false after so many seconds.
        """
        deadline = time.monotonic() + seconds
        while not self.value(condition):
            if time.monotonic() > deadline:
                raise BrowserError(f'still false after {seconds:g} s: {condition}')
            time.sleep(0.02)

    def picture(self, **clip: float) -> bytes:
        """Return a PNG of the page as it is now; `x`, `y`, `width`, `height` cut a part out."""
        options = {'clip': {**clip, 'scale': 1}} if clip else {}
        return base64.b64decode(self.send('Page.captureScreenshot', **options)['data'])
