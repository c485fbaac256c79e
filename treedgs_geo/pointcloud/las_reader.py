"""LAS, LAZ and COPC files read point by point, with broken headers and broken ends caught.

The bytes in front of the points are checked before a library reads them, and names that it cannot take made ones that
it can. How many points a file holds is told by its own structure and not by the count in its header.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from .file_crs import short


def _broken() -> tuple[type[BaseException], ...]:
    import laspy

    return (laspy.errors.LaspyException, ValueError, OSError, EOFError, RuntimeError, OverflowError, MemoryError)


#: Layers of compressed points of formats 6 to 10, by laspy's names, and the attributes in them; those of no other layer
#: are extra dimensions and wave forms.
_LAYERS = {
    "XY_RETURNS_CHANNEL": ("return_number", "number_of_returns", "scanner_channel"),
    "CLASSIFICATION": ("classification",),
    "FLAGS": ("synthetic", "key_point", "withheld", "overlap", "scan_direction_flag", "edge_of_flight_line"),
    "INTENSITY": ("intensity",),
    "SCAN_ANGLE": ("scan_angle", "scan_angle_rank"),
    "USER_DATA": ("user_data",),
    "POINT_SOURCE_ID": ("point_source_id",),
    "GPS_TIME": ("gps_time",),
    "RGB": ("red", "green", "blue"),
    "NIR": ("nir",),
}


def open_reader(path: Path, attributes: tuple[str, ...] | None = None) -> Any:
    """laspy's reader, its header checked. attributes: the only ones that will be looked at; others may read as zero.

    Raises:
        InputError: no LAS, a header that cannot be, or one that promises more points than the file can hold.
    """
    import laspy

    stream = las_stream(path)
    try:
        reader = laspy.open(stream, decompression_selection=_layers(attributes))
        header = reader.header
        promised, scales, offsets = header.point_count, np.asarray(header.scales), np.asarray(header.offsets)
    except _broken() as problem:
        raise InputError(
            f"{path}: is not a LAS/LAZ file that can be read ({short(problem)}); "
            "export it again from your LiDAR software."
        ) from None
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as problem:  # laspy lets struct and pyproj errors, lazrs panics of broken headers through
        raise InputError(f"{path}: has a broken LAS header ({short(problem)}); export it again.") from None
    trouble = ""
    if not np.isfinite(scales).all() or (scales <= 0).any() or (scales > 100).any():
        trouble = f"the header gives coordinate scales {scales.tolist()}, expected positive ones (0.001)"
    elif not np.isfinite(offsets).all() or (np.abs(offsets) > 1e9).any():
        trouble = f"the header gives coordinate offsets {offsets.tolist()}, expected map coordinates"
    elif not header.are_points_compressed:
        stored = (path.stat().st_size - header.offset_to_point_data) // max(header.point_format.size, 1)
        trouble = _promise(promised, stored) if stored < promised else ""
    if not trouble and (held := held_beyond_promise(path, header)):
        trouble = f"the header promises {promised:,} points, the file holds {held}, expected the same number"
    if trouble:
        reader.close()
        raise InputError(f"{path}: {trouble}; export or copy it again.")
    return reader


def _layers(attributes: tuple[str, ...] | None) -> Any:
    from laspy import DecompressionSelection as Layers

    if attributes is None:
        return Layers.all()
    wanted = set(attributes)
    chosen = Layers.XY_RETURNS_CHANNEL | Layers.Z
    for layer, names in _LAYERS.items():
        if wanted & set(names):
            chosen |= Layers[layer]
            wanted -= set(names)
    return chosen | Layers.ALL_EXTRA_BYTES | Layers.WAVEPACKET if wanted else chosen


def iter_points(path: Path, reader: Any, chunk_points: int) -> Iterator[Any]:
    """laspy's point records, chunk by chunk; InputError for a file that breaks off or holds fewer than promised."""
    promised, count = reader.header.point_count, 0
    chunks = iter(reader.chunk_iterator(chunk_points))
    while True:
        try:
            points = next(chunks, None)
        except (KeyboardInterrupt, SystemExit, GeneratorExit, MemoryError):
            raise
        except BaseException as problem:  # a panic in the decompressor is a BaseException
            # A file that is too short says so by its own structure.
            if breaks_off(path, reader.header):
                raise InputError(
                    f"{path}: breaks off after {count} of {promised} points ({short(problem)}); copy or download it "
                    "again."
                ) from None
            raise InputError(
                f"{path}: its points cannot be decoded after {count} of {promised} ({short(problem)}), though the "
                "file has its whole length; copy it again, or, if that does not help, export it again as LAS 1.2 or "
                "1.4."
            ) from None
        if points is None:
            break
        count += len(points)
        yield points
    if count != promised:
        raise InputError(f"{path}: {_promise(promised, count)}; copy it again.")


