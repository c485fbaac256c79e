"""LAS, LAZ and COPC files read point by point, with broken headers and broken ends caught."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from .file_crs import short
from .stored_points import held_beyond_promise


def _broken() -> tuple[type[BaseException], ...]:
    import laspy

    return (laspy.errors.LaspyException, ValueError, OSError, EOFError, RuntimeError, OverflowError, MemoryError)


def open_reader(path: Path) -> Any:
    """laspy's reader, its header checked.

    Raises:
        InputError: no LAS, a header that cannot be, or one that promises more points than the file can hold.
    """
    import laspy

    _check_public_header(path)
    try:
        reader = laspy.open(path)
        header = reader.header
        promised, scales, offsets = header.point_count, np.asarray(header.scales), np.asarray(header.offsets)
    except _broken() as problem:
        raise InputError(
            f"{path}: is not a LAS/LAZ file that can be read ({short(problem)}); "
            "export it again from your LiDAR software."
        ) from None
    except BaseException as problem:  # laspy lets struct and pyproj errors, lazrs panics of broken headers through
        if isinstance(problem, (KeyboardInterrupt, SystemExit)):
            raise
        raise InputError(f"{path}: has a broken LAS header ({short(problem)}); export it again.") from None
    trouble = ""
    if not np.isfinite(scales).all() or (scales <= 0).any() or (scales > 100).any():
        trouble = f"the header gives coordinate scales {scales.tolist()}, expected positive ones (0.001)"
    elif not np.isfinite(offsets).all() or (np.abs(offsets) > 1e9).any():
        trouble = f"the header gives coordinate offsets {offsets.tolist()}, expected map coordinates"
    elif path.suffix.lower() == ".las" or not header.are_points_compressed:
        stored = (path.stat().st_size - header.offset_to_point_data) // max(header.point_format.size, 1)
        trouble = _promise(promised, stored) if stored < promised else ""
    if not trouble and (held := held_beyond_promise(path, header)):
        trouble = f"the header promises {promised:,} points, the file holds {held}, expected the same number"
    if trouble:
        reader.close()
        raise InputError(f"{path}: {trouble}; export or copy it again.")
    return reader


def _check_public_header(path: Path) -> None:
    """Sizes in the first bytes that would make a reader ask for absurd memory are refused before it does.

    Raises:
        InputError: the file is shorter than what its header says lies in front of the points.
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
    if not 227 <= header_size <= to_points <= size or n_vlrs * 54 > to_points or record_size < 20:
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


def iter_points(path: Path, reader: Any, chunk_points: int) -> Iterator[Any]:
    """laspy's point records, chunk by chunk; a file that breaks off or holds fewer points than promised is named.

    Raises:
        InputError: see above.
    """
    promised, count = reader.header.point_count, 0
    chunks = iter(reader.chunk_iterator(chunk_points))
    while True:
        try:
            points = next(chunks)
        except StopIteration:
            break
        except BaseException as problem:  # a panic in the decompressor is a BaseException
            if isinstance(problem, (KeyboardInterrupt, SystemExit, GeneratorExit, MemoryError)):
                raise
            raise InputError(
                f"{path}: breaks off after {count} of {promised} points ({short(problem)}); copy or download it again."
            ) from None
        count += len(points)
        yield points
    if count != promised:
        raise InputError(_truncated(path, promised, count))


def is_copc(header: Any) -> bool:
    """Whether a laspy header is a COPC file's."""
    return any(vlr.user_id == "copc" and vlr.record_id == 1 for vlr in header.vlrs)


def copc_pieces(path: Path, bounds: tuple[float, float, float, float]) -> Iterator[Any]:
    """The points of a COPC file near a box, by its index: the rest of the file is not read.

    Raises:
        InputError: the index is broken.
    """
    import laspy

    west, south, east, north = bounds
    try:
        with laspy.CopcReader.open(path) as reader:
            low, high = reader.header.mins[2] - 1.0, reader.header.maxs[2] + 1.0
            yield reader.query(laspy.Bounds(np.array([west, south, low]), np.array([east, north, high])))
    except _broken() as problem:
        raise InputError(f"{path}: its COPC index cannot be read ({short(problem)}); copy it again.") from None


def _truncated(path: Path, promised: int, found: int) -> str:
    return f"{path}: {_promise(promised, found)}; copy it again."


def _promise(promised: int, found: int) -> str:
    return f"is truncated: the header promises {promised} points, the file holds {found}"
