"""A cloud of any size sorted into square tiles on disk, so that work on it needs the memory of a tile."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyproj

from ..core.errors import InputError, OutputError
from ..core.progress import Reporter
from .cloud import usable
from .file_crs import placed
from .files import describe_cloud, iter_cloud
from .sanity import examine, report
from .survey import Extent, Survey

#: Points that a tile should hold: half a gigabyte of memory while it is worked on.
_POINTS_A_TILE = 4_000_000
_SIDES_M = (10, 200)
#: More tiles are no cloud of one block: each of them is a file.
_MAX_TILES = 400_000
#: Clouds up to this size are worked on as a whole.
WHOLE_CLOUD_POINTS = 4_000_000


@dataclass
class TileStore:
    """Points in tiles of ``side_m`` on a lattice from ``origin`` (2,), coordinates as whole multiples of ``scale`` (3,)
    from ``offset`` (3,), as in the file: nothing is rounded.

    extras: name -> dtype of what is kept beside the coordinates. counts: tile -> points. low, high: (3,) true extent.
    extent: once all points are sorted, where they are; strays far off are not given out.
    """

    folder: Path
    side_m: float
    origin: np.ndarray
    scale: np.ndarray
    offset: np.ndarray
    extras: dict[str, str]
    crs: pyproj.CRS | None = None
    counts: dict[tuple[int, int], int] = field(default_factory=dict)
    low: np.ndarray = field(default_factory=lambda: np.full(3, np.inf))
    high: np.ndarray = field(default_factory=lambda: np.full(3, -np.inf))
    n_points: int = 0
    extent: Extent | None = None

    @property
    def dtype(self) -> np.dtype:
        """Record on disk."""
        return np.dtype([("xyz", "<i4", 3), *self.extras.items()])

    @property
    def tiles(self) -> list[tuple[int, int]]:
        """Tiles that hold points, in a fixed order."""
        return sorted(self.counts)

    def bounds(self, tile: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        """South-west and north-east corner (2,), (2,) of a tile, project coordinates."""
        low = self.origin + np.asarray(tile, float) * self.side_m
        return low, low + self.side_m

    def read(self, tile: tuple[int, int]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """(N, 3) float64 project coordinates of one tile, and its extras."""
        return self._decode(
            np.fromfile(self._path(tile), self.dtype) if tile in self.counts else np.empty(0, self.dtype)
        )

    def read_box(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Points with ``low <= xy < high``, whatever tiles they lie in, in a fixed order."""
        first = np.floor((np.asarray(low, float) - self.origin) / self.side_m).astype(int)
        last = np.floor((np.asarray(high, float) - self.origin) / self.side_m).astype(int)
        parts = [np.empty(0, self.dtype)]
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                if (i, j) not in self.counts:
                    continue
                part = np.fromfile(self._path((i, j)), self.dtype)
                xy = part["xyz"][:, :2] * self.scale[:2] + self.offset[:2]
                parts.append(part[((xy >= low) & (xy < high)).all(axis=1)])
        return self._decode(np.concatenate(parts))

    def neighbours(self, tile: tuple[int, int], reach_m: float) -> Iterator[tuple[int, int]]:
        """Tiles with points within ``reach_m`` of a tile, itself among them."""
        rings = int(np.ceil(reach_m / self.side_m))
        for i in range(tile[0] - rings, tile[0] + rings + 1):
            for j in range(tile[1] - rings, tile[1] + rings + 1):
                if (i, j) in self.counts:
                    yield i, j

    def add(self, xyz: np.ndarray, extras: dict[str, np.ndarray]) -> None:
        """Sort (N, 3) points into the tiles."""
        if not len(xyz):
            return
        whole = np.round((xyz - self.offset) / self.scale)
        held = (np.abs(whole) < 2**31).all(axis=1)
        if not held.all():  # text lines hundreds of kilometres off: strays in any cloud
            self.add(xyz[held], {name: values[held] for name, values in extras.items()})
            return
        rows = np.empty(len(xyz), self.dtype)
        rows["xyz"] = whole
        for name in self.extras:
            rows[name] = extras[name]
        cell = np.floor((xyz[:, :2] - self.origin) / self.side_m).astype(np.int64)
        base = cell.min(axis=0)
        key = (cell[:, 0] - base[0]) * (cell[:, 1].max() - base[1] + 1) + cell[:, 1] - base[1]
        order = np.argsort(key, kind="stable")
        starts = np.flatnonzero(np.r_[True, np.diff(key[order]) != 0])
        for start, end in zip(starts, np.r_[starts[1:], len(order)], strict=True):
            tile = int(cell[order[start], 0]), int(cell[order[start], 1])
            with open(self._path(tile), "ab") as stream:
                rows[order[start:end]].tofile(stream)
            self.counts[tile] = self.counts.get(tile, 0) + int(end - start)
        self.low, self.high = np.minimum(self.low, xyz.min(axis=0)), np.maximum(self.high, xyz.max(axis=0))
        self.n_points += len(xyz)

    def leave_out_strays(self, extent: Extent) -> None:
        """Forget the points far outside ``extent``."""
        self.extent = extent
        if not extent.n_strays:
            return
        for tile in self.tiles:
            kept = len(self.read(tile)[0])
            self.n_points -= self.counts[tile] - kept
            if kept:
                self.counts[tile] = kept
            else:
                del self.counts[tile]
                self._path(tile).unlink()
        self.low, self.high = np.maximum(self.low, extent.low), np.minimum(self.high, extent.high)

    def near(self, xyz: np.ndarray) -> np.ndarray | None:
        """(N,) bool: which of (N, 3) points are no strays; ``None`` where the cloud has none."""
        return self.extent.holds(xyz) if self.extent is not None and self.extent.n_strays else None

    def _path(self, tile: tuple[int, int]) -> Path:
        return self.folder / f"{tile[0]}_{tile[1]}.points"

    def _decode(self, rows: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        xyz = rows["xyz"] * self.scale + self.offset
        if (near := self.near(xyz)) is not None and not near.all():
            rows, xyz = rows[near], xyz[near]
        return xyz, {name: np.ascontiguousarray(rows[name]) for name in self.extras}


def is_large(path: Path) -> bool:
    """True when a cloud is worked on tile by tile."""
    return describe_cloud(path).n_points > WHOLE_CLOUD_POINTS


def sort_into_tiles(
    path: Path,
    folder: Path,
    crs: str | None,
    extras: tuple[str, ...] = (),
    reporter: Reporter | None = None,
    side_m: float | None = None,
    find_stems: bool = True,
    dtm: Path | None = None,
) -> TileStore:
    """Read a cloud once, chunk by chunk, and sort its usable points (no noise, not withheld) into tiles in ``folder``.

    extras: attributes to keep where the file has them. side_m: tile side (default: by the mean density). find_stems:
    see :func:`.sanity.examine`, whose warnings are said; strays are left out. dtm: the user's terrain model.

    Raises:
        InputError, CRSError: see :func:`.files.iter_cloud`, :func:`.sanity.examine` and
            :func:`.file_crs.placed`. OutputError: not enough room on the disk.
    """
    reporter = reporter or Reporter()
    about = describe_cloud(path)
    room = shutil.disk_usage(folder).free
    if 20 * about.n_points > room:
        raise OutputError(
            f"{folder}: has {room / 1e9:.1f} GB free, sorting {about.n_points:,} points into tiles needs "
            f"{20 * about.n_points / 1e9:.1f} GB; free some space or choose an output on a larger disk."
        )
    store: TileStore | None = None
    survey = Survey()
    done = 0
    for piece in iter_cloud(path, None, crs, (*extras, "classification", "withheld"), need_crs=False):
        done += len(piece)
        piece = piece.select(usable(piece))
        if not len(piece):
            continue
        if store is None:
            place = placed(piece.crs, piece.xyz, path, reporter, crs, dtm)
            side = side_m or _side(about.n_points, about.low, about.high)
            scale, offset = about.scale, about.offset
            if scale is None or offset is None:
                scale, offset = np.full(3, 1e-4), np.floor(np.median(piece.xyz, axis=0))
            kept = {name: piece.attributes[name].dtype.str for name in extras if name in piece.attributes}
            store = TileStore(folder, side, np.floor(piece.xyz[:, :2].min(axis=0)), scale, offset, kept, place)
        store.add(piece.xyz, piece.attributes)
        survey.add(piece.xyz)
        if len(store.counts) > _MAX_TILES:
            span = store.high - store.low
            raise InputError(
                f"{path}: spans {span[0]:,.0f} x {span[1]:,.0f} m with few points everywhere, expected a "
                "plot or block in metres; check the unit of x and y and which columns they are."
            )
        reporter.progress(done / max(about.n_points, 1))
    if store is None:
        raise InputError(
            f"{path}: holds no usable point (noise and withheld points left out), expected a point cloud; "
            "check the file."
        )
    extent, findings = examine(survey, path, find_stems, about.scale, dtm is not None)
    report(findings, reporter)
    store.leave_out_strays(extent)
    return store


def _side(count: int, low: np.ndarray, high: np.ndarray) -> float:
    """Tile side by the mean density, whole metres."""
    span = np.maximum(high[:2] - low[:2], 1.0)
    side = np.sqrt(_POINTS_A_TILE * float(span[0] * span[1]) / max(count, 1))
    return float(np.clip(np.floor(side) if np.isfinite(side) else _SIDES_M[0], *_SIDES_M))
