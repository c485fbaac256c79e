"""A cloud copied to a new file chunk by chunk, with dimensions added: in LAS and LAZ point format, extra dimensions,
VLRs and the stored integers of every coordinate stay as they are."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyproj

from ..core.files import atomic_path
from .cloud import PointCloud
from .file_crs import LOCAL
from .files import check_cloud_output, has_no_layout, is_ply, iter_without_layout, new_header
from .las_reader import iter_points, open_reader
from .ply_file import ply_writer

#: xyz (N, 3) and attributes by name -> which points to write (mask or None = all) and the added dimensions' values.
Step = Callable[[np.ndarray, Callable[[str], np.ndarray]], tuple[np.ndarray | None, dict[str, np.ndarray]]]

_CHUNK = 1_000_000


def copy_cloud(source: Path, target: Path, step: Step, added: dict[str, str], crs: pyproj.CRS | None = None) -> int:
    """Copy ``source`` to ``target`` (LAS, LAZ or PLY), asking ``step`` for each chunk; returns the number of points
    written.

    added: extra dimension -> type (``int32``, ``float32``); one of that name in the source is overwritten, and
    dimensions that the point format already has (``classification``) may be answered without being listed. crs: what
    the points are in (``None`` = local metres), whatever the source's header says.

    Raises:
        InputError: see :func:`.files.iter_cloud`; a target of another ending.
    """
    import laspy

    source, target = Path(source), Path(target)
    check_cloud_output(target)
    written = 0
    with _records(source, target, added, crs) as (header, records), _write_points(target, header, added) as write:
        for points in records:
            xyz = np.column_stack([points.x, points.y, points.z])
            mask, values = step(xyz, _reader(points))
            kept = points if mask is None else points[mask]
            out = laspy.ScaleAwarePointRecord.zeros(len(kept), header=header)
            for name in kept.array.dtype.names:
                out.array[name] = kept.array[name]
            for name, value in values.items():
                out[name] = value if mask is None else value[mask]
            write(out)
            written += len(kept)
    return written


@contextmanager
def _write_points(target: Path, header: Any, added: Iterable[str]) -> Iterator[Callable[[Any], None]]:
    """What takes laspy's point records for the file. added: named first in a PLY: viewers show the first."""
    import laspy

    if is_ply(target):
        names = [n for n in dict.fromkeys([*added, *header.point_format.dimension_names]) if n not in ("X", "Y", "Z")]
        with ply_writer(target) as write:
            yield lambda out: write(np.column_stack([out.x, out.y, out.z]), {name: out[name] for name in names})
        return
    with atomic_path(target) as temporary, laspy.open(temporary, "w", header=header) as las:
        yield las.write_points


def _reader(points: Any) -> Callable[[str], np.ndarray]:
    return lambda name: np.asarray(points[name])


@contextmanager
def _records(
    source: Path, target: Path, added: dict[str, str], crs: pyproj.CRS | None
) -> Iterator[tuple[Any, Iterator[Any]]]:
    """The new file's header, and laspy's point records of ``source``, chunk by chunk. Text and E57 have no layout of
    their own: a tenth of a millimetre."""
    if has_no_layout(source):
        pieces = iter_without_layout(source, LOCAL, False, _CHUNK)
        first = next(pieces)
        kinds = {name[:32]: "float64" for name in first.attributes} | added
        header = new_header(target, replace(first, crs=crs), kinds)
        header.scales, header.offsets = np.full(3, 1e-4), np.floor(np.median(first.xyz, axis=0))
        yield header, (_record(piece, header) for piece in itertools.chain([first], pieces))
        return
    with open_reader(source) as reader:
        header = new_header(target, PointCloud(np.empty((0, 3)), crs, {}, reader.header), added)
        yield header, iter_points(source, reader, _CHUNK)


def _record(piece: PointCloud, header: Any) -> Any:
    import laspy

    out = laspy.ScaleAwarePointRecord.zeros(len(piece), header=header)
    # Strays may lie farther than 32 bits reach; at the end of these (200 km off) they are strays still.
    reach = header.scales * (2**31 - 1)
    out.x, out.y, out.z = np.clip(piece.xyz, header.offsets - reach, header.offsets + reach).T
    for name, value in piece.attributes.items():
        out[name[:32]] = value
    return out
