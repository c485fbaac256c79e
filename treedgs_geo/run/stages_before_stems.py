"""What comes before stems are measured: positions, cameras, where to look, the ground. Each stage is kept."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.crs import LocalFrame
from ..core.errors import InputError
from ..core.files import content_hashes
from ..core.map_scale import zone_that_fits
from ..core.plots import Plot, read_plots
from ..core.progress import Reporter
from ..core.settings import to_json
from ..geotags.control import ControlPoints, read_control
from ..geotags.reading import read_stations
from ..geotags.sources import find_geotags
from ..geotags.stations import Stations, read_stations_layer, write_stations
from ..inventory.tree_layer import style_raster
from ..reconstruction.area import Area, area_seen
from ..reconstruction.cameras import OBLIQUE_DEG
from ..reconstruction.model import FRAME, MODEL_FILES, load_points, load_views
from ..reconstruction.model import REPORT as SFM_REPORT
from ..reconstruction.pipeline import reconstruct_photos
from ..terrain.dtm import GROUND_WARN_M, Dtm, height_above, read_dtm, require_coverage, require_same_heights, write_dtm
from ..terrain.sparse_ground import dtm_from_sparse, with_gaps_filled
from .context import Aligned, Flight, Run, Site
from .photo_files import photo_files
from .published_plot import is_published
from .search_forecast import (
    MIN_OBLIQUE,
    announce_search,
    measure_weight,
    nadir_reason,
    only_nadir,
    planned_ground,
    search_ahead,
)
from .stages import Collector

if TYPE_CHECKING:
    from .settings import PhotosToDbhSettings

#: A plot this far from the nearest photo lies elsewhere.
MAX_AWAY_M = 500.0


@dataclass(frozen=True)
class Ready:
    """aligned, site: ``None`` where nothing was matched. nothing: why no stem can be measured, empty where one may."""

    flight: Flight
    aligned: Aligned | None
    site: Site | None
    nothing: str


def prepare(run: Run, photos: list[Path]) -> Ready:
    """Positions, cameras, ground and the area to look in; cheap checks first, so that hours of work never end in a
    typing error.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    settings, reporter = run.settings, run.steps.reporter
    stations = _geotag(run, photos)
    control = _control(run, stations)
    run.space.record["crs"] = stations.crs.to_string()
    plots = read_plots(settings.plots, stations.crs) if settings.plots else []
    flight = Flight(stations, plots)
    given = read_dtm(settings.dtm, stations.crs, reporter) if settings.dtm else None
    check_cover(settings, flight, given)
    nothing = only_nadir(stations)
    if nothing:  # said now, not after the photos have been matched for nothing
        return Ready(flight, None, None, nothing)
    if is_published(settings):
        run.steps.weigh("measure", max(settings.time_limit, 1.0))  # of a minute's search
    else:
        search = search_ahead(stations, plots, planned_ground(stations, plots, given), run.preset.stems)
        announce_search(search, plots, reporter)
        run.steps.weigh("measure", measure_weight(search, len(stations)))

    aligned = _reconstruct(run, stations, control)
    area, nothing = _area(plots, aligned)
    dtm = _ground(run, given, aligned, area)
    return Ready(flight, aligned, Site(aligned.frame, aligned.views, dtm, area), nothing)


def _geotag(run: Run, photos: list[Path]) -> Stations:
    settings, layer = run.settings, run.path(names.GEOTAGS)

    def work(reporter: Reporter) -> dict[str, Any]:
        stations = read_stations(
            settings.photos, settings.geotags, settings.crs, frame=settings.geotags_crs, reporter=reporter
        )
        write_stations(layer, stations)
        return {"photos": len(stations), "positions": stations.counts()}

    # By what the files are, not by where: photos that were moved or renamed are the same photos.
    files = photo_files(run.space, settings.photos, photos, run.steps.reporter)
    contents = dict(zip(files, content_hashes(files.values()), strict=True))
    geotags, frame = settings.geotags is not None, settings.geotags_crs
    used = {"photos": contents, "geotags": geotags, "crs": settings.crs, "frame": frame}
    given = find_geotags(settings.geotags, settings.photos).all() if settings.geotags else []
    # People may move a camera by hand: the layer is taken as it is.
    run.steps.run("geotag", used, given, [layer], work, readable=lambda: read_stations_layer(layer))
    stations = read_stations_layer(layer)
    return replace(stations, paths=[files.get(name, settings.photos / name) for name in stations.names])


def check_cover(settings: PhotosToDbhSettings, flight: Flight, dtm: Dtm | None) -> None:
    """Plots under the flight, and a DTM under the plots, before anything expensive starts."""
    stations, plots = flight.stations, flight.plots
    placed = stations.xyz[stations.is_placed][:, :2]
    for plot in plots:
        away = float(np.linalg.norm(placed - [plot.x, plot.y], axis=1).min())
        if away > MAX_AWAY_M:
            zone = zone_that_fits(
                stations.crs,
                np.array([[plot.x, plot.y]]),
                lambda xy: bool(np.linalg.norm(placed - xy, axis=1).min() <= MAX_AWAY_M),
            )
            hint = f" (in EPSG:{zone.to_epsg()}, {zone.name}, it would lie there)" if zone is not None else ""
            raise InputError(
                f"{settings.plots}: plot {plot.plot_id!r} lies {away:.0f} m from the nearest photo, expected it under "
                f"the flight{hint}; check the coordinates and their CRS (column epsg)."
            )
    if dtm is not None:
        where = np.array([[p.x, p.y] for p in plots]) if plots else np.nanmedian(placed, axis=0)[None]
        require_coverage(dtm, where, str(settings.dtm))


