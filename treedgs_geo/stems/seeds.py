"""Field stems as seeds of the segmentation: where to look twice, and what the stems are called."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from .segment import StemMap

#: A field stem and a found one further apart than this are two, metres (field positions are rarely better).
MATCH_M = 1.0
_X, _Y = ("x", "easting", "e"), ("y", "northing", "n")


@dataclass(frozen=True)
class FieldStems:
    """(K, 2) xy in the cloud's CRS, (K,) int ids, (K,) names as written in the file; counted: ids are the order in the
    file, because the names are no whole numbers."""

    xy: np.ndarray
    ids: np.ndarray
    names: tuple[str, ...]
    counted: bool = False


def read_field_stems(path: Path, crs: object | None = None) -> FieldStems:
    """Field stems of a point layer (GeoPackage, shapefile, GeoJSON) or a CSV with x, y (or easting, northing).

    crs: of the cloud; a layer in another one is brought to it, a CSV is taken to be in it. ``tree_id`` is optional:
    whole numbers are kept as ids, other names are numbered in the order of the file.

    Raises:
        InputError: not readable, no positions, a tree_id twice.
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        table = _read_csv(path)
        columns = {name.strip().lower(): name for name in table.columns}
        x, y = (next((columns[name] for name in names if name in columns), None) for names in (_X, _Y))
        if x is None or y is None:
            raise InputError(f"{path}: found columns {', '.join(map(str, table.columns))}; expected x and y (or "
                             "easting and northing) of each stem.")
        xy = _numbers(path, table, (x, y))
    else:
        import geopandas as gpd

        try:
            table = gpd.read_file(path)
        except Exception as problem:
            raise InputError(f"{path}: cannot be read as a layer ({problem}); expected points, one a stem.") from None
        if table.geometry is None or not (table.geometry.geom_type == "Point").all():
            raise InputError(f"{path}: is no layer of points; expected one point a stem.")
        if crs is not None and table.crs is not None:
            table = table.to_crs(crs)
        columns = {str(name).strip().lower(): name for name in table.columns}
        xy = np.column_stack([table.geometry.x, table.geometry.y])
    if len(xy) == 0 or not np.isfinite(xy).all():
        raise InputError(f"{path}: {'holds no stem' if len(xy) == 0 else 'a stem has no position'}; expected x and y "
                         "of each stem.")
    if "tree_id" not in columns:
        return FieldStems(xy, np.arange(1, len(xy) + 1), tuple(str(k) for k in range(1, len(xy) + 1)))
    names = tuple(str(value).strip() for value in table[columns["tree_id"]])
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise InputError(f"{path}: tree_id {sorted(doubled)[0]!r} appears more than once; give every stem its own.")
    whole = [_whole(name) for name in names]
    if all(value > 0 for value in whole):
        return FieldStems(xy, np.array(whole, np.int64), names)
    return FieldStems(xy, np.arange(1, len(names) + 1), names, counted=True)


def _read_csv(path: Path):  # noqa: ANN202 - a pandas table
    import pandas as pd

    try:
        return pd.read_csv(path, sep=None, engine="python", encoding="utf-8-sig")
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a table ({problem}); expected columns x, y, tree_id.") from None


def _numbers(path: Path, table: object, columns: tuple[str, str]) -> np.ndarray:
    import pandas as pd

    values = np.column_stack([pd.to_numeric(table[name], errors="coerce") for name in columns])  # type: ignore[index]
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise InputError(f"{path}: line {bad[0] + 2} has no position; expected numbers in {columns[0]}, {columns[1]}.")
    return values


def _whole(name: str) -> int:
    """The id as a whole number that fits a 32-bit field, or 0."""
    try:
        value = float(name)
    except ValueError:
        return 0
    return int(value) if value == int(value) and 0 < value < 2**31 else 0


def name_stems(stems: StemMap, field: FieldStems, bh_m: float = 1.3) -> tuple[np.ndarray, list[str]]:
    """``(new ids (S + 1,) by old tree_id, names of field stems that were not found)``.

    Nearest pairs first, within :data:`MATCH_M` at breast height; found stems without a field stem are numbered on
    from the largest field id.
    """
    new = np.zeros(len(stems.stems) + 1, np.int32)
    taken: set[int] = set()
    if stems.stems:
        feet = np.array([stem.cone.centre(bh_m) for stem in stems.stems]) + stems.origin
        gap = np.linalg.norm(feet[:, None] - field.xy[None], axis=2)
        for i, j in sorted(np.argwhere(gap <= MATCH_M).tolist(), key=lambda pair: gap[pair[0], pair[1]]):
            if not new[i + 1] and j not in taken:
                new[i + 1] = field.ids[j]
                taken.add(j)
    rest = np.flatnonzero(new[1:] == 0) + 1
    new[rest] = int(field.ids.max()) + 1 + np.arange(len(rest))
    return new, [name for j, name in enumerate(field.names) if j not in taken]
