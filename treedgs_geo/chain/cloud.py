"""From a point cloud to the tree layer."""

from __future__ import annotations

from typing import Any

from ..core.files import ensure_writable
from ..core.progress import Reporter
from ..from_points.measuring.cloud import measure_cloud, point_weights
from ..from_points.measuring.foot import with_ground
from ..inventory.circle_layers import stem_slices
from ..inventory.tree_layer import check_output, write_trees
from ..pointcloud.file_crs import LOCAL_CRS
from ..pointcloud.files import write_cloud
from ..trees.odd_heights import mark_odd_heights
from .cloud_input import load_cloud, load_ground, tree_summary
from .cloud_plots import RunLog, cut_to_plots, trees_in_plots, write_cloud_report
from .settings import PointcloudToDbhSettings


def run_cloud_chain(settings: PointcloudToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, find stems, measure, write."""
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
