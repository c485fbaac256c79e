"""The drawn trees as files: GeoPackage and CSV to fill in, GPX for the phone."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj

from ...core import layer_files
from ...core.files import atomic_path
from ..double_sampling.tapes import LAYER

#: Layers of tapes.gpkg, with the columns by which they are known as ours.
OWN_LAYERS = {LAYER: frozenset({"tree_id", "taped_cm", "prob", "stratum"})}
#: Columns, in order; those of the crew come first after the number.
COLUMNS = (
    "walk", "tree_id", "plot_id", "taped_cm", "state", "tape_note", "near_id", "about_cm", "qc_flag", "azim_deg",
    "dist_m", "x", "y", "lon", "lat", "dbh_cm", "stratum", "prob", "n_frame", "design", "frame",
)  # fmt: skip
#: Those that a crew fills in.
CREW = ("taped_cm", "state", "tape_note", "near_id")
_DECIMALS = {"azim_deg": 1, "dist_m": 2, "x": 3, "y": 3, "lon": 7, "lat": 7, "dbh_cm": 2}


def tape_table(trees: pd.DataFrame, n_frame: int, design: str, mark: str) -> pd.DataFrame:
    """Columns :data:`COLUMNS`; probabilities keep every digit."""
    made = trees.assign(taped_cm=np.nan, state=None, tape_note=None, near_id=pd.array([None] * len(trees), "Int64"))
    made = made.assign(n_frame=n_frame, design=design, frame=mark)[list(COLUMNS)]
    return made.round({name: places for name, places in _DECIMALS.items() if name in made})


def write_layer(path: Path, table: pd.DataFrame, crs: pyproj.CRS) -> Path:
    """The layer ``tapes``, styled, with its form."""
    layer = gpd.GeoDataFrame(table, geometry=gpd.points_from_xy(table["x"], table["y"]), crs=crs)
    for name in ("state", "tape_note", "plot_id"):
        layer[name] = layer[name].astype(object).where(layer[name].notna(), None)
    return layer_files.write_layer(path, OWN_LAYERS, LAYER, layer, "Point")


def write_gpx(path: Path, table: pd.DataFrame, name: str) -> Path | None:
    """Waypoints (GPX 1.1) in the order of the walk; nothing where the CRS is not tied to the earth."""
    if table["lon"].isna().any():
        return None
    root = ElementTree.Element(
        "gpx", {"version": "1.1", "creator": "TreeDGS", "xmlns": "http://www.topografix.com/GPX/1/1"}
    )
    ElementTree.SubElement(ElementTree.SubElement(root, "metadata"), "name").text = _plain(name)
    for tree in table.itertuples():
        point = ElementTree.SubElement(root, "wpt", {"lat": f"{tree.lat:.7f}", "lon": f"{tree.lon:.7f}"})
        ElementTree.SubElement(point, "name").text = f"T{tree.tree_id}"
        about = "no DBH" if pd.isna(tree.about_cm) else f"about {tree.about_cm:.0f} cm"
        where = f", plot {_plain(str(tree.plot_id))}" if pd.notna(tree.plot_id) else ""
        ElementTree.SubElement(point, "desc").text = f"Tree {tree.tree_id}{where}, {about}"
    ElementTree.indent(root)
    with atomic_path(path) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
    return Path(path)


def _plain(text: str) -> str:
    """Without the control characters that XML cannot hold."""
    return "".join(letter if letter >= " " else " " for letter in text)
