"""The server of the explorer: on this machine alone, at an address that nobody guesses.

The address holds a token of 128 random bits: without it there is no page, no report and no
connection. Scripts come from the server itself; no request leaves the machine.
"""

from __future__ import annotations

import asyncio
import contextlib
import html
import logging
import os
import secrets
import signal
import socket
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tornado.httpserver import HTTPServer
from tornado.web import Application, RequestHandler, StaticFileHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from drillctl import units
from drillctl.design import Design
from drillctl.errors import InputError

if TYPE_CHECKING:
    from drillctl.explorer.page import Page
    from drillctl.explorer.state import State

HOST = "127.0.0.1"
LAST = 5.0  # time (s) that running work has to end once it is interrupted
SWITCH = 5e-4  # longest time (s) that a computation keeps a page from being heard
HERE = Path(__file__).parent


def return_freed_memory() -> None:
    """Return memory to the system once it is free, where the allocator of glibc would keep it.

    Threads come and go with each computation; each would get an arena of its own, which keeps the
    largest run that it ever held.
    """
    import ctypes

    arenas, mapped_from = -8, -3  # M_ARENA_MAX, M_MMAP_THRESHOLD of malloc.h
    with contextlib.suppress(OSError, AttributeError):  # another C library
        library = ctypes.CDLL(None)
        library.mallopt(arenas, 2)
        library.mallopt(mapped_from, 2**20)


def free_port(asked: int | None) -> socket.socket:
    """A socket bound to a port, random by default; refused (`InputError`) if it is taken."""
    made = socket.socket()
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        made.bind((HOST, asked or 0))
        made.listen(128)  # from when the address is told, a browser may come
    except OSError as error:
        raise InputError(f"port {asked}: {error.strerror}", "--port") from None
    return made


def serve(
    design: Design,
    settings: Mapping[str, Any] | None = None,
    system: units.System = "si",
    port: int | None = None,
    browser: bool = True,
    say: Callable[[str], None] = print,
) -> None:
    """Serve pages of a design until it is interrupted.

    Parameters
    ----------
    design : Design
        What pages open with.
    settings : mapping, optional
        Values laid over it first, by dotted path, as in a file.
    system : {'si', 'field'}
        Units that they open with.
    port : int, optional
        A random one by default.
    browser : bool
        Whether to open a page in the user's browser.
    say : callable
        Takes the address.

    Raises
    ------
    InputError
        The port is taken, or a value is impossible.
    """
    from drillctl.explorer.state import first_state

    return_freed_memory()
    with tempfile.TemporaryDirectory(prefix="drillctl-explore-") as folder:
        first = first_state(design, system, settings)
        server = _Server(design, first, port, Path(folder))
        say(f"explorer: {server.address}")
        say("Ctrl-C ends it")
        server.run(browser)
        ended = server.ended()
    if not ended:  # a thread inside compiled code cannot be taken down with the interpreter
        sys.stdout.flush()
        os._exit(0)


class _Server:
    def __init__(self, design: Design, first: State, port: int | None, folder: Path) -> None:
        import numba

        from drillctl.explorer.reports import Reports
        from drillctl.explorer.work import Engine

        self._bound = free_port(port)
        self._token = secrets.token_urlsafe(16)
        self.address = f"http://{HOST}:{self._bound.getsockname()[1]}/{self._token}"
        self._engine = Engine(numba.get_num_threads())
        self._reports = Reports(folder, f"/{self._token}/reports")
        self._design, self._first, self._folder = design, first, folder
        # While the browser loads its scripts; what fails here is told by the page.
        self._warming = threading.Thread(target=self._warm_up, daemon=True)
        self._warming.start()

    def ended(self) -> bool:
        """Whether all threads have ended, for which they have some seconds."""
        self._warming.join(LAST)
        return self._engine.ended(LAST) and not self._warming.is_alive()

    def _warm_up(self) -> None:
        """Load what the first map needs."""
        from drillctl.explorer import computed

        with contextlib.suppress(Exception):
            at = self._first.design(self._design)
            next(computed.mapped(at, self._first.grid(at), "j1"))

    def run(self, browser: bool) -> None:
        """Serve until interrupted."""
        asyncio.run(self._run(browser))

    async def _run(self, browser: bool) -> None:
        logging.getLogger("tornado.access").setLevel(logging.CRITICAL)  # pages that are not there
        # A page of another name that points here is refused, whatever it knows.
        application = Application()
        application.add_handlers(
            HOST.replace(".", r"\."),
            [
                (f"/{self._token}", _Document, {"text": self._document()}),
                (f"/{self._token}/ws", _Connection, {"opened": self._open}),
                (f"/{self._token}/reports/(.*)", StaticFileHandler, {"path": str(self._folder)}),
            ],
        )
        http = HTTPServer(application)
        self._bound.setblocking(False)
        http.add_sockets([self._bound])
        # Computations hold the interpreter for 5 ms at a time by default, each of them.
        sys.setswitchinterval(SWITCH)
        stop = asyncio.Event()
        running = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            running.add_signal_handler(number, stop.set)
        if browser:
            webbrowser.open(self.address)
        try:
            await stop.wait()
        finally:
            self._reports.end()
            self._engine.end()
            http.stop()
            await http.close_all_connections()

    def _document(self) -> str:
        """The page as the browser takes it."""
        text = (HERE / "page.html").read_text(encoding="utf-8")
        parts = {
            f"{{{{ {name} }}}}": (HERE / name).read_text(encoding="utf-8")
            for name in ("page.css", "draw.js", "page.js")
        }
        title = html.escape(self._design.tables.title or self._design.name)
        for place, part in {"{{ title }}": title, **parts}.items():
            text = text.replace(place, part)
        return text

    def _open(self, send: Callable[[str], Any]) -> Page:
        """A page that is opened."""
        from drillctl.explorer.page import Page

        soon = asyncio.get_running_loop().call_soon_threadsafe
        return Page(send, soon, self._design, self._first, self._engine, self._reports)


class _Document(RequestHandler):
    def initialize(self, text: str) -> None:
        self._text = text

    def get(self) -> None:
        self.set_header("Cache-Control", "no-store")
        self.finish(self._text)


class _Connection(WebSocketHandler):
    """The web socket of a page, which lives as long as this."""

    def initialize(self, opened: Callable[[Callable[[str], Any]], Page]) -> None:
        self._opened = opened

    def open(self, *args: str, **kwargs: str) -> None:
        self._page = self._opened(self._tell)

    def _tell(self, text: str) -> None:
        with contextlib.suppress(WebSocketClosedError):
            self.write_message(text)

    def on_message(self, message: str | bytes) -> None:
        self._page.take(str(message))

    def on_close(self) -> None:
        self._page.close()
