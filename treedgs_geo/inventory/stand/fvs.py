"""FVS-ready SQLite tables: FVS_StandInit, FVS_PlotInit and FVS_TreeInit, in inches, feet and acres.

Columns are those of the Forest Vegetation Simulator's own input database (Database Extension user's guide, USDA Forest
Service). Every tree's ``Tree_Count`` is the number of trees an acre that it stands for on its plot, with
``Basal_Area_Factor`` -1 and ``Inv_Plot_Size`` 1 (a plot of one acre): FVS divides by ``Num_Plots``, and gets the
report's trees an acre. Diameters are as measured, so that basal area in FVS is the report's uncorrected one.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ...core.files import atomic_path
from .species import UNKNOWN, species_of
from .survey import Stand
from .units import ACRE_HA, FOOT

_SHARED = (
    "Variant TEXT, Inv_Year INTEGER, Groups TEXT, AddFiles TEXT, FVSKeywords TEXT, Latitude REAL, Longitude REAL, "
    "Region INTEGER, Forest INTEGER, District INTEGER, Compartment INTEGER, Location INTEGER, Ecoregion TEXT, PV_Code "
    "TEXT, PV_Ref_Code INTEGER, Age INTEGER, Aspect REAL, Slope REAL, Elevation REAL, ElevFt REAL, Basal_Area_Factor "
    "REAL, Inv_Plot_Size REAL, Brk_DBH REAL, Num_Plots INTEGER, NonStk_Plots INTEGER, Sam_Wt REAL, Stk_Pcnt REAL, "
    "DG_Trans INTEGER, DG_Measure INTEGER, HTG_Trans INTEGER, HTG_Measure INTEGER, Mort_Measure INTEGER, Max_BA REAL, "
    "Max_SDI REAL, Site_Species TEXT, Site_Index REAL, Model_Type INTEGER, Physio_Region INTEGER, Forest_Type INTEGER, "
    "State INTEGER, County INTEGER, Fuel_Model INTEGER, Photo_Ref INTEGER, Photo_Code TEXT"
)
_SCHEMA = (
    f"CREATE TABLE FVS_StandInit (Stand_CN TEXT, Stand_ID TEXT, {_SHARED})",
    f"CREATE TABLE FVS_PlotInit (Stand_CN TEXT, Stand_ID TEXT, StandPlot_CN TEXT, StandPlot_ID TEXT, {_SHARED})",
    "CREATE TABLE FVS_TreeInit (Stand_CN TEXT, Stand_ID TEXT, StandPlot_CN TEXT, StandPlot_ID TEXT, Plot_ID INTEGER, "
    "Tree_ID INTEGER, Tree_Count REAL, History INTEGER, Species TEXT, DBH REAL, DG REAL, Ht REAL, HTG REAL, "
    "HtTopK REAL, CrRatio INTEGER, Damage1 INTEGER, Severity1 INTEGER, Damage2 INTEGER, Severity2 INTEGER, "
    "Damage3 INTEGER, Severity3 INTEGER, TreeValue INTEGER, Prescription INTEGER, Age INTEGER, Slope INTEGER, "
    "Aspect INTEGER, PV_Code TEXT, TopoCode INTEGER, SitePrep INTEGER)",
    "CREATE TABLE FVS_GroupAddFilesAndKeywords (Groups TEXT, AddFiles TEXT, FVSKeywords TEXT)",
)
#: FVS history codes: a live tree, and one that was dead before the growth measurement.
_LIVE, _DEAD = 1, 9
#: Characters of Stand_ID and StandPlot_ID that FVS keeps.
_LONGEST_ID = 26


def write_fvs(path: Path, stand: Stand, variant: str | None = None, year: int | None = None) -> Path:
    """Write the database atomically. variant: two letters (``SN``); year: of the inventory; NULL where not given."""
    with atomic_path(path) as temporary, closing(sqlite3.connect(temporary)) as connection, connection:
        for statement in _SCHEMA:
            connection.execute(statement)
        for name, table in _tables(stand, variant, year).items():
            table.to_sql(name, connection, if_exists="append", index=False)
    return Path(path)


def long_names(stand: Stand) -> list[str]:
    """A warning where FVS would cut names off, and mix up what they name."""
    names = [stand.stand_id, *(f"{stand.stand_id}_{plot.plot_id}" for plot in stand.plots)]
    longest = max(names, key=len)
    if len(longest) <= _LONGEST_ID:
        return []
    return [
        f"FVS reads {_LONGEST_ID} characters of a stand's or plot's name, {longest!r} has {len(longest)}: shorten it."
    ]


def tree_counts(stand: Stand) -> np.ndarray:
    """Trees an acre of its plot for each row of ``stand.rows``; their sum over Num_Plots is the stand's trees an acre.

    With plots of equal area that is weight / area; larger plots weigh more, as they do in the report.
    """
    return stand.rows["per_ha"].to_numpy() * stand.design.n * ACRE_HA


def _tables(stand: Stand, variant: str | None, year: int | None) -> dict[str, pd.DataFrame]:
    """Rows of each table by its name."""
    name, plot_names = stand.stand_id, [f"{stand.stand_id}_{plot.plot_id}" for plot in stand.plots]
    common = {"Variant": variant, "Inv_Year": year, "Basal_Area_Factor": -1.0, "Inv_Plot_Size": 1.0, "Brk_DBH": 999.0}
    stands = {"Stand_CN": name, "Stand_ID": name}
    places = pd.DataFrame(
        [_lonlat(stand, plot.x, plot.y) for plot in stand.plots], columns=["Longitude", "Latitude"], dtype=float
    )
    slopes = [100 * np.tan(np.radians(plot.slope_deg)) if plot.slope_deg else np.nan for plot in stand.plots]
    init = {**stands, "Groups": "All_Stands", "Num_Plots": stand.design.n, **places.mean()}
    plots = places.assign(
        **stands,
        StandPlot_CN=plot_names,
        StandPlot_ID=plot_names,
        Groups="All_Plots",
        Num_Plots=1,
        Slope=np.round(slopes, 1),
        **common,
    )
    groups = [
        (
            group,
            f"Database\nDSNIn\nFVS_Data.db\nStandSQL\nSELECT * FROM {table} WHERE {key} = '%StandID%'\nEndSQL\n"
            f"TreeSQL\nSELECT * FROM FVS_TreeInit WHERE {key} = '%StandID%'\nEndSQL\nEND",
        )
        for group, table, key in (
            ("All_Stands", "FVS_StandInit", "Stand_ID"),
            ("All_Plots", "FVS_PlotInit", "StandPlot_ID"),
        )
    ]
    return {
        "FVS_StandInit": pd.DataFrame([{**init, "Slope": round(float(np.mean(slopes)), 1), **common}]),
        "FVS_PlotInit": plots,
        "FVS_TreeInit": _trees(stand, np.array(plot_names, object)).assign(**stands),
        "FVS_GroupAddFilesAndKeywords": pd.DataFrame(groups, columns=["Groups", "FVSKeywords"]),
    }


def _trees(stand: Stand, plot_names: np.ndarray) -> pd.DataFrame:
    # A row of stand-ins is more of the same tree: one record a tree and plot.
    rows = stand.rows.assign(count=tree_counts(stand), History=_LIVE)
    counted = rows.groupby(["plot", "tree", "History"], as_index=False)["count"].sum()
    per_acre = stand.dead["weight"] / stand.design.areas.sum() * stand.design.n * ACRE_HA
    dead = stand.dead[["plot", "tree"]].assign(count=per_acre, History=_DEAD)
    found = pd.concat([counted, dead], ignore_index=True)
    ids = pd.to_numeric(stand.trees["tree_id"], errors="coerce")
    # The layer's own, unless several trees would have the same.
    own = not ids.isna().any() and ids.is_unique and found["tree"].is_unique
    found["Tree_ID"] = ids.to_numpy()[found["tree"]].astype(int) if own else found.index + 1
    found = found[np.isfinite(stand.values.dbh[found["tree"]])]
    tree, plot = found["tree"].to_numpy(int), found["plot"].to_numpy(int)
    species = [species_of(entry) for entry in stand.trees["species"].iloc[tree]]
    return pd.DataFrame(
        {
            "StandPlot_CN": plot_names[plot],
            "StandPlot_ID": plot_names[plot],
            "Plot_ID": plot + 1,
            "Tree_ID": found["Tree_ID"].to_numpy(),
            "Tree_Count": found["count"].to_numpy(float),
            "History": found["History"].to_numpy(),
            # FVS reads its own codes, FIA numbers and PLANTS symbols; three digits are FIA's.
            "Species": [s.fia.zfill(3) if s.fia else (s.symbol if s.symbol != UNKNOWN else None) for s in species],
            "DBH": stand.values.dbh[tree] / 2.54,
            "Ht": stand.values.height[tree] / FOOT,
        }
    )


def _lonlat(stand: Stand, x: float, y: float) -> tuple[float, float]:
    """Degrees; NaN without a place on the earth."""
    if stand.crs is None or stand.crs.geodetic_crs is None or not np.isfinite(x):
        return np.nan, np.nan
    made = pyproj.Transformer.from_crs(stand.crs, stand.crs.geodetic_crs.to_2d(), always_xy=True).transform(x, y)
    return round(float(made[0]), 6), round(float(made[1]), 6)
