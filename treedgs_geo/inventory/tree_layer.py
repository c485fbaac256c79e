"""The tree-point layer: GeoPackage (styled), shapefile, GeoJSON or CSV, from the same records."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj

from ..core.errors import OutputError
from ..core.files import atomic_path, ensure_writable, free_name
from ..core.geopackage import atomic_geopackage, ensure_unlocked, style_text, style_text_after
from ..core.layer_files import add_layer, typed, write_shapefile
from ..core.outputs import is_foreign
from ..core.progress import Reporter
from ..core.shown import LAYER_DECIMALS
from ..core.tables import write_csv
from ..stems.quality.tree import TREE_FIELDS, Tree
from .searched import COLUMNS as SEARCHED_COLUMNS
from .searched import SEARCHED
from .side_layers import CIRCLES, CROWN_COLUMNS, CROWNS, READING_COLUMNS, READINGS, SECTIONS, add_layers
from .tree_reading import LAYER, SHORT_NAMES
from .written import read_written

#: Layers of a tree file that a new run replaces, with the columns by which they are known as ours.
OWN_LAYERS = {
    LAYER: frozenset({"tree_id", "dbh_cm", "qc_flag", "run_id"}),
    CIRCLES: frozenset({"tree_id", "dbh_cm", "dbh_se_cm", "qc_flag"}),
    SECTIONS: frozenset({"tree_id", "height_m", "d_cm", "d_se_cm"}),
    "slices": frozenset({"tree_id", "height_m", "d_cm", "rms_cm"}),  # of 0.1, replaced by the sections
    SEARCHED: frozenset(SEARCHED_COLUMNS),
    READINGS: frozenset(READING_COLUMNS),
    CROWNS: frozenset(CROWN_COLUMNS),
}
#: Stands in the style of the trees (``tools/layer_styles/trees.py``) for the folder of their evidence sheets.
SHEETS_FOLDER = "folder-of-the-sheets"
_BEFORE_FOLDER = "file_path(decode_uri(@layer_id, 'path')) || '/' || "
_INTEGERS = ("tree_id", "n_pts", "n_views", "n_slices")
_TEXTS: tuple[str, ...] = ("plot_id", "method", "qc_flag", "qc_reason", "run_id", "species", "status", "note")
_TEXTS += ("height_why", "rev_flag", "rev_note", "rev_by", "rev_at")
#: Decimals kept per column: finer than any of them can be measured.
_DECIMALS = {"x": 3, "y": 3, "z_ground": 3, "ba_m2": 6, "opac_mean": 4, "height_m": 2, "lean_deg": 2, "arc_deg": 1}
_DRIVERS = {".gpkg": "GPKG", ".shp": "ESRI Shapefile", ".geojson": "GeoJSON", ".csv": "CSV"}


def tree_table(trees: list[Tree], crs: pyproj.CRS | str) -> gpd.GeoDataFrame:
    """Trees as a GeoDataFrame: PointZ at breast-height position and ground height, columns
    :data:`treedgs_geo.stems.quality.tree.TREE_FIELDS`.

    Missing numbers are NULL in every file; z falls back to 0 only in the geometry (``z_ground`` stays NULL).

    Examples:
        >>> import treedgs_geo as tg
        >>> table = tg.tree_table([tg.Tree(1, 500000.0, 5.2e6, dbh_cm=31.04)], "EPSG:32632")
        >>> table[["tree_id", "dbh_cm"]].values.tolist()
        [[1, 31.04]]
    """
    rows = [{name: getattr(tree.finish(), name) for name in TREE_FIELDS} for tree in trees]
    table = typed_trees(pd.DataFrame(rows, columns=list(TREE_FIELDS)))
    ground = table["z_ground"].to_numpy(float)
    points = gpd.points_from_xy(table["x"], table["y"], np.where(np.isfinite(ground), ground, 0.0))
    return gpd.GeoDataFrame(table, geometry=points, crs=crs)


def typed_trees(table: pd.DataFrame) -> pd.DataFrame:
    """The columns of a tree layer as every one has them."""
    return typed(table, _INTEGERS, _TEXTS, _DECIMALS, LAYER_DECIMALS)


def check_output(path: Path) -> None:
    """Prove that the layer can be written there, before hours of work.

    Raises:
        OutputError: unknown suffix, unwritable folder, or a GeoPackage that is being edited or has a foreign layer
            of one of our names.
    """
    path = Path(path)
    driver = _driver(path)
    ensure_writable(path)
    if driver == "GPKG":
        ensure_unlocked(path, OWN_LAYERS)


def _driver(path: Path) -> str:
    driver = _DRIVERS.get(path.suffix.lower())
    if driver is None:
        raise OutputError(f"{path}: ends in {path.suffix!r}, expected one of {', '.join(_DRIVERS)}; rename the output.")
    return driver


def write_trees(
    path: Path,
    trees: list[Tree],
    crs: pyproj.CRS | str,
    sections: list[dict] | None = None,
    reporter: Reporter | None = None,
    copies: tuple[Path, ...] = (),
    sheets: Path | None = None,
    searched: gpd.GeoDataFrame | None = None,
    readings: pd.DataFrame | None = None,
    crowns: gpd.GeoDataFrame | None = None,
) -> Path:
    """Write the tree layer atomically; the driver follows the suffix (.gpkg, .shp, .geojson, .csv).

    A GeoPackage also gets the layer ``circles`` (each stem at true scale), and ``sections``, ``searched``, ``readings``
    and ``crowns`` where they are given (:func:`treedgs_geo.stems.cloud.estimate.sections.stem_sections`,
    :func:`.searched.searched_table`, :func:`.side_layers.readings_table`, :func:`.side_layers.crown_table`). In an
    existing GeoPackage only these are replaced. What a person wrote into the layer that is replaced (species, status,
    note, decisions, columns of his own, trees that were drawn), or into ``copies`` of it, goes on with its trees; the
    reporter hears of it. sheets: folder of the trees' evidence sheets, which the layer's map tips show.

    Raises:
        OutputError: unknown suffix; see :func:`~treedgs_geo.core.geopackage.atomic_geopackage`.

    Examples:
        >>> import treedgs_geo as tg
        >>> tree = tg.Tree(7, 500000.0, 5.2e6, qc_flag="reject", qc_reason="few_views")
        >>> tg.write_trees(work / "refused.gpkg", [tree], "EPSG:32632").name
        'refused.gpkg'
    """
    path = Path(path)
    _driver(path)
    written = read_written(path, *copies)
    if written.unread and path.suffix.lower() in (".csv", ".geojson") and not is_foreign(path):
        kept = free_name(path.with_name(f"{path.stem}.before{path.suffix}"))
        with atomic_path(kept) as temporary:
            shutil.copyfile(path, temporary)
        (reporter or Reporter()).warn(f"{path}: can no longer be read ({written.unread}); kept as {kept.name}.")
    table = written.into(tree_table(trees, crs))
    write_table(
        path, table, lambda temporary: add_layers(temporary, table, sections, searched, readings, crowns), sheets
    )
    written.report(reporter)
    return path


def write_table(
    path: Path, table: gpd.GeoDataFrame, beside: Callable[[Path], None] | None = None, sheets: Path | None = None
) -> None:
    """A tree table as a layer, whole or not at all. beside: writes the layers that go with it into a GeoPackage;
    without it those that are there stay. sheets: folder of the evidence sheets; without it that of the layer that is
    replaced.

    Raises:
        OutputError: see :func:`write_trees`.
    """
    driver = _driver(path)
    sheets = sheets or sheets_of_layer(path)
    if driver == "CSV":
        write_csv(path, table)
    elif driver == "ESRI Shapefile":
        write_shapefile(path, table.rename(columns=SHORT_NAMES), "Point Z")
    elif driver == "GPKG":
        with atomic_geopackage(path, OWN_LAYERS if beside else {LAYER: OWN_LAYERS[LAYER]}) as temporary:
            add_layer(temporary, LAYER, table, "Point Z", {SHEETS_FOLDER: _from_layer(path, sheets)})
            if beside is not None:
                beside(temporary)
    else:
        with atomic_path(path) as temporary:
            table.to_file(temporary, layer=LAYER, driver=driver, engine="pyogrio", geometry_type="Point Z")


def _from_layer(layer: Path, sheets: Path | None) -> str:
    """The folder of the sheets as seen from the layer: both can be moved together."""
    if sheets is not None:
        with suppress(ValueError):  # on another drive: the map tips show no sheet
            return Path(os.path.relpath(sheets, layer.absolute().parent)).as_posix()
    return SHEETS_FOLDER


def sheets_of_layer(layer: Path) -> Path | None:
    """The folder in which the map tips of a tree layer look for evidence sheets; ``None`` where they know none."""
    folder = style_text_after(layer, LAYER, _BEFORE_FOLDER)
    return None if folder in (None, SHEETS_FOLDER) else Path(os.path.normpath(layer.absolute().parent / str(folder)))


def style_raster(path: Path, style: str = "dtm") -> None:
    """Put a style (``dtm``: hillshade, ``chm``: canopy height) beside a raster, where QGIS looks; a user's own one
    stays."""
    beside = Path(path).with_suffix(".qml")
    if not beside.exists():
        with suppress(OutputError), atomic_path(beside) as temporary:  # the raster is whole without it
            temporary.write_text(style_text(style), encoding="utf-8")
