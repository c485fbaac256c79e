"""``segment-stems``: which points belong to which stem."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.files import ensure_writable
from ..core.progress import Reporter
from ..core.settings import param
from ..core.shown import count_of
from ..run.cloud_input import load_ground, read_checked
from ..run.settings import CloudSettings
from ..stems.cloud.propose.options import (
    SegmentOptions,
    segmenter_command_option,
    segmenter_model_option,
    segmenter_option,
)

#: Points this near the terrain are ground in ``stem_class``, metres.
GROUND_M = 0.12


@dataclass(frozen=True, kw_only=True)
class SegmentStemsSettings(SegmentOptions, CloudSettings):
    """Options of ``segment-stems``."""

    output: Path = param(kind="output_file", help="stem points with tree_id", suffixes=("laz", "las"))
    keep_all: bool = param(False, help="write every point (tree_id 0 = no stem), not only stem points")
    field_stems: Path | None = param(
        None,
        kind="file",
        help="positions of known stems (point layer, or CSV with x, y, "
        "tree_id): they are looked for harder, and name what is found",
        suffixes=("gpkg", "shp", "geojson", "csv"),
    )
    segmenter: str = segmenter_option()
    segmenter_command: str | None = segmenter_command_option()
    segmenter_model: Path | None = segmenter_model_option()


def run(settings: SegmentStemsSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, find stems, write: a large cloud tile by tile."""
    from ..core.errors import InputError
    from ..pointcloud.files import check_cloud_output
    from ..pointcloud.tiles import is_large
    from ..stems.cloud.propose.external_segmenters import check_segmenter

    ensure_writable(settings.output)
    check_cloud_output(settings.output)
    check_segmenter(settings.segmenter, settings.segmenter_command, settings.segmenter_model)
    if settings.segmenter != "own":
        if settings.field_stems is not None:
            raise InputError(
                f"--field-stems guides our own segmenter, not {settings.segmenter}; leave one of the two out."
            )
        return _run_whole(settings, reporter)
    return _run_tiled(settings, reporter) if is_large(settings.input) else _run_whole(settings, reporter)


def _run_whole(settings: SegmentStemsSettings, reporter: Reporter) -> dict[str, Any]:
    import numpy as np

    from ..pointcloud.cloud import usable
    from ..pointcloud.files import write_cloud
    from ..stems.cloud.estimate.foot import stem_feet, stem_ground_se
    from ..stems.cloud.propose.segment import find_stems, label_points

    with reporter.stage("read cloud", 0.0, 0.15):
        everything = read_checked(settings.input, settings.crs, reporter, dtm=settings.dtm, all_points=True)
    good = usable(everything)
    cloud = everything if good.all() else everything.select(good)
    with reporter.stage("ground", 0.15, 0.3):
        ground = load_ground(settings, cloud, reporter)
    dtm = ground.dtm
    height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    answers: dict[str, Any] = {}
    with reporter.stage("find stems", 0.3, 0.85):
        if settings.segmenter != "own":
            from ..stems.cloud.propose.external_segmenters import segment_other

            command, model = settings.segmenter_command, settings.segmenter_model
            found = segment_other(cloud, settings.segmenter, command, model, reporter)
            tree_id, count, source = found.tree_id, found.n_trees, settings.segmenter
        else:
            field = _field_stems(
                settings, cloud.horizontal_crs, cloud.xyz[:, :2].min(axis=0), cloud.xyz[:, :2].max(axis=0)
            )
            places = None if field is None else field.xy
            stems = find_stems(cloud, dtm, settings, reporter, places)
            ids, answers = _named(stems, field, settings, reporter)
            tree_id, count, source = ids[label_points(cloud.xyz, height, stems)], int((ids > 0).sum()), stems.sensor
    ids, feet, radius_m = stem_feet(cloud.xyz, tree_id, height)
    se_m = _by_id(ids, stem_ground_se(ground, feet, radius_m, cloud.xyz), tree_id)
    labelled = everything
    for name, values in (
        ("tree_id", tree_id),
        ("height_m", height.astype(np.float32)),
        ("stem_class", _stem_class(tree_id, height)),
        ("ground_se_m", se_m),
    ):
        spread = np.zeros(len(everything), values.dtype)  # noise is nothing, at no height
        spread[good] = values
        labelled = labelled.with_attribute(name, spread)
    with reporter.stage("write", 0.85, 1.0):
        if not settings.keep_all and count:
            labelled = labelled.select(labelled.attributes["tree_id"] > 0)
        write_cloud(settings.output, labelled)
    return {**_summary(settings, reporter, count, int((tree_id > 0).sum()), source), **answers}


