"""What plans predict against what photos-to-dbh gets of them, on simulated stands; and a plan against the ring flight.

    python -m treedgs_lab.benchmarks.planning.chain --work DIR [--cases N] [--cameras own|true] [--ring] [--output FILE]

Each stand of :data:`CASES` (none was used to fit anything) is planned from five numbers, its leaf area and a plane of
its slope, for a small camera (1024 x 768 px, 1.84 cm at 70 m; target 0.7 cm and 90 %), flown by ``simulate-plot
--flight plan.gpkg`` and measured by ``photos-to-dbh`` with PPK files alone. Share: stems with a DBH of all true stems
in the plot, paired by place; error: median of the stated standard errors, beside the true RMSE. --ring: the plan for
a stand like ``plot_a``'s and the ring flight of ``plot_a`` (62 photos, preset ``plot``, of the same camera) over the
same simulated stand, in one simulation, each measured by itself. --cameras true: with true cameras and ground,
minutes less a stand. What is done is kept in DIR.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import rasterio
from rasterio.transform import from_origin

from treedgs_geo.core.progress import Reporter
from treedgs_geo.planning.flight_plan import PHOTOS
from treedgs_geo.planning.plan import plan_flight
from treedgs_geo.planning.settings import PlanFlightSettings
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import stems_from_photos
from treedgs_lab.benchmarks.photos.stems_from_photos import pair_up
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows
from treedgs_lab.benchmarks.verbs import photo_inputs, run_verb
from treedgs_lab.simulate.flight import ring_shots
from treedgs_lab.simulate.scene import total_height
from treedgs_lab.simulate.settings import SIZES
from treedgs_lab.simulate.simulate import streams

#: Where the plots are planned; the simulator takes what lies about the plots, wherever they are.
EAST, NORTH = 611337.0, 3718451.0
#: Seed, stems/ha, mean and sd of DBH (cm), leaf area of the mean tree (m2), slope (%), spacing.
CASES = (
    (601, 700, 27.0, 6.5, 38.0, 3, "rows"),
    (602, 1100, 21.0, 4.5, 22.0, 3, "natural"),
    (603, 450, 34.0, 7.0, 60.0, 10, "rows"),
    (604, 700, 27.0, 6.5, 20.0, 30, "rows"),
    (605, 600, 30.0, 8.0, 45.0, 3, "natural"),
    (606, 900, 24.0, 5.0, 30.0, 20, "rows"),
    (607, 500, 27.0, 6.5, 50.0, 40, "natural"),
    (608, 800, 18.0, 4.0, 18.0, 3, "rows"),
)
#: Of the ring comparison: a stand like plot_a's.
RING_CASE = (611, 700, 27.4, 6.7, 38.0, 3, "rows")
#: A measured tree within this distance of a true breast height is that stem, m.
PAIR_M = 0.5


def planned(case: tuple, folder: Path, camera: str, radius_m: float) -> dict[str, Any]:
    """Plan one stand; returns the result of plan-flight."""
    seed, per_ha, mean, sd, leaf, slope, _ = case
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "plots.csv").write_text(
        f"plot_id,easting,northing,epsg,radius_m\nP,{EAST},{NORTH},6344,{radius_m}\n", encoding="utf-8"
    )
    # The simulator's ground falls in a direction that is the first draw of its site.
    aspect = float(streams(seed)["site"].uniform(0, 2 * np.pi))
    axis = np.arange(-200, 200) + 0.5
    x, y = np.meshgrid(axis, axis[::-1])
    z = 100 + slope / 100 * (x * np.cos(aspect) + y * np.sin(aspect))
    with rasterio.open(
        folder / "dtm.tif", "w", driver="GTiff", width=400, height=400, count=1, dtype="float32", crs="EPSG:6344",
        transform=from_origin(EAST - 200, NORTH + 200, 1, 1),
    ) as target:  # fmt: skip
        target.write(z.astype(np.float32), 1)
    height = float(total_height(np.array([mean / 100]))[0])
    lai = leaf * per_ha / 1e4 * (1 + 0.5 * 1.6 * 0.6 * (sd / mean) ** 2)
    return plan_flight(
        PlanFlightSettings(
            plots=folder / "plots.csv", dtm=folder / "dtm.tif", stems_per_ha=per_ha, dbh_mean_cm=mean, dbh_sd_cm=sd,
            tree_height_m=height, crown_base_m=0.51 * height, leaf_area_index=lai, camera=camera,
            take_off=f"{EAST},{NORTH}", flight_date="2026-03-12", output=folder / "plan",
        ),
        Reporter(),
    )  # fmt: skip


def stand_options(case: tuple) -> list[Any]:
    """The stand as options of simulate-plot."""
    seed, per_ha, mean, sd, leaf, slope, spacing = case
    return [
        *("--seed", seed, "--stems-per-ha", per_ha, "--dbh-mean-cm", mean, "--dbh-sd-cm", sd, "--leaf-area-m2", leaf),
        *("--slope-pct", slope, "--spacing", spacing, "--preset", "plot", "--samples", 2, "--lidar-density-m2", 0),
    ]


def measured(plot: Path, work: Path, plan: Path) -> dict[str, Any]:
    """Run the chain and compare with the truth: share, stated and true errors, clear views."""
    trees = work / "trees.gpkg"
    options = [*photo_inputs(plot), "--flight-plan", plan, "--sheets", "none", "--workspace", work / "ws"]
    run_verb("photos-to-dbh", *options, "--output", trees, "--log-format", "quiet")
    rows = truth_rows(plot)
    found = gpd.read_file(trees, layer="trees")
    found = found[found["dbh_cm"].notna()]
    true = np.array([[float(row["E_bh"]), float(row["N_bh"])] for row in rows])
    places = found[["x", "y"]].to_numpy(float)
    errors, stated = [], []
    free = np.ones(len(found), bool)
    for k, row in enumerate(rows):
        away = np.hypot(places[:, 0] - true[k, 0], places[:, 1] - true[k, 1])
        away[~free] = np.inf
        if len(away) and away.min() < PAIR_M:
            tree = int(away.argmin())
            free[tree] = False
            errors.append(float(found["dbh_cm"].iloc[tree]) - float(row["dbh_cm"]))
            stated.append(float(found["dbh_se_cm"].iloc[tree]))
    compared = json.loads((work / "ws" / "planned.json").read_text(encoding="utf-8"))
    return {"cameras": "own", "photos": compared["got"]["photos"], **figures_of(rows, errors, stated)}


def measured_with_true_cameras(plot: Path) -> dict[str, Any]:
    """Find and fit the stems in the photos with true cameras and ground; as :func:`measured`."""
    views, frame, ground, area = plot_inputs(plot)
    views = [view for view in views if view.path.exists()]
    rows = truth_rows(plot)
    fits = stems_from_photos(views, ground, area, PhotoStemOptions(seed=1))
    pairs = pair_up(local_places(rows, frame), fits)
    good = [(fits[fit], float(rows[k]["dbh_cm"])) for k, fit in pairs.items() if fits[fit].measured]
    return {
        "cameras": "true",
        "photos": len(views),
        **figures_of(rows, [fit.dbh_cm - dbh for fit, dbh in good], [fit.se_cm for fit, _ in good]),
    }


def figures_of(rows: list[dict[str, str]], errors: list[float], stated: list[float]) -> dict[str, Any]:
    """rows: true stems; errors and stated standard errors (cm) of those measured."""
    return {
        "stems": len(rows),
        "measured": len(errors),
        "share": round(len(errors) / max(len(rows), 1), 3),
        "median_se_cm": round(float(np.median(stated)), 3) if stated else None,
        "rmse_cm": round(float(np.sqrt(np.mean(np.square(errors)))), 3) if errors else None,
        "clear_views": round(float(np.mean([int(row["n_unoccluded_bh_views"]) for row in rows])), 2),
    }


def one_case(case: tuple, work: Path, cameras: str) -> dict[str, Any]:
    """Plan, fly, measure one stand; kept in ``case.json``."""
    folder = work / f"case_{case[0]}"
    kept = folder / "case.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    plan = planned(case, folder, "1024,768,3804", 6.0)
    plot = folder / "plot"
    flown = folder / "plan" / "plan.gpkg"
    if not (plot / "truth" / "trees.csv").exists():
        run_verb("simulate-plot", "--flight", flown, *stand_options(case), "--output", plot, "--log-format", "quiet")
    got = measured(plot, folder, flown) if cameras == "own" else measured_with_true_cameras(plot)
    names = ("photos", "pattern", "share_measured", "error_cm", "clear_views")
    stand = dict(
        zip(("seed", "stems_per_ha", "dbh_mean_cm", "dbh_sd_cm", "leaf_m2", "slope_pct", "spacing"), case, strict=True)
    )
    row = {"stand": stand, "planned": {name: plan[name] for name in names}, "got": got}
    kept.write_text(json.dumps(row), encoding="utf-8")
    return row


def ring_case(work: Path, cameras: str) -> dict[str, Any]:
    """The plan and the ring flight over one simulated stand."""
    folder = work / "ring"
    kept = folder / "case.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    plan = planned(RING_CASE, folder, "1024,768,3804", 8.0)
    both = folder / "both.gpkg"
    shutil.copy(folder / "plan" / "plan.gpkg", both)
    photos = gpd.read_file(both, layer=PHOTOS)
    shots = ring_shots(np.random.default_rng(RING_CASE[0]), SIZES["plot"])
    more = gpd.GeoDataFrame(
        {"yaw_deg": [s.yaw_deg % 360 for s in shots], "pitch_deg": [s.pitch_deg for s in shots], "leg": 99},
        geometry=gpd.points_from_xy(
            [EAST + s.xyz[0] for s in shots], [NORTH + s.xyz[1] for s in shots], [s.xyz[2] for s in shots]
        ),
        crs=photos.crs,
    )
    more["above_m"] = [float(s.xyz[2]) for s in shots]
    for name in ("width_px", "height_px", "focal_px"):
        more[name] = photos[name].iloc[0]
    gpd.pd.concat([photos, more], ignore_index=True).to_file(both, layer=PHOTOS, driver="GPKG", engine="pyogrio")
    plot = folder / "plot"
    run_verb("simulate-plot", "--flight", both, *stand_options(RING_CASE), "--output", plot, "--log-format", "quiet")
    images = sorted((plot / "images").glob("*.JPG"), key=lambda path: path.name.split("_")[-2])
    row: dict[str, Any] = {
        "planned": {name: plan[name] for name in ("photos", "pattern", "share_measured", "error_cm")}
    }
    for name, chosen in (("plan", images[: len(photos)]), ("rings", images[len(photos) :])):
        part = folder / name
        shutil.copytree(plot, part / "plot", ignore=shutil.ignore_patterns("images"), dirs_exist_ok=True)
        (part / "plot" / "images").mkdir(exist_ok=True)
        for path in chosen:
            shutil.copy(path, part / "plot" / "images" / path.name)
        if cameras == "own":
            row[name] = measured(part / "plot", part, folder / "plan" / "plan.gpkg")
        else:
            row[name] = measured_with_true_cameras(part / "plot")
        # The truth's views are of both flights together.
        del row[name]["clear_views"]
    kept.write_text(json.dumps(row), encoding="utf-8")
    return row


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares and errors of all stands together, and how many keep what was wanted."""
    stems = np.array([row["got"]["stems"] for row in rows], float)
    share, predicted = (
        np.array([row[part][name] for row in rows], float)
        for part, name in (("got", "share"), ("planned", "share_measured"))
    )
    error = np.array([row["got"]["median_se_cm"] or np.nan for row in rows])
    ratio = error / np.array([row["planned"]["error_cm"] for row in rows])
    views = np.array([row["planned"]["clear_views"] / row["got"]["clear_views"] for row in rows])
    return {
        "stands": len(rows),
        "stems": int(stems.sum()),
        "share_planned": round(float(np.average(predicted, weights=stems)), 3),
        "share_got": round(float(np.average(share, weights=stems)), 3),
        "within_10_points": int((np.abs(share - predicted) <= 0.10).sum()),
        "error_ratio_median": round(float(np.nanmedian(ratio)), 3),
        "error_within_30_pct": int((np.abs(ratio - 1) <= 0.3).sum()),
        "views_ratio_median": round(float(np.median(views)), 3),
    }


def main() -> None:
    """Plan, fly, measure, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--cases", type=int, default=len(CASES))
    parser.add_argument("--cameras", choices=("own", "true"), default="own", help="true: quicker, the stems alone")
    parser.add_argument("--ring", action="store_true")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    ring = ring_case(args.work, args.cameras) if args.ring else None
    rows = []
    for case in CASES[: args.cases]:
        rows.append(one_case(case, args.work, args.cameras))
        print(json.dumps(rows[-1]), flush=True)
    whole = summary(rows)
    print(json.dumps({"summary": whole, "ring": ring}, indent=1))
    write_record(args.output, {"cases": rows, "summary": whole, "ring": ring}, seeds=[case[0] for case in CASES])


if __name__ == "__main__":
    main()
