"""From the settings of ``plan-flight`` to its files; the plan as a GeoPackage (photos, the way, footprints, plots with
what they are expected to give), and back again."""

from __future__ import annotations

import datetime as dt
import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
from shapely.geometry import LineString, Polygon

from ..core.errors import InputError
from ..core.files import write_json
from ..core.geopackage import atomic_geopackage
from ..core.layer_files import add_layer
from ..core.progress import Reporter
from ..core.settings import to_json
from ..inventory.declination import parse_date
from ..report.pdf import ensure_pages
from .brief import batteries_of, write_brief
from .choose import MORE, Choice, JudgedFlight, PlotStems, choose, reach_to_give_m, stems_of
from .curves import weighted_median
from .drones import DroneCamera, camera_of
from .flown import PHOTOS, PLOTS
from .mission_files import mission_of, write_kmz, write_litchi, write_plan
from .missions import compass
from .safety import lowest_clearance
from .settings import PlanFlightSettings
from .site import PlanSite, read_site
from .sun import SunDay, sun_day

#: The take-off is looked for within this distance of the plots, m.
TAKE_OFF_REACH_M = 120.0
#: Vegetation lower than this leaves a place open, m.
_LOW_M = 1.0


def plan_flight(settings: PlanFlightSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, compare flights, choose, write.

    Returns:
        paths of the files and the chosen flight's figures.

    Raises:
        InputError: one sentence about what cannot be flown and what would do. OutputError: cannot be written.
    """
    folder = Path(settings.output)
    ensure_pages(folder, "plan.json", "plan.gpkg", OWN_LAYERS)
    camera = camera_of(settings.camera)
    day = parse_date(settings.flight_date, "--flight-date") if settings.flight_date else dt.date.today()
    with reporter.stage("read", 0.0, 0.1):
        site = read_site(settings, reporter)
        reporter.tell(site.notes)
        take_off = take_off_of(site, settings.take_off)
        stems = stems_of(site, settings.seed)
    lon, lat = site.lonlat(np.zeros(2))[0]
    sun = sun_day(day, float(lon), float(lat), site.convergence_deg)
    heading = heading_of(site, sun)
    with reporter.stage("flights", 0.1, 0.85):
        choice = choose(site, stems, camera, settings, take_off, heading[0], reporter)
    more = list(choice.not_flown)
    flight = choice.plan.flight
    beyond = ~site.known(flight.xy)
    if beyond.any():
        _, margin = site.ground_and_margin(flight.xy[beyond])
        more.append(
            f"{settings.dtm}: {beyond.sum()} of {len(flight)} photos are taken beyond it; the ground there is taken "
            f"from its edge, and may be up to {margin.max():.0f} m higher: the clearance allows for that. Check the "
            f"terrain on site, or give a DTM that reaches {reach_to_give_m(flight.beyond_m(site.targets)):.0f} m "
            "beyond the plots."
        )
    site.notes.extend(more)
    reporter.tell(more)
    with reporter.stage("write", 0.85, 1.0):
        # The middle of the day: the same plan gives the same file.
        stamp = sun.utc[len(sun.utc) // 2].replace(tzinfo=dt.timezone.utc)
        mission = mission_of(choice.plan, site, camera, settings, take_off, stamp)
        clearance = lowest_clearance(flight, site.canopy_top, settings.clearance_m)
        (folder / "plan.kmz").unlink(missing_ok=True)
        for old in folder.glob("plan_litchi_*.csv"):
            old.unlink()
        layer = folder / "plan.gpkg"
        write_plan_layers(layer, choice.plan, stems, site, camera, take_off, mission.photos["speed_m_s"].to_numpy())
        kmz = write_kmz(folder / "plan.kmz", mission) if camera.wpml is not None else None
        plan = write_plan(folder / "plan.plan", mission)
        litchi = write_litchi(folder, "plan_litchi", mission)
        page, brief = write_brief(
            folder, choice, site, camera, settings, clearance, heading, sun, mission.home, take_off[:2]
        )
        figures = _figures(choice, clearance, heading[0])
        write_json(folder / "plan.json", {**figures, "settings": to_json(settings), "tried": choice.tried})
    reporter.info(_sentence(choice))
    files = {"output": folder, "layer": layer, "kmz": kmz, "plan": plan, "litchi": litchi[0], "brief": brief}
    return {**{name: path and str(path) for name, path in files.items()}, "page": str(page), **figures}


def take_off_of(site: PlanSite, text: str | None) -> np.ndarray:
    """(3,) the take-off in the planning frame: as given, else the most open place near the plots.

    Raises:
        InputError: not two numbers, far away, or off the terrain model.
    """
    if text is None:
        place = _open_place(site)
    else:
        try:
            east, north = (float(part) for part in text.split(","))
        except ValueError:
            wanted = "easting,northing like 611337.2,3718451.6"
            raise InputError(f"--take-off: found {text!r}, expected {wanted}.") from None
        place = np.array([east, north]) - site.origin
        away = min(float(np.hypot(*(target.centre - place))) for target in site.targets)
        if away > 5000:
            raise InputError(
                f"--take-off: {text} lies {away / 1000:.0f} km from the nearest plot; give it in {site.crs.name}."
            )
    height = float(site.ground(place[None])[0])
    if not np.isfinite(height):
        raise InputError(
            f"--take-off: {place[0] + site.origin[0]:.0f}, {place[1] + site.origin[1]:.0f} lies outside the terrain "
            "model; give a place on it, or a DTM that reaches it."
        )
    return np.array([*place, height])


def _open_place(site: PlanSite) -> np.ndarray:
    """The nearest place to the plots' middle where nothing stands; the middle of the nearest plot where none is
    known."""
    centres = np.array([target.centre for target in site.targets])
    nearest = centres[np.argmin(np.hypot(*(centres - centres.mean(axis=0)).T))]
    if site.canopy is not None:
        reach = TAKE_OFF_REACH_M + max(target.radius_m for target in site.targets)
        axis = np.arange(-reach, reach + 1, 2.0)
        spots = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2) + nearest
        top = site.canopy.highest(spots + site.origin)
        free = np.isfinite(top) & (top < _LOW_M) & np.isfinite(site.ground(spots))
        if free.any():
            away = np.hypot(*(spots[free] - nearest).T)
            return spots[free][np.argmin(away)]
    site.notes.append(
        "The take-off is put into the middle of a plot, as no open place is known: give yours with --take-off, "
        "the heights in the files are over it."
    )
    return nearest


def _figures(choice: Choice, clearance_m: float, heading_deg: float) -> dict[str, Any]:
    plan = choice.plan
    budget, found = plan.budget, plan.outcome
    return {
        "photos": budget.photos,
        "pattern": plan.flight.pattern,
        "height_m": round(max(plan.flight.heights_m), 1),
        "heading_deg": round(float(heading_deg), 1),
        "share_measured": round(found.share, 3),
        "error_cm": round(found.error_cm, 3),
        "clear_views": round(found.views, 2),
        "minutes": round(budget.minutes, 1),
        "batteries": budget.batteries,
        "gigabytes": round(budget.gigabytes, 2),
        "processing_s": round(budget.processing_s, 1),
        "speed_m_s": round(budget.speed_m_s, 2),
        "clearance_m": round(clearance_m, 1),
        "more_share": round(choice.more.share, 3),
        "more_error_cm": round(choice.more.error_cm, 3),
    }


def _sentence(choice: Choice) -> str:
    plan = choice.plan
    budget, found = plan.budget, plan.outcome
    heights = " and ".join(f"{height:.0f}" for height in plan.flight.heights_m)
    return (
        f"{plan.flight.pattern} at {heights} m: {budget.photos} photos, {budget.minutes:.0f} min, "
        f"{batteries_of(budget.batteries)}; expected {100 * found.share:.0f} % of the stems with "
        f"{found.error_cm:.2f} cm ({found.views:.1f} clear views a stem). {MORE} photos more: "
        f"{100 * choice.more.share:.0f} %, {choice.more.error_cm:.2f} cm."
    )


#: Steeper ground decides the heading: lines along the contours keep their height.
STEEP_PCT = 15.0


def heading_of(site: PlanSite, sun: SunDay) -> tuple[float, str]:
    """Grid azimuth of the lines and why."""
    if site.dtm is not None:
        reach = max(10.0, *(target.radius_m for target in site.targets))
        xy = (np.array([target.centre for target in site.targets])[:, None] + reach * compass(15)).reshape(-1, 2)
        z = site.ground(xy)
        known = np.isfinite(z)
        plane = np.linalg.lstsq(np.column_stack([xy[known], np.ones(known.sum())]), z[known], rcond=None)[0]
        slope, falls_to = 100 * float(np.hypot(*plane[:2])), float(np.degrees(np.arctan2(-plane[0], -plane[1])) % 360)
        if slope >= STEEP_PCT:
            return (falls_to + 90) % 180, f"along the contours of a slope of {slope:.0f} %"
    if sun.elevation_deg[sun.noon] < 5:
        return 45.0, "the sun stays low: any heading does"
    return (sun.azimuth_deg[sun.noon] + 45) % 180, "45° to the sun at its highest: no photo looks into it or along it"


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
    path: Path, plan: JudgedFlight, stems: list[PlotStems], site: PlanSite, camera: DroneCamera, take_off: np.ndarray,
    speed: np.ndarray,
) -> None:  # fmt: skip
    """Write the layers, styled; with them the take-off, project coordinates, and what its height refers to."""
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
    shown = gpd.GeoDataFrame({"photo": photos["photo"], "gsd_cm": gsd.round(2)}, geometry=prints, crs=site.crs)
    line = gpd.GeoDataFrame(ways, geometry="geometry", crs=site.crs)
    places = gpd.GeoDataFrame(photos, geometry=gpd.points_from_xy(*xyz.T), crs=site.crs)
    with atomic_geopackage(path, OWN_LAYERS) as temporary:
        add_layer(temporary, FOOTPRINTS, shown, "Polygon")
        add_layer(temporary, PLOTS, plots_table(plan, stems, site), "Polygon")
        add_layer(temporary, LINE, line, "LineString Z")
        add_layer(temporary, PHOTOS, places, "Point Z")
        place = [round(float(v), 3) for v in take_off + [*site.origin, 0.0]]
        text = json.dumps({"take_off": place, "heights": site.datum})
        with closing(sqlite3.connect(temporary)) as connection, connection:
            connection.execute("UPDATE gpkg_contents SET description = ? WHERE table_name = ?", (text, PHOTOS))


def plots_table(plan: JudgedFlight, stems: list[PlotStems], site: PlanSite) -> gpd.GeoDataFrame:
    """One row a plot: expected stems, clear views a stem, share measured, standard error (median)."""
    found, rows = plan.outcome, []
    owner = np.repeat([one.plot_id for one in stems], [len(one.rows) for one in stems])
    for plot, target in zip(site.plots, site.targets, strict=True):
        mine = owner == plot.plot_id
        weight = found.chance[mine]
        draws = max(1, sum(one.plot_id == plot.plot_id for one in stems))
        expected = float(site.numbers.stems_per_ha * plot.area_ha) if site.mapped is None else mine.sum() / draws
        rows.append(
            {
                "plot_id": str(plot.plot_id),
                "radius_m": round(target.radius_m, 2),
                "exp_stems": round(expected, 1),
                "exp_views": round(float(found.expected[mine].mean()), 2) if mine.any() else np.nan,
                "exp_share": round(float(weight.mean()), 3) if mine.any() else np.nan,
                "exp_err_cm": round(weighted_median(found.error[mine], weight), 3),
                "n_photos": int(plan.clear[mine].any(axis=0).sum()),
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
