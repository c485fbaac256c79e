"""LAS, LAZ and COPC files read point by point, with broken headers and broken ends caught."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from .file_crs import short
from .las_header import las_stream
from .stored_points import breaks_off, held_beyond_promise


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
            raise InputError(_unreadable(path, reader.header, count, problem)) from None
        count += len(points)
        yield points
    if count != promised:
        raise InputError(_truncated(path, promised, count))


def is_copc(header: Any) -> bool:
    """Whether a laspy header is a COPC file's."""
    return any(vlr.user_id == "copc" and vlr.record_id == 1 for vlr in header.vlrs)


def writable_version(header: Any) -> str:
    """The version of a laspy header, or, of one that is read but not written (1.0), the oldest that is and holds its
    point format."""
    import laspy

    known, own = sorted(laspy.supported_versions()), str(header.version)
    oldest = "1.4" if header.point_format.id > 5 else "1.2"
    return own if own in known else oldest


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


def _unreadable(path: Path, header: Any, count: int, problem: BaseException) -> str:
    """What a decoder's exception means: a file that is too short says so by its own structure."""
    if breaks_off(path, header):
        return (
            f"{path}: breaks off after {count} of {header.point_count} points ({short(problem)}); copy or download it "
            "again."
        )
    return (
        f"{path}: its points cannot be decoded after {count} of {header.point_count} ({short(problem)}), though the "
        "file has its whole length; copy it again, or, if that does not help, export it again as LAS 1.2 or 1.4."
    )


def _truncated(path: Path, promised: int, found: int) -> str:
    return f"{path}: {_promise(promised, found)}; copy it again."


def _promise(promised: int, found: int) -> str:
    return f"is truncated: the header promises {promised} points, the file holds {found}"