def is_copc(header: Any) -> bool:
    """Whether a laspy header is a COPC file's."""
    return any(vlr.user_id == "copc" and vlr.record_id == 1 for vlr in header.vlrs)


def writable_version(header: Any) -> str:
    """The version of a laspy header, or, of one that is read but not written (1.0), the oldest that is and holds its
    point format."""
    import laspy

    if (own := str(header.version)) in laspy.supported_versions():
        return own
    return "1.4" if header.point_format.id > 5 else "1.2"


def copc_pieces(path: Path, bounds: tuple[float, float, float, float]) -> Iterator[Any]:
    """The points of a COPC file near a box, by its index: the rest of the file is not read.

    Raises:
        InputError: the index is broken.
    """
    import laspy

    west, south, east, north = bounds
    try:
        with laspy.CopcReader.open(las_stream(path)) as reader:
            low, high = reader.header.mins[2] - 1.0, reader.header.maxs[2] + 1.0
            yield reader.query(laspy.Bounds(np.array([west, south, low]), np.array([east, north, high])))
    except _broken() as problem:
        raise InputError(f"{path}: its COPC index cannot be read ({short(problem)}); copy it again.") from None


def _promise(promised: int, found: int) -> str:
    return f"is truncated: the header promises {promised} points, the file holds {found}"


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
    with open(path, "rb") as stream:
        start = stream.read(to_points)
    readable = _readable(start)
    return io.BufferedReader(_Overlaid(path, readable) if readable != start else io.FileIO(path, "rb"))


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


#: Fewer points than this beyond the promised ones may be padding that a writer left at the end.
_PADDING = 100


def held_beyond_promise(path: Path, header: Any) -> str:
    """How many points the file holds, in words, where that is clearly more than the header says; empty otherwise.

    header: laspy's. LAS: the bytes up to the first extended record. LAZ: the chunk table (``laszip`` writes a table of
    equal chunks; the layered chunks of formats 6-10 also begin with their own count, and no chunk of the others is
    longer than its points uncompressed).
    """
    promised, size = header.point_count, max(header.point_format.size, 1)
    if not header.are_points_compressed:
        start, end = header.offset_to_point_data, path.stat().st_size
        waveforms = getattr(header, "start_of_waveform_data_packet_record", 0) or 0
        behind = waveforms, header.start_of_first_evlr if header.number_of_evlrs else 0
        held = (min([end, *(place for place in behind if start < place)]) - start) // size
        return f"{held:,}" if held - promised > max(_PADDING, promised // 100) else ""
    chunks, exact = _chunks(path, header)
    if not chunks:
        return ""
    whole = sum(count for count, _ in chunks[:-1])
    last, n_bytes = chunks[-1]
    if header.point_format.id >= 6 and not exact:
        with open(path, "rb") as stream:
            stream.seek(header.offset_to_point_data + 8 + sum(length for _, length in chunks[:-1]) + size)
            own = stream.read(4)
        last, exact = min(struct.unpack("<I", own)[0], last) if len(own) == 4 else last, True
    if exact:
        return f"{whole + last:,}" if whole + last > promised else ""
    if whole >= promised and whole:
        return f"about {whole + n_bytes * whole // max(sum(length for _, length in chunks[:-1]), 1):,}"
    # Only the last chunk is left, whose count is not written: its points are not longer than uncompressed ones.
    return "more" if n_bytes > 1.3 * (promised - whole) * size + 1000 else ""


def breaks_off(path: Path, header: Any) -> bool:
    """Whether the file is shorter than its points: by a point's size (LAS), by the place of its chunk table (LAZ)."""
    size, start = path.stat().st_size, header.offset_to_point_data
    if not header.are_points_compressed:
        return bool(size < start + header.point_count * header.point_format.size)
    with open(path, "rb") as stream:
        stream.seek(start)
        table = stream.read(8)
        if len(table) < 8:
            return True
        at = struct.unpack("<q", table)[0]
        if at == -1:  # a writer that could not seek put the place of the table at the very end
            stream.seek(size - 8)
            at = struct.unpack("<q", stream.read(8))[0]
    return not start < at <= size - 8


def _chunks(path: Path, header: Any) -> tuple[list[tuple[int, int]], bool]:
    """(points, bytes) of each chunk, and whether these counts are exact; none where the table cannot be read."""
    import lazrs

    record = next((vlr for vlr in header.vlrs if vlr.user_id == "laszip encoded"), None)
    if record is None:
        return [], False
    try:
        laz = lazrs.LazVlr(record.record_data)
        with open(path, "rb") as stream:
            stream.seek(header.offset_to_point_data)
            chunks = [(int(count), int(length)) for count, length in lazrs.read_chunk_table(stream, laz)]
        return chunks, bool(laz.uses_variable_size_chunks())
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException:  # the library panics on broken tables; reading the points says what is wrong
        return [], False
