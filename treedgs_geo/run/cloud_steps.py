"""The steps of a cloud one by one: the verbs ``terrain``, ``segment-stems`` and ``measure-dbh``.

They read the cloud and find its ground as :mod:`treedgs_geo.run.cloud` does. What writes points copies the file piece
by piece, so that a large cloud, of which only a part is held, is written whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyproj

from ..core.errors import InputError
from ..core.field_stems import FieldStems, read_field_stems
from ..core.files import ensure_writable
from ..core.map_scale import zone_hint
from ..core.progress import Collector, Reporter
from ..core.tables import write_csv
from ..inventory.tree_layer import check_output, style_raster, write_trees
from ..pointcloud.cloud import PointCloud, usable
from ..pointcloud.files import check_cloud_output
from ..pointcloud.stream import copy_cloud
from ..stems.cloud.estimate.cloud import measure_stems
from ..stems.cloud.estimate.foot import stem_feet, stem_ground_se, with_ground
from ..stems.cloud.estimate.sections import stem_sections
from ..stems.cloud.propose.external_programs import check_segmenter, segment_external
from ..stems.cloud.propose.field_stems import FAR_M, FIELD_MATCH_M, Answer, answer_stems, named
from ..stems.cloud.propose.labelling import Labeller
from ..stems.cloud.propose.segment import StemMap, find_stems
from ..stems.quality.ground import with_ground_error
from ..stems.quality.reasons import explain
from ..terrain.cloud_ground import CloudGround
from ..terrain.credibility import GroundLayer
from ..terrain.dtm import Dtm, write_dtm
from ..terrain.ground import dtm_from_cloud, height_above_ground
from ..terrain.surface import grid_ground
from .cloud import GROUND, MEASURED_BY, READ, CloudJob, run_cloud_stages, with_remarks
from .cloud_input import tree_summary
from .stage import Stage

if TYPE_CHECKING:
    from ..verbs.measure_dbh import MeasureDbhSettings
    from ..verbs.segment_stems import SegmentStemsSettings
    from ..verbs.terrain import TerrainSettings

#: Points a square metre from which ground has to stand out somewhere; most airborne clouds have fewer.
DENSE_M2 = 20.0
#: Points this near the terrain are ground in ``stem_class``, metres.
GROUND_M = 0.12
#: What ``segment-stems`` writes beside each point.
STEM_DIMENSIONS = {"tree_id": "int32", "height_m": "float32", "stem_class": "uint8", "ground_se_m": "float32"}


# --- terrain ----------------------------------------------------------------------------------------------------------


def run_terrain(settings: TerrainSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, grid, write; returns the result of ``terrain``.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    ensure_writable(settings.output)
    if settings.ground_points is not None:
        check_cloud_output(settings.ground_points)
    job = CloudJob(settings, reporter, (), find_stems=False)
    run_cloud_stages((READ, Stage("terrain", 0.5, _terrain), Stage("write", 0.2, _write_terrain)), job)
    return job.result


def _terrain(job: CloudJob, reporter: Reporter) -> None:
    asked, cloud, known = job.settings, job.cloud, None
    if asked.use_classes:
        known = cloud.attributes.get("classification", np.zeros(len(cloud))) == 2
        if not known.any():
            raise InputError(f"{asked.input}: has no ground class (2), expected by --use-classes; leave it out.")
    dtm = dtm_from_cloud(cloud.xyz, asked.resolution_m, asked, cloud.crs, ground=known)
    job.ground = CloudGround(dtm, own=dtm)
    if known is None:
        # A dense cloud in which no ground stands out has lost it: the model runs through the feet of what is left.
        layer = GroundLayer.of(cloud.xyz, dtm)
        if len(cloud) > DENSE_M2 * layer.area_m2 and not layer.seen(layer.places()).any():
            reporter.warn(
                f"{asked.input}: shows no ground surface (its lowest metres may have been clipped or filtered out): "
                "the terrain model runs through the lowest points that are left, do not measure heights or diameters "
                "above it."
            )


def _write_terrain(job: CloudJob, reporter: Reporter) -> None:
    asked, cloud, dtm = job.settings, job.cloud, job.ground.dtm
    if asked.ground_points is not None:

        def classify(xyz: np.ndarray, read: Callable[[str], np.ndarray]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
            height = height_above_ground(xyz, dtm)
            classes = _classes(read("classification"), np.abs(height) <= asked.ground_m)
            return job.extent.holds(xyz), {"classification": classes, "height_m": height.astype(np.float32)}

        copy_cloud(asked.input, asked.ground_points, classify, {"height_m": "float32"}, cloud.crs)
    write_dtm(asked.output, dtm)
    style_raster(asked.output)
    n_ground = int(np.count_nonzero(np.abs(height_above_ground(cloud.xyz, dtm)) <= asked.ground_m))
    assert dtm.support is not None
    covered, support = float(np.isfinite(dtm.heights).mean()), float(np.nanpercentile(dtm.support, 95))
    reporter.info(
        f"{100 * n_ground / len(cloud):.0f} % of the points are ground; the model covers "
        f"{100 * covered:.0f} % of the extent; 95 % of it lies within {support:.1f} m of a ground point."
    )
    job.result = {
        "output": str(asked.output),
        "n_points": len(cloud),
        "n_ground": n_ground,
        "covered_pct": round(100 * covered, 1),
        "support_p95_m": round(support, 2),
        "ground_points": str(asked.ground_points) if asked.ground_points else None,
    }


def _classes(before: np.ndarray, ground: np.ndarray) -> np.ndarray:
    """The file's classes with our ground as class 2; noise stays noise, former ground becomes unclassified."""
    classes = np.array(before, np.uint8)
    noise = np.isin(classes, (7, 18))
    classes[classes == 2] = 1
    classes[ground & ~noise] = 2
    return classes