def _control(run: Run, stations: Stations) -> ControlPoints | None:
    """Ground control, read before anything expensive starts; its warnings are the run's."""
    if run.settings.gcp is None:
        return None
    collector = Collector(run.steps.reporter)
    control = read_control(run.settings.gcp, stations, collector)
    run.steps.warnings += collector.warnings
    return control


def _reconstruct(run: Run, stations: Stations, control: ControlPoints | None) -> Aligned:
    options, sfm, calibration = run.preset.reconstruct, run.path(names.SFM), run.settings.calibration
    outputs = [sfm / name for name in (*MODEL_FILES, FRAME, SFM_REPORT)]
    used = {**to_json(options), "stations": stations.digest()}
    if control is not None:
        used["control"] = control.digest()
    report = run.steps.run(
        "reconstruct",
        used,
        [calibration] if calibration else [],
        outputs,
        lambda reporter: reconstruct_photos(stations, options, sfm, reporter, control, calibration),
    )
    frame, views = load_views(sfm, run.settings.photos, dict(zip(stations.names, stations.paths, strict=True)))
    return Aligned(frame, views, load_points(sfm).xyz, report)


def _area(plots: list[Plot], aligned: Aligned) -> tuple[Area, str]:
    """Where to look for stems (local), and why nowhere if so."""
    frame, views, points = aligned.frame, aligned.views, aligned.points
    oblique = [view for view in views if view.nadir_angle_deg > OBLIQUE_DEG]
    if plots:
        centres = frame.to_local(np.array([[p.x, p.y, frame.origin[2]] for p in plots]))[:, :2]
        area = Area.circles(centres, np.array([p.radius_m for p in plots]))
    else:
        area = area_seen(views, float(np.percentile(points[:, 2], 20)) if len(points) else 0.0)
    if len(oblique) < MIN_OBLIQUE:
        return area, nadir_reason(np.array([view.nadir_angle_deg for view in views]))
    if not len(area.radii_m):
        return area, "no place is seen by six or more oblique photos; fly more of them, from all sides"
    return area, ""


def _ground(run: Run, given: Dtm | None, aligned: Aligned, area: Area) -> Dtm:
    """The terrain model of the run, in project coordinates, kept as ``dtm.tif``."""
    settings, path = run.settings, run.path(names.DTM)

    def work(reporter: Reporter) -> dict[str, Any]:
        found = _sparse_dtm(aligned.points, aligned.frame, area)
        if given is None:
            write_dtm(path, found)
            return {"ground": "from the photos"}
        filled, above = _compared(settings, given, found, reporter)
        write_dtm(path, filled)
        return {"ground": str(settings.dtm), "above_photos_m": round(above, 3)}

    style_raster(path)
    used = {"dtm": settings.dtm is not None, "plots": circles(area)}
    if given is not None:
        # A world file beside the raster places it as well.
        used["grid"] = [list(given.transform), given.crs.to_wkt() if given.crs is not None else None]
    run.steps.run("ground", used, [settings.dtm] if settings.dtm else [], [path], work)
    return read_dtm(path, aligned.frame.crs)


def _compared(settings: PhotosToDbhSettings, given: Dtm, found: Dtm, reporter: Reporter) -> tuple[Dtm, float]:
    """The DTM given, its gaps filled with the ground that the photos see, and how far above that it lies, m."""
    x, y = found.centres()
    x, y = (np.broadcast_to(a, found.heights.shape).ravel() for a in (x, y))
    seen = np.column_stack([x, y, found.heights.ravel()])
    seen = seen[np.isfinite(seen).all(axis=1)]
    require_same_heights(given, seen, str(settings.dtm))
    above = height_above(given, found)
    filled, gaps_m2 = with_gaps_filled(given, found, above)
    if abs(above) > GROUND_WARN_M:
        reporter.warn(
            f"{settings.dtm}: lies {above:+.2f} m from the ground that the photos see (median), expected within "
            f"{GROUND_WARN_M:g} m; breast height may be off by as much and the trees' intervals are widened by it: "
            "check its datum (where shrubs cover the ground, the photos see the shrubs)."
        )
    if gaps_m2:
        reporter.warn(
            f"{settings.dtm}: has no height in {gaps_m2:.0f} m2 round the plots; the ground that the photos see "
            "stands in there."
        )
    return filled, above


def _sparse_dtm(points: np.ndarray, frame: LocalFrame, area: Area, margin_m: float = 8.0) -> Dtm:
    bounds = None
    if len(area.radii_m):
        low_x, low_y, high_x, high_y = area.bounds(margin_m)
        corners = frame.to_project(np.array([[low_x, low_y, 0.0], [high_x, high_y, 0.0]]))
        bounds = corners[0, :2], corners[1, :2]
    return dtm_from_sparse(frame.to_project(points), crs=frame.crs, bounds=bounds)


def circles(area: Area) -> list:
    """(K, 3) centre and radius of an area, to the millimetre, for the keys of stages."""
    return np.round(np.column_stack([area.centres, area.radii_m]), 3).tolist()
