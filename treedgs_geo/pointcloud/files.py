"""LAS/LAZ (and plain text, E57) files in and out (PLY: out), in chunks, with their traps caught; every scan of an
E57 is set up where its pose says."""

from __future__ import annotations

import contextlib
import copy
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
from numba import njit

from ..core.errors import InputError, MissingComponentError
from ..core.files import atomic_path
from ..core.machine import ahead
from ..core.settings import CLOUD_OUTPUTS
from .cloud import PointCloud, concatenate, extent, in_box
from .file_crs import agreed_crs, file_crs, short
from .las_reader import copc_pieces, is_copc, iter_points, open_reader, writable_version
from .ply_file import ply_writer
from .text_files import iter_text

_TEXT = (".txt", ".xyz", ".asc", ".pts", ".csv")
_KEPT = ("intensity", "return_number", "number_of_returns", "classification", "gps_time", "red", "green", "blue")
_RGB = ("red", "green", "blue")


@dataclass(frozen=True)
class About:
    """What a file says of itself: points, extent (3,), coordinate scale and offset (``None`` for text)."""

    n_points: int
    low: np.ndarray
    high: np.ndarray
    scale: np.ndarray | None = None
    offset: np.ndarray | None = None


def has_no_layout(path: Path) -> bool:
    """True for a cloud in text lines or E57, by its ending: its points are not stored as LAS stores them."""
    return Path(path).suffix.lower() in _TEXT or is_e57(path)


def describe_cloud(path: Path) -> About:
    """Number of points and extent from the header, without reading the points (text: counted by its size, extent
    unknown; E57: extent unknown).

    Raises:
        InputError: missing or not a cloud. MissingComponentError: E57 without pye57.
    """
    path = _there(path)
    if is_e57(path):
        with _opened(path) as file:
            # Those without a return among them.
            count = sum(int(file.get_header(scan).point_count) for scan in range(file.scan_count))
    else:
        count = path.stat().st_size // 20
    if has_no_layout(path):
        return About(count, np.zeros(3), np.full(3, np.inf))
    with open_reader(path) as reader:
        header = reader.header
        said = header.mins, header.maxs, header.scales, header.offsets
        return About(header.point_count, *(np.asarray(values, float) for values in said))


def _there(path: Path) -> Path:
    if not Path(path).is_file():
        raise InputError(f"{path}: not found; give a LAS, LAZ, E57 or text point cloud.")
    return Path(path)


def read_cloud(
    path: Path,
    bounds: tuple[float, float, float, float] | None = None,
    crs: str | None = None,
    attributes: tuple[str, ...] | None = None,
    need_crs: bool = True,
) -> PointCloud:
    """Read a LAS, LAZ, COPC, E57 or text (x y z per line) cloud.

    bounds: west, south, east, north to keep. crs: what the user says (``EPSG:...`` or ``local``), for files without a
    CRS; it must not contradict the file. attributes: names to keep (default: all known ones and every extra
    dimension). need_crs: refuse a file whose CRS nobody knows.

    Raises:
        InputError: missing, not a cloud, truncated, empty, or no point within ``bounds``.
        CRSError: missing, geographic, not metric, or contradictory CRS.

    Examples:
        >>> import treedgs_geo as tg
        >>> cloud = tg.read_cloud(plot / "lidar" / "test_uls.laz")
        >>> cloud.xyz.shape[1], cloud.horizontal_crs.to_epsg()
        (3, 6344)
    """
    return gathered(
        path, iter_cloud(path, bounds, crs, attributes, need_crs), " within the given bounds" if bounds else ""
    )


def gathered(path: Path, pieces: Iterator[PointCloud], where: str = "") -> PointCloud:
    """One cloud of the pieces of a file. where: what chose its points, for the message.

    Raises:
        InputError: there is no point.
    """
    pieces = (piece for piece in pieces if len(piece))
    first = next(pieces, None)
    if first is None:
        raise InputError(f"{path}: holds no point{where}, expected a point cloud; check the file and the extent.")
    cloud = concatenate(itertools.chain([first], pieces))
    del first
    # What is zero throughout is what a writer fills in anyway: it need not be carried along.
    extras = cloud.attributes if cloud.layout is None else set(cloud.layout.point_format.extra_dimension_names)
    kept = {
        name: values for name, values in cloud.attributes.items() if name in _KEPT or name in extras or values.any()
    }
    return PointCloud(cloud.xyz, cloud.crs, kept, cloud.layout)


