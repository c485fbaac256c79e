"""How much is spent on a block: guided matching of a few pairs first, more pairs guided by what that gave, and every
feature with every other only where photos are still missing. One block after another, until one is good enough."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import ReconstructionError
from ..core.files import fingerprint
from ..core.machine import available_threads
from ..core.progress import Collector, Reporter
from ..geotags.control import ControlPoints
from ..geotags.own_tags import OVERHEAD_DEG
from ..geotags.photos import read_photo
from ..geotags.stations import Stations
from .calibration import calibration_record
from .checks import check_block
from .covariance import posterior_of
from .georeference import HALF_TURN, Placement, place_by_gimbal, place_photos
from .guided_matching import Guide, match_guided
from .incremental_block import Joined, from_gimbal, join_photos
from .matching import match_all, similar_pairs
from .model import save_model
from .options import CONFIRMED_SHARE, ReconstructOptions
from .pairs import select_pairs
from .prior_knowledge import Survey, survey_of
from .sift import FeatureStore, extract

#: Photos that each photo is matched with at most where geotags and gimbals guide the matching.
GUIDED_NEIGHBOURS = 12
#: A photo whose best match is below this share of the median photo's may be stored turned by half.
WEAK_SHARE = 0.5
#: Asked by so many of its pairs first, those with the most matches.
TRIED_PAIRS = 3
#: Places described in a photo at most there (:mod:`.sift`).
GUIDED_FEATURES = 5000
#: A block of the first level is good enough when its photos are this sure at the stems, pixels: the median, and the
#: least sure of them (:func:`.covariance.posterior_of`). A stem's edges are fitted with a sideways error of 0.3 px for
#: each photo: what is sure to that costs no diameter (``docs/evidence/speed-accuracy.md``).
SURE_MEDIAN_PX, SURE_WORST_PX = 0.15, 0.3
#: The next level starts from the photos that are as sure as the least sure may be, where they are so many; else anew.
KEPT_SHARE = 0.5
#: And when what is left in the photos is no more than this, pixels: swaying shrubs leave 0.54 on ``plot_h``.
LEFT_PX = 0.6
#: And when no more than this share of the photos is not placed: one of 62 is not worth another level.
MISSING_SHARE = 0.03
#: Good enough after the level that a block guides: so large a share of the photos.
PLACED_SHARE = 0.9
#: Photos that were left out because they should show the ground and do not (:mod:`.ground_alignment`) are not missed
#: where so many are left: more matches in moving crowns place a few of them and all photos worse (six dense stands: a
#: tenth of the photos 0.6 to 4.3 px off, in place of 0.15 to 0.2).
GROUND_SHARE = 2 / 3
#: Every feature is matched with every other only where no guide has placed so many: of five blocks with two thirds and
#: more it placed not one photo more, in twice the time of all other levels.
FULL_BELOW = 0.5
#: And when so many points tie each photo (median), seen in so many photos each (mean).
TIED_POINTS, TIED_TRACK = 100, 3.0
#: Part of the work left that a level is where it is not enough; only the progress bar depends on it.
FIRST_PART = 0.4
#: Features lie so high at most, metres, and so far below the take-off point, share of the flying height.
CROWNS_M, LOW_SHARE = 25.0, 0.07


@dataclass(frozen=True)
class Level:
    """name: in ``run.json`` and the report. stage: what progress calls it. neighbours: photos that a photo is matched
    with. guided: :data:`GUIDED_FEATURES` a photo at most, matched where geotags and gimbals say, and placed by them;
    otherwise every feature with every other, and placed by a mapper. again: guided by the block of the level before."""

    name: str
    stage: str
    neighbours: int
    guided: bool = False
    again: bool = False


def levels_of(neighbours: int, guidable: bool) -> list[Level]:
    """The levels that a block may take, the cheapest first. guidable: :func:`.prior_knowledge.can_guide`."""
    full = Level("full", "without a guide", neighbours)
    if not guidable:
        return [full]
    guided = Level("guided", "guided by geotags and gimbals", min(neighbours, GUIDED_NEIGHBOURS), True)
    return [guided, Level("fine", "guided by the block so far", neighbours, True, True), full]


def better(level: Level, report: dict[str, Any], former: dict[str, Any]) -> bool:
    """Whether a level's block is better than the one of a level before: more photos, or as many from more guided
    matches. How sure it is of its poses does not tell: more matches in moving crowns are less alike, and where the
    ground placed photos they are no gain."""
    return report["registered"] >= former["registered"] + (not level.guided or former["placed_by_ground"] > 0)


def not_enough(level: Level, report: dict[str, Any]) -> str:
    """Why the block of this report is not good enough yet, empty where it is. Where crowns move, poses do not become
    surer without a guide, and single photos are not placed without one either: after ``again`` only the photos count,
    and a few may be missing; where the ground placed some, what is left in the photos and ties them does not count."""
    missing = report["photos"] - report["registered"]
    median, worst, left = report["poses_px_median"], report["poses_px_worst"], report["reprojection_rms_px"]
    few = 1 - PLACED_SHARE if level.again else MISSING_SHARE
    of_crowns = report["left_out_by_ground"] if report["registered"] >= GROUND_SHARE * report["photos"] else 0
    if missing - of_crowns > few * report["photos"]:
        return f"{missing} of {report['photos']} photos are not placed"
    if report["confirmed"] < CONFIRMED_SHARE * report["registered"]:
        return f"{report['confirmed']} of {report['registered']} placed photos are confirmed by the others' points"
    if level.again:
        return ""
    if median is None or worst is None:
        return "how sure the poses are is not known"
    if median > SURE_MEDIAN_PX or worst > SURE_WORST_PX:
        return (
            f"poses are sure to {median:.2f} px (the worst {worst:.2f} px), wanted {SURE_MEDIAN_PX:g} px "
            f"({SURE_WORST_PX:g} px)"
        )
    if report["placed_by_ground"]:
        return ""
    if left > LEFT_PX:
        return f"{left:.2f} px are left in the photos, wanted {LEFT_PX:g} px"
    if report["points_per_photo_median"] < TIED_POINTS or report["track_length"] < TIED_TRACK:
        return (
            f"photos are tied by {report['points_per_photo_median']:.0f} points (median) that "
            f"{report['track_length']:.1f} photos show"
        )
    return ""


@dataclass(frozen=True)
class Work:
    """One reconstruction, whatever the level."""

    stations: Stations
    options: ReconstructOptions
    survey: Survey
    sfm_folder: Path

    @property
    def threads(self) -> int:
        """Processor threads that it may use."""
        return self.options.threads or available_threads()

    @property
    def cache_root(self) -> Path:
        """Folder with the caches of reconstructions that go on."""
        return self.sfm_folder.parent / "cache"

    @property
    def cache(self) -> Path:
        """Where features and matches are kept while the work goes on."""
        key = fingerprint(self.stations.paths) + f"-{self.options.max_features}-{self.options.max_image_size}"
        return self.cache_root / f"sfm-{key}"


def reconstruct_photos(
    stations: Stations,
    options: ReconstructOptions,
    sfm_folder: Path,
    reporter: Reporter | None = None,
    control: ControlPoints | None = None,
    calibration_file: Path | None = None,
) -> dict[str, Any]:
    """Structure from motion in the project CRS; writes ``sfm_folder`` and returns its report.

    stations: from :func:`~treedgs_geo.geotags.reading.read_stations`. sfm_folder: replaced as a whole on success;
    features and matches are kept in ``cache/`` beside it while the work goes on, so that a stopped run resumes.
    control: ground control and check points. calibration_file: ``camera.json`` of an earlier reconstruction with this
    camera.

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
    work = Work(stations, options, survey_of(stations, control, calibration_file), sfm_folder)
    levels = levels_of(options.neighbours, work.survey.can_guide)
    level, joined, report, climbed = climb(work, levels, reporter)
    report |= {"seconds": round(time.monotonic() - began, 1), "level": level.name, "climbed_because": climbed}
    survey = work.survey
    record = calibration_record(read_photo(stations.paths[0]).model, joined.block.sensor, report["lens_sd"])
    save_model(sfm_folder, joined.block, stations.names, stations.paths, stations.flight, survey.frame, report, record)
    shutil.rmtree(work.cache, ignore_errors=True)
    if not any(work.cache_root.iterdir()):
        work.cache_root.rmdir()
    return report


