"""The stage ``ground``: the terrain model under the plots, and where stems are looked for."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError
from ..core.map_scale import zone_hint
from ..core.plots import read_plots
from ..core.progress import Reporter
from ..inventory.tree_layer import style_raster
from ..reconstruction.area import Area
from ..reconstruction.cameras import OBLIQUE_DEG
from ..terrain.cloud_ground import require_same_heights
from ..terrain.dtm import GROUND_WARN_M, height_above, read_dtm, require_coverage, write_dtm
from ..terrain.sparse_ground import dtm_from_sparse, with_gaps_filled
from .context import PhotoJob, Site, area_of
from .forecast import MIN_OBLIQUE, nadir_reason
from .stage import Key, Stage

#: A plot this far from the nearest photo lies elsewhere.
MAX_AWAY_M = 500.0
#: The ground is modelled this far beside the area in which stems are looked for, metres.
BESIDE_M = 8.0


def _read_plots(job: PhotoJob) -> None:
    if job.settings.plots:
        job.plots = read_plots(job.settings.plots, job.stations.crs)


def _read_ground(job: PhotoJob) -> None:
    if job.settings.dtm:
        job.given = read_dtm(job.settings.dtm, job.stations.crs, job.reporter)


def _check_cover(job: PhotoJob) -> None:
    """Plots under the flight, and a terrain model under the plots."""
    stations, plots = job.stations, job.plots
    surveyed = stations.xyz[stations.is_placed] if job.control is None else job.control.xyz
    placed = (stations.xyz[stations.is_placed] if stations.is_placed.any() else surveyed)[:, :2]
    for plot in plots:
        away = float(np.linalg.norm(placed - [plot.x, plot.y], axis=1).min())
        if away > MAX_AWAY_M:
            hint = zone_hint(
                " (in {zone}, it would lie there)",
                stations.crs,
                np.array([[plot.x, plot.y]]),
                lambda xy: bool(np.linalg.norm(placed - xy, axis=1).min() <= MAX_AWAY_M),
            )
            raise InputError(
                f"{job.settings.plots}: plot {plot.plot_id!r} lies {away:.0f} m from the nearest photo, expected it "
                f"under the flight{hint}; check the coordinates and their CRS (column epsg)."
            )
    if job.given is not None:
        where = np.array([[p.x, p.y] for p in plots]) if plots else np.nanmedian(placed, axis=0)[None]
        require_coverage(job.given, where, str(job.settings.dtm))


def _ground_key(job: PhotoJob) -> Key:
    block, dtm, given = job.block, job.settings.dtm, job.given
    job.area = area_of(block.frame, block.views, block.points, job.plots)
    angles = np.array([view.nadir_angle_deg for view in block.views])
    if (angles > OBLIQUE_DEG).sum() < MIN_OBLIQUE:
        job.nothing = nadir_reason(angles)
    elif not len(job.area.radii_m):
        job.nothing = "no place is seen by six or more oblique photos; fly more of them, from all sides"
    used: dict[str, Any] = {"dtm": dtm is not None, "plots": circles(job.area)}
    if given is not None:
        # A world file beside the raster places it as well.
        used["grid"] = [list(given.transform), given.crs.to_wkt() if given.crs is not None else None]
    return Key(used, [dtm] if dtm else [])


def _ground(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    """The terrain model of the run, project coordinates: the user's, its gaps filled, or what the photos see."""
    path, given, area, frame, bounds = job.path(names.DTM), job.given, job.area, job.block.frame, None
    if area is not None and len(area.radii_m):
        low_x, low_y, high_x, high_y = area.bounds(BESIDE_M)
        corners = frame.to_project(np.array([[low_x, low_y, 0.0], [high_x, high_y, 0.0]]))
        bounds = corners[0, :2], corners[1, :2]
    found = dtm_from_sparse(frame.to_project(job.block.points), crs=frame.crs, bounds=bounds)
    style_raster(path)
    if given is None:
        write_dtm(path, found)
        return {"ground": "from the photos"}
    name, x, y = str(job.settings.dtm), *found.centres()
    x, y = (np.broadcast_to(a, found.heights.shape).ravel() for a in (x, y))
    seen = np.column_stack([x, y, found.heights.ravel()])
    require_same_heights(given, seen[np.isfinite(seen).all(axis=1)], name)
    above = height_above(given, found)
    filled, gaps_m2 = with_gaps_filled(given, found, above)
    if abs(above) > GROUND_WARN_M:
        reporter.warn(
            f"{name}: lies {above:+.2f} m from the ground that the photos see (median), expected within "
            f"{GROUND_WARN_M:g} m; breast height may be off by as much and the trees' intervals are widened by it: "
            "check its datum (where shrubs cover the ground, the photos see the shrubs)."
        )
    if gaps_m2:
        reporter.warn(
            f"{name}: has no height in {gaps_m2:.0f} m2 round the plots; the ground that the photos see stands in "
            "there."
        )
    write_dtm(path, filled)
    return {"ground": name, "above_photos_m": round(above, 3)}


def _load_site(job: PhotoJob, _: object) -> None:
    block = job.block
    assert job.area is not None
    job.site = Site(block.frame, block.views, read_dtm(job.path(names.DTM), block.frame.crs), job.area)


def circles(area: Area) -> list:
    """(K, 3) centre and radius of an area, to the millimetre, for the keys of stages."""
    return np.round(np.column_stack([area.centres, area.radii_m]), 3).tolist()


GROUND = Stage(
    "ground",
    0.01,
    _ground,
    checks=(_read_plots, _read_ground, _check_cover),
    key=_ground_key,
    outputs=lambda job: [job.path(names.DTM)],
    load=_load_site,
    wanted=lambda job: job.aligned is not None,
)
