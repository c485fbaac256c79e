"""LAS/LAZ (and plain text) files in and out, in chunks, with their traps caught."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyproj

from ..core.crs import check_projected, project_crs
from ..core.errors import CRSError, InputError
from ..core.files import atomic_path
from .cloud import PointCloud, concatenate, horizontal

#: What ``--crs`` takes for a cloud in local metres without a place on the map (a terrestrial scan).
LOCAL = "local"
#: What layers made from such a cloud are written in.
LOCAL_CRS = pyproj.CRS.from_wkt('LOCAL_CS["local metres",UNIT["metre",1]]')
_TEXT = (".txt", ".xyz", ".asc", ".pts", ".csv")
_KEPT = ("intensity", "return_number", "number_of_returns", "classification", "gps_time", "red", "green", "blue")
_RGB = ("red", "green", "blue")


def read_cloud(path: Path, bounds: tuple[float, float, float, float] | None = None, crs: str | None = None,
               attributes: tuple[str, ...] | None = None, need_crs: bool = True) -> PointCloud:
    """Read a LAS, LAZ, COPC or text (x y z per line) cloud.

    bounds: west, south, east, north to keep. crs: what the user says (``EPSG:...`` or ``local``), for files without a
    CRS; it must not contradict the file. attributes: names to keep (default: all known ones and every extra
    dimension). need_crs: refuse a file whose CRS nobody knows.

    Raises:
        InputError: missing, not a cloud, truncated, empty, or no point within ``bounds``.
        CRSError: missing, geographic, not metric, or contradictory CRS.
    """
    pieces = [piece for piece in iter_cloud(path, bounds, crs, attributes, need_crs) if len(piece)]
    if not pieces:
        where = " within the given bounds" if bounds else ""
        raise InputError(f"{path}: holds no point{where}, expected a point cloud; check the file and the extent.")
    return pieces[0] if len(pieces) == 1 else concatenate(pieces)


def iter_cloud(path: Path, bounds: tuple[float, float, float, float] | None = None, crs: str | None = None,
               attributes: tuple[str, ...] | None = None, need_crs: bool = True,
               chunk_points: int = 2_000_000) -> Iterator[PointCloud]:
    """Like :func:`read_cloud`, piece by piece in bounded memory."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: not found; give a LAS, LAZ or text point cloud.")
    if path.suffix.lower() in _TEXT:
        yield _clip(_read_text(path, _agree(None, crs, path, need_crs)), bounds)
        return
    yield from _iter_las(path, bounds, crs, attributes, need_crs, chunk_points)


def write_cloud(path: Path, cloud: PointCloud, scale: float = 0.001, offsets: np.ndarray | None = None) -> None:
    """Write LAS 1.4 (``.las``) or LAZ (``.laz``), coordinates to ``scale``, extra attributes as extra dimensions.

    offsets: (3,) of the file (default: whole metres at the cloud's minimum).

    Raises:
        OutputError: the folder cannot be written. InputError: another ending than .las or .laz.
    """
    import laspy

    path = Path(path)
    if path.suffix.lower() not in (".las", ".laz"):
        raise InputError(f"{path}: found ending {path.suffix!r}, expected .laz or .las; rename the output.")
    coloured = all(name in cloud.attributes for name in _RGB)
    header = laspy.LasHeader(version="1.4", point_format=7 if coloured else 6)
    header.scales = np.full(3, scale)
    if offsets is None:
        offsets = np.floor(cloud.xyz.min(axis=0)) if len(cloud) else np.zeros(3)
    header.offsets = np.asarray(offsets, float)
    if cloud.crs is not None:
        header.add_crs(cloud.crs, keep_compatibility=False)
    known = set(header.point_format.dimension_names)
    extra = {name: values for name, values in cloud.attributes.items() if name not in known and name not in _RGB}
    header.add_extra_dims([laspy.ExtraBytesParams(name=name[:32], type=_las_type(values))
                           for name, values in extra.items()])
    data = laspy.LasData(header)
    data.x, data.y, data.z = cloud.xyz[:, 0], cloud.xyz[:, 1], cloud.xyz[:, 2]
    for name, values in cloud.attributes.items():
        if name in known or name in extra:
            data[name[:32]] = values.astype(_las_type(values)) if name in extra else values
    with atomic_path(path) as temporary:
        data.write(str(temporary))


def _las_type(values: np.ndarray) -> str:
    if values.dtype == bool:
        return "uint8"
    return values.dtype.name


def _iter_las(path: Path, bounds: Any, crs: str | None, attributes: tuple[str, ...] | None, need_crs: bool,
              chunk_points: int) -> Iterator[PointCloud]:
    import laspy

    broken = (laspy.errors.LaspyException, ValueError, OSError, EOFError, RuntimeError, OverflowError, MemoryError)
    try:
        reader = laspy.open(path)
        header = reader.header
        promised = header.point_count
        scales = np.asarray(header.scales)
    except broken as problem:
        raise InputError(f"{path}: is not a LAS/LAZ file that can be read ({_short(problem)}); "
                         "export it again from your LiDAR software.") from None
    except Exception as problem:  # laspy lets struct and pyproj errors of broken headers through
        raise InputError(f"{path}: has a broken LAS header ({_short(problem)}); export it again.") from None
    with reader:
        if not np.isfinite(scales).all() or (scales <= 0).any():
            raise InputError(f"{path}: the header gives coordinate scales {scales.tolist()}, expected positive ones; "
                             "export it again.")
        if path.suffix.lower() == ".las" or not header.are_points_compressed:
            stored = (path.stat().st_size - header.offset_to_point_data) // max(header.point_format.size, 1)
            if stored < promised:
                raise InputError(_truncated(path, promised, stored))
        own = _agree(_file_crs(header, path), crs, path, need_crs)
        names = _names(header, attributes)
        count = 0
        try:
            for points in reader.chunk_iterator(chunk_points):
                count += len(points)
                xyz = np.column_stack([np.asarray(points.x), np.asarray(points.y), np.asarray(points.z)])
                values = {name: np.asarray(points[name]) for name in names}
                yield _clip(PointCloud(xyz, own, values), bounds)
        except broken as problem:
            raise InputError(f"{path}: breaks off after {count} of {promised} points ({_short(problem)}); "
                             "copy or download it again.") from None
        except Exception as problem:
            if type(problem).__module__.startswith(("lazrs", "laspy")):
                raise InputError(f"{path}: breaks off after {count} of {promised} points ({_short(problem)}); "
                                 "copy or download it again.") from None
            raise
        if count != promised:
            raise InputError(_truncated(path, promised, count))