# --- segment-stems ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SegmentedStems:
    """Stems of ``segment-stems``. label: tree ids of the file's next usable points, from their xyz and heights above
    the ground. count: of the stems. source: settings used, or the segmenter. ids: (K,) of trees with points, ascending.
    ground_se_m: (K,) standard error of the ground under them, metres."""

    label: Callable[[np.ndarray, np.ndarray], np.ndarray]
    count: int
    source: str
    ids: np.ndarray
    ground_se_m: np.ndarray


def run_segment_stems(settings: SegmentStemsSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, find stems, write; returns the result of ``segment-stems``.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    ensure_writable(settings.output)
    check_cloud_output(settings.output)
    check_segmenter(settings.segmenter, settings.segmenter_command)
    own = settings.segmenter == "own"
    if settings.field_stems is not None and not own:
        raise InputError(f"--field-stems guides our own segmenter, not {settings.segmenter}; leave one of the two out.")
    job = CloudJob(settings, reporter, MEASURED_BY if own else None)
    run_cloud_stages((READ, GROUND, Stage("find stems", 0.55, _find_stems), Stage("write", 0.15, _write_stems)), job)
    return job.result


def _find_stems(job: CloudJob, reporter: Reporter) -> None:
    asked, cloud = job.settings, job.cloud
    height = height_above_ground(cloud.xyz, job.ground.dtm)
    if asked.segmenter != "own":
        tree_id = segment_external(cloud, asked.segmenter, asked.segmenter_command, reporter)
        label, count, source = _in_order(tree_id), int(tree_id.max()), asked.segmenter
    else:
        given = read_places(asked.field_stems, cloud.horizontal_crs, job.low[:2], job.high[:2])
        stems = find_stems(cloud, job.ground.dtm, asked, reporter, None if given is None else given.xy, height)
        names, job.result = name_stems(stems, given, asked.output, reporter)
        count, source = int((names > 0).sum()), stems.sensor
        label = partial(_named, Labeller(stems), names)
        tree_id = label(cloud.xyz, height)
    ids, feet, radius_m = stem_feet(cloud.xyz, tree_id, height)
    job.stems = SegmentedStems(label, count, source, ids, stem_ground_se(job.ground, feet, radius_m, cloud.xyz))


def _named(labeller: Labeller, names: np.ndarray, xyz: np.ndarray, height: np.ndarray) -> np.ndarray:
    return names[labeller(xyz, height)]


def _in_order(tree_id: np.ndarray) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Gives (N,) ids out piece by piece, in the order of the points that they were made for."""
    given = 0

    def label(xyz: np.ndarray, _height: np.ndarray) -> np.ndarray:
        nonlocal given
        given += len(xyz)
        return tree_id[given - len(xyz) : given]

    return label


def _write_stems(job: CloudJob, reporter: Reporter) -> None:
    asked, stems, n_points = job.settings, job.stems, 0
    everything = asked.keep_all or not stems.count

    def label(xyz: np.ndarray, read: Callable[[str], np.ndarray]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        nonlocal n_points
        flags = {name: read(name) for name in ("classification", "withheld")}
        near = job.extent.holds(xyz)
        good = near & usable(PointCloud(xyz, attributes=flags))
        height = height_above_ground(xyz[good], job.ground.dtm)
        own = stems.label(xyz[good], height)
        se_m = np.zeros(len(own))
        if len(stems.ids):
            se_m = np.where(own > 0, stems.ground_se_m[np.searchsorted(stems.ids, own).clip(max=len(stems.ids) - 1)], 0)
        kind = np.where(own > 0, 2, np.where(np.abs(height) < GROUND_M, 1, 0))  # stem (or whole tree), ground, other
        n_points += int(np.count_nonzero(own))
        added = {}
        for name, values in (("tree_id", own), ("height_m", height), ("stem_class", kind), ("ground_se_m", se_m)):
            added[name] = np.zeros(len(xyz), STEM_DIMENSIONS[name])  # noise is nothing, at no height
            added[name][good] = values
        return near if everything else added["tree_id"] > 0, added

    copy_cloud(asked.input, asked.output, label, STEM_DIMENSIONS, job.cloud.crs)
    if not stems.count:
        reporter.warn("No stem was found: the file holds all points with tree_id 0.")
    reporter.info(f"{stems.count} stems, {n_points:,} stem points ({stems.source} settings).")
    found = {"n_stems": stems.count, "n_stem_points": n_points, "source": stems.source}
    job.result = {"output": str(asked.output), **found, **job.result}


# --- measure-dbh ------------------------------------------------------------------------------------------------------


def run_measure_dbh(settings: MeasureDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, measure, write; returns the result of ``measure-dbh``.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    check_output(settings.output)
    job = CloudJob(settings, reporter, None, find_stems=False)
    run_cloud_stages((READ, replace(GROUND, run=_ground_of_stems), Stage("measure stems", 0.7, _measure)), job)
    return job.result


def _ground_of_stems(job: CloudJob, reporter: Collector) -> None:
    asked, there = job.settings, job.cloud.attributes
    if asked.id_field not in there:
        raise InputError(
            f"{asked.input}: has no dimension {asked.id_field!r} (it has: {', '.join(there)}); "
            "run segment-stems first, or name the dimension with --id-field."
        )
    job.tree_id = np.asarray(there[asked.id_field]).astype(np.int64)
    if asked.dtm is None and "height_m" in there:
        dtm = _dtm_of_heights(job.cloud)
        job.ground = CloudGround(dtm, dtm)
    else:
        GROUND.run(job, reporter)


def _measure(job: CloudJob, reporter: Reporter) -> None:
    asked, cloud, tree_id = job.settings, job.cloud, job.tree_id
    trees = measure_stems(cloud, tree_id, job.ground.dtm, asked, reporter)
    if asked.dtm is None and {"height_m", "ground_se_m"} <= set(cloud.attributes):
        se_m = np.asarray(cloud.attributes["ground_se_m"], float)
        trees = [with_ground_error(tree, float(se_m[tree_id == tree.tree_id].max()), "points") for tree in trees]
    else:
        trees = with_ground(trees, job.ground, cloud.xyz)
    trees = with_remarks(trees, cloud, job.ground, reporter)
    write_trees(asked.output, trees, job.crs, stem_sections(cloud.xyz, tree_id, trees), reporter)
    job.result = {"output": str(asked.output), **tree_summary(trees, reporter)}


def _dtm_of_heights(cloud: PointCloud) -> Dtm:
    """The ground that ``segment-stems`` used, rebuilt from the heights it wrote beside each point."""
    height = np.asarray(cloud.attributes["height_m"], float)
    known = np.isfinite(height)
    foot = cloud.xyz[known].copy()
    foot[:, 2] -= height[known]
    origin = np.floor(foot.min(axis=0))
    some = foot[:: max(len(foot) // 200_000, 1)] - origin
    grid = grid_ground(some, 0.25, neighbours=12, bandwidth_m=0.3, noise_m=0.02, reach_m=3.0, crs=cloud.horizontal_crs)
    return grid.moved(origin)


#: What is said of field stems that were not found, by their answer.
_NOT_FOUND = {
    "unsure": "have a stem near that may be another's",
    "refused": "are seen, but cannot be measured",
    "missing": "were not found at their places",
}


def read_places(path: Path | None, crs: pyproj.CRS | None, low: np.ndarray, high: np.ndarray) -> FieldStems | None:
    """The field stems in the cloud's CRS, ``None`` without a file. low, high: (2,) corners of the cloud.

    Raises:
        InputError: none of them stands in the cloud.
    """
    if path is None:
        return None
    field = read_field_stems(path, crs)

    def inside(xy: np.ndarray) -> bool:
        return bool(((xy >= low - FIELD_MATCH_M) & (xy <= high + FIELD_MATCH_M)).all(axis=1).any())

    if not inside(field.xy):
        hint = zone_hint("; in {zone}, they would", crs, field.xy, inside)
        raise InputError(
            f"{path}: none of its {len(field.xy)} stems stands in the cloud (the first is at {field.xy[0, 0]:.1f}, "
            f"{field.xy[0, 1]:.1f}{hint}); give positions in the cloud's CRS."
        )
    return field


def name_stems(
    stems: StemMap, field: FieldStems | None, output: Path, reporter: Reporter
) -> tuple[np.ndarray, dict[str, Any]]:
    """``((S + 1,) new ids by old ones, facts)``, 0 = seen, but refused; of field stems the facts are counts and the
    table of their answers, written beside ``output``."""
    seen = np.array([False, *(stem.refused not in ("", "not_round") for stem in stems.stems)])
    ids, facts = np.cumsum(np.r_[False, ~seen[1:]]).astype(np.int32), {}
    if field is not None:
        answers = answer_stems(stems, field)
        ids = named(stems, field, answers)
        facts = _answered(field, answers, output, reporter)
    ids[seen] = 0
    if seen.any():
        reasons = ", ".join(sorted({stem.refused for stem in stems.stems} - {"", "not_round"}))
        reporter.info(f"{seen.sum()} more are seen, but cannot be measured ({reasons}); their points carry no tree_id.")
    return ids, facts


def _answered(field: FieldStems, answers: list[Answer], output: Path, reporter: Reporter) -> dict[str, Any]:
    """Says what became of each field stem; writes the table beside the output."""
    if field.counted:
        pairs = list(zip(field.names, field.ids, strict=True))
        some = ", ".join(f"{name} = {number}" for name, number in pairs[:3])
        reporter.info(f"The field stems' names are no whole numbers: tree_id counts them as in the file ({some} ...).")
    by = {kind: [one for one in answers if one.answer == kind] for kind in ("found", *_NOT_FOUND)}
    reporter.info(f"{len(by['found'])} of {len(answers)} field stems found.")
    for kind, text in _NOT_FOUND.items():
        if by[kind]:
            listed = ", ".join(f"{one.name} ({one.reason or f'{one.gap_m:.2f} m'})" for one in by[kind][:8])
            reporter.warn(f"{len(by[kind])} field stems {text}: {listed}{' ...' if len(by[kind]) > 8 else ''}.")
    far = [one for one in by["found"] if one.gap_m is not None and one.gap_m >= FAR_M]
    if far:
        listed = ", ".join(f"{one.name} ({one.gap_m:.2f} m)" for one in far[:8])
        reporter.warn(f"{len(far)} field stems are found {FAR_M:g} m off or more, check their names: {listed}.")
    rows = [
        (int(number), one.name, *xy, one.answer, one.reason, explain(one.reason), one.gap_m)
        for number, xy, one in zip(field.ids, field.xy, answers, strict=True)
    ]
    table = output.with_name(f"{output.stem}_field.csv")
    columns = ["tree_id", "name", "x", "y", "answer", "qc_reason", "why", "gap_m"]
    write_csv(table, pd.DataFrame(rows, columns=columns), float_format="%.3f")
    return {"field_table": str(table), "field_stems": {kind: len(ones) for kind, ones in by.items()}}
