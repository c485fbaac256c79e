"""Places of stems that a person gives: a stem map of a field crew, or points set on a map."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError
from .plots import source_crs
from .tables import csv_text, refuse_other_formats

if TYPE_CHECKING:
    import pandas as pd
    import pyproj

_X, _Y = ("x", "easting", "e"), ("y", "northing", "n")
#: How QGIS names one layer of a file.
_LAYER = "|layername="


@dataclass(frozen=True)
class FieldStems:
    """(K, 2) xy in the CRS asked for, (K,) int ids, (K,) names as written in the file; counted: ids are the order in
    the file, because the names are no whole numbers."""

    xy: np.ndarray
    ids: np.ndarray
    names: tuple[str, ...]
    counted: bool = False


def read_field_stems(path: Path, crs: pyproj.CRS | None = None) -> FieldStems:
    """Stems of a point layer (GeoPackage, shapefile, GeoJSON) or a CSV with x, y (or easting, northing, or lon, lat).

    path: of a file with several layers of points, ``FILE|layername=NAME`` names the one meant. crs: of the result; a
    layer in another one is brought to it, and so is a CSV with lon and lat, or with a column ``epsg``; else a CSV is
    taken to be in it. ``tree_id`` is optional: whole numbers are kept as ids, other names are numbered in the order of
    the file.

    Raises:
        InputError: not readable, no positions, a tree_id twice. CRSError: an ``epsg`` that is unknown.
    """
    path = Path(path)
    table, xy = _of_csv(path, crs) if path.suffix.lower() == ".csv" else _of_layer(path, crs)
    columns = {str(name).strip().lower(): name for name in table.columns}
    if len(xy) == 0 or not np.isfinite(xy).all():
        raise InputError(
            f"{path}: {'holds no stem' if len(xy) == 0 else 'a stem has no position'}; expected x and y of each stem."
        )
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


def _of_layer(path: Path, crs: pyproj.CRS | None) -> tuple[Any, np.ndarray]:
    """A layer of points and their places (K, 2)."""
    import geopandas as gpd

    file, _, layer = str(path).partition(_LAYER)
    refuse_other_formats(Path(file), layers=True)
    try:
        table = gpd.read_file(file, layer=layer or _only_points(file))
    except InputError:
        raise
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a layer ({problem}); expected points, one a stem.") from None
    shapes = getattr(table, "geometry", None)
    if shapes is None or not shapes.geom_type.isin(["Point", "MultiPoint"]).all():
        raise InputError(f"{path}: is no layer of points; expected one point a stem.")
    if (shapes.geom_type == "MultiPoint").any():
        table = table.explode(ignore_index=True)
    if crs is not None and table.crs is not None:
        table = table.to_crs(crs)
    return table, np.column_stack([table.geometry.x, table.geometry.y])


def _only_points(file: str) -> str | None:
    """The one layer of points in a file.

    Raises:
        InputError: there are several.
    """
    import pyogrio

    layers = pyogrio.list_layers(file)
    points = [str(name) for name, kind in layers if kind and "Point" in kind]
    if len(points) > 1:
        raise InputError(
            f"{file}: holds {len(points)} layers of points ({', '.join(points)}), expected one; name the one meant: "
            f"{file}{_LAYER}{points[0]}"
        )
    return points[0] if points else None


def _of_csv(path: Path, crs: pyproj.CRS | None) -> tuple[Any, np.ndarray]:
    """A table and its places (K, 2)."""
    import pandas as pd

    try:
        table = pd.read_csv(io.StringIO(csv_text(path)))
    except InputError:
        raise
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a table ({problem}); expected columns x, y, tree_id.") from None
    columns = {name.strip().lower(): name for name in table.columns}
    x, y = (next((columns[name] for name in names if name in columns), None) for names in (_X, _Y))
    metric = x is not None and y is not None
    if not metric and crs is not None and {"lon", "lat"} <= set(columns):
        x, y = columns["lon"], columns["lat"]
    if x is None or y is None:
        raise InputError(
            f"{path}: found columns {', '.join(map(str, table.columns))}; expected x and y (or "
            "easting and northing) of each stem."
        )
    xy = _numbers(path, table, (x, y))
    return table, xy if crs is None else _moved(path, table, xy, columns.get("epsg"), metric, crs)


def _moved(
    path: Path, table: pd.DataFrame, xy: np.ndarray, epsg: str | None, metric: bool, crs: pyproj.CRS
) -> np.ndarray:
    """(K, 2) of a table in ``crs``."""
    import pandas as pd
    import pyproj

    out = xy.copy()
    codes = [None] * len(xy) if epsg is None else [None if pd.isna(cell) else cell for cell in table[epsg]]
    for row, code in enumerate(codes):
        source = source_crs(path, row + 2, {"epsg": code}, crs, metric)
        if source is not None:
            out[row] = pyproj.Transformer.from_crs(source, crs, always_xy=True).transform(*xy[row])
        if not np.isfinite(out[row]).all():
            raise InputError(
                f"{path}, line {row + 2}: {xy[row, 0]:g}, {xy[row, 1]:g} has no place in {crs.name}; correct the row, "
                "or its epsg."
            )
    return out


def _numbers(path: Path, table: pd.DataFrame, columns: tuple[str, str]) -> np.ndarray:
    import pandas as pd

    values = np.column_stack([pd.to_numeric(table[name], errors="coerce") for name in columns])
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
