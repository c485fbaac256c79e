"""FVS-ready SQLite tables: FVS_StandInit, FVS_PlotInit and FVS_TreeInit, in inches, feet and acres.

Columns are those of the Forest Vegetation Simulator's own input database (Database Extension user's guide, USDA Forest
Service). Every tree's ``Tree_Count`` is the number of trees an acre that it stands for on its plot, with
``Basal_Area_Factor`` -1 and ``Inv_Plot_Size`` 1 (a plot of one acre): FVS divides by ``Num_Plots``, and gets the
report's trees an acre. Diameters are as measured, so that basal area in FVS is the report's uncorrected one.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ...core.files import atomic_path
from .species import species_of
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
    with atomic_path(path) as temporary:
        connection = sqlite3.connect(temporary)
        try:
            with connection:
                for statement in _SCHEMA:
                    connection.execute(statement)
                _fill(connection, stand, variant, year)
        finally:
            connection.close()
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


def _fill(connection: sqlite3.Connection, stand: Stand, variant: str | None, year: int | None) -> None:
    common = {"Variant": variant, "Inv_Year": year, "Basal_Area_Factor": -1.0, "Inv_Plot_Size": 1.0, "Brk_DBH": 999.0}
    name = stand.stand_id
    places = [_lonlat(stand, plot.x, plot.y) for plot in stand.plots]
    known = [place for place in places if place is not None]
    middle = tuple(np.mean(known, axis=0)) if known else (None, None)
    _insert(
        connection,
        "FVS_StandInit",
        {
            "Stand_CN": name,
            "Stand_ID": name,
            "Groups": "All_Stands",
            "Num_Plots": stand.design.n,
            "Longitude": middle[0],
            "Latitude": middle[1],
            "Slope": _slope(stand),
            **common,
        },
    )
    for plot, place in zip(stand.plots, places, strict=True):
        _insert(
            connection,
            "FVS_PlotInit",
            {
                "Stand_CN": name,
                "Stand_ID": name,
                "StandPlot_CN": f"{name}_{plot.plot_id}",
                "StandPlot_ID": f"{name}_{plot.plot_id}",
                "Groups": "All_Plots",
                "Num_Plots": 1,
                "Longitude": place[0] if place else None,
                "Latitude": place[1] if place else None,
                "Slope": round(float(100 * np.tan(np.radians(plot.slope_deg))), 1) if plot.slope_deg else None,
                **common,
            },
        )
    # A row of stand-ins is more of the same tree: one record a tree and plot.
    counted = stand.rows.assign(count=tree_counts(stand)).groupby(["plot", "tree"], sort=True)["count"].sum()
    dead = stand.dead.assign(count=stand.dead["weight"] / stand.design.areas.sum() * stand.design.n * ACRE_HA)
    records = [(plot, tree, count, _LIVE) for (plot, tree), count in counted.items()]
    records += [
        (row.plot, row.tree, row.count_, _DEAD) for row in dead.rename(columns={"count": "count_"}).itertuples()
    ]
    ids = pd.to_numeric(stand.trees["tree_id"], errors="coerce")
    own = not ids.isna().any() and ids.is_unique and len({tree for _, tree, *_ in records}) == len(records)
    for number, (position, tree, count, history) in enumerate(records, start=1):
        k, j = int(tree), int(position)
        if not np.isfinite(stand.values.dbh[k]):
            continue
        height = stand.values.height[k]
        found = species_of(stand.trees["species"].iloc[k])
        _insert(
            connection,
            "FVS_TreeInit",
            {
                "Stand_CN": name,
                "Stand_ID": name,
                "StandPlot_CN": f"{name}_{stand.plots[j].plot_id}",
                "StandPlot_ID": f"{name}_{stand.plots[j].plot_id}",
                "Plot_ID": j + 1,
                # The layer's own, unless several trees would have the same.
                "Tree_ID": int(ids.iloc[k]) if own else number,
                "Tree_Count": float(count),
                "History": history,
                # FVS reads its own codes, FIA numbers and PLANTS symbols; three digits are FIA's.
                "Species": found.fia.zfill(3) if found.fia else (found.symbol if found.symbol != "unknown" else None),
                "DBH": float(stand.values.dbh[k] / 2.54),
                "Ht": float(height / FOOT) if np.isfinite(height) else None,
            },
        )
    for group, table, key in (
        ("All_Stands", "FVS_StandInit", "Stand_ID"),
        ("All_Plots", "FVS_PlotInit", "StandPlot_ID"),
    ):
        keywords = (
            f"Database\nDSNIn\nFVS_Data.db\nStandSQL\nSELECT * FROM {table} WHERE {key} = '%StandID%'\nEndSQL\n"
            f"TreeSQL\nSELECT * FROM FVS_TreeInit WHERE {key} = '%StandID%'\nEndSQL\nEND"
        )
        _insert(connection, "FVS_GroupAddFilesAndKeywords", {"Groups": group, "FVSKeywords": keywords})


def _insert(connection: sqlite3.Connection, table: str, row: dict) -> None:
    marks = ", ".join("?" * len(row))
    connection.execute(f"INSERT INTO {table} ({', '.join(row)}) VALUES ({marks})", list(row.values()))


def _slope(stand: Stand) -> float | None:
    slopes = [np.tan(np.radians(plot.slope_deg)) for plot in stand.plots if plot.slope_deg]
    return round(100 * float(np.mean(slopes)), 1) if len(slopes) == len(stand.plots) else None


def _lonlat(stand: Stand, x: float, y: float) -> tuple[float, float] | None:
    if stand.crs is None or stand.crs.geodetic_crs is None or not np.isfinite(x):
        return None
    made = pyproj.Transformer.from_crs(stand.crs, stand.crs.geodetic_crs.to_2d(), always_xy=True).transform(x, y)
    return round(float(made[0]), 6), round(float(made[1]), 6)
