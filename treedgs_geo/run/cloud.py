"""From a point cloud to the tree layer."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.files import ensure_writable
from ..core.plots import Plot
from ..core.progress import Reporter
from ..inventory.searched import partly_searched, searched_table
from ..inventory.tree_layer import check_output, write_trees
from ..pointcloud.cloud import PointCloud
from ..pointcloud.file_crs import LOCAL_CRS
from ..pointcloud.files import write_cloud
from ..stems.cloud.estimate.cloud import measure_cloud, point_weights
from ..stems.cloud.estimate.foot import with_ground
from ..stems.cloud.estimate.options import MeasureOptions
from ..stems.cloud.estimate.rounding import with_rounding
from ..stems.cloud.estimate.sections import stem_sections
from ..stems.quality.odd_heights import mark_odd_heights
from ..stems.quality.repeated import mark_repeated
from ..stems.quality.tree import Tree
from ..terrain.cloud_ground import CloudGround
from .cloud_input import load_cloud, load_ground, tree_summary
from .cloud_plots import RunLog, cut_to_plots, trees_in_plots, write_cloud_report
from .cloud_sheets import make_cloud_sheets, name_run, sheets_of
from .searched import LOW_M, day_scanned, seen_in_cloud
from .settings import PointcloudToDbhSettings

#: Attributes of a cloud that measuring may ask for.
MEASURED_BY = ("intensity", "opacity", "gps_time", "point_source_id", "scan_angle", "scan_angle_rank", "return_number")


def find_and_measure(
    cloud: PointCloud, ground: CloudGround, plots: list[Plot], options: MeasureOptions, reporter: Reporter
) -> tuple[list[Tree], np.ndarray]:
    """``(trees, (N,) tree_id)`` of a checked cloud over its ground; only trees of the plots, where there are any."""
    with reporter.stage("stems", 0.3, 0.95):
        trees, tree_id = measure_cloud(cloud, ground.dtm, options, reporter)
    trees, tree_id = trees_in_plots(trees, tree_id, plots, reporter)
    trees = with_rounding(with_ground(trees, ground, cloud.xyz), cloud.xyz, reporter)
    mark_odd_heights(trees, cloud, ground.dtm, reporter)
    if said := mark_repeated(trees):
        reporter.warn(said)
    return trees, tree_id


def run_cloud_chain(settings: PointcloudToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, find stems, measure, write."""
    check_output(settings.output)
    for beside in filter(None, (settings.stems_output, settings.report)):
        ensure_writable(beside)
    reporter = log = RunLog(reporter)
    kept = None if settings.stems_output else MEASURED_BY
    cloud = load_cloud(settings, reporter, kept)
    plots, cloud = cut_to_plots(settings, cloud, reporter)
    point_weights(cloud, settings.weights)  # a missing attribute is reported before the work, not after
    ground = load_ground(settings, cloud, reporter)
    trees, tree_id = find_and_measure(cloud, ground, plots, settings, reporter)
    if settings.stems_output is not None and (tree_id > 0).any():
        write_cloud(settings.stems_output, cloud.with_attribute("tree_id", tree_id).select(tree_id > 0))
    name_run(settings, trees)
    sections = stem_sections(cloud.xyz, tree_id, trees)
    with reporter.stage("sheets", 0.95, 0.99):
        sheets = make_cloud_sheets(settings, cloud.xyz, tree_id, trees, sections, reporter)
    crs = cloud.horizontal_crs or LOCAL_CRS
    searched = searched_table(
        seen_in_cloud(cloud.xyz, ground.dtm), plots, crs, day_scanned(settings.input, cloud.attributes.get("gps_time"))
    )
    for sentence in partly_searched(searched, f"elsewhere the cloud holds no point in the lowest {LOW_M:g} m"):
        reporter.warn(sentence)
    write_trees(settings.output, trees, crs, sections, reporter, sheets=sheets_of(settings.output), searched=searched)
    stems_file = str(settings.stems_output) if settings.stems_output is not None and (tree_id > 0).any() else None
    summary = tree_summary(trees, reporter)
    report = write_cloud_report(settings, cloud, trees, plots, searched, log, sheets)
    return {"output": str(settings.output), "report": report, "stems_output": stems_file, **summary}
