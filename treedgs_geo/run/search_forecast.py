"""What geotags and gimbal angles say before any photo is matched: where the photos look, and how large the search
for stems will be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError, ReconstructionError
from ..core.machine import cores
from ..core.plots import Plot
from ..core.progress import Reporter
from ..core.shown import count_of
from ..geotags.photos import read_photo
from ..geotags.stations import Stations
from ..reconstruction.area import Area, area_seen
from ..reconstruction.calibration import calibration_of
from ..reconstruction.cameras import OBLIQUE_DEG, View
from ..reconstruction.pairs import ground_below
from ..reconstruction.prior_knowledge import gimbal_rotations
from ..stems.photos.options import PhotoStemOptions
from ..stems.photos.tiles import TILE_M, split
from ..terrain.dtm import Dtm

#: A stem needs so many photos that look at it from the side.
MIN_OBLIQUE = 3
#: Gimbal angles and the reconstructed ones differ by less than this, degrees: nadir is called nadir early only below.
GIMBAL_SLACK_DEG = 5.0
#: Core-seconds to search 100 m2 in one photo that sees it, on the machines of docs/results.
SEARCH_S = 0.55
#: More tiles than this (about a hectare) are worth a warning where no plots were given.
MANY_TILES = 16
#: Core-seconds of the other stages for each photo of a usual plot; only the progress bar depends on it.
_OTHER_S_PHOTO = 8.0
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

    def seconds_a_tile(self) -> float:
        """On this machine, one tile."""
        return self.core_seconds / max(self.tiles, 1) / max(min(cores(), 16) ** 0.9, 1)

    def sentence(self) -> str:
        """For the user, when no plots were given."""
        each = self.seconds_a_tile()
        total = each * self.tiles
        time = f"{total / 3600:.1f} hours" if total > 5400 else f"{total / 60:.0f} minutes"
        one = f"{each / 60:.0f} minutes" if each >= 90 else f"{each:.0f} seconds"
        return (
            f"Without plots all ground that the photos see well is searched: {'roughly ' if self.is_rough else ''}"
            f"{self.hectares:.1f} ha in {count_of(self.tiles, 'tile')} of about {one} each, about {time} in all on "
            f"{cores()} cores"
        )


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
    origin = planned_origin(stations, ground)
    views = []
    for i, rotation in enumerate(gimbal_rotations(stations)):
        centre = stations.xyz[i] - origin
        if np.isfinite(centre).all() and np.isfinite(rotation).all() and rotation[2, 2] < -0.2 and centre[2] > 1:
            views.append(View(stations.names[i], stations.paths[i], camera, rotation, -rotation @ centre))
    return views


def planned_origin(stations: Stations, ground: float) -> np.ndarray:
    """(3,) project coordinates of the origin of :func:`planned_views`."""
    return np.array([*np.median(stations.xyz[stations.is_placed][:, :2], axis=0), ground])


def planned_ground(stations: Stations, plots: list[Plot], dtm: Dtm | None) -> float:
    """A typical ground height, metres: of the terrain model (at the plots), else of the take-off place; NaN unknown."""
    ground = float("nan")
    if dtm is not None:
        ground = float(np.nanmedian(dtm.heights))
        if plots:
            ground = float(np.nanmedian(dtm.height(np.array([p.x for p in plots]), np.array([p.y for p in plots]))))
    return ground if np.isfinite(ground) else ground_below(stations.xyz, stations.relative_altitude_m)


def only_nadir(stations: Stations) -> str:
    """Why no trunk can be seen, if the photos' own angles say so for nearly all of them; else an empty text."""
    axis = gimbal_rotations(stations)[:, 2, 2]
    known = np.isfinite(axis)
    if known.mean() < 0.9:
        return ""
    angle = np.degrees(np.arccos(np.clip(-axis[known], -1, 1)))
    if np.sum(angle > OBLIQUE_DEG - GIMBAL_SLACK_DEG) >= MIN_OBLIQUE:
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
    stations: Stations, plots: list[Plot], ground: float, options: PhotoStemOptions, views: list[View] | None = None
) -> PlannedSearch | None:
    """The search as it will be cut into tiles, from planned cameras, or from the flight's outline where these are
    unknown; ``None`` for plots that unknown cameras may see.

    views: of :func:`planned_views`, made here if not given.
    """
    views = planned_views(stations, ground) if views is None else views
    if not views:
        return None if plots else _rough_search(stations, options)
    if plots:
        centres = np.array([[p.x, p.y] for p in plots]) - planned_origin(stations, ground)[:2]
        area = Area.circles(centres, np.array([p.radius_m for p in plots]))
    else:
        area = area_seen(views, 0.0)
    return search_of(area, views, options)


def search_of(area: Area, views: list[View], options: PhotoStemOptions) -> PlannedSearch:
    """Tiles, ground and core-seconds of a search; a tile costs its ground times the oblique photos that see it."""
    tiles = split(area, options.margin_m)
    if not tiles:
        return PlannedSearch(0, 0.0, 0.0)
    boxes = np.array([box for _, box in tiles])
    ground_m2 = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    middle = np.column_stack([boxes[:, [0, 2]].mean(axis=1), boxes[:, [1, 3]].mean(axis=1), np.full(len(boxes), 1.3)])
    seen = np.zeros(len(boxes))
    for view in views:
        if view.nadir_angle_deg > OBLIQUE_DEG:
            seen += view.contains(view.project(middle)[0])
    core_seconds = SEARCH_S * np.minimum(seen, options.max_views) * ground_m2 / 100
    low_x, low_y, high_x, high_y = area.bounds()
    step = max(high_x - low_x, high_y - low_y) / 200
    x, y = np.meshgrid(np.arange(low_x, high_x, step) + step / 2, np.arange(low_y, high_y, step) + step / 2)
    inside = area.contains(np.column_stack([x.ravel(), y.ravel()]))
    return PlannedSearch(len(tiles), float(inside.sum()) * step**2 / 1e4, float(core_seconds.sum()))


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


def announce_search(search: PlannedSearch | None, plots: list[Plot], reporter: Reporter) -> None:
    """Say before hours of work how large they will be."""
    if search is None or plots or search.tiles <= MANY_TILES:
        return
    reporter.warn(f"{search.sentence()}: give plots (--plots) to measure only those.")


def measure_weight(search: PlannedSearch | None, photos: int) -> float:
    """How much longer the measuring is, against the other stages, than on a usual plot."""
    return 1.0 if search is None else float(np.clip(search.core_seconds / (_OTHER_S_PHOTO * max(photos, 1)), 1.0, 1e3))
