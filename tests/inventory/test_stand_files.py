"""``stand-table`` end to end: every file is read back and holds the same numbers; real tallies; mistakes."""

from __future__ import annotations

import datetime
import json
import re
import shutil
import sqlite3
import subprocess

import geopandas as gpd
import numpy as np
import openpyxl
import pandas as pd
import pytest
from inventory.stand_helpers import CRS, figures, html_tables, make_survey, number, report
from shared_data import needs_shared

import treedgs_geo as tg
from treedgs_geo.core.errors import CRSError, InputError
from treedgs_geo.core.settings import build
from treedgs_geo.inventory.review.apply import Decision
from treedgs_geo.inventory.searched import searched_table
from treedgs_geo.inventory.stand.files import CSV_TABLES, csv_name, tree_layer, write_shapefiles
from treedgs_geo.inventory.stand.tables import cross_table, species_class_table
from treedgs_geo.inventory.stand.units import UNITS
from treedgs_geo.verbs.stand_table import StandTableSettings

FIGURES = ("trees", "ba", "volume", "biomass", "qmd", "lorey", "dominant")


@pytest.fixture(scope="module", params=["metric", "us"])
def written(request, tmp_path_factory):
    """The survey's report in each system of units."""
    folder = make_survey(tmp_path_factory.mktemp(request.param))
    result, ears, out = report(folder, units=request.param, stand_id="Stand 7 é", field_date="2026-03-12")
    return request.param, result, ears, out, json.loads((out / "summary.json").read_text(encoding="utf-8"))


def expected(written, name, key="mean"):
    units, _, _, _, summary = written
    value = summary["estimates"][UNITS["metric"][name].key][key]
    return np.nan if value is None else value * UNITS[units][name].factor


def test_the_result_is_the_summary(written):
    _, result, ears, out, summary = written
    for name in FIGURES:
        key = UNITS["metric"][name].key
        assert result[key] == pytest.approx(summary["estimates"][key]["mean"], abs=1e-4)
    assert result["n_plots"] == 4 and result["n_missing"] == summary["n_missing"] > 0
    assert summary["warnings"] == ears.warnings and summary["estimates"]["ba_m2_ha"]["se_plots"] > 0
    assert not list(out.glob(".*"))


def test_csv(written):
    units, _, _, out, _ = written
    table = pd.read_csv(out / "stand_summary.csv").set_index("key")
    long = pd.read_csv(out / "stand_table.csv")
    plots = pd.read_csv(out / "stand_plots.csv")
    for name in FIGURES:
        key = UNITS[units][name].key
        for column in ("mean", "se_plots", "low", "high"):
            assert table.loc[key, column] == pytest.approx(expected(written, name, column), nan_ok=True), (name, column)
    for name in FIGURES[:4]:
        key = UNITS[units][name].key
        assert long[key][long.species == "all"].item() == pytest.approx(expected(written, name))
        assert long[key][long.species != "all"].sum() == pytest.approx(expected(written, name))
        assert np.average(plots[key]) == pytest.approx(expected(written, name))  # plots of one size
    trees = pd.read_csv(out / "stand_trees.csv")
    measured = trees[trees.counts_as == "measured"]
    assert len(measured) == plots.n_trees.sum() and (trees.counts_as == "missing").sum() >= plots.n_missing.sum()
    cm, m2, m3, kg = ("cm", "m2", "m3", "kg") if units == "metric" else ("in", "ft2", "ft3", "lb")
    assert (long[f"lower_{cm}"].dropna() < long[f"upper_{cm}"].dropna()).all()
    assert {f"dbh_{cm}", f"dbh_se_{cm}", f"ba_{m2}", f"volume_{m3}", f"biomass_{kg}", UNITS[units]["trees"].key} < {
        *trees
    }


def test_workbook(written):
    units, _, _, out, _ = written
    book = openpyxl.load_workbook(out / "stand_table.xlsx")
    assert set(CSV_TABLES) < set(book.sheetnames)
    for name in CSV_TABLES:
        sheet, table = book[name], pd.read_csv(out / csv_name(name)).drop(columns="key", errors="ignore")
        assert sheet.max_column == len(table.columns)
        for k, column in enumerate(table.columns, start=1):
            cells = [sheet.cell(row + 2, k).value for row in range(len(table))]
            if pd.api.types.is_numeric_dtype(table[column]):
                found = np.array([np.nan if c is None else float(c) for c in cells])
                assert found == pytest.approx(table[column].to_numpy(float), nan_ok=True), (name, column)
    assert not any(c.data_type == "f" for sheet in book for row in sheet for c in row)


