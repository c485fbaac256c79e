"""The report's files beside its page. *Map layers*: GeoPackage and shapefiles, always metric, names of at most 10
characters. *Tables*: an Excel workbook and CSV files, with every digit. *FVS*: SQLite tables in inches, feet and acres.

FVS_StandInit, FVS_PlotInit and FVS_TreeInit have the columns of the Forest Vegetation Simulator's own input database
(Database Extension user's guide, USDA Forest Service). Every tree's ``Tree_Count`` is the number of trees an acre that
it stands for on its plot, with ``Basal_Area_Factor`` -1 and ``Inv_Plot_Size`` 1 (a plot of one acre): FVS divides by
``Num_Plots``, and gets the report's trees an acre. Diameters are as measured, so that basal area in FVS is the report's
uncorrected one.
"""

from __future__ import annotations

import re
import sqlite3
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from ...core import tables
from ...core.files import atomic_path, ensure_writable
from ...core.frames import own_degrees
from ...core.geopackage import atomic_geopackage
from ...core.layer_files import add_layer, write_shapefile
from ...report.blocks import Document, Table, known
from .species import UNKNOWN, species_of
from .survey import Stand
from .units import ACRE_HA, FOOT

PLOTS, TREES = "stand_plots", "stand_trees"
#: The columns by which a layer of that name is known as ours.
OWN_LAYERS = {
    PLOTS: frozenset({"plot_id", "expansion", "ba_m2_ha", "trees_ha"}),
    TREES: frozenset({"plot_id", "tree_id", "counts_as", "tph"}),
}
#: What is known of a plot, and fields whose names are shorter.
_PLOT_FIELDS = (
    "plot_id", "shape", "edge", "area_ha", "expansion", "n_trees", "n_missing", "n_dead", "trees_ha", "ba_m2_ha",
    "qmd_cm", "lorey_m", "dominant_m", "volume_m3_ha", "biomass_t_ha",
)  # fmt: skip
_SHORT = {"volume_m3_ha": "vol_m3_ha", "biomass_t_ha": "bio_t_ha"}


def plot_layer(stand: Stand) -> gpd.GeoDataFrame:
    """One polygon a plot with its figures; plots without a place have no geometry."""
    table = stand.plot_rows[list(_PLOT_FIELDS)].rename(columns=_SHORT)
    return gpd.GeoDataFrame(table, geometry=[plot.outline for plot in stand.plots], crs=stand.crs)


def tree_layer(stand: Stand) -> gpd.GeoDataFrame:
    """One point a tree and plot, also those that do not count (``counts_as``); ``tph``: trees a hectare it stands for.

    Rows of stand-ins are folded into the tree that stands in: ``tph`` holds them, ``weight`` does not.
    """
    rows = stand.tree_rows().rename(columns={"height_source": "height_src"})
    plot, tree = rows.pop("plot"), rows.pop("tree")
    per_ha = stand.rows.groupby(["plot", "tree"])["per_ha"].sum()
    per_ha = per_ha.reindex(pd.MultiIndex.from_arrays([plot, tree])).fillna(0.0).to_numpy()
    rows.insert(rows.columns.get_loc("ba_m2"), "tph", np.where(rows["counts_as"] == "measured", per_ha, 0.0))
    for name in ("height_src", "qc_reason", "note"):
        rows[name] = rows[name].where(rows[name] != "", None)
    place = stand.trees[["x", "y"]].to_numpy(float)[tree]
    known = np.isfinite(place).all(axis=1)
    points = np.where(known, shapely.points(np.where(known[:, None], place, 0.0)), None)
    return gpd.GeoDataFrame(rows, geometry=points, crs=stand.crs)


def write_geopackage(path: Path, stand: Stand) -> None:
    """Both layers, styled where a style exists; other layers of an existing file stay."""
    with atomic_geopackage(path, OWN_LAYERS) as temporary:
        add_layer(temporary, PLOTS, plot_layer(stand), "Unknown")
        add_layer(temporary, TREES, tree_layer(stand), "Point")


def write_shapefiles(folder: Path, stand: Stand) -> list[Path]:
    """``stand_plots.shp`` and ``stand_trees.shp``; nothing for a layer that has no place on the map."""
    written = []
    for name, layer in ((PLOTS, plot_layer(stand)), (TREES, tree_layer(stand))):
        if len(layer := layer[layer.geometry.notna()]):
            written.append(Path(folder) / f"{name}.shp")
            ensure_writable(written[-1])
            write_shapefile(written[-1], layer)
    return written


