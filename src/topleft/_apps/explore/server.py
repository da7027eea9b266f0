"""Serves the page and its socket: on the loopback, under an address that holds a token.

Where a proxy blocks WebSockets, the page posts its frames one by one. The server refuses requests without the token,
of another origin or for another host with a sentence. Each request is answered in a thread, so a slow request does not
block others. The server ends when all pages have been closed for a while.

Based on: I. Fette, A. Melnikov, RFC 6455, The WebSocket Protocol, 2011; the checks of Host and Origin prevent DNS
rebinding and cross-site WebSocket hijacking.
"""

from __future__ import annotations

import asyncio
import secrets
import socket
import threading
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any

from topleft._apps.explore.handlers import answer
from topleft._apps.explore.messages import pack, read_header, split, unpack
from topleft._apps.explore.session import SCRIPTS, Content, Reply, Session
from topleft.errors import MissingPackageError

try:
    import uvicorn
    import websockets  # noqa: F401 -- what uvicorn speaks to sockets with
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import PlainTextResponse, Response
    from starlette.routing import Route, WebSocketRoute
    from starlette.websockets import WebSocket, WebSocketDisconnect
    from websockets.exceptions import InvalidState
except ImportError as error:
    raise MissingPackageError(
        f"the explorer needs {error.name or 'starlette'}: pip install starlette uvicorn websockets"
    ) from error

LOOPBACK = "127.0.0.1"

MAX_MESSAGE_BYTES = 256 << 20
"""Of a request: a mesh file that is dropped on the page."""

MAX_PAGES = 16
"""Open at a time."""

POSTING_SECONDS = 90.0
"""After its last request a page without a socket counts as closed; it polls every 20 s, in the background every 60."""

FILES: Mapping[str, str] = {
    "": "text/html; charset=utf-8",
    "explore.css": "text/css; charset=utf-8",
    **dict.fromkeys(SCRIPTS, "text/javascript; charset=utf-8"),
}
"""The files that are served, with their types; the first is the page itself."""

HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""The page fetches only from this server, is not cached, and no other page may frame it."""


@dataclass
class PostingPage:
    """A page without a socket: its session, a lock that answers requests in turn, and the timer that closes it."""

    session: Session
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)
    expiry: asyncio.TimerHandle | None = None


class Server:
    """Serves the page of a content at an address, until `close`, or until no page has been open for `idle` seconds.

    `host`: the loopback, or an address that other machines reach; port 0: a free port; `idle` infinite: never ends.
    """

    def __init__(self, content: Content, host: str = LOOPBACK, port: int = 0, idle: float = 30.0) -> None:
        self.content, self.host, self.idle = content, host, idle
        self.token = secrets.token_urlsafe(24)
        self._socket = socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
        self.port: int = self._socket.getsockname()[1]
        self._pages = 0
        self._posting: dict[str, PostingPage] = {}
        self._end: asyncio.Event | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._closing: asyncio.TimerHandle | None = None
        self._is_ready = threading.Event()
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="topleft-explore", daemon=True)

    @property
    def url(self) -> str:
        """The address of the page, with the token."""
        name = f"[{self.host}]" if ":" in self.host else self.host
        shown = LOOPBACK if self.host in ("", "0.0.0.0") else name
        fragment = f"#{self.content.fragment}" if self.content.fragment else ""
        return f"http://{shown}:{self.port}/{self.token}/{fragment}"

    def start(self) -> None:
        """Start the thread of the server, and return when the page can be opened."""
        self._thread.start()
        self._is_ready.wait()
        if self._error is not None:
            raise self._error

    def wait(self) -> None:
        """Return when the server has ended."""
        self._thread.join()

    def close(self) -> None:
        """End the server; open pages show that it has ended."""
        if self._loop is not None and self._end is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._end.set)
            self._thread.join()
        self._socket.close()

    def app(self) -> Starlette:
        """The page, its files and its socket."""
        return Starlette(
            routes=[
                WebSocketRoute("/{path:path}", self._talk),
                Route("/{path:path}", self._serve_file, methods=["GET"]),
                Route("/{path:path}", self._answer_post, methods=["POST"]),
            ]
        )

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except Exception as error:
            self._error = error
        finally:
            self._is_ready.set()

    async def _serve(self) -> None:
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        config = uvicorn.Config(
            self.app(), log_level="critical", lifespan="off", ws="websockets-sansio", ws_max_size=MAX_MESSAGE_BYTES,
            ws_per_message_deflate=False, ws_ping_interval=None, server_header=False, date_header=False,
            timeout_graceful_shutdown=2,
        )  # fmt: skip
        config.load()
        serving = EventServer(config, self._end)
        self._close_in(600.0 if self.idle < float("inf") else self.idle)  # where no browser opens the page
        self._loop.call_soon(self._is_ready.set)
        with suppress(InvalidState):  # raised by the end of a page that is being closed at this moment
            await serving.serve(sockets=[self._socket])

    def _close_in(self, seconds: float) -> None:
        """End the server after `seconds`, unless a page opens."""
        if self._closing is not None:
            self._closing.cancel()
        if self._loop is not None and self._end is not None and seconds < float("inf"):
            self._closing = self._loop.call_later(seconds, self._end.set)

    def _add_page(self) -> str:
        """Count an opened page; returns the reason where it is refused, else ""."""
        if self._pages >= MAX_PAGES:
            return f"At most {MAX_PAGES} pages may be open at a time."
        self._pages += 1
        self._close_in(float("inf"))
        return ""

    def _remove_page(self) -> None:
        """Count a closed page."""
        self._pages -= 1
        if not self._pages:
            self._close_in(self.idle)

    # Requests

    def refusal(self, headers: Mapping[str, str], token: str, *, is_socket: bool) -> str:
        """Return why a request is refused, "" where it is not."""
        host, origin = headers.get("host", ""), headers.get("origin")
        hosts = [f"{name}:{self.port}" for name in (LOOPBACK, "localhost", "[::1]")]
        if self.host in (LOOPBACK, "localhost", "::1") and host not in hosts:
            return f"Host must be {LOOPBACK}:{self.port}: this page is for this machine alone."
        if (origin is not None or is_socket) and origin != f"http://{host}":
            return "Origin must be this page: others may not talk to it."
        if not secrets.compare_digest(token.encode(), self.token.encode()):
            return "The address must hold the token that the terminal shows."
        return ""

    async def _serve_file(self, request: Request) -> Response:
        token, _, name = request.path_params["path"].partition("/")
        if why := self.refusal(request.headers, token, is_socket=False):
            return PlainTextResponse(why + "\n", 403, HEADERS)
        if name not in FILES:
            return PlainTextResponse("There is no such file here.\n", 404, HEADERS)
        content = files("topleft._apps.explore").joinpath("page", name or "index.html").read_bytes()
        return Response(content, headers={**HEADERS, "Content-Type": FILES[name]})

    async def _talk(self, page: WebSocket) -> None:
        token, _, name = page.path_params["path"].partition("/")
        why = self.refusal(page.headers, token, is_socket=True)
        if not why and name != "socket":
            why = "There is no such socket here."
        if why := why or self._add_page():
            await page.send_denial_response(PlainTextResponse(why + "\n", 403, HEADERS))
            return
        try:
            await page.accept()
            await self._answer_all(page, Session(self.content))
        except WebSocketDisconnect:
            pass
        finally:
            self._remove_page()

    async def _answer_all(self, page: WebSocket, session: Session) -> None:
        while True:
            message: Mapping[str, Any] = await page.receive()
            if message["type"] == "websocket.disconnect":
                return
            frame = message.get("bytes")
            await page.send_bytes(await reply_to(session, message["text"] if frame is None else frame))

    async def _answer_post(self, request: Request) -> Response:
        token, _, name = request.path_params["path"].partition("/")
        if why := self.refusal(request.headers, token, is_socket=True):
            return PlainTextResponse(why + "\n", 403, HEADERS)
        verb, _, key = name.partition("/")
        if verb != "ask" or not 0 < len(key) <= 64:
            return PlainTextResponse("There is nothing to ask here.\n", 404, HEADERS)
        frame = bytearray()
        async for piece in request.stream():
            frame += piece
            if len(frame) > MAX_MESSAGE_BYTES:
                return PlainTextResponse(f"A message may have {MAX_MESSAGE_BYTES} bytes.\n", 413, HEADERS)
        if key not in self._posting:
            if why := self._add_page():
                return PlainTextResponse(why + "\n", 403, HEADERS)
            self._posting[key] = PostingPage(Session(self.content))
        page = self._posting[key]
        async with page.turn:
            if page.expiry is not None:
                page.expiry.cancel()
            reply = await reply_to(page.session, bytes(frame))
            page.expiry = asyncio.get_running_loop().call_later(POSTING_SECONDS, self._expire, key)
        return Response(reply, headers={**HEADERS, "Content-Type": "application/octet-stream"})

    def _expire(self, key: str) -> None:
        """Close a page without a socket, after POSTING_SECONDS without a request."""
        if not self._posting[key].turn.locked():
            del self._posting[key]
            self._remove_page()


async def reply_to(session: Session, message: bytes | str) -> bytes:
    """The frame of the reply to a frame, or to a header without parts."""
    try:
        request = unpack(message) if isinstance(message, bytes) else {**read_header(message), "parts": []}
    except ValueError as error:
        reply = Reply({"id": None, "error": str(error)})
    else:
        reply = await asyncio.to_thread(answer, session, request)
    return pack(*split(reply))


class EventServer(uvicorn.Server):
    """A server that sleeps until an event ends it: `uvicorn.Server` polls ten times a second."""

    def __init__(self, config: uvicorn.Config, end: asyncio.Event) -> None:
        super().__init__(config)
        self._end_event = end

    async def main_loop(self) -> None:
        """Return when the event is set."""
        await self._end_event.wait()
