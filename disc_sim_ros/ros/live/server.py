"""The web server of live_view: one page, and one WebSocket to each browser that has it open."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
import ipaddress
import json
import os
import secrets
import socket
import threading
from typing import Any

from disc_sim_ros.errors import ConfigError, DiscSimError

try:
    from websockets.asyncio.server import Server, ServerConnection, broadcast, serve
    from websockets.datastructures import Headers
    from websockets.exceptions import ConnectionClosed
    from websockets.http11 import Request, Response

    MISSING = ''
except ImportError as error:
    MISSING = f'live_view needs websockets 13 or newer (pip install "websockets>=13"): {error}'

SOCKET = '/live'
LARGEST_REQUEST = 4096  # bytes that a browser may send at once
START = 10.0  # s
Throw = Callable[[dict[str, Any]], str]


class LiveServer(threading.Thread):
    """Serves the page and sends the states of the discs.

    Attributes:
        token: Who knows it may throw. It is in the fragment of the address of the page, which
            browsers do not send.
    """

    def __init__(self, address: str, port: int, page: bytes, throw: Throw) -> None:
        """Prepare the server; `start_serving` starts it.

        Args:
            address: Numeric address to listen at.
            port: Port; 0 for a free one.
            page: The page.
            throw: Throws, with the values of the page; returns a line about it, or raises
                DiscSimError. Called in the thread of the server.

        Raises:
            DiscSimError: The package websockets is missing or too old.
        """
        if MISSING:
            raise DiscSimError(MISSING)
        super().__init__(name='live_server', daemon=True)
        self.token = secrets.token_urlsafe(16)
        self._address, self._port = address, port
        self._page, self._throw = page, throw
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._failure: OSError | None = None
        self._server: Server | None = None
        self._connections: set[ServerConnection] = set()

    def start_serving(self) -> str:
        """Start the thread and return the address of the page.

        Raises:
            ConfigError: The port is in use, or the address is not of this machine.
        """
        self.start()
        self._ready.wait(START)
        if self._failure is not None or self._server is None:
            number = self._failure.errno if self._failure else None
            reason = os.strerror(number) if number else 'the server did not start'
            where = f'{self._address} port {self._port}'
            raise ConfigError('port', where, f'cannot listen there ({reason}); give another port')
        port = next(iter(self._server.sockets)).getsockname()[1]
        host = f'[{self._address}]' if ':' in self._address else self._address
        if ipaddress.ip_address(self._address).is_unspecified:  # every interface
            host = socket.gethostname()
        return f'http://{host}:{port}/#{self.token}'

    @property
    def has_viewers(self) -> bool:
        """Return True if a browser has the page open."""
        return bool(self._connections)

    def send(self, message: dict[str, Any]) -> None:
        """Send a message to every browser; call this from any thread."""
        text = json.dumps(message, allow_nan=False, separators=(',', ':'))
        self._loop.call_soon_threadsafe(broadcast, self._connections, text)

    def end(self) -> None:
        """End the server and wait for it."""
        if self._ready.is_set() and self.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self.join(START)

    def run(self) -> None:
        """Serve until `end`."""
        asyncio.set_event_loop(self._loop)
        try:
            self._server = self._loop.run_until_complete(self._listen())
        except OSError as error:
            self._failure = error
        self._ready.set()
        if self._server is not None:
            self._loop.run_forever()
            self._server.close()
            self._loop.run_until_complete(self._server.wait_closed())
        self._loop.close()

    async def _listen(self) -> 'Server':
        return await serve(
            self._talk,
            self._address,
            self._port,
            process_request=self._respond,
            compression=None,
            max_size=LARGEST_REQUEST,
        )

    def _respond(self, _: 'ServerConnection', request: 'Request') -> 'Response | None':
        """Return the page, or None for the WebSocket of this page."""
        if request.path == SOCKET:
            origin, host = request.headers.get('Origin'), request.headers.get('Host')
            same = origin is None or origin == f'http://{host}'  # not a page of another server
            return None if same else _response(403, 'Forbidden', b'another origin')
        if request.path in {'/', ''}:
            return _response(200, 'OK', self._page, 'text/html; charset=utf-8')
        return _response(404, 'Not Found', b'there is one page: /')

    async def _talk(self, connection: 'ServerConnection') -> None:
        self._connections.add(connection)
        try:
            with suppress(ConnectionClosed):  # a browser may leave without a word
                async for text in connection:
                    await connection.send(json.dumps({'answer': self._answer(text)}))
        finally:
            self._connections.discard(connection)

    def _answer(self, text: str | bytes) -> str:
        try:
            values = json.loads(text)
        except (ValueError, RecursionError):
            return 'error: not JSON'
        if not isinstance(values, dict):
            return 'error: not an object'
        if not secrets.compare_digest(str(values.pop('token', '')).encode(), self.token.encode()):
            return 'error: open the page with the address that live_view has printed, to throw'
        try:
            return self._throw(values)
        except DiscSimError as error:
            return f'error: {error}'


def _response(code: int, reason: str, body: bytes, kind: str = 'text/plain') -> 'Response':
    headers = Headers(
        {
            'Content-Type': kind,
            'Content-Length': str(len(body)),
            'Connection': 'close',
            'Cache-Control': 'no-store',
        }
    )
    return Response(code, reason, headers, body)
