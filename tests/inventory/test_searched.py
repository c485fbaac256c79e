"""A plot counts as far as stems were searched for in it: stand tables, growth, tapes, plans, merged layers."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from inventory.stand_helpers import CRS, EAST, NORTH, Ears, figures, report
from inventory.test_change import compared, two_dates

from treedgs_geo.campaign.layer import write_layer
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.plots import Plot
from treedgs_geo.inventory.searched import SEARCHED, read_searched, searched_area, searched_table
from treedgs_geo.inventory.taping.sample import sample_tapes as sample
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.planning.settings import PlanFlightSettings
from treedgs_geo.planning.site import read_site
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs.tape_sample import TapeSampleSettings

R = 10.0
CENTRES = [(20.0, 20.0), (80.0, 20.0), (20.0, 80.0), (80.0, 80.0)]
PLOTS = [Plot(f"p{k + 1}", EAST + x, NORTH + y, R) for k, (x, y) in enumerate(CENTRES)]
WHOLE = shapely.box(EAST - 50, NORTH - 50, EAST + 150, NORTH + 150)


def survey(folder, seen=WHOLE, searched=True, name="trees.gpkg", crs=CRS):
    """30 trees in each of four plots of 10 m, those of ``seen`` in the layer."""
    rng = np.random.default_rng(3)
    trees = []
    for plot in PLOTS:
        for _ in range(30):
            turn, away = rng.uniform(0, 2 * np.pi), R * np.sqrt(rng.uniform())
            x, y = plot.x + away * np.cos(turn), plot.y + away * np.sin(turn)
            if shapely.contains_xy(seen, x, y):
                trees.append(
                    Tree(len(trees) + 1, x, y, z_ground=38.0, plot_id=plot.plot_id, dbh_cm=float(rng.uniform(15, 35)),
                         dbh_se_cm=0.5, height_m=20.0, method="photos")
                )  # fmt: skip
    write_trees(folder / name, trees, crs, searched=searched_table(seen, PLOTS, crs) if searched else None)
    plots_csv(folder)
    gpd.GeoDataFrame(geometry=[WHOLE], crs=CRS).to_file(folder / "stand.gpkg")
    return folder


def plots_csv(folder, radius=R, plots=PLOTS):
    rows = [{"plot_id": p.plot_id, "easting": p.x, "northing": p.y, "epsg": 6344, "radius_m": radius} for p in plots]
    pd.DataFrame(rows).to_csv(folder / "plots.csv", index=False)


def per_ha(folder, **more):
    stand, ears = figures(folder, boundary=None, **more)
    return stand, {name: stand.estimates[name].mean for name in ("trees", "ba")}, ears


def test_the_layer_says_what_was_searched(tmp_path):
    table = read_searched(survey(tmp_path, shapely.box(EAST, NORTH, EAST + 80, NORTH + 100)) / "trees.gpkg")
    assert table["share"].round(3).tolist() == [1.0, 0.5, 1.0, 0.5]
    assert table["area_m2"].to_numpy() == pytest.approx(table.geometry.area.to_numpy(), abs=0.02)
    # A review or a shapefile knows nothing of it; an own layer of that name is not replaced.
    assert searched_area(tmp_path / "plots.csv", CRS) is None
    survey(tmp_path, searched=False)
    assert read_searched(tmp_path / "trees.gpkg") is None


@pytest.mark.parametrize("radius", [12.62, 32.808, 8.0])
def test_a_radius_that_is_not_the_searched_one(tmp_path, radius):
    _, truth, _ = per_ha(survey(tmp_path))
    plots_csv(tmp_path, radius)
    stand, found, ears = per_ha(tmp_path)
    if radius < R:
        assert {plot.shape for plot in stand.plots} == {"circle"} and not any("searched" in w for w in ears.warnings)
        return
    assert found == pytest.approx(truth, rel=1e-4)
    (sentence,) = (text for text in ears.warnings if "more ground than stems were searched for" in text)
    assert "4 of 4 plots" in sentence and ("feet" in sentence) == (radius > 30)
    assert stand.plot_rows["searched_pct"].to_numpy() == pytest.approx(100 * (R / radius) ** 2, rel=1e-3)


def test_plots_that_are_the_same_ground_are_refused(tmp_path):
    plots_csv(survey(tmp_path), 1000.0)
    with pytest.raises(InputError, match="p1 and p2 ask for the same searched ground"):
        figures(tmp_path, boundary=None)


def test_half_of_a_plot_and_none_of_it(tmp_path):
    half = shapely.box(EAST - 50, NORTH - 50, EAST + 80, NORTH + 50)
    stand, found, ears = per_ha(survey(tmp_path, half))
    assert [(p.plot_id, round(p.searched, 3)) for p in stand.plots] == [("p1", 1.0), ("p2", 0.5)]
    n = len(read_trees(tmp_path / "trees.gpkg"))
    assert found["trees"] == pytest.approx(n / (1.5 * np.pi * R**2 / 1e4), rel=1e-3)
    assert any("2 of 4 plots were not searched for stems and are left out: p3, p4" in w for w in ears.warnings)
    _, _, out = report(tmp_path, boundary=None)
    rows = pd.read_csv(out / "stand_plots.csv")
    assert rows["searched_pct"].round().tolist() == [100.0, 50.0]
    plots_csv(tmp_path, plots=PLOTS[2:])
    with pytest.raises(InputError, match="searched for in none of the 2 plots"):
        figures(tmp_path, boundary=None)


def test_an_empty_plot_that_was_searched_counts(tmp_path):
    survey(tmp_path)
    far = Plot("far", EAST + 600, NORTH, R)
    plots_csv(tmp_path, plots=[*PLOTS, far])
    trees = read_trees(tmp_path / "trees.gpkg")
    _, before, _ = per_ha(tmp_path)
    seen = searched_table(WHOLE.union(shapely.box(EAST + 500, NORTH - 50, EAST + 700, NORTH + 50)), [*PLOTS, far], CRS)
    seen.to_file(tmp_path / "trees.gpkg", layer=SEARCHED, engine="pyogrio")
    stand, after, _ = per_ha(tmp_path)
    assert stand.design.n == 5 and after["ba"] == pytest.approx(0.8 * before["ba"]) and len(trees) == 120


def test_without_it_whole_plots_are_taken_and_said(tmp_path):
    survey(tmp_path, searched=False)
    _, _, ears = per_ha(tmp_path)
    assert any("does not say where stems were searched for" in text for text in ears.infos)
    plots_csv(tmp_path, 12.62)
    _, _, ears = per_ha(tmp_path)
    assert any("trees none stands in their outer" in text for text in ears.warnings)


def test_a_census_of_half_the_stand(tmp_path):
    survey(tmp_path)
    stand, _, ears = per_ha(tmp_path, plots=tmp_path / "trees.gpkg")
    assert stand.design.n == 4 and not any("searched" in text for text in (*ears.warnings, *ears.infos))
    stand, ears = figures(tmp_path, plots=None)
    assert stand.design.areas.sum() == pytest.approx(4 * np.pi * R**2 / 1e4, rel=1e-4)
    assert any("stand (1,257 of 40,000 m²)" in text for text in ears.warnings)


def test_the_circles_of_the_searched_layer_are_plots(tmp_path):
    _, truth, _ = per_ha(survey(tmp_path))
    _, found, _ = per_ha(tmp_path, plots=tmp_path / "trees.gpkg")
    assert found == pytest.approx(truth, rel=1e-3)


def test_growth_on_ground_that_both_dates_searched(tmp_path):
    two_dates(tmp_path, shift=(0.0, 0.0))
    one, two = (read_trees(tmp_path / name) for name in ("one.gpkg", "two.gpkg"))
    circles = [
        Plot(row.plot_id, row.easting, row.northing, 14.0) for row in pd.read_csv(tmp_path / "plots.csv").itertuples()
    ]
    east = shapely.box(EAST + 30, NORTH - 50, EAST + 200, NORTH + 200)
    plots = tmp_path / "plots.csv"
    _, _, whole, _ = compared(tmp_path, plots=plots)
    for name, seen in (("one.gpkg", WHOLE), ("two.gpkg", east)):
        searched_table(seen, circles, CRS).to_file(tmp_path / name, layer=SEARCHED, engine="pyogrio")
    kept = two[two["x"] >= EAST + 30]
    kept.to_file(tmp_path / "two.gpkg", layer="trees", engine="pyogrio", geometry_type="Point Z")
    _, table, change, ears = compared(tmp_path, plots=plots)
    assert set(table["fate"]) <= {"survivor", "unsure"}, "trees that were not searched for are not dead"
    assert change["per_ha"]["ba_mortality"]["mean"] == 0
    assert change["per_ha"]["ba_growth"]["mean"] == pytest.approx(whole["per_ha"]["ba_growth"]["mean"], rel=0.15)
    assert any("two.gpkg: 1 of 3 plots asks for more ground" in text for text in ears.warnings)
    found, table, _, ears = compared(tmp_path)
    assert set(table["fate"]) == {"survivor"} and found["n_survivors"] == len(table) < len(kept) < len(one)
    assert any("of the first date left out" in text for text in ears.infos)


def test_tapes_are_drawn_from_what_was_searched(tmp_path):
    pytest.importorskip("matplotlib")
    plots_csv(survey(tmp_path), 12.62)
    ears = Ears()
    sample(
        TapeSampleSettings(trees=tmp_path / "trees.gpkg", plots=tmp_path / "plots.csv", n=10, output=tmp_path / "t"),
        ears,
    )
    assert any("more ground than stems were searched for" in text for text in ears.warnings)


def test_a_plan_from_an_earlier_visit_of_smaller_plots(tmp_path):
    plots_csv(survey(tmp_path), 20.0)
    site = read_site(
        PlanFlightSettings(
            plots=tmp_path / "plots.csv", stand=tmp_path / "trees.gpkg", crown_base_m=8.0, output=tmp_path / "plan"
        ),
        Ears(),
    )
    assert site.numbers.stems_per_ha == pytest.approx(120 / (4 * np.pi * R**2 / 1e4), rel=1e-3)
    assert site.mapped_area is not None and site.mapped_area.area == pytest.approx(4 * np.pi * R**2, rel=1e-3)
    assert site.mapped_area.centroid.x == pytest.approx(0, abs=1)


def test_a_campaign_s_layer_has_what_all_its_plots_searched(tmp_path):
    plots = []
    for k, crs in enumerate(("EPSG:6344", "EPSG:6345")):
        (tmp_path / str(k)).mkdir()
        survey(tmp_path / str(k), name="trees.gpkg", crs=crs)
        plots.append({"plot_id": f"c{k}", "number": k, "folder": tmp_path / str(k), "crs": crs, "table": True})
    path, ears = tmp_path / "all.gpkg", Ears()
    write_layer(path, plots, "EPSG:6344", ears)
    table = read_searched(path)
    assert len(table) == 8 and set(table["camp_plot"]) == {"c0", "c1"} and table.crs == CRS
    assert not ears.warnings
    survey(tmp_path / "1", searched=False, crs="EPSG:6345")
    write_layer(path, plots, "EPSG:6344", ears)
    assert read_searched(path) is None and "1 plots do not (c1" in ears.warnings[0]
