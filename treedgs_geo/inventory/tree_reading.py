"""Reading tree layers that TreeDGS wrote."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import pandas as pd

from ..core.errors import InputError
from ..core.tables import refuse_other_formats

LAYER = "trees"
#: Names of columns that are longer than a shapefile can have, and what they are called there.
SHORT_NAMES = {"height_se_m": "ht_se_m"}


def read_trees(path: Path) -> gpd.GeoDataFrame:
    """Read a tree layer written by :func:`.tree_layer.write_trees`.

    Raises:
        InputError: not readable, or not a tree layer.

    Examples:
        >>> import treedgs_geo as tg
        >>> path = tg.write_trees(work / "one.gpkg", [tg.Tree(1, 500000.0, 5.2e6, dbh_cm=31.0)], "EPSG:32632")
        >>> tg.read_trees(path)[["tree_id", "dbh_cm", "qc_flag"]].values.tolist()
        [[1, 31.0, 'ok']]
    """
    path = Path(path)
    refuse_other_formats(path, layers=True)
    try:
        layer = {"layer": LAYER} if path.suffix.lower() == ".gpkg" else {}
        table = gpd.read_file(path, engine="pyogrio", **layer)
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a tree layer ({problem}).") from None
    # A shapefile of ours, or one that GDAL cut the names of.
    cut = {cut: name for name, short in SHORT_NAMES.items() for cut in (short, name[:10])}
    table = table.rename(columns=cut)
    missing = {"tree_id", "dbh_cm", "qc_flag"} - set(table.columns)
    if missing:
        raise InputError(f"{path}: lacks the columns {', '.join(sorted(missing))}; give a layer made by TreeDGS.")
    if "rev_at" in table and str(table["rev_at"].dtype).startswith("datetime"):
        # GDAL takes the text for a time where the format has no types of its own (GeoJSON).
        moments = pd.to_datetime(table["rev_at"], utc=True)
        table["rev_at"] = moments.dt.strftime("%Y-%m-%dT%H:%M:%SZ").astype(object).where(moments.notna(), None)
    return table