def iter_cloud(
    path: Path,
    bounds: tuple[float, float, float, float] | None = None,
    crs: str | None = None,
    attributes: tuple[str, ...] | None = None,
    need_crs: bool = True,
    chunk_points: int = 2_000_000,
) -> Iterator[PointCloud]:
    """Like :func:`read_cloud`, piece by piece in bounded memory."""
    path = _there(path)
    if has_no_layout(path):
        for piece in iter_without_layout(path, crs, need_crs, chunk_points):
            kept = piece.attributes if attributes is None else set(attributes) & set(piece.attributes)
            yield _clip(replace(piece, attributes={name: piece.attributes[name] for name in kept}), bounds)
        return
    with open_reader(path, attributes) as reader:
        header = reader.header
        middle = tuple((header.mins[:2] + header.maxs[:2]) / 2)
        own = agreed_crs(file_crs(header, path, crs), crs, path, need_crs, middle)
        there = (name for name in header.point_format.dimension_names if name not in ("X", "Y", "Z"))
        names = [name for name in there if attributes is None or name in attributes]
        pieces = iter_points(path, reader, chunk_points)
        if bounds is not None and is_copc(header):
            pieces = copc_pieces(path, bounds)
        with contextlib.closing(ahead(pieces)) as pieces_ahead:
            for points in pieces_ahead:
                stored = (np.ascontiguousarray(points.array[axis]) for axis in "XYZ")
                xyz = placed(*stored, np.array(points.scales), np.array(points.offsets))
                values = {name: np.asarray(points[name]) for name in names}
                yield _clip(PointCloud(xyz, own, values, header), bounds)


def iter_without_layout(path: Path, crs: str | None, need_crs: bool, chunk_points: int) -> Iterator[PointCloud]:
    """The points of a text or E57 cloud, piece by piece."""
    if is_e57(path):
        return iter_e57(path, crs, need_crs, chunk_points)
    return iter_text(path, agreed_crs(None, crs, path, need_crs), chunk_points)


def write_cloud(path: Path, cloud: PointCloud, scale: float | None = None) -> None:
    """Write LAS (``.las``), LAZ (``.laz``) or PLY (``.ply``) with extra attributes as extra dimensions.

    A cloud that was read from LAS keeps point format, version, scale, offsets, VLRs and types. Others become LAS 1.4,
    format 6 (7 with colours), 1 mm, whole metres at the cloud's minimum as offset. scale: another one. PLY holds the
    coordinates as float64 and no CRS.

    Raises:
        OutputError: the folder cannot be written. InputError: another ending, or COPC.

    Examples:
        >>> import numpy as np
        >>> import treedgs_geo as tg
        >>> tg.write_cloud(work / "two.laz", tg.PointCloud(np.zeros((2, 3)), attributes={"tree_id": np.array([1, 2])}))
        >>> tg.read_cloud(work / "two.laz", crs="local").attributes["tree_id"].tolist()
        [1, 2]
    """
    import laspy

    path = Path(path)
    check_cloud_output(path)
    if is_ply(path):
        with ply_writer(path) as write:
            write(cloud.xyz, cloud.attributes)
        return
    values_of = {name[:32]: values for name, values in cloud.attributes.items()}
    if "scan_angle_rank" in values_of and (cloud.layout is None or cloud.layout.point_format.id > 5):
        values_of["scan_angle"] = np.round(values_of.pop("scan_angle_rank") / 0.006).astype(np.int16)
    kinds = {name: "uint8" if values.dtype == bool else values.dtype.name for name, values in values_of.items()}
    header = new_header(path, cloud, kinds)
    header.remove_extra_dims([name for name in header.point_format.extra_dimension_names if name not in values_of])
    if scale is not None:
        header.scales = np.full(3, scale)
    if cloud.layout is None or not _fits(cloud.xyz, header):
        header.offsets = np.floor(cloud.xyz.min(axis=0)) if len(cloud) else np.zeros(3)
    record = laspy.ScaleAwarePointRecord.zeros(len(cloud), header=header)
    record.x, record.y, record.z = cloud.xyz.T
    for name, values in values_of.items():
        record[name] = values
    with atomic_path(path) as temporary, laspy.open(temporary, "w", header=header) as writer:
        writer.write_points(record)


