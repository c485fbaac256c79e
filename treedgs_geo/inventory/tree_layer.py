"""The tree-point layer: GeoPackage (styled), shapefile, GeoJSON or CSV, from the same records."""

from __future__ import annotations

import sqlite3
from importlib.resources import files
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj

from ..core.errors import InputError, OutputError
from ..core.files import atomic_geopackage, atomic_path, ensure_unlocked, ensure_writable
from ..core.progress import Reporter
from ..core.tables import refuse_other_formats, safe_frame
from ..measure.trees import TREE_FIELDS, Tree
from .circle_layers import add_layers
from .written import read_written

LAYER = "trees"
_INTEGERS = ("tree_id", "n_pts", "n_views", "n_slices")
_TEXTS = ("plot_id", "method", "qc_flag", "qc_reason", "run_id", "species", "status", "note")
#: Decimals kept per column: finer than any of them can be measured.
_DECIMALS = {"x": 3, "y": 3, "z_ground": 3, "ba_m2": 6, "opac_mean": 4, "height_m": 2, "lean_deg": 2, "arc_deg": 1}
_DRIVERS = {".gpkg": "GPKG", ".shp": "ESRI Shapefile", ".geojson": "GeoJSON", ".csv": "CSV"}


def tree_table(trees: list[Tree], crs: pyproj.CRS) -> gpd.GeoDataFrame:
    """Trees as a GeoDataFrame: PointZ at breast-height position and ground height, columns :data:`TREE_FIELDS`.

    Missing numbers are NULL in every file; z falls back to 0 only in the geometry (``z_ground`` stays NULL).
    """
    rows = [{name: getattr(tree.finish(), name) for name in TREE_FIELDS} for tree in trees]
    table = pd.DataFrame(rows, columns=list(TREE_FIELDS))
    for name in table:
        if name in _INTEGERS:
            table[name] = pd.array(table[name], dtype="Int64")
        elif name in _TEXTS:
            table[name] = table[name].astype(object).where(table[name].notna(), None)
        else:
            table[name] = pd.to_numeric(table[name]).astype(float).round(_DECIMALS.get(name, 2))
    ground = table["z_ground"].to_numpy(float)
    points = gpd.points_from_xy(table["x"], table["y"], np.where(np.isfinite(ground), ground, 0.0))
    return gpd.GeoDataFrame(table, geometry=points, crs=crs)


def check_output(path: Path) -> str:
    """The driver for ``path``, after proving that the layer can be written there (before hours of work).

    Raises:
        OutputError: unknown suffix or unwritable folder.
    """
    path = Path(path)
    driver = _DRIVERS.get(path.suffix.lower())
    if driver is None:
        raise OutputError(f"{path}: ends in {path.suffix!r}, expected one of {', '.join(_DRIVERS)}; rename the output.")
    ensure_writable(path)
    if driver == "GPKG":
        ensure_unlocked(path)
    return driver


def write_trees(
    path: Path,
    trees: list[Tree],
    crs: pyproj.CRS,
    slices: list[dict] | None = None,
    reporter: Reporter | None = None,
) -> Path:
    """Write the tree layer atomically; the driver follows the suffix (.gpkg, .shp, .geojson, .csv).

    A GeoPackage also gets the layer ``circles`` (each stem at true scale), and ``slices`` where they are given
    (:func:`treedgs_geo.inventory.circle_layers.stem_slices`). Species, status and note that a person wrote into the
    layer that is replaced go on with their trees; the reporter hears of it.

    Raises:
        OutputError: unknown suffix or unwritable folder.
    """
    path = Path(path)
    driver = check_output(path)
    written = read_written(path)
    table = written.fill(tree_table(trees, crs))
    if driver == "CSV":
        with atomic_path(path) as temporary:
            safe_frame(pd.DataFrame(table.drop(columns="geometry"))).to_csv(temporary, index=False)
    elif driver == "ESRI Shapefile":
        _write_shapefile(path, table)
    else:
        with (atomic_geopackage if driver == "GPKG" else atomic_path)(path) as temporary:
            # QGIS 3.22 knows GeoPackage up to 1.3 and warns about newer ones at every opening.
            options = {"dataset_options": {"VERSION": "1.2"}} if driver == "GPKG" else {}
            table.to_file(temporary, layer=LAYER, driver=driver, engine="pyogrio", geometry_type="Point Z", **options)
            if driver == "GPKG":
                save_style(temporary, LAYER, (files(__package__) / "styles" / "trees.qml").read_text(encoding="utf-8"))
                add_layers(temporary, table, slices)
    written.tell(reporter)
    return path


def read_trees(path: Path) -> gpd.GeoDataFrame:
    """Read a tree layer written by :func:`write_trees`.

    Raises:
        InputError: not readable, or not a tree layer.
    """
    path = Path(path)
    refuse_other_formats(path, layers=True)
    try:
        layer = {"layer": LAYER} if path.suffix.lower() == ".gpkg" else {}
        table = gpd.read_file(path, engine="pyogrio", **layer)
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a tree layer ({problem}).") from None
    missing = {"tree_id", "dbh_cm", "qc_flag"} - set(table.columns)
    if missing:
        raise InputError(f"{path}: lacks the columns {', '.join(sorted(missing))}; give a layer made by TreeDGS.")
    return table


def style_stations(path: Path) -> None:
    """Give the camera stations layer in ``path`` its style."""
    save_style(path, "stations", (files(__package__) / "styles" / "stations.qml").read_text(encoding="utf-8"))


def style_terrain(path: Path) -> None:
    """Put the hillshade style beside a terrain raster (``dtm.qml``), where QGIS looks; a user's own one stays."""
    beside = Path(path).with_suffix(".qml")
    if not beside.exists():
        beside.write_text((files(__package__) / "styles" / "dtm.qml").read_text(encoding="utf-8"), encoding="utf-8")


def save_style(geopackage: Path, layer: str, qml: str, geometry: str = "geom") -> None:
    """Store ``qml`` as the layer's default style inside the GeoPackage, where QGIS looks for it."""
    with sqlite3.connect(geopackage) as connection:
        connection.execute(
            "CREATE TABLE IF NOT EXISTS layer_styles (id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, "
            "f_table_catalog TEXT(256), f_table_schema TEXT(256), f_table_name TEXT(256), f_geometry_column TEXT(256), "
            "styleName TEXT(30), styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT, owner TEXT(30), "
            "ui TEXT(30), update_time DATETIME DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')))"
        )
        connection.execute("DELETE FROM layer_styles WHERE f_table_name = ?", (layer,))
        connection.execute(
            "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, styleName, "
            "styleQML, styleSLD, useAsDefault, description, owner) VALUES ('', '', ?, ?, ?, ?, '', 1, ?, '')",
            (layer, geometry, layer, qml, f"TreeDGS {layer}"),
        )
        connection.execute(
            "INSERT OR IGNORE INTO gpkg_contents (table_name, data_type, identifier) "
            "VALUES ('layer_styles', 'attributes', 'layer_styles')"
        )
    connection.close()


def _write_shapefile(path: Path, table: gpd.GeoDataFrame) -> None:
    """A shapefile is several files: written together in a folder beside the target, then moved one by one."""
    import shutil
    import tempfile

    ensure_writable(path)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".shp") as folder:
        table.to_file(
            Path(folder) / path.name,
            driver="ESRI Shapefile",
            engine="pyogrio",
            geometry_type="Point Z",
            encoding="UTF-8",
        )
        for part in Path(folder).iterdir():
            shutil.move(str(part), path.parent / part.name)
