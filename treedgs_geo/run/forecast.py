"""What geotags and gimbal angles say before any photo is matched: where the photos look, how large the search for
stems will be, and what the run will need.

Time, memory and disk are estimates from recorded runs (``docs/technician/qgis.md``): good for "minutes or hours", not
for seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import InputError, ReconstructionError
from ..core.machine import cores
from ..core.plots import Plot
from ..core.shown import count_of
from ..geotags.photos import read_photo
from ..geotags.sources import find_geotags
from ..geotags.stations import Stations
from ..reconstruction.area import Area, area_seen
from ..reconstruction.calibration import calibration_of
from ..reconstruction.cameras import OBLIQUE_DEG, View
from ..reconstruction.matching_strategy import GUIDED_NEIGHBOURS
from ..reconstruction.options import ReconstructOptions
from ..reconstruction.pairs import ground_below, select_pairs
from ..reconstruction.prior_knowledge import can_guide, gimbal_rotations
from ..stems.photos.options import PhotoStemOptions
from ..stems.photos.tiles import split
from ..stems.photos.tuned import TILE_M
from ..terrain.dtm import Dtm
from .stage import Cost, Findings

#: Core-seconds on the machines of docs/results: per megapixel of features, per matched pair, per photo of mapping and
#: adjustment.
GUIDED_S_MP, GUIDED_S_PAIR, GUIDED_S_PHOTO = 0.18, 0.02, 0.17
#: The same where every feature is matched with every other, 8000 of a photo.
FULL_S_MP, FULL_S_PAIR, FULL_S_PHOTO = 0.34, 0.10, 0.4
#: A stem needs about this many photos of its breast height; below this overlap photos may not join.
FEW_VIEWS, LOW_OVERLAP_PCT = 5, 70.0
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
        return self.core_seconds / max(self.tiles, 1) / _at_once()

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


def measure_weight(search: PlannedSearch | None, photos: int) -> float:
    """How much longer the measuring is, against the other stages, than on a usual plot."""
    return 1.0 if search is None else float(np.clip(search.core_seconds / (_OTHER_S_PHOTO * max(photos, 1)), 1.0, 1e3))


def report_positions(stations: Stations, photos: Path, geotags: Path | None, findings: Findings) -> None:
    """How the photos are placed. geotags: what was given for them."""
    counts = stations.counts()
    fix_pct = 100 * counts.get("fix", 0) / len(stations)
    findings.info(
        f"{len(stations)} photos; positions: "
        + ", ".join(f"{number} {quality}" for quality, number in counts.items())
        + f" ({fix_pct:.0f} % fixed)."
    )
    if fix_pct < 90:
        share = f"Only {fix_pct:.0f} %" if fix_pct >= 0.5 else "None"
        given = find_geotags(geotags, photos) if geotags else None
        advice = (
            f"give their accuracies in {given.tables[0].name} (sd_e, sd_n, sd_u, metres) if they are better"
            if given and given.tables
            else "process the PPK again with a nearer base station"
            if given
            else "give PPK files (--geotags), or positions by photo name with their accuracies (CSV)"
        )
        findings.warn(
            f"{share} of the photos have a fixed (centimetre) position: the trees' places and the scale rest on them; "
            f"{advice}."
        )
    findings.facts |= {"n_photos": len(stations), "fix_pct": round(fix_pct, 1)}


def report_overlap(
    views: list[View], stations: Stations, plots: list[Plot], findings: Findings, is_nadir: bool
) -> None:
    """How often each place of the plots is seen from the side, and how much neighbouring photos share. views: of
    :func:`planned_views`."""
    findings.facts |= {"overlap_pct": None, "median_views": None}
    if not views:
        findings.warn(
            "The overlap cannot be estimated: the photos do not say where the camera looked or how high it flew."
        )
        return
    frame_origin = np.array([*np.median(stations.xyz[stations.is_placed][:, :2], axis=0), 0.0])
    aims = np.array([view.centre[:2] - view.rotation[2, :2] / view.rotation[2, 2] * view.centre[2] for view in views])
    low, high = aims.min(axis=0) - 10, aims.max(axis=0) + 10
    step = max(float(np.max(high - low)) / 60, 1.0)
    x, y = np.meshgrid(np.arange(low[0], high[0], step), np.arange(low[1], high[1], step))
    grid = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    sees = np.array([view.contains(view.project(grid)[0]) for view in views])
    filled = sees.sum(axis=1) > 0
    shared = (sees.astype(np.int32) @ sees.T.astype(np.int32)).astype(float)
    size = np.diag(shared).copy()
    np.fill_diagonal(shared, 0.0)
    overlap_pct = float(np.median(100 * shared[filled].max(axis=1) / size[filled])) if filled.any() else 0.0
    oblique = [view for view in views if view.nadir_angle_deg > OBLIQUE_DEG]
    if plots:
        places = np.array([[p.x, p.y, 0.0] for p in plots]) - frame_origin
        angle, ring = np.linspace(0, 2 * np.pi, 12, endpoint=False), np.array([0.0, 0.5, 1.0])
        offsets = np.array([[r * np.cos(a), r * np.sin(a), 0.0] for r in ring for a in angle])
        places = np.concatenate([place + offsets * p.radius_m for place, p in zip(places, plots, strict=True)])
    else:
        places = grid[sees.any(axis=0)]
    breast = places + [0.0, 0.0, 1.3]
    seen = sum((view.contains(view.project(breast)[0]).astype(int) for view in oblique), np.zeros(len(breast), int))
    median = float(np.median(seen)) if len(seen) else 0.0
    findings.info(
        f"{len(oblique)} of {len(views)} photos look from the side (more than {OBLIQUE_DEG:.0f} degrees from straight "
        f"down). Neighbouring photos share {overlap_pct:.0f} % of their ground. The middle place of the "
        f"{'plots' if plots else 'flight'} lies in {median:.0f} of them, before trees hide it."
    )
    if overlap_pct < LOW_OVERLAP_PCT:
        findings.warn(
            f"Neighbouring photos share only {overlap_pct:.0f} % of their ground, 80 % is asked for: photos may not "
            "join, and then their trees are lost; fly with more overlap."
        )
    if len(oblique) < MIN_OBLIQUE and not is_nadir:
        findings.warn(
            "Almost all photos look straight down, which shows crowns but no trunk from the side: expect no DBH; fly "
            "oblique photos (30 to 50 degrees) from all sides."
        )
    elif plots and not is_nadir and (share := float(np.mean(seen < 3 * FEW_VIEWS))) > 0.1:
        findings.warn(
            f"{100 * share:.0f} % of the plots' ground lies in fewer than {3 * FEW_VIEWS} oblique photos; a stem needs "
            f"about {FEW_VIEWS} that really see it, and crowns hide most: expect refused stems there."
        )
    findings.facts |= {"overlap_pct": round(overlap_pct, 1), "median_views": median}


def matching_cost(stations: Stations, ground: float, options: ReconstructOptions) -> Cost:
    """Of the reconstruction. ground: height of :func:`planned_ground`."""
    photo, number = read_photo(stations.paths[0]), len(stations)
    longer, full_mp = max(photo.width, photo.height), photo.width * photo.height / 1e6
    used_mp = full_mp * min(1.0, options.max_image_size / longer) ** 2
    try:
        half_field = 0.5 * longer / calibration_of([photo]).camera.fx
    except ReconstructionError:
        half_field = 0.6
    rotations = gimbal_rotations(stations)
    full_s, guided_s = (
        each_mp * used_mp * number
        + each_pair * len(select_pairs(stations.xyz, rotations, ground, half_field, neighbours))
        + each_photo * number
        for each_mp, each_pair, each_photo, neighbours in (
            (FULL_S_MP, FULL_S_PAIR * (options.max_features / 8000) ** 1.5, FULL_S_PHOTO, options.neighbours),
            (GUIDED_S_MP, GUIDED_S_PAIR, GUIDED_S_PHOTO, GUIDED_NEIGHBOURS),
        )
    )
    guided = can_guide(stations.xyz, stations.sd, rotations, ground)
    return Cost(
        seconds=(guided_s if guided else full_s) / _at_once() * 1.1,
        more_s=full_s / _at_once() if guided else 0.0,
        # A photo's features need about 0.1 GB a megapixel in each thread.
        memory_gb=0.08 * used_mp * min(cores(), 16),
        disk_gb=number * (0.004 + 0.001 * full_mp),
    )


def search_cost(stations: Stations, core_seconds: float) -> Cost:
    """Of the search for stems, which keeps its photos open."""
    photo = read_photo(stations.paths[0])
    full_mp = photo.width * photo.height / 1e6
    return Cost(seconds=core_seconds / _at_once() * 1.1, memory_gb=0.004 * full_mp * min(len(stations), 100))


def _at_once() -> float:
    """Cores' worth of work that this machine does at once."""
    return max(min(cores(), 16) ** 0.9, 1)