def is_ply(path: Path) -> bool:
    """By its ending."""
    return path.suffix.lower() == ".ply"


def new_header(path: Path, cloud: PointCloud, extra: dict[str, str]) -> Any:
    """laspy's header of a new file: of points stored as those of ``cloud`` (of no LAS file: 1.4, format 6 or, with
    colours, 7, millimetres), with ``extra`` dimensions, name -> type, that the format does not have.

    Raises:
        InputError: waveform points for LAZ, whose compressor loses their packet fields where there are several scanner
            channels.
    """
    import laspy

    if cloud.layout is None:
        header = laspy.LasHeader(version="1.4", point_format=7 if all(name in cloud.attributes for name in _RGB) else 6)
        header.scales = np.full(3, 0.001)
    else:
        if cloud.layout.point_format.id in (9, 10) and path.suffix.lower() == ".laz":
            raise InputError(
                f"{path}: waveform points (format {cloud.layout.point_format.id}) do not survive LAZ compression "
                "unharmed, expected .las for them; rename the output."
            )
        header = copy.deepcopy(cloud.layout)
        header.version = laspy.header.Version.from_str(writable_version(header))
        # What belongs to the other file: its compression, its index, a CRS that is not the points'.
        kept_crs = cloud.crs is not None and cloud.crs == header.parse_crs()
        users = {"copc", "laszip encoded"} | (set() if kept_crs else {"LASF_Projection"})
        header.vlrs = laspy.vlrs.vlrlist.VLRList([vlr for vlr in header.vlrs if vlr.user_id not in users])
        if header.evlrs is not None:
            header.evlrs = laspy.vlrs.vlrlist.VLRList([vlr for vlr in header.evlrs if vlr.user_id not in users])
    if cloud.crs is not None and header.parse_crs() is None:
        header.add_crs(cloud.crs, keep_compatibility=False)
    there = set(header.point_format.dimension_names)
    header.add_extra_dims(
        [laspy.ExtraBytesParams(name=name, type=kind) for name, kind in extra.items() if name not in there]
    )
    return header


def check_cloud_output(path: Path) -> None:
    """InputError for an output that is no LAS, LAZ or PLY by its name, or promises an index which is not written."""
    if Path(path).suffix.lower().lstrip(".") not in CLOUD_OUTPUTS:
        raise InputError(f"{path}: found ending {Path(path).suffix!r}, expected .laz, .las or .ply; rename the output.")
    if str(path).lower().endswith(".copc.laz"):
        raise InputError(f"{path}: COPC is read but not written, expected .laz; rename the output.")


def _fits(xyz: np.ndarray, header: Any) -> bool:
    """True when the coordinates can be held as 32-bit multiples of the header's scale."""
    reach = np.abs(np.vstack(extent(xyz)) - header.offsets) / header.scales if len(xyz) else np.zeros(1)
    return bool((reach < 2**31 - 1).all())


@njit(cache=True, nogil=True)
def placed(x, y, z, scale, offset):  # pragma: no cover - compiled
    """(N, 3) coordinates of whole numbers as LAS stores them."""
    xyz = np.empty((len(x), 3))
    for m in range(len(x)):
        xyz[m, 0], xyz[m, 1] = x[m] * scale[0] + offset[0], y[m] * scale[1] + offset[1]
        xyz[m, 2] = z[m] * scale[2] + offset[2]
    return xyz


def _clip(cloud: PointCloud, bounds: tuple[float, float, float, float] | None) -> PointCloud:
    west, south, east, north = bounds or (-np.inf, -np.inf, np.inf, np.inf)
    inside = in_box(cloud.xyz, np.array([west, south, -np.inf]), np.array([east, north, np.inf]))
    return cloud if inside.all() else cloud.select(inside)


_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLOURS = {"colorRed": "red", "colorGreen": "green", "colorBlue": "blue"}


def is_e57(path: Path) -> bool:
    """True for an E57 file, by its ending."""
    return Path(path).suffix.lower() == ".e57"