def _truncated(path: Path, promised: int, found: int) -> str:
    return f"{path}: is truncated: the header promises {promised} points, the file holds {found}; copy it again."


def _names(header: Any, attributes: tuple[str, ...] | None) -> list[str]:
    there = list(header.point_format.dimension_names)
    extra = list(header.point_format.extra_dimension_names)
    wanted = [name for name in (*_KEPT, *extra) if name in there]
    return [name for name in wanted if attributes is None or name in attributes]


def _clip(cloud: PointCloud, bounds: tuple[float, float, float, float] | None) -> PointCloud:
    finite = np.isfinite(cloud.xyz).all(axis=1)
    if bounds is not None:
        west, south, east, north = bounds
        x, y = cloud.xyz[:, 0], cloud.xyz[:, 1]
        finite &= (x >= west) & (x <= east) & (y >= south) & (y <= north)
    return cloud if finite.all() else cloud.select(finite)


def _file_crs(header: Any, path: Path) -> pyproj.CRS | None:
    try:
        return header.parse_crs()
    except Exception as problem:
        raise CRSError(f"{path}: its CRS record is unreadable ({_short(problem)}); export the cloud again.") from None


def _agree(own: pyproj.CRS | None, given: str | None, path: Path, need_crs: bool) -> pyproj.CRS | None:
    """The CRS to work in, from the file's and the user's word."""
    if own is not None and not own.is_geographic and not own.is_projected and given and given.lower() != LOCAL:
        own = None  # an engineering CRS says nothing about the place: the user's word fills it in
    if own is not None:
        base = horizontal(own)
        assert base is not None
        check_projected(base, str(path))
        for part in own.sub_crs_list if own.is_compound else []:
            unit = part.axis_info[0].unit_name if part.is_vertical and part.axis_info else "metre"
            if unit not in ("metre", "meter"):
                raise CRSError(f"{path}: heights are in {unit}, expected metres; convert the cloud to metres.")
        if given and given.lower() == LOCAL:
            return own
        if given and not same_place(base, project_crs(given)):
            raise CRSError(f"{path}: is in {base.name}, but --crs says {given}; leave --crs out or reproject it.")
        return own
    if given and given.lower() == LOCAL:
        return None
    if given:
        return project_crs(given)
    if need_crs:
        raise CRSError(f"{path}: holds no CRS, expected a projected one in metres; give it with --crs EPSG:CODE "
                       f"(or --crs {LOCAL} for a scan in local metres).")
    return None


def same_place(one: pyproj.CRS, other: pyproj.CRS) -> bool:
    """True when two horizontal CRS are the same, apart from metadata and axis order."""
    first, second = horizontal(one), horizontal(other)
    assert first is not None and second is not None
    if first.equals(second, ignore_axis_order=True):
        return True
    codes = first.to_epsg(min_confidence=70), second.to_epsg(min_confidence=70)
    return codes[0] is not None and codes[0] == codes[1]


def _read_text(path: Path, crs: pyproj.CRS | None) -> PointCloud:
    """x y z per line (blank, comma, semicolon or tab between), one optional header line that names the columns."""
    try:
        with open(path, encoding="utf-8-sig") as stream:
            first = stream.readline()
    except (OSError, UnicodeDecodeError) as problem:
        raise InputError(f"{path}: is not a text file ({_short(problem)}); give x y z per line.") from None
    delimiter = next((mark for mark in (",", ";", "\t") if mark in first), None)
    words = [word.strip().lower() for word in first.strip().lstrip("#/").split(delimiter)]
    has_header = not all(_is_number(word) for word in words)
    names = words if has_header else []
    if len(words) < 3:
        raise InputError(f"{path}: its first line has {len(words)} columns, expected x y z; give x y z per line.")
    try:
        table = np.loadtxt(path, delimiter=delimiter, skiprows=int(has_header), ndmin=2, encoding="utf-8-sig")
    except ValueError as problem:
        raise InputError(f"{path}: is not a table of numbers ({_short(problem)}); give x y z per line.") from None
    where = [names.index(axis) for axis in "xyz"] if all(axis in names for axis in "xyz") else [0, 1, 2]
    if table.size == 0:
        table = table.reshape(0, max(len(words), 3))
    extra = {name: table[:, column] for column, name in enumerate(names[:table.shape[1]]) if column not in where}
    return PointCloud(np.ascontiguousarray(table[:, where]), crs, extra)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _short(problem: BaseException) -> str:
    text = " ".join(str(problem).split()) or type(problem).__name__
    return text[:120]
