"""A small COPC file, written by the specification (copc.io, 1.0) with lazrs: an octree of two levels."""

from __future__ import annotations

import struct
from pathlib import Path

import laspy
import lazrs
import numpy as np


def write_copc(path: Path, las: laspy.LasData) -> None:
    """Write a LAS 1.4 point format 6 cloud as COPC: every eighth point in the root node, the rest in its children."""
    xyz = np.column_stack([las.x, las.y, las.z])
    low = xyz.min(axis=0)
    half = float((xyz.max(axis=0) - low).max()) / 2 + 0.01
    centre = low + half
    child = (xyz >= centre).astype(int)
    node = np.where(np.arange(len(xyz)) % 8 == 0, -1, child[:, 0] + 2 * child[:, 1] + 4 * child[:, 2])
    laz = lazrs.LazVlr.new_for_compression(6, 0, True)
    record, wkt = laz.record_data(), las.header.parse_crs().to_wkt("WKT1_GDAL").encode() + b"\0"
    to_points = 375 + 54 + 160 + 54 + len(record) + 54 + len(wkt)
    entries = []
    with open(path, "w+b") as stream:
        stream.write(b"\0" * to_points)
        compressor = lazrs.LasZipCompressor(stream, laz)
        compressor.reserve_offset_to_chunk_table()
        for key in np.unique(node):
            rows = las.points.array[node == key]
            start = stream.tell()
            compressor.compress_many(np.frombuffer(rows.tobytes(), np.uint8))
            compressor.finish_current_chunk()
            stream.flush()
            level = (0, 0, 0, 0) if key < 0 else (1, int(key) & 1, int(key) >> 1 & 1, int(key) >> 2 & 1)
            entries.append(struct.pack("<4iQ2i", *level, start, stream.tell() - start, len(rows)))
        compressor.done()
        stream.seek(0, 2)
        evlr = stream.tell()
        pages = b"".join(entries)
        stream.write(struct.pack("<H16sHQ32s", 0, b"copc", 1000, len(pages), b"") + pages)
        stream.seek(0)
        header = struct.pack(
            "<4sHHIHH8sBB32s32sHHHIIBHI20s",
            b"LASF",
            0,
            17,
            0,
            0,
            0,
            b"",
            1,
            4,
            b"",
            b"",
            1,
            2026,
            375,
            to_points,
            3,
            6 | 128,
            30,
            0,
            b"",
        )
        header += struct.pack("<6d", *las.header.scales, *las.header.offsets)
        header += struct.pack("<6d", *(v for a, b in zip(xyz.max(axis=0), low, strict=True) for v in (a, b)))
        header += struct.pack("<QQIQ15Q", 0, evlr, 1, len(xyz), len(xyz), *([0] * 14))
        stream.write(header)
        info = struct.pack("<5dQQ2d88s", *centre, half, 1.0, evlr + 60, len(pages), 0.0, 0.0, b"")
        for user, number, data in (
            (b"copc", 1, info),
            (b"laszip encoded", 22204, record),
            (b"LASF_Projection", 2112, wkt),
        ):
            stream.write(struct.pack("<H16sHH32s", 0, user, number, len(data), b"") + data)
        assert stream.tell() == to_points