def test_page(written):
    units, _, _, out, _ = written
    tables, outside = html_tables(out / "report.html")
    assert outside == []
    shown = {row[0]: [number(cell) for cell in row[1:]] for row in tables["summary"][1:]}
    for name in FIGURES:
        assert shown[UNITS[units][name].heading][0] == pytest.approx(expected(written, name), abs=0.0051)
    stock, long = tables["stock_table"], pd.read_csv(out / "stand_table.csv")
    total = [number(cell) for cell in stock[-1][1:]]
    assert total[1:] == pytest.approx([expected(written, n) for n in FIGURES[:4]], abs=0.51)
    columns = np.array([[number(cell) for cell in row[1:]] for row in stock[1:-1]])
    assert columns.sum(axis=0)[1:] == pytest.approx(total[1:], abs=0.06 * len(columns) + 0.5)
    assert columns[:, 0].sum() == long[long.species == "all"].n.item() == total[0]
    plots = {row[0] for row in tables["plots"][1:]}
    assert plots == {"A", "B", "C", "D & é"} and len(tables["trees"]) - 1 == len(pd.read_csv(out / "stand_trees.csv"))
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 3 and "Westfall" in page and "Stand 7 é" in page


def test_pdf(written):
    """Text as a reader sees it, by poppler's pdftotext."""
    if shutil.which("pdftotext") is None:
        pytest.skip("pdftotext (poppler-utils) is not installed")
    units, _, _, out, _ = written
    done = subprocess.run(["pdftotext", "-layout", out / "report.pdf", "-"], capture_output=True, text=True, check=True)
    text = re.sub(r"(?<=\d)\s(?=\d{3}\.)", "", done.stdout)
    for name in FIGURES:
        assert f"{expected(written, name):.2f}" in text, name
    assert "Stand 7 é" in text and ("ft²/ac" if units == "us" else "m²/ha") in text and "Westfall" in text
    assert (out / "report.pdf").read_bytes().startswith(b"%PDF") and text.count("\f") >= 3


def test_layers(written):
    _, _, _, out, summary = written
    tables = {
        ".gpkg": [gpd.read_file(out / "stand.gpkg", layer=n) for n in ("stand_plots", "stand_trees")],
        ".shp": [gpd.read_file(out / f"stand_{n}.shp") for n in ("plots", "trees")],
    }
    for kind, (plots, trees) in tables.items():
        assert plots.crs == trees.crs == CRS or kind == ".shp" and plots.crs.to_epsg() == 6344
        assert max(map(len, plots.columns)) <= 10 and max(map(len, trees.columns)) <= 10
        means = summary["estimates"]
        assert plots.ba_m2_ha.mean() == pytest.approx(means["ba_m2_ha"]["mean"])
        assert plots.vol_m3_ha.mean() == pytest.approx(means["volume_m3_ha"]["mean"])
        assert trees.tph.sum() == pytest.approx(means["trees_ha"]["mean"])
        assert (trees.tph * trees.ba_m2.fillna(0)).sum() == pytest.approx(means["ba_m2_ha"]["mean"])
        assert (trees.tph * trees.biomass_kg.fillna(0)).sum() / 1000 == pytest.approx(means["biomass_t_ha"]["mean"])
        missing = trees[trees.counts_as == "missing"]
        assert len(missing) and missing.dbh_cm.isna().all() and (missing.tph == 0).all()
        assert plots.geometry.area.to_numpy() == pytest.approx(plots.area_ha * 1e4, rel=1e-4)