def climb(work: Work, levels: list[Level], reporter: Reporter) -> tuple[Level, Joined, dict[str, Any], str]:
    """The first level whose block is good enough, or else the best; its block and report; why others were not."""
    found: tuple[Level, Joined, dict[str, Any], Collector] | None = None
    reasons, at = list[str](), 0.0
    for level in levels:
        former = found[1] if found else None
        if level.again and kept_poses(former, work.survey) is None:
            continue
        if found and not level.guided and found[2]["registered"] >= FULL_BELOW * found[2]["photos"]:
            break  # no block without a guide is better
        if reasons:
            reporter.info(f"Photos are matched anew, {level.stage}: {reasons[-1]}.")
        held, is_last = Collector(reporter, held=True), level is levels[-1]
        end = 1.0 if is_last else at + FIRST_PART * (1 - at)
        with reporter.stage(level.stage, at, end):
            try:
                joined, report = at_level(work, level, held, former)
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


def at_level(
    work: Work, level: Level, reporter: Reporter, former: Joined | None = None
) -> tuple[Joined, dict[str, Any]]:
    """The block at one level, and its report. former: of the level before, whose poses are kept where they are sure.

    Raises:
        ReconstructionError: as :func:`reconstruct_photos`.
    """
    stations, options, survey = work.stations, work.options, work.survey
    cache, timing, began = work.cache, dict[str, float](), time.monotonic()
    cache.mkdir(parents=True, exist_ok=True)
    database = cache / "matches.db"

    def timed(name: str) -> None:
        timing[name] = round(time.monotonic() - began - sum(timing.values()), 1)

    with reporter.stage("features", 0.0, 0.30):
        most = min(options.max_features, GUIDED_FEATURES) if level.guided else options.max_features
        store = FeatureStore(
            extract(stations.paths, most, options.max_image_size, work.threads, cache / "features", reporter)
        )
    timed("features")
    camera = survey.calibration.camera
    half_field = 0.5 * max(camera.width, camera.height) / survey.calibration.focal_px
    pairs = select_pairs(survey.known.xyz, survey.rotations, survey.ground, half_field, level.neighbours)
    with reporter.stage("matching", 0.30, 0.75):
        if level.guided:
            guide = _guide(survey, former, level.again)
            match_guided(store, pairs, guide, options.seed, work.threads, reporter)
            guide = _as_stored(store, pairs, guide, work, reporter)
        else:
            pairs = similar_pairs(store, pairs, level.neighbours, work.threads)
            match_all(store, stations.names, pairs, camera, database, options.seed, work.threads, reporter)
    timed("matching")
    with reporter.stage("mapping", 0.75, 0.85):
        if (kept := kept_poses(former, survey, level.again)) is not None:
            placement = kept
        elif level.guided:
            start = place_by_gimbal(camera, survey.known.xyz, guide.rotations)
            placement = from_gimbal(start, store, survey.known, survey.sensor)
        else:
            placement = place_photos(database, cache, stations, survey, store, options.seed)
    timed("mapping")
    with reporter.stage("adjustment", 0.85, 1.0):
        joined = join_photos(placement, store, stations, survey, reporter)
    timed("adjustment")
    report = check_block(joined, stations, survey.calibration, survey.readout, reporter)
    matches = int(sum(len(m) for m in store.matches.values()))
    return joined, report | {"stage_seconds": timing, "pairs": len(pairs), "matches": matches}


