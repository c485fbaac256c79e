"""``measure-dbh``: DBH of stems that are already segmented."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.command import Command, run_by
from ..core.settings import TREE_LAYERS, param
from ..run.settings import CloudSettings
from ..stems.cloud.estimate.options import MeasureOptions


@dataclass(frozen=True, kw_only=True)
class MeasureDbhSettings(MeasureOptions, CloudSettings):
    """Options of ``measure-dbh``."""

    output: Path = param(kind="output_file", help="tree layer", suffixes=TREE_LAYERS)
    id_field: str = param("tree_id", help="dimension of the cloud that holds the tree ids")


COMMAND = Command(
    name="measure-dbh",
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
    run=run_by("run.cloud_steps", "run_measure_dbh"),
    main=("input", "dtm", "crs", "weights", "fit", "bh_m", "output"),
    example="treedgs measure-dbh --input stems.laz --dtm dtm.tif --output lidar_trees.gpkg",
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
