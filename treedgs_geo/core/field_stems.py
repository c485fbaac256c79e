"""Places of stems that a person gives: a stem map of a field crew, or points set on a map."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .columns import columns, places, require
from .errors import InputError
from .number_cells import as_number, column_name
from .tables import is_table, read_table, refuse_other_formats

if TYPE_CHECKING:
    import pyproj

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
    if is_table(path):
        table: Any = read_table(path)
        found = columns(table, "easting", "northing", *(("lon", "lat") if crs is not None else ()))
        require(path, table, found, (("easting", "lon"), ("northing", "lat")))
        xy = places(path, table, crs)
    else:
        table, xy = _of_layer(path, crs)
    if len(xy) == 0 or not np.isfinite(xy).all():
        raise InputError(
            f"{path}: {'holds no stem' if len(xy) == 0 else 'a stem has no position'}; expected x and y of each stem."
        )
    named = columns(map(column_name, map(str, table.columns)), "field_id").get("field_id")
    if named is None:
        return FieldStems(xy, np.arange(1, len(xy) + 1), tuple(str(k) for k in range(1, len(xy) + 1)))
    ids = next(name for name in table.columns if column_name(str(name)) == named.name)
    names = tuple("" if value is None or value != value else str(value).strip() for value in table[ids])
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
    """The one layer of points in a file; several are refused."""
    import pyogrio

    layers = pyogrio.list_layers(file)
    points = [str(name) for name, kind in layers if kind and "Point" in kind]
    if len(points) > 1:
        raise InputError(
            f"{file}: holds {len(points)} layers of points ({', '.join(points)}), expected one; name the one meant: "
            f"{file}{_LAYER}{points[0]}"
        )
    return points[0] if points else None


def _whole(name: str) -> int:
    """The id as a whole number that fits a 32-bit field, or 0."""
    value = as_number(name)
    return int(value) if value % 1 == 0 and 0 < value < 2**31 else 0