def test_fvs(written):
    """What FVS would compute: Tree_Count over Num_Plots is trees an acre; diameters in inches, heights in feet."""
    _, _, _, out, summary = written
    with sqlite3.connect(out / "FVS_Data.db") as connection:
        stand = pd.read_sql("SELECT * FROM FVS_StandInit", connection)
        plots = pd.read_sql("SELECT * FROM FVS_PlotInit", connection)
        trees = pd.read_sql("SELECT * FROM FVS_TreeInit", connection)
        groups = pd.read_sql("SELECT * FROM FVS_GroupAddFilesAndKeywords", connection)
    connection.close()
    assert stand[["Stand_ID", "Inv_Year", "Num_Plots"]].values.tolist() == [["Stand 7 é", 2026, 4]]
    assert (stand.Basal_Area_Factor == -1).all() and (stand.Inv_Plot_Size == 1).all()
    assert len(plots) == 4 and set(trees.StandPlot_ID) == set(plots.StandPlot_ID) and trees.Tree_ID.is_unique
    layer = pd.read_csv(out / "stand_trees.csv").set_index("tree_id")
    inches = 1.0 if "dbh_in" in layer else 2.54
    dbh = layer["dbh_in" if "dbh_in" in layer else "dbh_cm"].reindex(trees.Tree_ID) / inches
    assert trees.DBH.to_numpy() == pytest.approx(dbh.to_numpy()), "ids are the layer's"
    live = trees[trees.History < 6]
    us = UNITS["us"]
    tpa = summary["estimates"]["trees_ha"]["mean"] * us["trees"].factor
    ba = summary["uncorrected"]["ba_m2_ha"] * us["ba"].factor
    assert live.Tree_Count.sum() / 4 == pytest.approx(tpa)
    assert (live.Tree_Count * np.pi / 576 * live.DBH**2).sum() / 4 == pytest.approx(ba)
    by_plot = pd.read_csv(out / "stand_plots.csv")
    key = "trees_ac" if "trees_ac" in by_plot else "trees_ha"
    factor = 1.0 if key == "trees_ac" else us["trees"].factor
    one = live.groupby("StandPlot_ID").Tree_Count.sum().sort_index()  # a plot run as a stand of its own
    assert one.to_numpy() == pytest.approx(by_plot.set_index("plot_id")[key].sort_index().to_numpy() * factor)
    assert set(trees.Species) == {"131"} and trees.Ht.between(15, 120).all() and trees.DBH.between(2, 20).all()
    assert 33 < stand.Latitude.item() < 34 and -92 < stand.Longitude.item() < -91
    assert groups.Groups.tolist() == ["All_Stands", "All_Plots"]


def test_the_day_of_the_flight_and_who_decided_are_said_where_known(tmp_path):
    folder = make_survey(tmp_path)
    stand = gpd.read_file(folder / "stand.gpkg")
    area = searched_table(stand.geometry.iloc[0], [], CRS, datetime.date(2025, 5, 14))
    facts = dict(html_tables(report(folder)[2] / "report.html")[0]["about"])
    assert "Day of the photos or points" not in facts and "Decided by" not in facts
    area.to_file(folder / "trees.gpkg", layer="searched", driver="GPKG")
    tg.review_trees(folder / "trees.gpkg", [Decision(0, "accept", 1, by="Bea"), Decision(1, "accept", 2, by="Ada")])
    _, _, out = report(folder)
    facts = dict(html_tables(out / "report.html")[0]["about"])
    assert facts["Day of the photos or points"] == "2025-05-14" and facts["Decided by"] == "Ada, Bea"
    with sqlite3.connect(out / "FVS_Data.db") as connection:
        assert connection.execute("SELECT DISTINCT Inv_Year FROM FVS_StandInit").fetchall() == [(2025,)]
    connection.close()


def test_both_treatments_of_stems_without_a_dbh_are_reported(tmp_path):
    folder = make_survey(tmp_path)
    impute, reported = figures(folder)
    exclude, reported_too = figures(folder, missing="exclude")
    more, less = impute.estimates["ba"].mean, exclude.estimates["ba"].mean
    assert more > less and impute.other["ba"].mean == less and exclude.other["ba"].mean == more
    for ears in (reported, reported_too):
        text = next(w for w in ears.warnings if "without a DBH" in w)
        assert f"{more:.2f}" in text and f"{less:.2f}" in text
    assert impute.n_thin > 0 and any("too_small" in info for info in reported.infos)


