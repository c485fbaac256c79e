"""What the synthetic plot hands over in tables: the truth, and what a field crew would have written down."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.reconstruction.cameras import View

from . import files, flight, truth
from .barks import BARKS
from .layout import Layout
from .scanned import ScannedForest
from .scanned_truth import scanned_table
from .scene import PlantedStem, StemLook
from .settings import Sizes
from .world import World

#: Columns of trees.csv, visibility.csv and cameras.csv.
TREE_COLUMNS = [
    *("tree_id", "kind", "status", "in_plot", "E_bh", "N_bh", "h_bh", "x_bh", "y_bh", "z_bh", "E_base", "N_base"),
    *("h_base", "dbh_cm", "w_min_cm", "w_max_cm", "height_m", "lean_deg", "lean_bh_deg", "lean_az_grid_deg"),
    *("crown_base_m", "taper_cm_m", "n_in_frame", "n_unoccluded_bh_views", "n_half_visible_bh_views"),
    *("mean_width_px", "mean_width_px_unoccluded"),
]
VISIBILITY_COLUMNS = ["tree_id", "image", "visible_fraction", "width_px", "in_frame", "foreshortening"]
CAMERA_COLUMNS = [
    *("image", "flight", "kind", "E", "N", "h"),
    *(f"r{i}{j}" for i in range(3) for j in range(3)),
    *("tx", "ty", "tz", "fx", "fy", "cx", "cy", "k1", "k2", "width", "height"),
    *("yaw_grid_deg", "pitch_deg", "roll_deg", "utc", "ppk_float"),
    *("p1", "p2", "k3", "travel_e_m", "travel_n_m", "travel_u_m"),
]


def write_truth(
    folder: Path,
    world: World,
    stems: list[PlantedStem],
    sizes: Sizes,
    layout: Layout,
    geo: files.Georeference,
    views: list[View],
    scan: ScannedForest | None = None,
) -> dict[str, Any]:
    """trees.csv (with the plot where there are several), visibility.csv and stems.json; returns what the field tables
    need. scan: where the stems were measured in one."""
    if scan is None:
        rows, profiles, saplings = truth.stem_table(world.mesh, stems, sizes.radius_m + 5, layout.centres)
    else:
        rows, profiles, saplings = scanned_table(scan, stems, world)
    ids = layout.plot_ids(sizes.name)
    columns = [*TREE_COLUMNS, "plot_id"] if len(ids) > 1 else TREE_COLUMNS
    if scan is not None:
        columns = [*columns, "dbh_se_cm", "rendered_cm"]
    table, seen = [], []
    for row in rows:
        stem = stems[row["index"]]
        records = [truth.visibility(world, stem, row["index"], row["dbh_cm"] / 100, view) for view in views]
        seen += [
            [
                row["tree_id"],
                view.name,
                f"{r['visible_fraction']:.3f}",
                f"{r['width_px']:.2f}",
                r["in_frame"],
                f"{r['foreshortening']:.3f}",
            ]
            for view, r in zip(views, records, strict=True)
        ]
        row.update(truth.count_views(records))
        row["plot_id"] = ids[layout.owner(row["base"][:2])]
        values = {**row, **_places(row, geo)}
        table.append([f"{values[c]:.4f}" if isinstance(values[c], float) else values[c] for c in columns])
    files.write_csv(folder / "trees.csv", columns, table)
    files.write_csv(folder / "visibility.csv", VISIBILITY_COLUMNS, seen)
    files.write_json_plain(
        folder / "stems.json",
        {
            "columns": ["s_m", "mean_diameter_cm", "x", "y", "z"],
            "origin": geo.origin.tolist(),
            "stems": profiles,
            "saplings_xy_dbhcm": saplings,
        },
    )
    inside = [row for row in rows if row["in_plot"]]
    views_free = [row["n_unoccluded_bh_views"] for row in inside]
    return {"rows": inside, "in_plot": len(inside), "median_views": float(np.median(views_free)) if views_free else 0.0}


def write_looks(path: Path, stems: list[PlantedStem]) -> None:
    """looks.csv: bark, crown, ivy, shrubs and lobes of every stem; no file where all stems are plain."""
    if all(stem.look == StemLook() for stem in stems):
        return
    columns = [
        *("tree_id", "kind", "in_plot", "bark", "hardwood", "moss_pct", "lichen_pct", "ivy_m", "wrap_m"),
        *("lobes", "flute_pct", "buttress_m"),
    ]
    table = []
    for stem in stems:
        look, lobes = stem.look, stem.look.lobes
        shape = (lobes.number, f"{100 * lobes.flute:.1f}", f"{lobes.butt_m if lobes.butt else 0:.2f}") if lobes else ()
        table.append(
            [
                *(stem.tree_id, stem.kind, stem.in_plot, BARKS[look.bark], look.hardwood),
                *(f"{100 * look.moss:.1f}", f"{100 * look.lichen:.1f}", f"{look.ivy_m:.2f}", f"{look.wrap_m:.2f}"),
                *(shape or (0, "0.0", "0.00")),
            ]
        )
    files.write_csv(path, columns, table)


def _places(row: dict[str, Any], geo: files.Georeference) -> dict[str, float]:
    """Breast height and base of a stem, local and projected, metres."""
    (x, y, z), (e, n, h) = row["bh"], geo.project(row["bh"])[0]
    eb, nb, hb = geo.project(row["base"])[0]
    local = {"x_bh": x, "y_bh": y, "z_bh": z}
    return {"E_bh": e, "N_bh": n, "h_bh": h, **local, "E_base": eb, "N_base": nb, "h_base": hb}


def write_cameras(
    path: Path, geo: files.Georeference, stations: list[flight.Station], views: list[View], track: flight.Track
) -> None:
    """cameras.csv: the true poses and lens of every photo."""
    cameras = []
    for station, view, floating in zip(stations, views, track.floating, strict=True):
        e, n, h = geo.project(station.centre)[0]
        camera = view.camera
        cameras.append(
            [
                station.name,
                station.flight,
                station.kind,
                f"{e:.4f}",
                f"{n:.4f}",
                f"{h:.4f}",
                *(f"{value:.9f}" for value in view.rotation.ravel()),
                *(f"{value:.5f}" for value in view.translation),
                *(camera.fx, camera.fy, camera.cx, camera.cy, camera.k1, camera.k2, camera.width, camera.height),
                f"{station.yaw_deg:.4f}",
                f"{station.pitch_deg:.4f}",
                f"{station.roll_deg:.4f}",
                f"{station.utc:%Y-%m-%dT%H:%M:%S.%f}",
                int(floating),
                *(camera.p1, camera.p2, camera.k3),
                *(f"{value:.6f}" for value in view.readout_travel_m),
            ]
        )
    files.write_csv(path, CAMERA_COLUMNS, cameras)


def write_field_tables(
    folder: Path,
    rng: np.random.Generator,
    sizes: Sizes,
    layout: Layout,
    geo: files.Georeference,
    summary: dict[str, Any],
) -> list[list[float]]:
    """plots.csv and field_trees.csv as a crew would bring them, and the key; returns the centres' errors (n, 2), m."""
    plots, tallies, key, errors = [], [], {}, []
    for plot_id, centre in zip(layout.plot_ids(sizes.name), layout.centres, strict=True):
        error = rng.normal(0, 0.3 / np.sqrt(2), 2)
        surveyed = np.array([*(centre + error), 0.0])
        lon, lat, _ = geo.lonlat(surveyed)[0]
        e, n, _ = geo.project(surveyed)[0]
        plots.append([plot_id, f"{lon:.8f}", f"{lat:.8f}", f"{e:.3f}", f"{n:.3f}", files.EPSG, f"{sizes.radius_m:.1f}"])
        tally = _tally(rng, [row for row in summary["rows"] if row["plot_id"] == plot_id], centre, geo)
        for k, (azimuth, distance, dbh, tall, status, tree) in enumerate(tally, start=1):
            tallies.append(
                [
                    plot_id,
                    k,
                    round(azimuth) % 360,
                    f"{max(distance, 0):.2f}",
                    f"{dbh:.1f}",
                    f"{tall:.1f}",
                    status,
                    "PITA",
                ]
            )
            key[str(k) if len(layout.centres) == 1 else f"{plot_id}/{k}"] = tree
        errors.append(error.tolist())
    files.write_csv(folder / "plots.csv", ["plot_id", "lon", "lat", "easting", "northing", "epsg", "radius_m"], plots)
    files.write_csv(
        folder / "field_trees.csv",
        ["plot_id", "tree_id", "azimuth_deg", "distance_m", "dbh_cm", "height_m", "status", "species"],
        tallies,
    )
    files.write_json_plain(folder / "truth" / "field_key.json", {"field_tree_id_to_truth": key})
    return errors


def _tally(rng: np.random.Generator, rows: list[dict], centre: np.ndarray, geo: files.Georeference) -> list[list]:
    """Azimuth (true north), distance, DBH, height, status and true tree of one plot's stems, by azimuth."""
    tally = []
    for row in rows:
        x, y = row["bh"][:2] - centre
        azimuth = (np.degrees(np.arctan2(x, y)) + geo.convergence_deg + rng.normal(0, 1)) % 360
        tally.append(
            [
                azimuth,
                np.hypot(x, y) + rng.normal(0, 0.05),
                row["dbh_cm"] + rng.normal(0, 0.3),
                row["height_m"] + rng.normal(0, 0.4),
                row["status"],
                row["tree_id"],
            ]
        )
    return sorted(tally)
