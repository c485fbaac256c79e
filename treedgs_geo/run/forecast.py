"""What geotags and gimbal angles say before any photo is matched: where the photos look, and how large the search for
stems will be.

Seconds are estimates from recorded runs (``docs/technician/qgis.md``): good for "minutes or hours", not for more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError, ReconstructionError
from ..core.machine import cores
from ..core.plots import Plot, plot_cells
from ..core.shown import count_of
from ..geotags.photos import read_photo
from ..geotags.stations import Stations
from ..reconstruction.area import Area, area_seen
from ..reconstruction.calibration import calibration_of
from ..reconstruction.cameras import OBLIQUE_DEG, View
from ..reconstruction.pairs import ground_below
from ..reconstruction.prior_knowledge import gimbal_rotations
from ..stems.photos.options import PhotoStemOptions
from ..stems.photos.tiles import split
from ..stems.photos.tuned import TILE_M
from ..terrain.dtm import Dtm
from .searched import photos_looking
from .stage import Findings

#: A stem needs about this many photos of its breast height; below this overlap photos may not join.
FEW_VIEWS, LOW_OVERLAP_PCT = 5, 70.0
#: A stem needs so many photos that look at it from the side.
MIN_OBLIQUE = 3
#: Gimbal angles and the reconstructed ones differ by less than this, degrees: nadir is called nadir early only below.
GIMBAL_SLACK_DEG = 5.0
#: Core-seconds to search 100 m2 in one photo that sees it, on the machines of docs/results.
SEARCH_S = 0.15
#: More tiles than this (about a hectare) are worth a warning where no plots were given.
MANY_TILES = 16
#: Where cameras are unknown: ground that a photo shows (a square), and how often tiles cover it.
_FOOTPRINT_M, _TILE_OVERLAP = 60.0, 1.7


@dataclass(frozen=True)
class PlannedSearch:
    """The search for stems. tiles: pieces that are searched one after the other; they overlap. hectares: the ground
    that is searched. core_seconds: of all tiles. is_rough: from the flight's outline alone, the photos do not say where
    they look."""

    tiles: int
    hectares: float
    core_seconds: float
    is_rough: bool = False

    def sentence(self) -> str:
        """For the user, when no plots were given."""
        total = self.core_seconds / at_once()
        each = total / max(self.tiles, 1)
        time = f"{total / 3600:.1f} hours" if total > 5400 else f"{total / 60:.0f} minutes"
        one = f"{each / 60:.0f} minutes" if each >= 90 else f"{each:.0f} seconds"
        return (
            f"Without plots all ground that the photos see well is searched: {'roughly ' if self.is_rough else ''}"
            f"{self.hectares:.1f} ha in {count_of(self.tiles, 'tile')} of about {one} each, about {time} in all on "
            f"{cores()} cores"
        )


def at_once() -> float:
    """Cores' worth of work that this machine does at once."""
    return max(min(cores(), 16) ** 0.9, 1)


def planned_views(stations: Stations, ground: float) -> list[View]:
    """Cameras from geotags and gimbal, in a frame whose origin is the middle of the flight on the ground.

    ground: its height, metres, project CRS. Empty where the photos say neither focal length nor angles.
    """
    if not np.isfinite(ground) or not stations.is_placed.any():
        return []
    try:
        camera = calibration_of([read_photo(stations.paths[0])]).camera
    except (ReconstructionError, InputError):
        return []
    views = []
    for i, rotation in enumerate(gimbal_rotations(stations)):
        centre = stations.xyz[i] - [*flight_middle(stations), ground]
        if np.isfinite(centre).all() and np.isfinite(rotation).all() and rotation[2, 2] < -0.2 and centre[2] > 1:
            views.append(View(stations.names[i], stations.paths[i], camera, rotation, -rotation @ centre))
    return views


def flight_middle(stations: Stations) -> np.ndarray:
    """(2,) project coordinates of the middle of the flight; zeros where no photo has a position."""
    placed = stations.xyz[stations.is_placed][:, :2]
    return np.median(placed, axis=0) if len(placed) else np.zeros(2)


def planned_ground(stations: Stations, plots: list[Plot], dtm: Dtm | None) -> float:
    """A typical ground height, metres: of the terrain model (at the plots), else of the take-off place; NaN unknown."""
    ground = float("nan")
    if dtm is not None:
        places = np.array([[plot.x, plot.y] for plot in plots])
        ground = float(np.nanmedian(dtm.height(*places.T) if plots else dtm.heights))
    return ground if np.isfinite(ground) else ground_below(stations.xyz, stations.relative_altitude_m)


def only_nadir(stations: Stations) -> str:
    """Why no trunk can be seen, if the photos' own angles say so for nearly all of them; else an empty text."""
    axis = gimbal_rotations(stations)[:, 2, 2]
    known = np.isfinite(axis)
    angle = np.degrees(np.arccos(np.clip(-axis[known], -1, 1)))
    if known.mean() < 0.9 or np.sum(angle > OBLIQUE_DEG - GIMBAL_SLACK_DEG) >= MIN_OBLIQUE:
        return ""
    return nadir_reason(angle)


def nadir_reason(nadir_angle_deg: np.ndarray) -> str:
    """Why photos that look down give no DBH, and what to do. nadir_angle_deg: (N,) of the photos."""
    down = nadir_angle_deg <= OBLIQUE_DEG
    count, other = len(down), int(np.sum(~down))
    steepest = float(nadir_angle_deg[down].max()) if down.any() else OBLIQUE_DEG
    return (
        f"{f'all but {other} of {count}' if other else f'all {count}'} photos look almost straight down (at most "
        f"{steepest:.0f} degrees from it), which shows crowns but no trunk from the side; fly oblique photos (30 to 50 "
        "degrees) from all sides"
    )


