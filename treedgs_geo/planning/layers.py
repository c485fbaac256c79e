"""The plan as a GeoPackage: photos, the way, footprints, plots with what they are expected to give; and back again."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
from shapely.geometry import LineString, Polygon

from ..core.geopackage import atomic_geopackage
from ..core.layer_files import add_layer
from .choose import JudgedFlight, PlotStems
from .curves import weighted_median
from .drones import DroneCamera
from .flown import PHOTOS, PLOTS
from .site import PlanSite

LINE, FOOTPRINTS = "plan_line", "plan_footprints"
#: Layers of plan.gpkg, with the columns by which they are known as ours.
OWN_LAYERS = {
    PHOTOS: frozenset({"photo", "yaw_deg", "pitch_deg", "above_m"}),
    PLOTS: frozenset({"plot_id", "exp_views", "exp_share"}),
    LINE: frozenset({"leg"}),
    FOOTPRINTS: frozenset({"photo", "gsd_cm"}),
}
#: Rays flatter than this meet the ground nowhere useful, degrees from straight down.
_FLATTEST_DEG = 80.0


def write_plan_layers(
    path: Path,
    plan: JudgedFlight,
    stems: list[PlotStems],
    site: PlanSite,
    camera: DroneCamera,
    take_off: np.ndarray,
    speed: np.ndarray,
) -> Path:
    """Write the layers, styled."""
    flight = plan.flight
    xyz = flight.xyz + [*site.origin, 0.0]
    photos = pd.DataFrame(
        {
            "photo": np.arange(1, len(flight) + 1),
            "leg": flight.leg + 1,
            "pattern": flight.pattern,
            "yaw_deg": flight.yaw_deg.round(1),
            "yaw_true": ((flight.yaw_deg + site.convergence_deg) % 360).round(1),
            "pitch_deg": flight.pitch_deg.round(1),
            "h_m": xyz[:, 2].round(2),
            "over_m": (xyz[:, 2] - take_off[2]).round(2),
            "above_m": flight.above_m.round(2),
            "speed_m_s": speed.round(2),
            "clear": plan.clear.sum(axis=0).round(2),
            "camera": camera.key,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "focal_px": round(camera.focal_px, 1),
        }
    )
    prints, gsd = footprints(plan, site, camera)
    ways = [
        {"leg": int(leg) + 1, "geometry": LineString(xyz[flight.leg == leg])}
        for leg in np.unique(flight.leg)
        if (flight.leg == leg).sum() > 1
    ]
    tables = {
        FOOTPRINTS: (
            gpd.GeoDataFrame({"photo": photos["photo"], "gsd_cm": gsd.round(2)}, geometry=prints, crs=site.crs),
            "Polygon",
        ),
        PLOTS: (plots_table(plan, stems, site), "Polygon"),
        LINE: (gpd.GeoDataFrame(ways, geometry="geometry", crs=site.crs), "LineString Z"),
        PHOTOS: (gpd.GeoDataFrame(photos, geometry=gpd.points_from_xy(*xyz.T), crs=site.crs), "Point Z"),
    }
    with atomic_geopackage(path, OWN_LAYERS) as temporary:
        for name, (table, geometry) in tables.items():
            add_layer(temporary, name, table, geometry)
        save_take_off(temporary, take_off + [*site.origin, 0.0], site.datum)
    return Path(path)


def plots_table(plan: JudgedFlight, stems: list[PlotStems], site: PlanSite) -> gpd.GeoDataFrame:
    """One row a plot: expected stems, clear views a stem, share measured, standard error (median)."""
    found, rows = plan.outcome, []
    owner = np.repeat([one.plot_id for one in stems], [len(one.rows) for one in stems])
    for plot, target in zip(site.plots, site.targets, strict=True):
        mine = owner == plot.plot_id
        weight = found.chance[mine]
        draws = max(1, sum(one.plot_id == plot.plot_id for one in stems))
        seen = plan.clear[mine].any(axis=0) if mine.any() else np.zeros(len(plan.flight), bool)
        rows.append(
            {
                "plot_id": str(plot.plot_id),
                "radius_m": round(target.radius_m, 2),
                "exp_stems": round(
                    float(site.numbers.stems_per_ha * plot.area_ha) if site.mapped is None else mine.sum() / draws, 1
                ),
                "exp_views": round(float(found.expected[mine].mean()), 2) if mine.any() else np.nan,
                "exp_share": round(float(weight.mean()), 3) if mine.any() else np.nan,
                "exp_err_cm": round(weighted_median(found.error[mine], weight), 3),
                "n_photos": int(seen.sum()),
                "geometry": plot.outline,
            }
        )
    return gpd.GeoDataFrame(rows, geometry="geometry", crs=site.crs)


def footprints(plan: JudgedFlight, site: PlanSite, camera: DroneCamera) -> tuple[list[Polygon], np.ndarray]:
    """Ground that each photo shows (level ground at the height below the photo), and its ground sample distance at the
    middle, cm."""
    flight = plan.flight
    half = np.array([camera.width_px, camera.height_px]) / 2 / camera.focal_px
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [0, 0]]) * half
    rays = np.column_stack([corners, np.ones(5)])
    prints, gsd = [], np.zeros(len(flight))
    for k, rotation in enumerate(flight.rotations):
        ways = rays @ rotation
        flat = np.hypot(ways[:, 0], ways[:, 1])
        down = np.maximum(-ways[:, 2], flat / np.tan(np.radians(_FLATTEST_DEG)))
        spots = flight.xy[k] + site.origin + ways[:, :2] * (flight.above_m[k] / down)[:, None]
        prints.append(Polygon(spots[:4]))
        gsd[k] = 100 * flight.above_m[k] / down[4] / camera.focal_px
    return prints, gsd


def save_take_off(path: Path, place: np.ndarray, datum: str) -> None:
    """Keep the take-off with the layers: project coordinates, height, what it refers to."""
    text = json.dumps({"take_off": [round(float(v), 3) for v in place], "heights": datum})
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE gpkg_contents SET description = ? WHERE table_name = ?", (text, PHOTOS))
