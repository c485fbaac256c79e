"""``pointcloud-to-dbh``: ground, stems and DBH of a LAS/LAZ cloud in one go."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.files import ensure_writable
from ..core.progress import Reporter
from ..core.settings import param
from ..measure.options import MeasureOptions
from .cloud_input import CloudSettings, load_cloud, load_ground, tree_summary


@dataclass(frozen=True, kw_only=True)
class PointcloudToDbhSettings(MeasureOptions, CloudSettings):
    """Options of ``pointcloud-to-dbh``."""

    output: Path = param(kind="output_file", help="tree layer", suffixes=("gpkg", "shp", "csv"))
    dry_run: bool = param(
        False,
        kind="flag",
        help="Only check the cloud, its CRS, density and DTM, memory and disk, and foretell the time; writes nothing",
    )
    plots: Path | None = param(
        None,
        kind="file",
        help="CSV of plots: plot_id, easting, northing, radius_m (or lon, "
        "lat); only stems in them are measured, without it those of the whole cloud",
        suffixes=("csv",),
    )
    report: Path | None = param(
        None,
        kind="output_file",
        help="also write a report: map, each DBH, what the cloud did not show, cost",
        suffixes=("html",),
    )
    stems_output: Path | None = param(
        None, kind="output_file", help="also write the stem points with tree_id", suffixes=("laz", "las")
    )


def run(settings: PointcloudToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, find stems, measure, write."""
    if settings.dry_run:
        from ..chain.preflight import check_cloud

        return check_cloud(settings, reporter)
    from ..chain.cloud_plots import RunLog, cut_to_plots, trees_in_plots, write_cloud_report
    from ..inventory.circle_layers import stem_slices
    from ..inventory.tree_layer import check_output, write_trees
    from ..measure.cloud import measure_cloud, point_weights
    from ..measure.plausible import mark_odd_heights
    from ..measure.tree_ground import with_ground
    from ..pointcloud.file_crs import LOCAL_CRS
    from ..pointcloud.files import write_cloud

    check_output(settings.output)
    for beside in filter(None, (settings.stems_output, settings.report)):
        ensure_writable(beside)
    reporter = log = RunLog(reporter)
    kept = None if settings.stems_output else ("intensity", "opacity", "gps_time")
    cloud = load_cloud(settings, reporter, kept)
    plots, cloud = cut_to_plots(settings, cloud, reporter)
    point_weights(cloud, settings.weights)  # a missing attribute is told before the work, not after
    ground = load_ground(settings, cloud, reporter)
    dtm = ground.dtm
    with reporter.stage("stems", 0.3, 0.95):
        trees, tree_id = measure_cloud(cloud, dtm, settings, reporter)
    trees, tree_id = trees_in_plots(trees, tree_id, plots, reporter)
    trees = with_ground(trees, ground, cloud.xyz)
    if settings.stems_output is not None and (tree_id > 0).any():
        write_cloud(settings.stems_output, cloud.with_attribute("tree_id", tree_id).select(tree_id > 0))
    mark_odd_heights(trees, cloud, dtm, reporter)
    slices = stem_slices(cloud.xyz, tree_id, trees)
    write_trees(settings.output, trees, cloud.horizontal_crs or LOCAL_CRS, slices, reporter)
    stems_file = str(settings.stems_output) if settings.stems_output is not None and (tree_id > 0).any() else None
    summary = tree_summary(trees, reporter)
    report = write_cloud_report(settings, cloud, trees, plots, dtm, log)
    return {"output": str(settings.output), "report": report, "stems_output": stems_file, **summary}


COMMAND = Command(
    name="pointcloud-to-dbh",
    qgis_id="pointcloudtodbh",
    title="Measure DBH from a point cloud",
    group="Measure trees",
    summary="From a LiDAR cloud (drone or terrestrial) or surface points to tree points with DBH.",
    help=(
        "Finds the ground (or takes your DTM), finds the stems in the band from 0.5 to 5 m, measures each at breast "
        "height and writes the tree layer: DBH, standard error and 90 % interval in cm, lean, height where the cloud "
        "reaches the crowns, and for every stem that cannot be measured the reason. Needs about 100 points on the "
        "lower 3 m of a stem (drone LiDAR above 1,000 points/m2, or a terrestrial scan). The CRS comes from the file; "
        "give --crs where it has none ('local' for a scan without a place on the map)."
    ),
    settings=PointcloudToDbhSettings,
    run=run,
    example="treedgs pointcloud-to-dbh --input plot_uls.laz --output trees.gpkg",
    expert=("method", "min_dbh_cm", "max_dbh_cm", "max_lean_deg", "source"),
    order=("input", "plots", "dtm", "crs", "output", "report"),
    outputs={
        "output": "tree layer",
        "report": "the page to open",
        "stems_output": "stem points",
        "n_trees": "stems in the layer",
        "n_measured": "stems with a DBH",
        "n_ok": "without remark",
        "n_check": "to check",
        "n_reject": "refused",
        "mean_dbh_cm": "mean DBH, cm",
        "n_points": "points (dry run)",
        "density_pts_m2": "points a square metre (dry run)",
        "predicted_s": "foretold time, s (dry run)",
        "needed_memory_gb": "foretold memory, GB (dry run)",
        "needed_disk_gb": "foretold disk, GB (dry run)",
        "status": "verdict (dry run)",
    },
)
