"""Simulated stands without photos: who sees which stem is traced, nothing is rendered. Seconds a stand."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyproj

from treedgs_geo.core.progress import Reporter
from treedgs_geo.planning.canopy import Canopy, canopy_of_cloud
from treedgs_geo.planning.stand import StandNumbers, Trees
from treedgs_geo.planning.views import CLEAR_SHARE, MIN_SINE
from treedgs_geo.terrain.dtm import read_dtm
from treedgs_lab.simulate import flight, simulate, truth
from treedgs_lab.simulate.camera import STILL
from treedgs_lab.simulate.settings import SimulateSettings, resolve

#: Stands that the view model was fitted to, and others that it was not: options of simulate-plot.
FITTED = tuple(
    {"seed": seed, **more}
    for seed, more in (
        (301, {"leaf_area_m2": 20.0}),
        (302, {"leaf_area_m2": 38.0}),
        (303, {"leaf_area_m2": 56.0}),
        (304, {"leaf_area_m2": 25.0, "stems_per_ha": 1200.0, "dbh_mean_cm": 20.0, "dbh_sd_cm": 4.0}),
        (305, {"leaf_area_m2": 70.0, "stems_per_ha": 400.0, "dbh_mean_cm": 36.0, "spacing": "natural"}),
        (306, {"leaf_area_m2": 38.0, "slope_pct": 30.0, "spacing": "natural"}),
    )
)
KEPT_BACK = tuple(
    {"seed": seed, **more}
    for seed, more in (
        (401, {"leaf_area_m2": 30.0}),
        (402, {"leaf_area_m2": 50.0, "stems_per_ha": 500.0}),
        (403, {"leaf_area_m2": 38.0, "spacing": "natural"}),
        (404, {"leaf_area_m2": 18.0, "stems_per_ha": 1400.0, "dbh_mean_cm": 18.0, "dbh_sd_cm": 4.0}),
        (405, {"leaf_area_m2": 80.0, "stems_per_ha": 350.0, "dbh_mean_cm": 38.0, "dbh_sd_cm": 9.0}),
        (406, {"leaf_area_m2": 38.0, "slope_pct": 45.0}),
        (407, {"leaf_area_m2": 26.0, "stems_per_ha": 900.0, "dbh_mean_cm": 22.0, "spacing": "natural"}),
        (408, {"leaf_area_m2": 60.0, "stems_per_ha": 600.0, "slope_pct": 20.0}),
    )
)


@dataclass(frozen=True)
class Stand:
    """name; trees: every stem with a crown, local m; ids of those scored, (S,) rows of ``trees``; shown: (S, P) share
    of the band that each photo sees, clear: (S, P) bool; cameras, rotations, focal, size of the photos; ground: of the
    plot's middle; slope: function of (N, 2) -> height. numbers: what a planner would be given."""

    name: str
    trees: Trees
    scored: np.ndarray
    shown: np.ndarray
    clear: np.ndarray
    cameras: np.ndarray
    rotations: np.ndarray
    focal: float
    size: np.ndarray
    feet: np.ndarray
    numbers: StandNumbers
    radius_m: float


def clear_of(records: list[dict[str, Any]]) -> np.ndarray:
    """(P,) whether each view of a stem is clear."""
    return np.array(
        [
            bool(r["in_frame"]) and r["visible_fraction"] >= CLEAR_SHARE and r["foreshortening"] > MIN_SINE
            for r in records
        ]
    )


