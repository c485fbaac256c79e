"""``measure-dbh``: DBH of stems that are already segmented."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import param
from ..run.cloud_input import load_ground, read_checked, tree_summary
from ..run.settings import CloudSettings
from ..stems.cloud.estimate.options import MeasureOptions


@dataclass(frozen=True, kw_only=True)
class MeasureDbhSettings(MeasureOptions, CloudSettings):
    """Options of ``measure-dbh``."""

    output: Path = param(kind="output_file", help="tree layer", suffixes=("gpkg", "shp", "geojson", "csv"))
    id_field: str = param("tree_id", help="dimension of the cloud that holds the tree ids")


def run(settings: MeasureDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, measure, write."""
    import numpy as np

    from ..core.errors import InputError
    from ..inventory.tree_layer import check_output, write_trees
    from ..pointcloud.file_crs import LOCAL_CRS
    from ..run.cloud import with_remarks
    from ..stems.cloud.estimate.cloud import measure_stems
    from ..stems.cloud.estimate.foot import with_ground
    from ..stems.cloud.estimate.sections import stem_sections
    from ..stems.quality.ground import with_ground_error

    check_output(settings.output)
    with reporter.stage("read cloud", 0.0, 0.15):
        cloud = read_checked(settings.input, settings.crs, reporter, find_stems=False, dtm=settings.dtm)
    if settings.id_field not in cloud.attributes:
        raise InputError(
            f"{settings.input}: has no dimension {settings.id_field!r} (it has: {', '.join(cloud.attributes)}); "
            "run segment-stems first, or name the dimension with --id-field."
        )
    tree_id = np.asarray(cloud.attributes[settings.id_field]).astype(np.int64)
    kept = settings.dtm is None and "height_m" in cloud.attributes
    with reporter.stage("ground", 0.15, 0.3):
        ground = _ground_from_heights(cloud) if kept else load_ground(settings, cloud, reporter)
    with reporter.stage("measure stems", 0.3, 0.95):
        trees = measure_stems(cloud, tree_id, ground.dtm, settings, reporter)
    if kept and "ground_se_m" in cloud.attributes:
        se_m = np.asarray(cloud.attributes["ground_se_m"], float)
        trees = [with_ground_error(tree, float(se_m[tree_id == tree.tree_id].max()), "points") for tree in trees]
    else:
        trees = with_ground(trees, ground, cloud.xyz)
    trees = with_remarks(trees, cloud, ground, reporter)
    sections = stem_sections(cloud.xyz, tree_id, trees)
    write_trees(settings.output, trees, cloud.horizontal_crs or LOCAL_CRS, sections, reporter)
    return {"output": str(settings.output), **tree_summary(trees, reporter)}


def _ground_from_heights(cloud: Any) -> Any:
    """The ground that ``segment-stems`` used, rebuilt from the heights it wrote beside each point."""
    import numpy as np

    from ..terrain.cloud_ground import CloudGround
    from ..terrain.surface import grid_ground

    height = np.asarray(cloud.attributes["height_m"], float)
    known = np.isfinite(height)
    foot = cloud.xyz[known].copy()
    foot[:, 2] -= height[known]
    origin = np.floor(foot.min(axis=0))
    grid = grid_ground(
        foot[:: max(len(foot) // 200_000, 1)] - origin,
        0.25,
        neighbours=12,
        bandwidth_m=0.3,
        noise_m=0.02,
        reach_m=3.0,
        crs=cloud.horizontal_crs,
    )
    dtm = grid.moved(origin)
    return CloudGround(dtm, dtm)


COMMAND = Command(
    name="measure-dbh",
    qgis_id="measuredbh",
    title="Measure DBH of segmented stems",
    group="5 Steps and research",
    summary="Measure the DBH of stems whose points carry tree ids.",
    help=(
        "Takes a cloud with a tree-id dimension (segment-stems, or another segmenter with --id-field) and writes one "
        "point a tree: DBH with its standard error and 90 % interval in cm, at breast height above the ground at the "
        "stem. --method paper gives the published estimator (solid circles, taper RANSAC; with --fit cylinder the "
        "published cylinder); the default fits a leaning, tapering stem to the bark points. A stem that cannot be "
        "measured stays in the layer with qc_flag=reject and the reason."
    ),
    settings=MeasureDbhSettings,
    run=run,
    main=("input", "dtm", "crs", "weights", "fit", "bh_m", "output"),
    example="treedgs measure-dbh --input stems.laz --dtm dtm.tif --output trees.gpkg",
    outputs={
        "output": "tree layer",
        "n_trees": "stems in the layer",
        "n_measured": "stems with a DBH",
        "n_ok": "without remark",
        "n_check": "to check",
        "n_reject": "refused",
        "mean_dbh_cm": "mean DBH, cm",
    },
)