def iter_e57(path: Path, crs: str | None, need_crs: bool, chunk_points: int) -> Iterator[PointCloud]:
    """The points that have a return, scan by scan. ``point_source_id``: number of the scan, from 1; intensity and
    colours over the whole range of 16 bits, as LAS has them.

    Raises:
        InputError: no E57, damaged, or a scan without coordinates. MissingComponentError: pye57 is not installed.
        CRSError: see :func:`.file_crs.agreed_crs`.
    """
    with _opened(path) as file:
        agreed = agreed_crs(_own_crs(file), crs, path, need_crs)
        fields = [set(file.get_header(scan).point_fields) for scan in range(file.scan_count)]
        common = set.intersection(*fields) if fields else set()
        for scan in range(file.scan_count):
            try:
                yield from _scan(file, scan, agreed, chunk_points, path, common)
            except (RuntimeError, ValueError, KeyError) as problem:
                raise InputError(
                    f"{path}: scan {scan + 1} of {file.scan_count} cannot be read ({short(problem)}); copy it again, "
                    "or export it as LAS or LAZ from the scanner's software."
                ) from None


def _opened(path: Path) -> Any:
    try:
        import pye57
    except ImportError:
        raise MissingComponentError(
            f"{path}: reading E57 needs the library pye57, which is not installed; pip install 'treedgs-geo[e57]', or "
            "export the cloud as LAS or LAZ (CloudCompare: File > Save)."
        ) from None
    try:
        return pye57.E57(str(path))
    except Exception as problem:
        raise InputError(
            f"{path}: is not an E57 file that can be read ({short(problem)}); copy it again, or export it "
            "as LAS or LAZ."
        ) from None


def _own_crs(file: Any) -> pyproj.CRS | None:
    try:
        return pyproj.CRS.from_user_input(file.root["coordinateMetadata"].value())
    except Exception:  # no such node, empty, or words that are no CRS
        return None


def _scan(
    file: Any, scan: int, crs: pyproj.CRS | None, chunk_points: int, path: Path, common: set[str]
) -> Iterator[PointCloud]:
    """common: the fields that every scan has; of intensity and colours no others are read."""
    header = file.get_header(scan)
    there = list(header.point_fields)
    axes = next((axes for axes in (_CARTESIAN, _SPHERICAL) if all(name in there for name in axes)), None)
    if axes is None:
        raise InputError(
            f"{path}: scan {scan + 1} has the fields {', '.join(there)}, expected x, y, z or range and angles; export "
            "it as LAS or LAZ."
        )
    invalid = "cartesianInvalidState" if axes is _CARTESIAN else "sphericalInvalidState"
    names = [*axes, *(name for name in (invalid,) if name in there)]
    names += [name for name in ("intensity", *_COLOURS) if name in common]
    data, buffers = file.make_buffers(names, min(chunk_points, max(int(header.point_count), 1)))
    reader = header.points.reader(buffers)
    while count := reader.read():
        part = {name: values[:count] for name, values in data.items()}
        good = part[invalid] == 0 if invalid in part else np.ones(count, bool)
        xyz = np.column_stack([part[name] for name in axes])[good]
        if axes is _SPHERICAL:
            reach, azimuth, elevation = xyz.T
            flat = reach * np.cos(elevation)
            xyz = np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), reach * np.sin(elevation)])
        if header.has_pose():
            xyz = file.to_global(xyz, header.rotation, header.translation)
        values = {"point_source_id": np.full(len(xyz), scan + 1, np.uint16)}
        if "intensity" in part:
            values["intensity"] = _in_16_bits(part["intensity"][good], *_limits(header, "intensity"))
        for name, short_name in _COLOURS.items():
            if name in part:
                values[short_name] = _in_16_bits(part[name][good], 0, 255)
        yield PointCloud(np.ascontiguousarray(xyz), crs, values)
    reader.close()


def _limits(header: Any, name: str) -> tuple[float, float]:
    try:
        node = header["intensityLimits"]
        return float(node[f"{name}Minimum"].value()), float(node[f"{name}Maximum"].value())
    except Exception:  # optional in the format
        return 0.0, 1.0


def _in_16_bits(values: np.ndarray, low: float, high: float) -> np.ndarray:
    share = (values.astype(float) - low) / (high - low if high > low else 1.0)
    return np.round(np.clip(share, 0, 1) * 65535).astype(np.uint16)
