"""Tables with or without geometries as layers of GeoPackages and as shapefiles."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from .errors import InputError
from .files import temporary_beside
from .geopackage import OwnLayers, atomic_geopackage, save_style
from .resource_errors import reporting_full_disk


def add_layer(
    path: Path, layer: str, table: Any, geometry: str | None = None, texts: Mapping[str, str] | None = None
) -> None:
    """A table as a layer of a GeoPackage, with our style (texts: :func:`.geopackage.save_style`); rows go to a layer
    that is there.

    geometry: type of the geometries; ``None``: as they are.
    """
    # QGIS 3.22 knows GeoPackage up to 1.3 and warns about newer ones at every opening.
    new: dict[str, Any] = {} if path.exists() else {"dataset_options": {"VERSION": "1.2"}}
    _write(table, path, layer=layer, driver="GPKG", geometry_type=geometry, append=not new, **new)
    save_style(path, layer, texts)


def write_layer(path: Path, own: OwnLayers, layer: str, table: Any, geometry: str | None = None) -> None:
    """A GeoPackage of one layer; layers of others (:func:`.geopackage.atomic_geopackage`) in an existing one stay."""
    with atomic_geopackage(path, own) as temporary:
        add_layer(temporary, layer, table, geometry)


def write_shapefile(path: Path, table: Any, geometry: str | None = None) -> None:
    """A shapefile is several files: written together in a folder beside the target, then moved one by one."""
    with temporary_beside(path) as folder, reporting_full_disk(path):
        folder.mkdir()
        _write(table, folder / path.name, driver="ESRI Shapefile", geometry_type=geometry, encoding="UTF-8")
        for part in folder.iterdir():
            shutil.move(str(part), path.parent / part.name)


def read_if_there(path: Path, layer: str, columns: Collection[str]) -> Any:
    """A layer of a GeoPackage with all of these columns; ``None`` where there is none (another format, an older
    version, another program)."""
    import pyogrio

    if Path(path).suffix.lower() != ".gpkg":
        return None
    try:
        if layer not in {str(name) for name, _ in pyogrio.list_layers(path)}:
            return None
        table = pyogrio.read_dataframe(path, layer=layer)
    except Exception:  # what cannot be read is reported where the trees are
        return None
    return table if set(columns) <= set(table.columns) else None


def typed(table: Any, wholes: Collection[str], texts: Collection[str], decimals: Mapping[str, int], usual: int) -> Any:
    """The table's columns, each of its own type also where all of it is missing: whole numbers, texts, and others
    rounded. decimals: of those that have not the ``usual`` number."""
    import pandas as pd

    made = {}
    for name, values in table.items():
        if name in texts:
            made[name] = values.astype(object).where(values.notna(), None)
        elif name in wholes:
            made[name] = pd.to_numeric(values).astype("Int64")
        elif name != "geometry":
            made[name] = pd.to_numeric(values).astype(float).round(decimals.get(name, usual))
    return table.assign(**made)


def read_layer(path: Path, layer: str, columns: Collection[str], made_by: str) -> Any:
    """A layer that another command wrote. columns: that it has to have. made_by: that command, for the sentence.

    Raises:
        InputError: not readable, no such layer, or one without these columns.
    """
    import geopandas as gpd

    try:
        table = gpd.read_file(path, layer=layer, engine="pyogrio")
    except Exception as problem:
        raise InputError(f"{path}: holds no layer {layer} ({problem}), expected the output of {made_by}.") from None
    if missing := sorted(set(columns) - set(table.columns)):
        raise InputError(f"{path}: its layer {layer} lacks {', '.join(missing)}; run {made_by} again.")
    return table


def _write(table: Any, path: Path, **more: Any) -> None:
    import pyogrio

    with warnings.catch_warnings():
        # A tally without coordinates has no CRS, and needs none.
        warnings.filterwarnings("ignore", message="'crs' was not provided")
        pyogrio.write_dataframe(table, path, **more)
