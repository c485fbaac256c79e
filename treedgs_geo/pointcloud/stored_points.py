"""How many points a LAS or LAZ file holds, by its own structure and not by the count in its header."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

#: Fewer points than this beyond the promised ones may be padding that a writer left at the end.
_PADDING = 100


def held_beyond_promise(path: Path, header: Any) -> str:
    """How many points the file holds, in words, where that is clearly more than the header says; empty otherwise.

    header: laspy's. LAS: the bytes up to the first extended record. LAZ: the chunk table (``laszip`` writes a table of
    equal chunks; the layered chunks of formats 6-10 also begin with their own count, and no chunk of the others is
    longer than its points uncompressed).
    """
    promised, size = header.point_count, max(header.point_format.size, 1)
    end = path.stat().st_size
    if header.number_of_evlrs and header.offset_to_point_data < header.start_of_first_evlr < end:
        end = header.start_of_first_evlr
    waveforms = getattr(header, "start_of_waveform_data_packet_record", 0) or 0
    if header.offset_to_point_data < waveforms < end:
        end = waveforms
    if header.are_points_compressed:
        return _held_in_chunks(path, header, promised, size)
    held = (end - header.offset_to_point_data) // size
    return f"{held:,}" if held - promised > max(_PADDING, promised // 100) else ""


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


def _held_in_chunks(path: Path, header: Any, promised: int, size: int) -> str:
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
            return [(int(count), int(length)) for count, length in lazrs.read_chunk_table(stream, laz)], bool(
                laz.uses_variable_size_chunks()
            )
    except BaseException as problem:  # the library panics on broken tables; reading the points says what is wrong
        if isinstance(problem, (KeyboardInterrupt, SystemExit)):
            raise
        return [], False