def test_the_same_run_gives_the_same_files_and_formulas_in_names_stay_text(tmp_path):
    folder = make_survey(tmp_path)
    plots = (folder / "plots.csv").read_text().replace("\nB,", "\n=1+1,")
    (folder / "plots.csv").write_text(plots.replace("\nC,", "\n<script>,"))
    report(folder)
    first = [(folder / "out" / name).read_bytes() for name in ("summary.json", "report.html", "stand_plots.csv")]
    _, _, out = report(folder)
    assert first == [(out / name).read_bytes() for name in ("summary.json", "report.html", "stand_plots.csv")]
    cells = [c for row in openpyxl.load_workbook(out / "stand_table.xlsx")["plots"] for c in row if c.value == "=1+1"]
    assert cells and cells[0].data_type == "s" and "\n'=1+1," in (out / "stand_plots.csv").read_text()
    assert "<script>" not in (out / "report.html").read_text()


def test_a_real_tally(tmp_path):
    """Petawawa PRF025: the crew's own sums by hand from the table; heights without a unit are refused."""
    folder = needs_shared("field_prf025")
    (tmp_path / "plots.csv").write_text(
        "plot_id,easting,northing,epsg,radius_m\nPRF025,312029.5177,5096039.418,2959,11.28\n"
    )
    more = {"trees": None, "boundary": None, "species": None, "field": folder / "PRF025_field.csv"}
    more.update(dbh_unit="cm", distance_unit="m", breast_height_m=1.3)
    with pytest.raises(InputError, match="'ht' does not say its unit"):
        figures(tmp_path, **more)
    head = "id,quantity,species,formula,dbh_unit,result_unit,source\n"
    (tmp_path / "own.csv").write_text(head + "half,volume,*,0.45*3.14159265358979/4*D**2*H,m,m3,hand\n")
    table = pd.read_csv(folder / "PRF025_field.csv")
    table.rename(columns={"Ht": "Ht_m"}).to_csv(tmp_path / "field.csv", index=False)
    more["field"] = tmp_path / "field.csv"
    stand, ears = figures(tmp_path, **more, equations=tmp_path / "own.csv")
    live = table[table.Status == "L"]
    area = np.pi * 11.28**2 / 1e4
    found = stand.estimates
    assert len(stand.rows) == len(live) and found["trees"].mean == pytest.approx(len(live) / area)
    assert found["ba"].mean == pytest.approx((np.pi / 4e4 * live.DBH**2).sum() / area)
    assert any("One plot" in w for w in ears.warnings) and (live.Ht > 0).any()
    used = stand.values.height_source[stand.rows.tree]
    heights = np.where(live.Ht > 0, live.Ht, stand.values.height[stand.rows.tree])
    assert (used == np.where(live.Ht > 0, "measured", "curve")).all()
    assert found["volume"].mean == pytest.approx((0.45 * np.pi / 4e4 * live.DBH**2 * heights).sum() / area)
    assert found["lorey"].mean == pytest.approx(np.average(heights, weights=live.DBH**2))
    drawn = tree_layer(stand)
    away = np.hypot(drawn.geometry.x - 312029.5177, drawn.geometry.y - 5096039.418)
    assert len(drawn) == len(table) and away.max() < 11.5 and drawn.crs.to_epsg() == 2959


