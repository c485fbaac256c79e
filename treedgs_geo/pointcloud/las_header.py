"""The bytes in front of a LAS file's points: checked before a library reads them, and names that it cannot take made
ones that it can."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

from ..core.errors import InputError

#: Bytes of a variable length record's own header, and of one description of extra bytes.
_RECORD, _EXTRA = 54, 192
#: Records of text, which laspy reads as UTF-8 or ASCII.
_TEXTS = (2111, 2112, 34737)


class _Overlaid(io.FileIO):
    """A file that reads as if other bytes of the same number stood at its start."""

    def __init__(self, path: Path, start: bytes) -> None:
        super().__init__(path, "rb")
        self._start = start

    def readinto(self, buffer: Any) -> int:
        """As :meth:`io.RawIOBase.readinto`."""
        at = self.tell()
        count = super().readinto(buffer) or 0
        own = self._start[at : at + count]
        memoryview(buffer).cast("B")[: len(own)] = own
        return count


def las_stream(path: Path) -> io.BufferedReader:
    """The file, open for reading. Extra dimensions that share a name with one another or with a dimension of the point
    format (FARO's chain writes such) get a number after it; letters that are not UTF-8 are read as Latin-1.

    Raises:
        InputError: no LAS by its first bytes, or sizes in them that would make a reader ask for absurd memory.
    """
    to_points = _check_public_header(path)
    with open(path, "rb") as stream:
        start = stream.read(to_points)
    readable = _readable(start)
    return io.BufferedReader(_Overlaid(path, readable) if readable != start else io.FileIO(path, "rb"))


def _check_public_header(path: Path) -> int:
    """How many bytes stand in front of the points.

    Raises:
        InputError: see :func:`las_stream`.
    """
    try:
        size = path.stat().st_size
        with open(path, "rb") as stream:
            head = stream.read(375)
    except OSError as problem:
        raise InputError(f"{path}: cannot be read ({problem.strerror}); check the file.") from None
    if head[:4] != b"LASF" or len(head) < 227:
        raise InputError(
            f"{path}: is not a LAS/LAZ file that can be read (found {len(head)} bytes starting "
            f"{head[:4]!r}, expected 'LASF'); export it again from your LiDAR software."
        )
    header_size, to_points, n_vlrs = struct.unpack_from("<HII", head, 94)
    record_size = struct.unpack_from("<H", head, 105)[0]
    if not 227 <= header_size <= to_points <= size or n_vlrs * _RECORD > to_points or record_size < 20:
        raise InputError(
            f"{path}: has a broken LAS header (points start at byte {to_points} of {size}, "
            f"{n_vlrs} records before, {record_size} bytes a point); export it again."
        )
    if head[25] >= 4 and len(head) >= 247 and header_size >= 375:
        first, count = struct.unpack_from("<QI", head, 235)
        if count and (first > size or count * 60 > size):
            raise InputError(
                f"{path}: has a broken LAS header ({count} extended records from byte {first} of {size}); "
                "copy it again."
            )
    return int(to_points)


def _readable(start: bytes) -> bytes:
    """``start`` with the names and texts in its records as laspy takes them."""
    from laspy.point.format import PointFormat

    out = bytearray(start)
    at, n_vlrs, kind = struct.unpack_from("<H", start, 94)[0], *struct.unpack_from("<IB", start, 100)
    taken = {"X", "Y", "Z", "x", "y", "z"}
    if kind & 63 <= 10:
        taken |= {*PointFormat(kind & 63).dimension_names, *(PointFormat(kind & 63).dtype().names or ())}
    for _ in range(n_vlrs):
        if at + _RECORD > len(start):
            break
        user, number, length = struct.unpack_from("<16sHH", start, at + 2)
        body, at = at + _RECORD, at + _RECORD + length
        if at > len(start):
            break
        if user.rstrip(b"\0") == b"LASF_Spec" and number == 4:
            for place in range(body, at - _EXTRA + 1, _EXTRA):
                name = _text(start[place + 4 : place + 36]) or "extra"
                count, distinct = 1, name
                while distinct in taken:
                    count += 1
                    distinct = f"{name[:28]}_{count}"
                taken.add(distinct)
                _put(out, place + 4, 32, distinct)
                _put(out, place + 160, 32, _text(start[place + 160 : place + 192]))
        elif number in _TEXTS and user.rstrip(b"\0") in (b"LASF_Projection", b"liblas"):
            try:
                start[body:at].decode("ascii" if number == 34737 else "utf-8")
            except UnicodeDecodeError:
                out[body:at] = bytes(byte if byte < 128 else ord("?") for byte in start[body:at])
    return bytes(out)


def _text(raw: bytes) -> str:
    raw = raw.split(b"\0")[0]
    try:
        return raw.decode()
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _put(out: bytearray, at: int, width: int, text: str) -> None:
    raw = text.encode()[:width].decode("utf-8", "ignore").encode()
    out[at : at + width] = raw.ljust(width, b"\0")