def _field_stems(settings: SegmentStemsSettings, crs: Any, low: Any, high: Any) -> Any:
    """The field stems in the cloud's CRS, ``None`` without a file; some of them have to stand in the cloud."""
    from ..core.errors import InputError
    from ..core.field_stems import read_field_stems
    from ..core.map_scale import zone_that_fits
    from ..stems.cloud.propose.field_stems import FIELD_MATCH_M

    if settings.field_stems is None:
        return None
    field = read_field_stems(settings.field_stems, crs)

    def inside(xy: Any) -> bool:
        return bool(((xy >= low - FIELD_MATCH_M) & (xy <= high + FIELD_MATCH_M)).all(axis=1).any())

    if not inside(field.xy):
        zone = zone_that_fits(crs, field.xy, inside)
        hint = f"; in EPSG:{zone.to_epsg()}, {zone.name}, they would" if zone is not None else ""
        raise InputError(
            f"{settings.field_stems}: none of its {len(field.xy)} stems stands in the cloud (the first "
            f"is at {field.xy[0, 0]:.1f}, {field.xy[0, 1]:.1f}{hint}); give positions in the cloud's CRS."
        )
    return field


def _named(stems: Any, field: Any, settings: SegmentStemsSettings, reporter: Reporter) -> tuple[Any, dict[str, Any]]:
    """New ids by old ones (0 = seen, but refused), and of field stems the counts and the table of their answers."""
    import numpy as np

    from ..stems.cloud.propose.field_stems import answer_stems, named

    ids, answers = np.arange(len(stems.stems) + 1, dtype=np.int32), []
    if field is not None:
        answers = answer_stems(stems, field)
        ids, _ = named(stems, field, answers)
    seen = np.array([False, *(stem.refused not in ("", "not_round") for stem in stems.stems)])
    ids[seen] = 0
    if field is None:
        ids[~seen] = np.arange(len(ids) - seen.sum())
    if seen.any():
        reasons = ", ".join(sorted({stem.refused for stem in stems.stems if stem.refused not in ("", "not_round")}))
        reporter.info(f"{seen.sum()} more are seen, but cannot be measured ({reasons}); their points carry no tree_id.")
    return ids, _answered(field, answers, settings, reporter) if field is not None else {}


def _answered(field: Any, answers: Any, settings: SegmentStemsSettings, reporter: Reporter) -> dict[str, Any]:
    """Says what became of each field stem; writes the table beside the output."""
    from ..stems.cloud.propose.field_stems import FAR_M

    if field.counted:
        pairs = list(zip(field.names, field.ids, strict=True))
        some = ", ".join(f"{name} = {number}" for name, number in pairs[:3])
        reporter.info(f"The field stems' names are no whole numbers: tree_id counts them as in the file ({some} ...).")
    by = {kind: [one for one in answers if one.answer == kind] for kind in ("found", "unsure", "refused", "missing")}
    reporter.info(f"{len(by['found'])} of {len(answers)} field stems found.")
    words = {
        "unsure": "have a stem near that may be another's",
        "refused": "are seen, but cannot be measured",
        "missing": "were not found at their places",
    }
    for kind, text in words.items():
        if by[kind]:
            listed = ", ".join(f"{one.name} ({one.reason or f'{one.gap_m:.2f} m'})" for one in by[kind][:8])
            reporter.warn(f"{len(by[kind])} field stems {text}: {listed}{' ...' if len(by[kind]) > 8 else ''}.")
    far = [one for one in by["found"] if one.gap_m >= FAR_M]
    if far:
        listed = ", ".join(f"{one.name} ({one.gap_m:.2f} m)" for one in far[:8])
        reporter.warn(f"{len(far)} field stems are found {FAR_M:g} m off or more, check their names: {listed}.")
    table = settings.output.with_name(f"{settings.output.stem}_field.csv")
    _write_answers(table, field, answers)
    return {"field_table": str(table), "field_stems": {kind: len(ones) for kind, ones in by.items()}}


def _write_answers(path: Path, field: Any, answers: Any) -> None:
    """One line a field stem: tree_id, name, place, answer, reason and its words, distance."""
    import pandas as pd

    from ..core.tables import write_csv
    from ..stems.quality.reasons import explain

    rows = [
        {
            "tree_id": int(number),
            "name": one.name,
            "x": xy[0],
            "y": xy[1],
            "answer": one.answer,
            "qc_reason": one.reason,
            "why": explain(one.reason),
            "gap_m": one.gap_m,
        }
        for number, xy, one in zip(field.ids, field.xy, answers, strict=True)
    ]
    write_csv(path, pd.DataFrame(rows), float_format="%.3f")


def _by_id(ids: Any, values: Any, tree_id: Any) -> Any:
    """(N,) float32: the value of each point's tree, 0 where it has none."""
    import numpy as np

    if not len(ids):
        return np.zeros(len(tree_id), np.float32)
    place = np.clip(np.searchsorted(ids, tree_id), 0, len(ids) - 1)
    return np.where(ids[place] == tree_id, np.asarray(values)[place], 0.0).astype(np.float32)


def _stem_class(tree_id: Any, height: Any) -> Any:
    """(N,) uint8: 2 = stem (of another segmenter: its whole tree), 1 = ground, 0 = anything else."""
    import numpy as np

    return np.where(tree_id > 0, 2, np.where(np.abs(height) < GROUND_M, 1, 0)).astype(np.uint8)


