"""Photos with stations -> one georeferenced block."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..core.crs import LocalFrame, grid_convergence_deg
from ..core.errors import ReconstructionError
from ..core.files import fingerprint
from ..core.machine import available_threads
from ..core.progress import Reporter
from ..core.settings import param
from ..geotags.control import ControlPoints
from ..geotags.photos import read_photo
from ..geotags.readout import Readout, readout_of
from ..geotags.stations import Stations
from .adjustment import Known
from .calibration import Calibration, calibration_of, calibration_record
from .checks import check_block
from .features import FeatureStore, count_rows, run_task
from .georeference import Placement, place_by_gimbal, place_photos
from .guided_pairs import Guide, match_guided
from .images import load_image
from .joining import Joined, from_gimbal, join_photos
from .levels import KEPT_SHARE, KEPT_SURE_PX, Held, Level, better, can_guide, levels_of, not_enough
from .matchers import Matcher, Plugin, load_matcher, match_photos
from .matching import match_pairs
from .model import save_model
from .pairs import ground_below, select_pairs
from .poses import rotation_from_gimbal
from .posterior import posterior_of
from .sensor import Sensor
from .shutter import free_shutter, lens_sd, sensor_of
from .sift import SMALL_PHOTO_PX, extract

#: Part of the work left that a level is where it is not enough; only the progress bar depends on it.
FIRST_PART = 0.4
#: Features lie so high at most, metres, and so far below the take-off point, share of the flying height.
CROWNS_M, LOW_SHARE = 25.0, 0.07


@dataclass(frozen=True, kw_only=True)
class ReconstructOptions:
    """How to reconstruct; the defaults suit drone photos of 1 to 60 MP."""

    max_features: int = param(
        8000, kind="integer", help="Most features per photo", minimum=500, maximum=60000, advanced=True
    )
    max_image_size: int = param(
        4000,
        kind="integer",
        unit="px",
        help="Photos are reduced to this longer side for the features",
        minimum=500,
        maximum=20000,
        advanced=True,
    )
    neighbours: int = param(
        20, kind="integer", help="Photos that each photo is matched with", minimum=4, maximum=200, advanced=True
    )
    threads: int = param(0, kind="integer", help="Processor threads, 0 = all", minimum=0, maximum=256, advanced=True)
    seed: int = param(1, kind="integer", help="Random seed", minimum=0, advanced=True)
    keep_cache: bool = param(False, kind="flag", help="Keep the feature database after a successful run", advanced=True)


def reconstruct_photos(
    stations: Stations,
    options: ReconstructOptions,
    sfm_folder: Path,
    reporter: Reporter | None = None,
    plugin: Plugin | None = None,
    control: ControlPoints | None = None,
    calibration_file: Path | None = None,
) -> dict[str, Any]:
    """Structure from motion in the project CRS; writes ``sfm_folder`` and returns its report.

    Args:
        stations: from :func:`~treedgs_geo.geotags.reading.read_stations`. sfm_folder: replaced as a whole on success;
        features and matches are
            kept in ``cache/`` beside it while the work goes on, so that a stopped run resumes. plugin: a learned
            matcher whose matches are used beside SIFT's. control: ground control and check points. calibration_file:
            ``camera.json`` of an earlier reconstruction with this camera.

    Raises:
        ReconstructionError: too few photos register, or the result contradicts geotags, calibration or flying height.
    """
    reporter = reporter or Reporter()
    began = time.monotonic()
    if len(stations) < 3:
        raise ReconstructionError(
            f"{len(stations)} usable photos: structure from motion needs at least 3, a plot 30 or more; add photos."
        )
    sfm_folder = Path(sfm_folder)
    # A plug-in that cannot be loaded must not be found out after an hour of matching.
    matcher = load_matcher(plugin) if plugin else None
    work = _Work(stations, options, _survey(stations, control, calibration_file), plugin, matcher, sfm_folder)
    levels = levels_of(options.neighbours, plugin is None and _guided(work.survey))
    level, joined, report, climbed = _climb(work, levels, reporter)
    report |= {"seconds": round(time.monotonic() - began, 1), "level": level.name, "climbed_because": climbed}
    survey = work.survey
    record = calibration_record(read_photo(stations.paths[0]).model, joined.block.sensor, report["lens_sd"])
    save_model(sfm_folder, joined.block, stations.names, stations.paths, stations.flight, survey.frame, report, record)
    if not options.keep_cache:
        shutil.rmtree(work.cache, ignore_errors=True)
        if not any(work.cache_root.iterdir()):
            work.cache_root.rmdir()
    return report


def _climb(work: _Work, levels: list[Level], reporter: Reporter) -> tuple[Level, Joined, dict[str, Any], str]:
    """The first level whose block is good enough, or else the best; its block and report; why others were not."""
    found: tuple[Level, Joined, dict[str, Any], Held] | None = None
    reasons, at = list[str](), 0.0
    for level in levels:
        former = found[1] if found else None
        if level.again and _kept(former, work.survey) is None:
            continue
        if reasons:
            reporter.info(f"Photos are matched anew, {level.stage}: {reasons[-1]}.")
        held, is_last = Held(reporter), level is levels[-1]
        end = 1.0 if is_last else at + FIRST_PART * (1 - at)
        with reporter.stage(level.stage, at, end):
            try:
                joined, report = _at_level(work, level, held, former)
            except ReconstructionError as problem:
                if is_last and found is None:
                    held.release()
                    raise
                reasons.append(str(problem).rstrip("."))
                continue
        at = end
        if found is None or better(level, report, found[2]):
            found = level, joined, report, held
        if problem_left := "" if is_last else not_enough(level, report):
            reasons.append(problem_left)
        else:
            break
    assert found is not None  # the last level raises where no level has found anything
    level, joined, report, held = found
    held.release()
    return level, joined, report, "; ".join(reasons)


@dataclass(frozen=True)
class _Survey:
    """What is known before a photo is looked at, in the local frame. ground: height, NaN unknown. free: parts of lens
    and shutter that are adjusted."""

    frame: LocalFrame
    calibration: Calibration
    rotations: np.ndarray
    ground: float
    known: Known
    sensor: Sensor
    free: frozenset[str]
    free_focal: bool
    readout: Readout

    @property
    def height(self) -> float:
        """Of the cameras above the ground, metres."""
        return float(np.nanmedian(self.known.xyz[:, 2]) - self.ground) if np.isfinite(self.ground) else 80.0


def _survey(stations: Stations, control: ControlPoints | None, calibration_file: Path | None) -> _Survey:
    calibration = calibration_of([read_photo(stations.paths[0])], calibration_file)
    frame = LocalFrame.around(stations.crs, stations.xyz[stations.is_placed])
    ground = ground_below(stations.xyz, stations.relative_altitude_m)
    if np.isfinite(ground):
        frame = replace(frame, origin=np.array([*frame.origin[:2], np.round(ground)]))
        ground -= frame.origin[2]
    xyz = frame.to_local(stations.xyz)
    rotations = gimbal_rotations(stations)
    free = _free_lens(rotations, xyz, stations, control)
    readout = _readout(stations, calibration)
    known = Known(
        xyz,
        stations.sd,
        calibration.camera,
        lens_sd(calibration),
        control=_local(control, frame),
        gimbal=rotations,
        taken_s=stations.utc,
    )
    height = np.nanmedian(xyz[:, 2]) - ground if np.isfinite(ground) else 80.0
    known, sensor, shutter = free_shutter(
        known, sensor_of(stations, calibration.camera), stations, readout, float(height)
    )
    return _Survey(frame, calibration, rotations, ground, known, sensor, free | shutter, "focal" in free, readout)


def _guided(survey: _Survey) -> bool:
    return can_guide(survey.known.xyz, survey.known.sd, survey.rotations, survey.ground)


@dataclass(frozen=True)
class _Work:
    """One reconstruction, whatever the level."""

    stations: Stations
    options: ReconstructOptions
    survey: _Survey
    plugin: Plugin | None
    matcher: Matcher | None
    sfm_folder: Path

    @property
    def threads(self) -> int:
        return self.options.threads or available_threads()

    @property
    def cache_root(self) -> Path:
        return self.sfm_folder.parent / "cache"

    @property
    def cache(self) -> Path:
        """Where features and matches are kept while the work goes on."""
        key = fingerprint(self.stations.paths) + f"-{self.options.max_features}-{self.options.max_image_size}"
        if self.plugin is not None:
            key += "-" + self.plugin.digest()
        return self.cache_root / f"sfm-{key}"


def _at_level(
    work: _Work, level: Level, reporter: Reporter, former: Joined | None = None
) -> tuple[Joined, dict[str, Any]]:
    """The block at one level, and its report. former: of the level before, whose poses are kept where they are sure.

    Raises:
        ReconstructionError: as :func:`reconstruct_photos`.
    """
    stations, options, survey = work.stations, work.options, work.survey
    cache, timing, began = work.cache, dict[str, float](), time.monotonic()
    cache.mkdir(parents=True, exist_ok=True)
    database = cache / "features.db"

    def timed(name: str) -> None:
        timing[name] = round(time.monotonic() - began - sum(timing.values()), 1)

    with reporter.stage("features", 0.0, 0.30):
        if level.guided:
            most = min(options.max_features, level.features)
            found = extract(stations.paths, most, options.max_image_size, work.threads, cache / "own", reporter)
            store = FeatureStore.of(found)
        else:
            extract_features(database, cache, stations, survey.calibration, options, work.threads, reporter)
    timed("features")
    camera = survey.calibration.camera
    half_field = 0.5 * max(camera.width, camera.height) / survey.calibration.focal_px
    pairs = select_pairs(survey.known.xyz, survey.rotations, survey.ground, half_field, level.neighbours)
    with reporter.stage("matching", 0.30, 0.75):
        if level.guided:
            guide = _guide(survey, former if level.again else None)
            match_guided(store, pairs, guide, options.seed, work.threads, reporter)
        else:
            match_pairs(database, cache, stations.names, pairs, work.threads, options.seed, reporter)
            if work.plugin is not None:
                database = _match_learned(database, stations, pairs, work.plugin, work.matcher, reporter)
            store = FeatureStore.read(database, stations.names)
    timed("matching")
    with reporter.stage("mapping", 0.75, 0.85):
        if (kept := _kept(former, survey, level.again)) is not None:
            placement = kept
        elif level.guided:
            start = place_by_gimbal(camera, survey.known.xyz, survey.rotations)
            placement = from_gimbal(start, store, survey.known, survey.sensor)
        else:
            placement = place_photos(
                database,
                cache,
                stations,
                survey.calibration,
                survey.known.xyz,
                survey.rotations,
                survey.free_focal,
                options.seed,
                reporter,
            )
    timed("mapping")
    with reporter.stage("adjustment", 0.85, 1.0):
        joined = join_photos(placement, store, stations, survey.known, survey.sensor, survey.free, reporter)
    timed("adjustment")
    report = check_block(joined, stations, survey.calibration, survey.readout, reporter)
    matches = int(sum(len(m) for m in store.matches.values()))
    return joined, report | {"stage_seconds": timing, "pairs": len(pairs), "matches": matches}


def _kept(former: Joined | None, survey: _Survey, all_poses: bool = False) -> Placement | None:
    """The sure poses of a block, or all that it has, the other photos by geotag and gimbal; ``None`` where too few are
    sure for a start."""
    if former is None:
        return None
    sure = _sure(former)
    if sure.sum() < max(3, KEPT_SHARE * len(sure)):
        return None
    kept = former.block.is_posed if all_poses else sure
    start = place_by_gimbal(former.block.camera, survey.known.xyz, survey.rotations)
    return replace(
        start,
        rotations=np.where(kept[:, None, None], former.block.rotations, start.rotations),
        translations=np.where(kept[:, None], former.block.translations, start.translations),
        mapped=kept,
    )


def _sure(joined: Joined) -> np.ndarray:
    """(N,) bool: photos whose poses are sure enough to guide the next level."""
    with np.errstate(invalid="ignore"):
        return joined.block.is_posed & (posterior_of(joined.adjusted).poses_px <= KEPT_SURE_PX)


def _guide(survey: _Survey, former: Joined | None = None) -> Guide:
    """Features lie between somewhat below the take-off point and the tops of the crowns. former: a block whose sure
    poses say more than gimbals do."""
    low = survey.ground - LOW_SHARE * survey.height
    high = survey.ground + min(CROWNS_M, 0.5 * survey.height)
    guide = Guide(survey.rotations, survey.known.xyz, survey.calibration.camera, low, high)
    if former is None:
        return guide
    return guide.finer(former.block.rotations, former.block.centres, former.block.camera, _sure(former))


def gimbal_rotations(stations: Stations) -> np.ndarray:
    """(N, 3, 3) world -> camera from the gimbal angles, NaN where they are unknown."""
    import pyproj

    rotations = np.full((len(stations), 3, 3), np.nan)
    placed = stations.xyz[stations.is_placed]
    to_degrees = pyproj.Transformer.from_crs(
        stations.crs, pyproj.CRS(stations.crs.geodetic_crs).to_2d(), always_xy=True
    )
    convergence = grid_convergence_deg(stations.crs, *to_degrees.transform(*placed[:, :2].mean(axis=0)))
    for i in range(len(stations)):
        angles = stations.yaw_deg[i] - convergence, stations.pitch_deg[i], stations.roll_deg[i]
        if np.isfinite(angles).all():
            rotations[i] = rotation_from_gimbal(*angles)
    return rotations


def _free_lens(
    rotations: np.ndarray, xyz: np.ndarray, stations: Stations, control: ControlPoints | None
) -> frozenset[str]:
    """Which intrinsics the flight can determine (:data:`.adjustment.PARTS`).

    Nadir photos from one height cannot tell focal length from height (a 19 % error hid in 1 % of reprojection error,
    ``docs/analyst/reconstruction.md``); obliques can, and with precise geotags two heights or control points.
    """
    axis = rotations[:, 2, 2]
    known = np.isfinite(axis)
    oblique = known & (np.degrees(np.arccos(np.clip(-axis, -1, 1))) > 15)
    precise = np.nanmedian(stations.sd, axis=0).max() < 0.5 if stations.is_placed.any() else False
    heights = np.nanpercentile(xyz[:, 2], [5, 95])
    two_heights = (
        bool(heights[1] - heights[0] > 0.15 * max(np.nanmedian(stations.relative_altitude_m), 20))
        if np.isfinite(stations.relative_altitude_m).any()
        else False
    )
    surveyed = control is not None and int((~control.is_check).sum()) >= 3 and precise
    enough = bool(oblique.sum() >= 8 or (precise and two_heights) or surveyed)
    return frozenset({"radial", "tangential", *({"focal", "aspect", "principal_point", "drift"} if enough else ())})


def _readout(stations: Stations, calibration: Calibration) -> Readout:
    """Readout time by the camera's own calibration file, or by metadata and tables."""
    if np.isfinite(calibration.readout_s) and calibration.readout_sd_s > 0:
        return Readout(calibration.readout_s, calibration.readout_sd_s, "calibration file")
    return readout_of([read_photo(path) for path in stations.paths[:: max(len(stations) // 5, 1)]])


def _local(control: ControlPoints | None, frame: LocalFrame) -> ControlPoints | None:
    return None if control is None else replace(control, xyz=frame.to_local(control.xyz))


def _photo_root(stations: Stations) -> Path:
    path, name = stations.paths[0], stations.names[0]
    return Path(str(path)[: -len(name)]) if str(path).endswith(name) else path.parent


def extract_features(
    database: Path,
    cache: Path,
    stations: Stations,
    calibration: Calibration,
    options: ReconstructOptions,
    threads: int,
    reporter: Reporter,
) -> None:
    """SIFT of every photo into ``database`` (made if missing); ``cache`` holds the child's job and log.

    Raises:
        MemoryError, ReconstructionError: as :func:`.features.run_task`.
    """
    camera = calibration.camera
    job = {
        "database": str(database),
        "photos": str(_photo_root(stations)),
        "names": stations.names,
        "threads": threads,
        "camera_params": ",".join(
            f"{v:.6f}" for v in (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion[:4])
        ),
        "max_image_size": options.max_image_size,
        "max_features": options.max_features,
        # Doubling the photos (octave -1) costs five times more and adds weak features; small ones need them.
        "first_octave": -1 if camera.width * camera.height < SMALL_PHOTO_PX else 0,
        "peak_threshold": 0.0067,
    }
    run_task("extract", job, cache, reporter, count_rows(database, "keypoints", len(stations)))


def _match_learned(
    database: Path, stations: Stations, pairs: np.ndarray, plugin: Plugin, matcher: Matcher | None, reporter: Reporter
) -> Path:
    """The database with the matches of the user's plug-in added to SIFT's."""
    done = database.with_name("learned.db")
    if done.exists() or matcher is None:
        return done
    paths = dict(zip(stations.names, stations.paths, strict=True))
    # Neighbours come one after the other: a few decoded photos are enough.
    photo = lru_cache(maxsize=24)(lambda name: load_image(paths[name]))
    names = [(stations.names[i], stations.names[j]) for i, j in pairs]
    report = match_photos(database, done, names, photo, matcher, plugin, reporter.progress)
    reporter.info(f"{plugin.code.name}: {report.added} matches in {report.pairs} pairs beside those of SIFT")
    return done