def kept_poses(former: Joined | None, survey: Survey, all_poses: bool = False) -> Placement | None:
    """The sure poses of a block, or all that it has, the other photos by geotag and gimbal; ``None`` where too few are
    sure for a start."""
    if former is None:
        return None
    sure = _sure(former)
    if sure.sum() < max(3, KEPT_SHARE * len(sure)):
        return None
    kept = former.block.is_posed if all_poses else sure
    start = place_by_gimbal(former.block.camera, survey.known.xyz, _gimbal(survey, former))
    return replace(
        start,
        rotations=np.where(kept[:, None, None], former.block.rotations, start.rotations),
        translations=np.where(kept[:, None], former.block.translations, start.translations),
        mapped=kept,
    )


def _sure(joined: Joined) -> np.ndarray:
    """(N,) bool: photos whose poses are sure enough to guide the next level."""
    with np.errstate(invalid="ignore"):
        return joined.block.is_posed & (posterior_of(joined.adjusted).poses_px <= SURE_WORST_PX)


def _as_stored(store: FeatureStore, pairs: np.ndarray, guide: Guide, work: Work, reporter: Reporter) -> Guide:
    """The guide with pictures turned by half against their gimbal, as cameras and programs store them upright, where
    more of their features match so; the matches, too. Asked are photos whose gimbal rolled over, then those that match
    no other one half as well as the median photo does."""

    def of_photos(how: np.ufunc, matches: dict[tuple[int, int], np.ndarray]) -> np.ndarray:
        """(N,) the matches of each photo's pairs, together or at most."""
        found = np.zeros(len(guide.centres), int)
        for pair, rows in matches.items():
            how.at(found, list(pair), len(rows))
        return found

    def turned(asked: np.ndarray, again: np.ndarray) -> tuple[Guide, dict[tuple[int, int], np.ndarray], np.ndarray]:
        """With the photos ``asked`` turned: the guide, matches of the pairs ``again``, and who matches better."""
        rotations = np.where(asked[:, None, None], HALF_TURN @ guide.rotations, guide.rotations)
        other, known = replace(guide, rotations=rotations), store.matches
        match_guided(store, again, other, work.options.seed, work.threads, reporter)
        found, store.matches = store.matches, known
        before = {pair: known[pair] for pair in map(tuple, again.tolist()) if pair in known}
        return other, found, asked & (of_photos(np.add, found) > of_photos(np.add, before))

    for weak in (False, True):
        best = of_photos(np.maximum, store.matches)
        asked = best < WEAK_SHARE * np.median(best) if weak else np.abs(work.stations.roll_deg) > OVERHEAD_DEG
        if asked.any():  # a few pairs tell most
            count = np.array([len(store.matches.get(pair, ())) for pair in map(tuple, pairs.tolist())])
            own = [np.flatnonzero((pairs == i).any(axis=1)) for i in np.flatnonzero(asked)]
            few = np.unique(
                np.concatenate([rows[np.argsort(-count[rows], kind="stable")[:TRIED_PAIRS]] for rows in own])
            )
            asked = turned(asked, pairs[few])[2]
        while asked.any():
            other, found, better = turned(asked, pairs[asked[pairs].any(axis=1)])
            if (asked == better).all():
                kept = {pair: rows for pair, rows in store.matches.items() if not asked[list(pair)].any()}
                guide, store.matches = other, kept | found
                reporter.info(f"The pictures of {asked.sum()} photos are turned by 180 degrees against their gimbal.")
                break
            asked = better
    return guide


def _guide(survey: Survey, former: Joined | None = None, again: bool = False) -> Guide:
    """Features lie between somewhat below the take-off point and the tops of the crowns. former: a block, which
    tells how pictures are stored; ``again``: and whose sure poses say more than gimbals do."""
    low = survey.ground - LOW_SHARE * survey.height
    high = survey.ground + min(CROWNS_M, 0.5 * survey.height)
    baseline_sd_m = 2**0.5 * float(np.nanmedian(survey.known.sd[:, :2]))
    guide = Guide(
        _gimbal(survey, former), survey.known.xyz, survey.calibration.camera, low, high, baseline_sd_m=baseline_sd_m
    )
    if former is None or not again:
        return guide
    return guide.finer(former.block.rotations, former.block.centres, former.block.camera, _sure(former))


def _gimbal(survey: Survey, former: Joined | None) -> np.ndarray:
    """(N, 3, 3) what the gimbals say, of pictures as they are stored where a block tells that."""
    return survey.rotations if former is None or former.known.gimbal is None else former.known.gimbal
