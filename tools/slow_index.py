"""A package index on this computer, no faster than a given line: what a set-up over such a line takes, measured.

Standard library only. It serves a folder of wheels as PEP 503 and PEP 658 say, over HTTP on 127.0.0.1; all answers
together are held to the line's speed, and each waits for the way there and back first.
"""

from __future__ import annotations

import html
import threading
import time
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote, unquote

from treedgs_qgis.pip_meter import plain

CHUNK_BYTES = 32768
METADATA = ".metadata"


class Line:
    """What all connections share. ``sent_bytes``: of wheels, so far."""

    def __init__(self, mbit_s: float, way_s: float) -> None:
        self.bytes_s, self.way_s, self.sent_bytes = mbit_s * 1e6 / 8, way_s, 0
        self._lock, self._free = threading.Lock(), 0.0

    def wait(self, count: int) -> None:
        """Until ``count`` bytes are through."""
        with self._lock:
            self._free = max(self._free, time.monotonic()) + count / self.bytes_s
            until = self._free
        time.sleep(max(0.0, until - time.monotonic()))


def page(wheels: list[Path]) -> str:
    """The page of one library."""
    links = [
        f'<a href="/files/{quote(wheel.name)}" data-dist-info-metadata="true">{html.escape(wheel.name)}</a>'
        for wheel in wheels
    ]
    return "<!DOCTYPE html><html><body>" + "\n".join(links) + "</body></html>"


def metadata(wheel: Path) -> bytes:
    """What a wheel says of itself."""
    with zipfile.ZipFile(wheel) as archive:
        return archive.read(next(name for name in archive.namelist() if name.endswith(".dist-info/METADATA")))


@contextmanager
def serving(folder: Path, mbit_s: float, way_s: float) -> Iterator[tuple[str, Line]]:
    """Serve the wheels of ``folder`` while this lasts: the index's address, and its line."""
    line = Line(mbit_s, way_s)

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            """A library's page, a wheel, or what it says of itself."""
            time.sleep(line.way_s)
            kind, _, name = unquote(self.path).strip("/").partition("/")
            wheel = folder / Path(name.removesuffix(METADATA)).name
            if kind == "simple" and name:
                found = sorted(path for path in folder.glob("*.whl") if plain(path.name.split("-")[0]) == plain(name))
                self.answer(page(found).encode() if found else None, "text/html")
            elif kind == "files" and wheel.is_file():
                self.answer(metadata(wheel) if name.endswith(METADATA) else wheel.read_bytes(), "application/zip")
                line.sent_bytes += 0 if name.endswith(METADATA) else wheel.stat().st_size
            else:
                self.answer(None, "")

        def answer(self, body: bytes | None, kind: str) -> None:
            """Send it at the line's speed."""
            if body is None:
                self.send_error(404)
                return
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            for begin in range(0, len(body), CHUNK_BYTES):
                part = body[begin : begin + CHUNK_BYTES]
                line.wait(len(part))
                self.wfile.write(part)

        def log_message(self, *_: object) -> None:
            """Nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/simple/", line
    finally:
        server.shutdown()
        server.server_close()