def _run_tiled(settings: SegmentStemsSettings, reporter: Reporter) -> dict[str, Any]:
    """The same in bounded memory: the points sorted into tiles on disk, the output copied chunk by chunk."""
    import tempfile

    import numpy as np

    from ..pointcloud.cloud import PointCloud, horizontal, usable
    from ..pointcloud.stream import copy_cloud
    from ..pointcloud.tiles import sort_into_tiles
    from ..stems.cloud.estimate.foot import USUAL_FOOT_M
    from ..stems.cloud.propose.labelling import Labeller
    from ..stems.cloud.propose.tiled import find_stems_tiled
    from ..terrain.streamed import ground_of_tiles

    with tempfile.TemporaryDirectory(dir=settings.output.parent, prefix=".tiles.") as name:
        folder = Path(name)
        with reporter.stage("read cloud", 0.0, 0.1):
            store = sort_into_tiles(settings.input, folder, settings.crs, ("opacity",), reporter, dtm=settings.dtm)
        n_tiles = count_of(len(store.tiles), "tile")
        reporter.info(f"{store.n_points:,} usable points in {n_tiles} of {store.side_m:g} m.")
        with reporter.stage("ground", 0.1, 0.4):
            dtm = (ground := ground_of_tiles(store, folder, settings.dtm, settings.z_is, reporter)).dtm
        with reporter.stage("find stems", 0.4, 0.85):
            field = _field_stems(settings, horizontal(store.crs), store.low[:2], store.high[:2])
            stems = find_stems_tiled(store, dtm, settings, reporter, None if field is None else field.xy)
            labeller = Labeller(stems)
            names, answers = _named(stems, field, settings, reporter)
            feet = np.array([stem.cone.centre(1.3) for stem in stems.stems]).reshape(-1, 2) + stems.origin
            se_m = np.r_[0.0, ground.se_m(feet, np.full(len(feet), USUAL_FOOT_M))].astype(np.float32)
        tally = np.zeros(2, int)
        everything = settings.keep_all or not (names > 0).any()

        def label(xyz: np.ndarray, read: Any) -> tuple[np.ndarray | None, dict[str, np.ndarray]]:
            good = usable(PointCloud(xyz, attributes={name: read(name) for name in ("classification", "withheld")}))
            height = np.where(good, xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1]), 0.0)  # noise is nothing, at no height
            stem_number = labeller(xyz, height)
            unsure, tree_id = se_m[stem_number], names[stem_number]
            tally[:] += len(xyz), int((tree_id > 0).sum())
            reporter.progress(min(tally[0] / max(store.n_points, 1), 1.0))
            added = {
                "tree_id": tree_id,
                "height_m": height.astype(np.float32),
                "stem_class": np.where(good, _stem_class(tree_id, height), 0).astype(np.uint8),
                "ground_se_m": unsure,
            }
            return store.near(xyz) if everything else tree_id > 0, added

        with reporter.stage("write", 0.85, 1.0):
            kinds = {"tree_id": "int32", "height_m": "float32", "stem_class": "uint8", "ground_se_m": "float32"}
            copy_cloud(settings.input, settings.output, label, kinds, store.crs)
    return {**_summary(settings, reporter, int((names > 0).sum()), int(tally[1]), stems.sensor), **answers}


def _summary(
    settings: SegmentStemsSettings, reporter: Reporter, n_stems: int, n_points: int, source: str
) -> dict[str, Any]:
    if not n_stems:
        reporter.warn("No stem was found: the file holds all points with tree_id 0.")
    reporter.info(f"{n_stems} stems, {n_points:,} stem points ({source} settings).")
    return {"output": str(settings.output), "n_stems": n_stems, "n_stem_points": n_points, "source": source}


COMMAND = Command(
    name="segment-stems",
    qgis_id="segmentstems",
    title="Find stems in a point cloud",
    group="5 Steps and research",
    summary="Find stems in a point cloud and give each point the id of its tree.",
    help=(
        "Looks in the band from 0.5 to 5 m above ground for rings (or discs, for surface points of splats) that "
        "repeat over the height, fits a leaning, tapering cone to each, keeps what is empty inside, clean outside and "
        "continuous, and follows the axis upwards. No trained weights. The output carries tree_id (0 = no stem), "
        "height_m, stem_class (0 other, 1 ground, 2 stem) and ground_se_m (how sure the ground "
        "under the tree is, 99 = not seen at all). --segmenter runs a program that you installed instead "
        "and checks that its labels belong to the points it was given. --field-stems gives known positions: near them "
        "weaker evidence is looked at, and the stems found carry the field's tree_id: pairs are one to one, as near as "
        "the positions are exact, 1 m at most. OUTPUT_field.csv answers for each: found, unsure (the stem near it may "
        "be another's), refused or missing, with the reason."
    ),
    settings=SegmentStemsSettings,
    run=run,
    main=("input", "dtm", "crs", "output", "keep_all", "field_stems"),
    example="treedgs segment-stems --input plot.laz --dtm dtm.tif --output stems.laz",
    outputs={
        "output": "stem points with tree_id and height_m",
        "n_stems": "stems found",
        "n_stem_points": "points on stems",
        "field_table": "what was found of each field stem",
        "source": "settings used: uls, tls, splat, or the segmenter",
    },
)