#: Tables that get a file of their own.
CSV_TABLES = ("summary", "stand_table", "plots", "corrections", "equations", "trees")
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")


def csv_name(table: str) -> str:
    """File of a table; all begin alike, so that they cannot be taken for a survey's own plots.csv or trees.csv."""
    return f"{table if table.startswith('stand_') else f'stand_{table}'}.csv"


def write_workbook(path: Path, document: Document) -> None:
    """One sheet a table; numbers as numbers, shown with their decimals."""
    from openpyxl import Workbook
    from openpyxl.styles import Alignment, Font, PatternFill
    from openpyxl.utils import get_column_letter

    book = Workbook()
    book.remove(book.active)
    for name in ("summary", "stand_table", "plots", "corrections", "trees", "equations", "about"):
        table = document.tables[name]
        sheet = book.create_sheet(name)
        sheet.append([column.heading for column in table.columns])
        for number, row in enumerate(table.rows):
            for k, column in enumerate(table.columns, start=1):
                value = row.get(column.key)
                if not isinstance(value, str) and (value := known(value)) is None:
                    continue
                cell = sheet.cell(number + 2, k)
                cell.value = _CONTROL.sub(" ", value) if isinstance(value, str) else value
                if isinstance(value, str):
                    # Never a formula, whatever a plot is called.
                    cell.data_type = "s"
                if column.decimals is not None:
                    cell.number_format = "#,##0" + ("." + "0" * column.decimals if column.decimals else "")
                if number >= len(table.rows) - table.n_totals:
                    cell.font = Font(bold=True)
        for k, column in enumerate(table.columns, start=1):
            head = sheet.cell(1, k)
            head.font, head.fill = Font(bold=True, color="FFFFFF"), PatternFill("solid", fgColor="1F6B45")
            head.alignment = Alignment(wrap_text=True, vertical="top")
            longest = max([len(table.text(row, column)) for row in table.rows], default=0)
            sheet.column_dimensions[get_column_letter(k)].width = min(max(longest + 2, 11), 60)
        sheet.freeze_panes = "A2"
        if table.note:
            sheet.cell(len(table.rows) + 3, 1).value = table.note
    book.properties.title = document.title
    book.properties.creator = "TreeDGS"
    with atomic_path(path) as temporary:
        book.save(temporary)


def write_csv(path: Path, table: Table) -> None:
    """One table; column names are keys with units, missing is empty."""
    keys = [column.key for column in table.columns]
    if any("key" in row for row in table.rows):
        keys.insert(1, "key")
    tables.write_csv(path, pd.DataFrame(table.rows, columns=keys, dtype=object), lineterminator="\n")


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


def write_fvs(path: Path, stand: Stand, year: int | None = None) -> None:
    """Write the database atomically. year: of the inventory; NULL where it is not known, as the variant, the user's."""
    with atomic_path(path) as temporary, closing(sqlite3.connect(temporary)) as connection, connection:
        for statement in _SCHEMA:
            connection.execute(statement)
        for name, table in _tables(stand, year).items():
            table.to_sql(name, connection, if_exists="append", index=False)


def long_names(stand: Stand) -> list[str]:
    """A warning where FVS would cut names off, and mix up what they name."""
    names = [stand.stand_id, *(f"{stand.stand_id}_{plot.plot_id}" for plot in stand.plots)]
    longest = max(names, key=len)
    if len(longest) <= _LONGEST_ID:
        return []
    return [
        f"FVS reads {_LONGEST_ID} characters of a stand's or plot's name, {longest!r} has {len(longest)}: shorten it."
    ]


def _tables(stand: Stand, year: int | None) -> dict[str, pd.DataFrame]:
    """Rows of each table by its name."""
    name, plot_names = stand.stand_id, [f"{stand.stand_id}_{plot.plot_id}" for plot in stand.plots]
    common = {"Variant": None, "Inv_Year": year, "Basal_Area_Factor": -1.0, "Inv_Plot_Size": 1.0, "Brk_DBH": 999.0}
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
    # Their sum over Num_Plots is the stand's trees an acre; larger plots weigh more, as they do in the report.
    rows = stand.rows.assign(count=stand.rows["per_ha"] * stand.design.n * ACRE_HA, History=_LIVE)
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
    found = own_degrees(stand.crs, x, y) if np.isfinite(x) else None
    return (np.nan, np.nan) if found is None else (round(found[0], 6), round(found[1], 6))