def simulated(options: dict[str, Any], shots: list[flight.Shot] | None = None) -> Stand:
    """One simulated stand of preset ``plot`` and the truth about its photos. shots: another flight than the rings."""
    settings, sizes = resolve(SimulateSettings(output=Path("unused"), preset="plot", **options))
    rng = simulate.streams(settings.seed)
    camera = simulate.make_camera(settings, sizes)
    planned, layout = simulate.plan_shots(rng, settings, sizes, camera)
    world, stems, _ = simulate.grow_world(rng, settings, sizes, layout, Reporter())
    _, start = simulate.site_of(rng["site"])
    stations = flight.fly(rng["flight"], shots or planned, start)
    views = simulate.true_views(settings, camera, stations, [STILL] * len(stations))
    rows, _, _ = truth.stem_table(world.mesh, stems, sizes.radius_m, layout.centres)
    rows = [row for row in rows if row["in_plot"]]
    records = [
        [truth.visibility(world, stems[r["index"]], r["index"], r["dbh_cm"] / 100, v) for v in views] for r in rows
    ]
    grown = [k for k, stem in enumerate(stems) if stem.kind not in ("sapling", "branch")]
    place = {k: n for n, k in enumerate(grown)}
    chosen = [stems[k] for k in grown]
    dbh, height = np.array([s.dbh_m for s in chosen]), np.array([s.height_m for s in chosen])
    base = np.array([s.crown_base_m for s in chosen])
    mean = settings.dbh_mean_cm
    leaf = settings.leaf_area_m2 * (100 * dbh / mean) ** 1.6
    xy = np.array([s.axis[0, :2] for s in chosen])
    per_ha = 1e4 * len(chosen) / (np.pi * layout.stand_radius_m**2)
    numbers = StandNumbers(
        per_ha, 100 * float(dbh.mean()), 100 * float(dbh.std()), float(height.mean()), float(base.mean()),
        float(leaf.mean()) * per_ha / 1e4,
    )  # fmt: skip
    return Stand(
        f"seed {settings.seed}",
        Trees(xy, dbh, height, base, numbers.crown_m(dbh), leaf, np.ones(len(dbh), bool)),
        np.array([place[row["index"]] for row in rows]),
        np.array([[r["visible_fraction"] for r in own] for own in records]),
        np.array([clear_of(own) for own in records]),
        np.array([view.centre for view in views]),
        np.array([view.rotation for view in views]),
        camera.fx,
        np.array([camera.width, camera.height], float),
        np.array([s.axis[0] for s in chosen]),
        numbers,
        sizes.radius_m,
    )


def canopy_of(plot: Path, config: dict[str, Any]) -> Canopy:
    """The canopy of the plot's own LiDAR cloud."""
    crs = pyproj.CRS.from_epsg(config["epsg"])
    cloud = next((plot / "lidar").glob("*.laz"))
    centre = np.array([config["true_plot_centre"]], float)
    return canopy_of_cloud(cloud, crs, read_dtm(plot / "dtm.tif", crs), centre, float(config["config"]["radius_m"]))


def rendered(plot: Path) -> Stand:
    """A rendered plot's own truth; trees out to 15 m are known (``truth/trees.csv``), leaves and crowns from its
    cloud."""
    config = json.loads((plot / "truth" / "config.json").read_text(encoding="utf-8"))
    made, origin = config["config"], np.array(config["origin_E_N_h"])

    def table(name: str) -> list[dict[str, str]]:
        with open(plot / "truth" / name, newline="", encoding="utf-8") as stream:
            return list(csv.DictReader(stream))

    trees, photos = table("trees.csv"), table("cameras.csv")
    number = {row["image"]: k for k, row in enumerate(photos)}
    scored = [k for k, row in enumerate(trees) if row["in_plot"] in ("True", "1")]
    index = {trees[k]["tree_id"]: n for n, k in enumerate(scored)}
    shown, clear = np.zeros((len(scored), len(photos))), np.zeros((len(scored), len(photos)), bool)
    for row in table("visibility.csv"):
        if row["tree_id"] in index:
            at = index[row["tree_id"]], number[row["image"]]
            shown[at] = float(row["visible_fraction"])
            clear[at] = clear_of(
                [{key: float(row[key]) for key in ("in_frame", "visible_fraction", "foreshortening")}]
            )[0]
    feet = np.array([[float(row[key]) for key in ("E_base", "N_base", "h_base")] for row in trees]) - origin
    dbh = np.array([float(row["dbh_cm"]) for row in trees]) / 100
    height, base = (np.array([float(row[key]) for row in trees]) for key in ("height_m", "crown_base_m"))
    leaf = (
        made["leaf_area"] * (100 * dbh / made["dbh_mean"]) ** 1.6 * (np.array([r["status"] for r in trees]) != "dead")
    )
    per_ha = float(made["density_ha"])
    canopy = canopy_of(plot, config)
    numbers = StandNumbers(
        per_ha, 100 * float(dbh.mean()), 100 * float(dbh.std()), float(height.mean()), float(base.mean()),
        canopy.measured["leaf_area_index"], canopy.crown_radius_m(per_ha, float(base.mean())),
    )  # fmt: skip
    rotations = np.array([[float(p[f"r{i}{j}"]) for i in range(3) for j in range(3)] for p in photos]).reshape(-1, 3, 3)
    cameras = np.array([[float(p[key]) for key in "ENh"] for p in photos]) - origin
    first = photos[0]
    return Stand(
        plot.name, Trees(feet[:, :2], dbh, height, base, numbers.crown_m(dbh), leaf, np.ones(len(dbh), bool)),
        np.array(scored), shown, clear,
        cameras, rotations, float(first["fx"]), np.array([float(first["width"]), float(first["height"])]), feet,
        numbers, float(made["radius_m"]),
    )  # fmt: skip