def test_large_square_plots_of_many_species(tmp_path):
    """Mount Rainier: fifteen plots of one hectare without coordinates, trees to 2.5 m, 18 species."""
    table = pd.read_csv(needs_shared("field_rainier_forestplotr") / "mapping.csv").rename(columns={"dbh": "dbh_cm"})
    table.rename(columns={"stand_id": "plot_id"}).drop(columns=["x_coord", "y_coord"]).to_csv(
        tmp_path / "field.csv", index=False
    )
    stands = sorted(set(table.stand_id))
    pd.DataFrame({"plot_id": stands, "area_ha": 1.0}).to_csv(tmp_path / "plots.csv", index=False)
    more = {"trees": None, "boundary": None, "species": None, "field": tmp_path / "field.csv"}
    stand, ears = figures(tmp_path, **more)
    found = stand.estimates
    ba = (np.pi / 4e4 * table.dbh_cm**2).groupby(table.stand_id).sum()
    assert stand.design.n == 15 and found["ba"].mean == pytest.approx(ba.mean())
    assert found["ba"].se_plots == pytest.approx(ba.sem())
    assert np.isnan(found["volume"].mean) and any("without a height" in w for w in ears.warnings)
    # Old PLANTS symbols are in no list: no biomass by guess, and the trees are named.
    assert np.isnan(found["biomass"].mean) and any("species CANO without an equation" in w for w in ears.warnings)
    assert any("Extrapolated" in w and "jenkins-agb-douglas-fir" in w for w in ears.warnings)
    crossed = cross_table(species_class_table(stand, "metric", 20.0), "metric", "trees")
    assert [column.heading for column in crossed.columns][-2:] == ["other species", "all"]
    counts = table.species.value_counts() / 15
    assert crossed.rows[-1]["ABAM"] == pytest.approx(counts["ABAM"])
    assert crossed.rows[-1]["other"] == pytest.approx(counts.iloc[5:].sum())
    assert write_shapefiles(tmp_path, stand) == []  # they have no place on the map


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"trees": None}, InputError, "Give --trees"),
        ({"plots": None, "boundary": None}, InputError, "Give --plots"),
        ({"trees": None, "field": "plots.csv", "pairs": "trees.gpkg"}, InputError, "--pairs"),
        ({"plots": "far.csv"}, InputError, "no plot is left"),
        ({"plots": "local.csv"}, InputError, "local metres by their size"),
        ({"plots": "twice.csv"}, InputError, "line 3: plot_id 'a' appears twice"),
        ({"plots": "bad.csv"}, InputError, "line 2: radius_m is 'ten'"),
        ({"plots": "none.csv"}, InputError, "lacks the radius"),
        ({"plots": "epsg.csv"}, CRSError, "epsg '999999' is unknown"),
        ({"min_dbh_cm": 300.0}, InputError, "No tree with a DBH"),
    ],
)
def test_mistakes_are_reported_before_anything_is_written(tmp_path, change, error, message):
    folder = make_survey(tmp_path)
    head = "plot_id,easting,northing,radius_m,epsg\n"
    (folder / "far.csv").write_text(head + "a,600000,3700000,10,\n")
    (folder / "local.csv").write_text(head + "a,1000,1000,10,\n")
    (folder / "twice.csv").write_text(head + "a,611340,3718430,10,\na,611350,3718430,10,\n")
    (folder / "bad.csv").write_text(head + "a,611340,3718430,ten,\n")
    (folder / "none.csv").write_text("plot_id,easting,northing\na,611340,3718430\n")
    (folder / "epsg.csv").write_text(head + "a,611340,3718430,10,999999\n")
    change = {key: folder / value if str(value).endswith((".csv", ".gpkg")) else value for key, value in change.items()}
    with pytest.raises(error, match=message):
        report(folder, **change)
    assert not list((folder / "out").glob("*"))


def test_odd_names_pass_through_every_file(tmp_path):
    folder = make_survey(tmp_path)
    names = ["a\u0001b", "林班 7 🌲", "</table>&amp;" + "x" * 200, "a/b\\c'; DROP TABLE x"]
    plots = pd.read_csv(folder / "plots.csv")
    plots["plot_id"] = names
    plots.to_csv(folder / "plots.csv", index=False)
    _, ears, out = report(folder, stand_id=names[1])
    assert set(names[1:]) <= set(gpd.read_file(out / "stand.gpkg", layer="stand_plots").plot_id)
    with sqlite3.connect(out / "FVS_Data.db") as connection:
        assert connection.execute("SELECT Stand_ID FROM FVS_StandInit").fetchall() == [(names[1],)]
    connection.close()
    assert any("FVS reads 26 characters" in w for w in ears.warnings)
    assert (out / "report.pdf").stat().st_size > 20000 and "</table>&amp;x" not in (out / "report.html").read_text()


def test_settings_are_checked_like_every_verbs():
    with pytest.raises(InputError, match="expected one of zone, walkthrough, area, none"):
        build(StandTableSettings, {"output": "x", "edge": "mirage"})
    with pytest.raises(InputError, match="50 to 99.9"):
        build(StandTableSettings, {"output": "x", "confidence_pct": 100})
