"""Clouds in E57, as terrestrial scanners write them: every scan set up where its pose says, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyproj

from ..core.errors import InputError, MissingComponentError
from .cloud import PointCloud
from .file_crs import agreed_crs, short

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLOURS = {"colorRed": "red", "colorGreen": "green", "colorBlue": "blue"}


def is_e57(path: Path) -> bool:
    """True for an E57 file, by its ending."""
    return Path(path).suffix.lower() == ".e57"


def count_e57(path: Path) -> int:
    """How many points all scans hold by their headers, those without a return among them.

    Raises:
        InputError, MissingComponentError: as :func:`iter_e57`.
    """
    with _opened(path) as file:
        return sum(int(file.get_header(scan).point_count) for scan in range(file.scan_count))


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
