"""A plan in the simulator, and planned against got."""

import csv
import json

import geopandas as gpd
import numpy as np
import pytest

from tests.inventory.stand_helpers import Ears
from treedgs_geo.core.errors import InputError
from treedgs_geo.planning.flown import planned_and_got
from treedgs_geo.planning.plan import plan_flight
from treedgs_geo.planning.settings import PlanFlightSettings
from treedgs_geo.stems.quality.tree import Tree
from treedgs_lab.simulate.settings import SimulateSettings, resolve
from treedgs_lab.simulate.simulate import simulate_plot


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flown")
    (folder / "plots.csv").write_text("plot_id,easting,northing,epsg,radius_m\nA,611337,3718451,6344,5\n")
    given = {"stems_per_ha": 700, "dbh_mean_cm": 27, "dbh_sd_cm": 6, "tree_height_m": 20, "crown_base_m": 10}
    plan_flight(
        PlanFlightSettings(
            plots=folder / "plots.csv", camera="1280,960,3804", pattern="orbits", output=folder / "plan", **given
        ),
        Ears(),
    )
    return folder / "plan" / "plan.gpkg"


def test_the_simulator_flies_a_plan(plan, tmp_path):
    found = simulate_plot(
        SimulateSettings(
            output=tmp_path / "plot", preset="micro", flight=str(plan), image_width=320, samples=1, slope_pct=20.0,
            lidar_density_m2=0.0,
        )
    )  # fmt: skip
    photos = gpd.read_file(plan, layer="plan_photos")
    assert found["n_photos"] == len(photos)
    with open(tmp_path / "plot" / "truth" / "cameras.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    config = json.loads((tmp_path / "plot" / "truth" / "config.json").read_text())
    origin = config["origin_E_N_h"]
    assert config["config"]["radius_m"] == 5
    for row, photo in zip(rows, photos.itertuples(), strict=True):
        place = [float(row[name]) - origin[k] for k, name in enumerate("EN")]
        assert place == pytest.approx([photo.geometry.x - 611337, photo.geometry.y - 3718451], abs=0.2)
        assert float(row["yaw_grid_deg"]) % 360 == pytest.approx(photo.yaw_deg, abs=0.1)
        assert float(row["fx"]) == pytest.approx(3804 * 320 / 1280, abs=1)
    heights = np.array([float(row["h"]) - origin[2] for row in rows])
    assert np.ptp(heights) > 5, "the ground falls by 20 %, the flight with it"


@pytest.mark.parametrize(
    ("flight", "more", "said"),
    [
        ("circles", {}, "expected rings, grid, walk, low, or a flight plan that exists"),
        ("gone.gpkg", {}, "expected rings, grid, walk, low, or a flight plan that exists"),
        (None, {"photos": 30}, "are those of the flight plan; leave them out"),
    ],
)
def test_a_flight_that_is_none_is_refused(plan, flight, more, said):
    with pytest.raises(InputError, match=said):
        resolve(SimulateSettings(output="x", flight=flight or str(plan), **more))


def trees_of(n, dbh=25.0, se=0.4, views=9):
    return [
        Tree(
            k + 1, 611337.0, 3718451.0, dbh_cm=dbh if k % 5 or not k else None, dbh_se_cm=se, n_views=views, plot_id="A"
        )
        for k in range(n)
    ]


def test_planned_against_got(plan):
    expected = gpd.read_file(plan, layer="plan_plots").iloc[0]
    n = len(gpd.read_file(plan, layer="plan_photos"))
    good = planned_and_got(plan, [tree for tree in trees_of(40) if tree.dbh_cm][:6], n)
    assert good["planned"]["photos"] == good["got"]["photos"] == n
    assert good["planned"]["share"] == pytest.approx(expected["exp_share"], abs=1e-3)
    assert good["got"]["share"] == 1.0 and len(good["sentences"]) == 1
    bad = planned_and_got(plan, trees_of(3, se=2.0), n - 10)
    assert bad["got"]["share"] == pytest.approx(3 / max(bad["planned"]["stems"], 3), abs=0.01)
    said = " ".join(bad["sentences"])
    assert "10 planned photos are missing" in said and "denser than it was described" in said
    assert "Standard errors are larger than planned" in said
    assert planned_and_got(plan, [], 0)["got"]["error_cm"] is None


def test_what_is_no_plan_is_refused(plan, tmp_path):
    other = tmp_path / "trees.gpkg"
    gpd.GeoDataFrame({"a": [1]}, geometry=gpd.points_from_xy([1], [2]), crs="EPSG:6344").to_file(other, layer="trees")
    with pytest.raises(InputError, match=r"holds no layer plan_plots .* expected the output of plan-flight"):
        planned_and_got(other, [], 0)
    gpd.GeoDataFrame({"plot_id": [1]}, geometry=gpd.points_from_xy([1], [2]), crs="EPSG:6344").to_file(
        other, layer="plan_plots"
    )
    with pytest.raises(InputError, match="lacks exp_err_cm, exp_share"):
        planned_and_got(other, [], 0)
