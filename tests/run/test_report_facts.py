"""What the reports say about the data, from data whose answer is known; clouds with plots and a report."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import geopandas
import numpy as np
import pyproj
import pytest
from affine import Affine
from photo_ring import CAMERA, ring
from qgis_helpers import stems_cloud
from small_campaign import ROOT

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.plots import Plot, plot_cells
from treedgs_geo.geotags.stations import Stations
from treedgs_geo.inventory.searched import not_seen, partly_searched, searched_table
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.run.context import Site
from treedgs_geo.run.outputs import matched, photo_facts
from treedgs_geo.run.searched import ENOUGH_VIEWS, seen_in_cloud, seen_in_photos
from treedgs_geo.terrain.dtm import Dtm

CRS = pyproj.CRS.from_epsg(32617)
ORIGIN = np.array([500000.0, 3450000.0, 100.0])


@pytest.fixture
def stations() -> Stations:
    """24 of them: two without a fix, two days."""
    views = ring()
    n = len(views)
    none = np.full(n, np.nan)
    return Stations(
        [v.name for v in views],
        [v.path for v in views],
        np.array([v.centre for v in views]) + ORIGIN,
        np.full((n, 3), 0.02),
        ["fix"] * (n - 2) + ["float"] * 2,
        1_700_000_000.0 + 86_400 * (np.arange(n) > 11),
        (np.arange(n) > 11).astype(int),
        none,
        none,
        none,
        none,
        CRS,
    )


SFM = {"geotag_rms_e_n_u_m": [0.012, 0.034, 0.056], "geotag_residual_quality": "fix", "reprojection_rms_px": 0.45}


def test_how_far_the_reconstruction_went():
    sure = {"level": "guided", "pairs": 417, "poses_px_median": 0.029, "poses_px_worst": 0.053, "climbed_because": ""}
    assert matched(sure).startswith("where geotags and gimbals say, 417 pairs; sure to 0.03 px at the stems, the worst")
    assert "more pairs would not show" in matched(sure)
    climbed = sure | {"level": "full", "pairs": 740, "climbed_because": "2 of 62 photos are not placed"}
    assert matched(climbed).endswith("(fewer pairs were tried first, but 2 of 62 photos are not placed)")
    assert matched(climbed | {"level": "fine"}).startswith("where geotags, gimbals and a first block say, 740 pairs")
    assert "more pairs gave no better block, but 2 of 62" in matched(climbed | {"level": "guided"})


def test_a_flight_in_figures(stations):
    plots = [Plot("near", 500000.0, 3450000.0, 2.0), Plot("far", 500080.0, 3450000.0, 2.0)]
    facts = photo_facts(stations, plots, SFM, site_of(ring()), searched(ring(), plots))
    assert facts["flown"] == "2023-11-14 to 2023-11-15 (UTC), 2 flights"
    assert facts["positions"] == "22 of 24 photos fixed (92 %), 2 float"
    assert facts["cameras against their positions"].startswith("east 1.2, north 3.4, height 5.6 cm")
    assert facts["plot area not seen"].startswith("50 % (far 100 %, near 0 %) is seen from the side by fewer than 6")
    # The cameras are 45 m away and 70 m up, breast height 1.3 m above the ground.
    assert facts["ground sample distance"].startswith(f"{100 * np.hypot(45, 68.7) / CAMERA.fx:.2f} cm a pixel")


def site_of(views) -> Site:
    ground = Dtm(np.full((400, 400), 100.0), Affine(1, 0, 499800, 0, -1, 3450200), CRS)
    return Site(LocalFrame(CRS, ORIGIN), views, ground, Area.circles(np.array([[3.0, 4.0]]), np.array([5.0])))


def searched(views, plots):
    return searched_table(seen_in_photos(site_of(views), plots), plots, CRS)


def test_too_few_photos_are_an_area_not_seen():
    plots = [Plot("near", 500000.0, 3450000.0, 2.0)]
    assert not_seen(searched(ring()[: ENOUGH_VIEWS - 1], plots)) == "100 %"
    assert not_seen(searched(ring()[:ENOUGH_VIEWS], plots)) == "0 %"


def test_a_plot_that_photos_see_in_part():
    plots = [Plot("near", 500000.0, 3450000.0, 2.0), Plot("wide", 500000.0, 3450000.0, 15.0)]
    table = searched(ring(), plots).set_index("plot_id")
    assert table.loc["near", "share"] == 1.0 and 0.05 < table.loc["wide", "share"] < 0.6
    assert table.loc["wide"].geometry.area == pytest.approx(table.loc["wide", "area_m2"], abs=0.01)
    (sentence,) = partly_searched(table.reset_index(), "elsewhere no photo looks")
    assert sentence.startswith("1 of 2 plots was searched in part only: wide (")
    assert partly_searched(table.loc[["near"]].reset_index(), "") == []
    # Without plots: the circles of the search.
    (whole,) = searched(ring(), []).geometry
    assert whole.area == pytest.approx(np.pi * 25, rel=1e-2) and whole.centroid.x == pytest.approx(500003.0)


@pytest.mark.parametrize(
    ("inside", "area"),
    [
        (lambda q: (abs(q) <= 8).all(axis=1), 256.0),
        (lambda q: np.hypot(*q.T) <= 10, np.pi * 100),
        (lambda q: (abs(q) <= 8).all(axis=1) & (np.hypot(*q.T) > 6), 256 - np.pi * 36),
    ],
)
def test_the_area_that_a_cloud_covers(inside, area):
    rng = np.random.default_rng(1)
    xy = rng.uniform(-12, 12, (115_000, 2))
    xy = xy[inside(xy)] + [425000.0, 3718000.0]
    flat = Dtm(np.full((100, 100), 50.0), Affine(1, 0, 424950, 0, -1, 3718050), CRS)
    xyz = np.column_stack([xy, np.full(len(xy), 51.0)])
    assert seen_in_cloud(xyz, flat).area == pytest.approx(area, rel=0.02)
    # Crowns beyond it are no ground that was searched, and a shadow of 3 m is searched beside.
    crowns = np.column_stack([rng.uniform(-12, 12, (50_000, 2)) + [425000.0, 3718000.0], np.full(50_000, 65.0)])
    shadow = np.hypot(*(xyz[:, :2] - [425007.0, 3718000.0]).T) > 1.5
    assert seen_in_cloud(np.vstack([xyz[shadow], crowns]), flat).area == pytest.approx(area, rel=0.08)
    assert seen_in_cloud(crowns, flat).area == 0


def test_what_is_not_known_is_not_said(stations):
    unknown = replace(stations, utc=np.full(len(stations), np.nan))
    assert list(photo_facts(unknown, [], {}, None)) == ["positions"]


def test_known_lengths_stand_beside_what_the_block_makes_of_them(stations):
    bars = [{"label": "stick", "length_m": 2.0, "block_m": 2.0042}, {"label": "tape", "length_m": 9.5, "block_m": None}]
    told = photo_facts(stations, [], {"bars": bars, "scale_sd": 0.0014}, None)["known lengths"]
    assert told == "stick 2.000 m, in the block 2.004 m; tape 9.500 m, not seen; scale sure to 0.14 %"


def test_cells_cover_a_plot_once():
    cells, owner = plot_cells([Plot("a", 3.3, 7.7, 10.0), Plot("b", 100.0, 0.0, 0.1)], 0.5)
    assert abs(0.25 * (owner == 0).sum() - np.pi * 100) < 4 and (owner == 1).sum() == 1
    assert len(np.unique(cells, axis=0)) == len(cells)
    assert len(plot_cells([Plot("large", 0.0, 0.0, 1000.0)])[0]) < 21_000


def cloud_run(tmp_path: Path, *words: str) -> subprocess.CompletedProcess:
    command = [
        sys.executable,
        "-m",
        "treedgs_geo",
        "pointcloud-to-dbh",
        "--input",
        str(tmp_path / "cloud.laz"),
        "--output",
        str(tmp_path / "trees.gpkg"),
        "--log-format",
        "plain",
        *words,
    ]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT)


def plots_table(tmp_path: Path, *lines: str) -> str:
    (tmp_path / "plots.csv").write_text("\n".join(["plot_id,easting,northing,radius_m", *lines]))
    return str(tmp_path / "plots.csv")


def test_a_cloud_with_plots_and_a_report(tmp_path):
    truth = stems_cloud(tmp_path / "cloud.laz")
    plots = plots_table(tmp_path, "A,500002.5,3450004,2", "B,500009.5,3450006,3", "far,600000,3450004,3")
    done = cloud_run(tmp_path, "--plots", plots, "--report", str(tmp_path / "r.html"), "--sheets", "all")
    assert done.returncode == 0, done.stderr
    trees = geopandas.read_file(tmp_path / "trees.gpkg", layer="trees")
    assert sorted(trees["plot_id"]) == ["A", "B"], "the stem between the plots is in neither"
    for plot, (_, _, dbh) in zip("AB", (truth[0], truth[2]), strict=True):
        assert abs(float(trees.loc[trees["plot_id"] == plot, "dbh_cm"].iloc[0]) - dbh) < 1.0
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    for number in trees["tree_id"]:
        assert f"id='tree-{number}'" in page
        (run_id,) = set(trees["run_id"])
        assert 5_000 < (tmp_path / "trees_sheets" / run_id / f"{number}.jpg").stat().st_size <= 80_000
        assert f"data-sheet='trees_sheets/{run_id}/{number}.jpg'" in page
    assert "1 of 3 plots do not lie on the cloud" in page and "2 stems have a DBH" in page
    assert "href='r_3d.html'" in page and f"trees_sheets/{run_id}/" in (tmp_path / "r_3d.html").read_text("utf-8")
    # Plot B reaches 1 m over the cloud's edge, A is within it.
    assert ", A 0 %) holds no point in the lowest 5 m" in page and "(B " in page


def test_plots_change_no_tree(tmp_path):
    """The cloud is cut to the plots: what stands in them comes out as without plots."""
    stems_cloud(tmp_path / "cloud.laz")
    assert cloud_run(tmp_path).returncode == 0
    everything = geopandas.read_file(tmp_path / "trees.gpkg", layer="trees")
    assert cloud_run(tmp_path, "--plots", plots_table(tmp_path, "A,500006,3450004,2.5")).returncode == 0
    (tree,) = geopandas.read_file(tmp_path / "trees.gpkg", layer="trees").itertuples()
    (same,) = everything[np.hypot(everything["x"] - tree.x, everything["y"] - tree.y) < 0.05].itertuples()
    assert abs(tree.dbh_cm - same.dbh_cm) < 0.2 and tree.qc_flag == same.qc_flag and same.plot_id is None


@pytest.mark.parametrize("dry", [True, False])
def test_plots_elsewhere_are_refused(tmp_path, dry):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    plots = plots_table(tmp_path, "A,100,200,5")
    done = cloud_run(tmp_path, "--plots", plots, *(["--dry-run"] if dry else []))
    assert done.returncode == 2 and "no plot lies on" in done.stderr and "x 100.0" in done.stderr
    assert not (tmp_path / "trees.gpkg").exists()


def test_plots_with_an_epsg_need_a_cloud_with_a_crs(tmp_path):
    (tmp_path / "cloud.csv").write_text("x,y,z\n" + "\n".join(f"{k % 9},{k % 7},{k % 5}" for k in range(400)))
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,epsg,radius_m\nA,3,3,32617,2\n")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "treedgs_geo",
            "pointcloud-to-dbh",
            "--input",
            str(tmp_path / "cloud.csv"),
            "--crs",
            "local",
            "--plots",
            str(tmp_path / "plots.csv"),
            "--output",
            str(tmp_path / "t.gpkg"),
        ],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
    assert "has no CRS to bring it into" in done.stderr or "cloud" in done.stderr


def test_the_layers_ids_stand_beside_the_truth(tmp_path):
    """What the demo prints."""
    from treedgs_geo.inventory.accuracy.scores import score_against_truth

    columns = (
        "tree_id,kind,in_plot,E_bh,N_bh,E_base,N_base,dbh_cm,n_unoccluded_bh_views\n"
        "T001,normal,True,1,1,1,1,20,9\nT002,normal,True,5,5,5,5,30,9\n"
    )
    (tmp_path / "trees.csv").write_text(columns)
    trees = geopandas.GeoDataFrame(
        {
            "tree_id": [7],
            "x": [5.0],
            "y": [5.0],
            "dbh_cm": [30.5],
            "dbh_se_cm": [0.4],
            "dbh_lo_cm": [29.0],
            "dbh_hi_cm": [31.0],
            "qc_flag": ["ok"],
            "qc_reason": [""],
        },
        geometry=geopandas.points_from_xy([5.0], [5.0]),
    )
    _, table = score_against_truth(trees, tmp_path / "trees.csv")
    assert json.loads(table.set_index("tree_id")["layer_id"].to_json()) == {"T001": None, "T002": 7.0}
