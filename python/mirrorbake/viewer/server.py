"""The server behind `mirrorbake view`: this machine only, and nothing but the page and one PEM."""

from __future__ import annotations

import threading
from collections import OrderedDict
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import TYPE_CHECKING, Any, ClassVar
from urllib.parse import unquote, urlsplit

from mirrorbake.errors import InputError
from mirrorbake.viewer.page import SCRIPT_NAME, STYLE_NAME, built_file, page_beside_files

if TYPE_CHECKING:
    from mirrorbake.pem.export.web import WebPem

LOOPBACK = "127.0.0.1"

KEPT_BYTES = 256_000_000
"""Of encoded files, which are made when they are asked for first."""

MEDIA_TYPES = {
    "html": "text/html; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "json": "application/json",
    "avif": "image/avif",
    "webp": "image/webp",
    "gz": "application/octet-stream",
}


class Content:
    """The files that there are: a table of names, so that no request can reach any other file."""

    def __init__(self, pem: WebPem, title: str) -> None:
        self._pem = pem
        self._page = {
            "": page_beside_files(title).encode(),
            SCRIPT_NAME: built_file(SCRIPT_NAME).encode(),
            STYLE_NAME: built_file(STYLE_NAME).encode(),
        }
        self._page["index.html"] = self._page[""]
        self._names = frozenset(pem.names)
        self._kept: OrderedDict[str, bytes] = OrderedDict()
        self._kept_bytes = 0
        self._lock = threading.Lock()

    def read(self, name: str) -> bytes | None:
        """Bytes of a file, or None if there is no such one.

        Raises
        ------
        InputError
            The PEM is damaged.
        """
        if name in self._page:
            return self._page[name]
        if name not in self._names:
            return None
        # One at a time: the PEM's store is not made for several readers, and encoding uses all cores.
        with self._lock:
            if name in self._kept:
                self._kept.move_to_end(name)
                return self._kept[name]
            data = self._pem.read(name)
            self._kept[name] = data
            self._kept_bytes += len(data)
            while self._kept_bytes > KEPT_BYTES and len(self._kept) > 1:
                _, dropped = self._kept.popitem(last=False)
                self._kept_bytes -= len(dropped)
            return data


def byte_range(header: str, size: int) -> tuple[int, int] | None:
    """First byte and the one behind the last of a Range header of one range (RFC 9110 §14.1.2).

    Returns None for a header that has to be ignored: another unit, several ranges, no sense.

    Raises
    ------
    ValueError
        The range lies behind the end.

    >>> byte_range("bytes=2-5", 10), byte_range("bytes=7-", 10), byte_range("bytes=-3", 10)
    ((2, 6), (7, 10), (7, 10))
    """
    unit, _, ranges = header.partition("=")
    first, dash, last = ranges.partition("-")
    parts = [part.strip() for part in (first, last)]
    if unit.strip() != "bytes" or not dash or not any(parts):
        return None
    if any(part and not (part.isascii() and part.isdigit()) for part in parts):
        return None
    if not parts[0]:
        start, end = max(size - int(parts[1]), 0), size
    else:
        start, end = int(parts[0]), min(int(parts[1]) + 1, size) if parts[1] else size
        if parts[1] and int(parts[1]) < start:
            return None
    if start >= end:
        raise ValueError(header)
    return start, end


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    # Head and body in one packet: apart, the second waits for the answer to the first.
    wbufsize = 65536
    disable_nagle_algorithm = True
    content: ClassVar[Content]

    def do_GET(self) -> None:
        self._answer(with_body=True)

    def do_HEAD(self) -> None:
        self._answer(with_body=False)

    def _answer(self, *, with_body: bool) -> None:
        # A page of another site that made a name of its own point to this machine is not answered.
        host = (self.headers.get("Host") or "").rsplit(":", 1)[0]
        if host not in (LOOPBACK, "localhost"):
            return self._fail(HTTPStatus.FORBIDDEN)
        name = unquote(urlsplit(self.path).path, errors="replace").removeprefix("/")
        try:
            data = self.content.read(name)
        except InputError as failure:
            return self._fail(HTTPStatus.INTERNAL_SERVER_ERROR, str(failure))
        if data is None:
            return self._fail(HTTPStatus.NOT_FOUND)
        status, start, end = HTTPStatus.OK, 0, len(data)
        wanted = self.headers.get("Range")
        if wanted is not None:
            try:
                part = byte_range(wanted, len(data))
            except ValueError:
                return self._fail(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, size=len(data))
            if part is not None:
                status, (start, end) = HTTPStatus.PARTIAL_CONTENT, part
        self.send_response(status)
        suffix = name.rsplit(".", 1)[-1] if name else "html"
        self.send_header("Content-Type", MEDIA_TYPES.get(suffix, "application/octet-stream"))
        self.send_header("Content-Length", str(end - start))
        self.send_header("Accept-Ranges", "bytes")
        if status == HTTPStatus.PARTIAL_CONTENT:
            self.send_header("Content-Range", f"bytes {start}-{end - 1}/{len(data)}")
        self._common_headers()
        self.end_headers()
        if with_body:
            self.wfile.write(data[start:end])
        return None

    def _fail(self, status: HTTPStatus, text: str = "", size: int | None = None) -> None:
        body = (text or status.phrase).encode() + b"\n"
        self.send_response(status)
        self.send_header("Content-Type", "text/plain; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        if size is not None:
            self.send_header("Content-Range", f"bytes */{size}")
        self._common_headers()
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def _common_headers(self) -> None:
        self.send_header("Cache-Control", "no-cache")
        self.send_header("X-Content-Type-Options", "nosniff")

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: standard error belongs to the command."""


def make_server(content: Content, port: int = 0) -> ThreadingHTTPServer:
    """Return a server on the loopback interface, not yet serving; port 0 takes a free one.

    Raises
    ------
    InputError
        The port is taken or not allowed.
    """
    handler = type("Handler", (_Handler,), {"content": content})
    try:
        server = ThreadingHTTPServer((LOOPBACK, port), handler)
    except (OSError, OverflowError) as failure:
        raise InputError(f"port {port}: cannot serve there: {failure}") from None
    server.daemon_threads = True
    return server