def search_ahead(
    stations: Stations, plots: list[Plot], views: list[View], options: PhotoStemOptions
) -> PlannedSearch | None:
    """The search as it will be cut into tiles; of the flight's outline alone where neither plots nor cameras are known,
    ``None`` where there is no outline. views: of :func:`planned_views`."""
    if plots:
        places = np.array([[plot.x, plot.y] for plot in plots]) - flight_middle(stations)
        area = Area.circles(places, np.array([plot.radius_m for plot in plots]))
    elif views:
        area = area_seen(views, 0.0)
    else:
        return _rough_search(stations, options)
    return search_of(area, views, options, len(stations))


def search_of(area: Area, views: list[View], options: PhotoStemOptions, photos: int = 0) -> PlannedSearch:
    """Tiles, ground and core-seconds of a search; a tile costs its ground times the photos that see it from the side.
    photos: that may, where no views are known."""
    tiles = split(area, options.margin_m)
    if not tiles:
        return PlannedSearch(0, 0.0, 0.0)
    low, high = np.split(np.array([box for _, box in tiles]), 2, axis=1)
    middle = np.column_stack([(low + high) / 2, np.full(len(tiles), 1.3)])
    seen = photos_looking(views, middle)[0] if views else np.full(len(tiles), photos)
    core_seconds = SEARCH_S * np.minimum(seen, options.max_views) * np.prod(high - low, axis=1) / 100
    return PlannedSearch(len(tiles), area.shape().area / 1e4, float(core_seconds.sum()))


def _rough_search(stations: Stations, options: PhotoStemOptions) -> PlannedSearch | None:
    """The flight's outline, a footprint wider, in tiles that overlap as they usually do."""
    from shapely import MultiPoint

    placed = stations.xyz[stations.is_placed][:, :2]
    if len(placed) < MIN_OBLIQUE:
        return None
    ground_m2 = float(MultiPoint(placed).convex_hull.buffer(_FOOTPRINT_M / 2).area)
    tiled_m2 = _TILE_OVERLAP * ground_m2
    seen = min(len(placed) * _FOOTPRINT_M**2 / ground_m2, options.max_views)
    core_seconds = SEARCH_S * seen * tiled_m2 / 100
    return PlannedSearch(int(np.ceil(tiled_m2 / TILE_M**2)), ground_m2 / 1e4, core_seconds, is_rough=True)


def report_overlap(views: list[View], stations: Stations, plots: list[Plot], findings: Findings) -> None:
    """How often each place of the plots is seen from the side, and how much neighbouring photos share. views: of
    :func:`planned_views`."""
    findings.facts |= {"overlap_pct": None, "median_views": None}
    if not views:
        findings.warn(
            "The overlap cannot be estimated: the photos do not say where the camera looked or how high it flew."
        )
        return
    aims = np.array([view.centre[:2] - view.rotation[2, :2] / view.rotation[2, 2] * view.centre[2] for view in views])
    low, high = aims.min(axis=0) - 10, aims.max(axis=0) + 10
    step = max(float(np.max(high - low)) / 60, 1.0)
    x, y = np.meshgrid(np.arange(low[0], high[0], step), np.arange(low[1], high[1], step))
    grid = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    sees = np.array([view.contains(view.project(grid)[0]) for view in views])
    shared = (sees.astype(np.int32) @ sees.T.astype(np.int32)).astype(float)
    size = np.diag(shared).copy()
    np.fill_diagonal(shared, 0.0)
    filled = size > 0
    overlap_pct = float(np.median(100 * shared[filled].max(axis=1) / size[filled])) if filled.any() else 0.0
    places = plot_cells(plots, 1.0)[0] - flight_middle(stations) if plots else grid[sees.any(axis=0), :2]
    seen, _ = photos_looking(views, np.column_stack([places, np.full(len(places), 1.3)]))
    median = float(np.median(seen)) if len(seen) else 0.0
    oblique = sum(view.nadir_angle_deg > OBLIQUE_DEG for view in views)
    findings.info(
        f"{oblique} of {len(views)} photos look from the side (more than {OBLIQUE_DEG:.0f} degrees from straight "
        f"down). Neighbouring photos share {overlap_pct:.0f} % of their ground. The middle place of the "
        f"{'plots' if plots else 'flight'} lies in {median:.0f} of them, before trees hide it."
    )
    if overlap_pct < LOW_OVERLAP_PCT:
        findings.warn(
            f"Neighbouring photos share only {overlap_pct:.0f} % of their ground, 80 % is asked for: photos may not "
            "join, and then their trees are lost; fly with more overlap."
        )
    if oblique < MIN_OBLIQUE:
        findings.warn(
            "Almost all photos look straight down, which shows crowns but no trunk from the side: expect no DBH; fly "
            "oblique photos (30 to 50 degrees) from all sides."
        )
    elif plots and (share := float(np.mean(seen < 3 * FEW_VIEWS))) > 0.1:
        findings.warn(
            f"{100 * share:.0f} % of the plots' ground lies in fewer than {3 * FEW_VIEWS} oblique photos; a stem needs "
            f"about {FEW_VIEWS} that really see it, and crowns hide most: expect refused stems there."
        )
    findings.facts |= {"overlap_pct": round(overlap_pct, 1), "median_views": median}
