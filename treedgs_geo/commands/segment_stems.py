"""``segment-stems``: which points belong to which stem."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.files import ensure_writable
from ..core.progress import Reporter
from ..core.settings import param
from ..stems.options import SegmentOptions
from .cloud_input import CloudSettings, load_cloud, load_ground


@dataclass(frozen=True, kw_only=True)
class SegmentStemsSettings(SegmentOptions, CloudSettings):
    """Options of ``segment-stems``."""

    output: Path = param(kind="output_file", help="stem points with tree_id", suffixes=("laz", "las"))
    keep_all: bool = param(False, kind="flag", help="write every point (tree_id 0 = no stem), not only stem points")


def run(settings: SegmentStemsSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, find stems, write."""
    import numpy as np

    from ..pointcloud.files import write_cloud
    from ..stems.segment import find_stems, label_points

    ensure_writable(settings.output)
    cloud = load_cloud(settings, reporter)
    dtm, _ = load_ground(settings, cloud, reporter)
    height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    with reporter.stage("find stems", 0.3, 0.85):
        stems = find_stems(cloud, dtm, settings, reporter)
        tree_id = label_points(cloud.xyz, height, stems)
    labelled = cloud.with_attribute("tree_id", tree_id).with_attribute("height_m", height.astype(np.float32))
    with reporter.stage("write", 0.85, 1.0):
        if not settings.keep_all and stems.stems:
            labelled = labelled.select(tree_id > 0)
        write_cloud(settings.output, labelled)
    if not stems.stems:
        reporter.warn("No stem was found: the file holds all points with tree_id 0.")
    reporter.info(f"{len(stems.stems)} stems, {int((tree_id > 0).sum()):,} stem points ({stems.sensor} settings).")
    return {"output": str(settings.output), "n_stems": len(stems.stems), "n_stem_points": int((tree_id > 0).sum()),
            "source": stems.sensor}


COMMAND = Command(
    name="segment-stems",
    qgis_id="segmentstems",
    title="Find stems in a point cloud",
    group="Single steps",
    summary="Find stems in a point cloud and give each point the id of its tree.",
    help=(
        "Looks in the band from 0.5 to 5 m above ground for rings (or discs, for surface points of splats) that "
        "repeat over the height, fits a leaning, tapering cone to each, keeps what is empty inside, clean outside and "
        "continuous, and follows the axis upwards. No trained weights. The output carries tree_id (0 = no stem) and "
        "height_m."),
    settings=SegmentStemsSettings,
    run=run,
    example="treedgs segment-stems --input plot.laz --dtm dtm.tif --output stems.laz",
    expert=("low_m", "high_m", "max_dbh_cm", "max_lean_deg"),
    outputs={"output": "stem points with tree_id and height_m", "n_stems": "stems found",
             "n_stem_points": "points on stems", "source": "settings used: uls, tls or splat"},
)
