"""From a point cloud to the tree layer: the stages, in their order."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyproj

from .. import __version__
from ..core.errors import CRSError, InputError
from ..core.files import ensure_writable
from ..core.machine import cores
from ..core.plots import Plot, plot_of, read_plots
from ..core.progress import Collector, Reporter
from ..core.workspace import peak_memory_mb
from ..inventory.report import write_report
from ..inventory.searched import not_seen, partly_searched, searched_table
from ..inventory.stand_view import view_of
from ..inventory.tree_layer import check_output, tree_table, write_trees
from ..pointcloud.cloud import PointCloud
from ..pointcloud.cloud import extent as extent_of
from ..pointcloud.file_crs import LOCAL_CRS
from ..pointcloud.survey import Extent
from ..stems.cloud.estimate.cloud import measure_cloud, point_weights
from ..stems.cloud.estimate.foot import with_ground
from ..stems.cloud.estimate.rounding import with_rounding
from ..stems.cloud.estimate.sections import stem_sections
from ..stems.quality.odd_heights import mark_odd_heights
from ..stems.quality.repeated import mark_repeated
from ..stems.quality.tree import Tree
from ..terrain.cloud_ground import CloudGround
from .cloud_input import load_ground, read_checked, tree_summary
from .cloud_sheets import make_cloud_sheets, name_run, sheets_of
from .searched import LOW_M, day_scanned, seen_in_cloud
from .settings import PointcloudToDbhSettings
from .stage import Cost, Findings, Stage, Steps, check, check_target, dry_run, run_stages
from .stand_view import cloud_crowns, show_cloud

if TYPE_CHECKING:
    import geopandas as gpd

    from .cloud_steps import SegmentedStems

#: Attributes of a cloud that measuring asks for, besides those that weigh its points.
MEASURED_BY = ("opacity", "gps_time", "point_source_id", "scan_angle", "scan_angle_rank", "return_number")
#: Points this far around a plot stay: the ground, and stems whose points reach over the edge.
MARGIN_M = 5.0
#: Core-seconds per million cloud points that are used: reading, ground, stems; and their memory, GB (measured: 0.07 and
#: 0.5 besides, from 0.8 to 26 million).
CLOUD_S_MILLION, CLOUD_GB_MILLION = 9.0, 0.1


@dataclass
class CloudJob:
    """A run over a point cloud. What was asked for; then what its stages found, in their order.

    settings: of the verb. attributes: of the points, to keep (``None`` = all, and every point of a large cloud).
    find_stems: stems are to be found. cloud: its usable points. extent: beyond it are strays. low, high: (3,) corners,
    project coordinates. plots: none = the whole cloud. tree_id: (N,) of each point, 0 = none. stems: those of
    ``segment-stems``.
    sheets: ``tree_id`` -> evidence sheet. crowns: layer of the trees' crowns. result: of the verb.
    """

    settings: Any
    reporter: Reporter
    attributes: tuple[str, ...] | None = MEASURED_BY
    find_stems: bool = True
    cloud: PointCloud = field(init=False)
    extent: Extent = field(init=False)
    low: np.ndarray = field(init=False)
    high: np.ndarray = field(init=False)
    plots: list[Plot] = field(default_factory=list)
    ground: CloudGround = field(init=False)
    trees: list[Tree] = field(default_factory=list)
    tree_id: np.ndarray = field(init=False)
    stems: SegmentedStems = field(init=False)
    sections: list[dict[str, Any]] = field(default_factory=list)
    sheets: dict[int, Path] = field(default_factory=dict)
    searched: gpd.GeoDataFrame = field(init=False)
    crowns: gpd.GeoDataFrame | None = None
    result: dict[str, Any] = field(default_factory=dict)

    @property
    def crs(self) -> pyproj.CRS:
        """Of the tree layer."""
        return self.cloud.horizontal_crs or LOCAL_CRS


# --- read cloud -------------------------------------------------------------------------------------------------------


def _check_outputs(job: CloudJob) -> None:
    for target in filter(None, (job.settings.output, job.settings.report)):
        check_target(target)


def _read_cost(job: CloudJob, findings: Findings) -> Cost:
    """Read the cloud as the run does."""
    _read(job, findings)
    span, count = job.high - job.low, len(job.cloud)
    density = count / max(float(span[0] * span[1]), 1.0)
    findings.info(f"{density:,.0f} points a square metre, heights {job.low[2]:.1f} to {job.high[2]:.1f} m.")
    if density < 300:
        findings.warn(
            f"{density:.0f} points a square metre are few: a stem needs about 100 points on its lower 3 m (drone LiDAR "
            "above 1,000 points a square metre); expect most stems to be missed or refused."
        )
    findings.facts |= {"n_points": count, "density_pts_m2": round(density, 1)}
    return Cost(
        seconds=3 + CLOUD_S_MILLION * count / 1e6 / max(min(cores(), 4) ** 0.5, 1),
        memory_gb=0.5 + CLOUD_GB_MILLION * count / 1e6,
        disk_gb=0.05,
    )


def _read(job: CloudJob, reporter: Reporter) -> None:
    asked = job.settings
    dtm = getattr(asked, "dtm", None)
    take(job, *read_checked(asked.input, asked.crs, reporter, job.attributes, job.find_stems, dtm))


def take(job: CloudJob, cloud: PointCloud, extent: Extent) -> None:
    """``cloud`` is what the job measures: checked points in ``extent``."""
    job.cloud, job.extent = cloud, extent
    job.low, job.high = extent_of(cloud.xyz)


#: Of every verb that takes a cloud.
READ = Stage("read cloud", 0.15, _read)


# --- ground -----------------------------------------------------------------------------------------------------------


def find_plots(job: CloudJob) -> None:
    """The plots that lie on the cloud; none when none were asked for.

    Raises:
        InputError: none does. CRSError: the table's coordinates cannot be brought into the cloud's CRS.
    """
    asked, low, high = job.settings, job.low, job.high
    if asked.plots is None:
        return
    try:
        plots = read_plots(asked.plots, job.crs)
    except pyproj.exceptions.ProjError:
        raise CRSError(
            f"{asked.plots}: has an epsg, but {asked.input} has no CRS to bring it into; give the "
            "cloud's with --crs, or the centres in the cloud's own metres."
        ) from None
    inside = [
        plot
        for plot in plots
        if low[0] - plot.radius_m < plot.x < high[0] + plot.radius_m
        and low[1] - plot.radius_m < plot.y < high[1] + plot.radius_m
    ]
    if not inside:
        plot = plots[0]
        raise InputError(
            f"{asked.plots}: no plot lies on {asked.input}: {plot.plot_id!r} is at x {plot.x:.1f}, "
            f"y {plot.y:.1f}, the cloud covers x {low[0]:.1f} to {high[0]:.1f}, y {low[1]:.1f} to {high[1]:.1f}; check "
            "the coordinates and their CRS (column epsg)."
        )
    if len(inside) < len(plots):
        away = [plot.plot_id for plot in plots if plot not in inside]
        job.reporter.warn(
            f"{asked.plots}: {len(away)} of {len(plots)} plots do not lie on the cloud and are left out: "
            f"{', '.join(away[:5])}{' …' if len(away) > 5 else ''}."
        )
    job.plots = inside


def cut_to_plots(job: CloudJob) -> None:
    """The cloud within :data:`MARGIN_M` of the plots; everything where no plots were given."""
    if not job.plots:
        return
    cloud, kept = job.cloud, np.zeros(len(job.cloud), bool)
    for plot in job.plots:
        kept |= _within(plot, cloud.xyz, MARGIN_M)
    if not any(_within(plot, cloud.xyz[kept], 0.0).any() for plot in job.plots):
        raise InputError(
            f"{job.settings.input}: holds no point in the plots of {job.settings.plots}; check their coordinates."
        )
    job.reporter.info(f"{int(kept.sum()):,} points in {len(job.plots)} plots and {MARGIN_M:g} m around them.")
    job.cloud = cloud.select(kept)


def _within(plot: Plot, xyz: np.ndarray, margin_m: float) -> np.ndarray:
    return np.hypot(xyz[:, 0] - plot.x, xyz[:, 1] - plot.y) <= plot.radius_m + margin_m


def _ground_cost(job: CloudJob, findings: Findings) -> Cost:
    """Find the ground as the run does."""
    try:
        _ground(job, findings)
    except InputError as refusal:
        findings.problem(str(refusal))
    return Cost()


def _ground(job: CloudJob, reporter: Reporter) -> None:
    cut_to_plots(job)
    job.ground = load_ground(job.settings, job.cloud, reporter)


#: Of every verb that takes a cloud and perhaps a terrain model.
GROUND = Stage("ground", 0.15, _ground)


# --- stems ------------------------------------------------------------------------------------------------------------


def with_remarks(trees: list[Tree], cloud: PointCloud, ground: CloudGround, reporter: Reporter) -> list[Tree]:
    """The trees with what the cloud as a whole says of them: rounded coordinates, odd heights, stems seen twice."""
    trees = with_rounding(trees, cloud.xyz, reporter)
    mark_odd_heights(trees, cloud, ground.dtm, reporter)
    if said := mark_repeated(trees):
        reporter.warn(said)
    return trees


def _stems(job: CloudJob, reporter: Reporter) -> None:
    cloud, ground, plots = job.cloud, job.ground, job.plots
    trees, tree_id = measure_cloud(cloud, ground.dtm, job.settings, reporter)
    if plots:
        for tree in trees:
            tree.plot_id = plot_of(plots, tree.x, tree.y)
        inside = [tree for tree in trees if tree.plot_id is not None]
        if len(inside) < len(trees):
            reporter.info(f"{len(trees) - len(inside)} stems stand outside the plots and are left out.")
        if trees and not inside:
            reporter.warn("All stems found stand outside the plots; check the plot centres.")
        trees, tree_id = inside, np.where(np.isin(tree_id, [tree.tree_id for tree in inside]), tree_id, 0)
    job.trees = with_remarks(with_ground(trees, ground, cloud.xyz), cloud, ground, reporter)
    job.tree_id = tree_id
    name_run(job)
    job.sections = stem_sections(cloud.xyz, tree_id, job.trees)


STEMS = Stage("stems", 0.65, _stems)


# --- sheets, write ----------------------------------------------------------------------------------------------------


SHEETS = Stage("sheets", 0.04, make_cloud_sheets)


def _write(job: CloudJob, reporter: Reporter) -> None:
    asked, cloud = job.settings, job.cloud
    seen, day = seen_in_cloud(cloud.xyz, job.ground.dtm), day_scanned(asked.input, cloud.attributes.get("gps_time"))
    job.searched = searched_table(seen, job.plots, job.crs, day)
    reporter.tell(partly_searched(job.searched, f"elsewhere the cloud holds no point in the lowest {LOW_M:g} m"))
    try:
        job.crowns = cloud_crowns(job)
    except Exception as problem:  # the trees are measured
        reporter.warn(f"No crowns: {problem}")
    more = {"sheets": sheets_of(asked.output), "searched": job.searched, "crowns": job.crowns}
    write_trees(asked.output, job.trees, job.crs, job.sections, reporter, **more)
    summary = tree_summary(job.trees, reporter)
    job.result = {"output": str(asked.output), "report": None, **summary}


WRITE = Stage("write", 0.01, _write)

STAGES = (
    replace(READ, checks=(_check_outputs,), cost=_read_cost),
    replace(GROUND, checks=(find_plots, lambda job: point_weights(job.cloud, job.settings.weights)), cost=_ground_cost),
    STEMS,
    SHEETS,
    WRITE,
)


def run_cloud_stages(stages: Sequence[Stage[CloudJob]], job: CloudJob) -> Steps:
    """Do the stages; what they took.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    steps = Steps(None, job.reporter, {stage.name: stage.share for stage in stages})
    check(stages[0], job)
    run_stages(stages, job, steps)
    return steps


def run_cloud_chain(settings: PointcloudToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, find the ground, find stems, measure, write; returns the result of ``pointcloud-to-dbh``.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    began, heard = time.monotonic(), Collector(reporter)
    job = CloudJob(settings, heard, _measured_by(settings))
    check_output(settings.output)
    if settings.report is not None:
        ensure_writable(settings.report)
    steps = run_cloud_stages(STAGES, job)
    if settings.report is not None:
        whole = {"seconds": time.monotonic() - began, "peak_memory_mb": peak_memory_mb()}
        stages = {name: entry for name, entry in steps.done.items() if name != WRITE.name} | {"in all": whole}
        job.result["report"] = str(_write_report(job, settings.report, stages, heard.warnings))
    return job.result


def _measured_by(settings: PointcloudToDbhSettings) -> tuple[str, ...]:
    return (*MEASURED_BY, "intensity") if "intensity" in settings.weights else MEASURED_BY


def _write_report(job: CloudJob, path: Path, stages: dict[str, dict[str, Any]], warnings: list[str]) -> Path:
    """The page ``--report`` asks for, as ``photos-to-dbh`` writes it."""
    asked, cloud, plots = job.settings, job.cloud, job.plots
    span = np.ptp(cloud.xyz[:, :2], axis=0)
    facts = {
        "cloud": f"{asked.input.name}, {len(cloud):,} points{' in and around the plots' if plots else ''}"
        + ("" if plots else f", {len(cloud) / max(span[0] * span[1], 1.0):,.0f} a square metre"),
        "date in the file": _date(asked.input),
        "ground": str(asked.dtm) if asked.dtm else "from the cloud",
        "plot area not seen": f"{not_seen(job.searched)} holds no point in the lowest {LOW_M:g} m" if plots else "",
        "method": f"{asked.method}, {asked.fit}",
        "breast height": f"{asked.bh_m:g} m",
        "CRS": job.crs.to_string() if cloud.horizontal_crs is not None else "local metres, none",
        "TreeDGS": __version__,
    }
    facts = {name: text for name, text in facts.items() if text}
    view: Path | None = view_of(path)
    try:
        show_cloud(job, view_of(path))
    except Exception as problem:  # the trees are written
        warnings, view = [*warnings, f"No 3D view: {problem}"], None
        job.reporter.warn(warnings[-1])
    return write_report(
        path, tree_table(job.trees, job.crs), plots, facts, list(dict.fromkeys(warnings)), stages, job.sheets, view
    )


def _date(path: Path) -> str:
    """When the LAS file says that it was made; '' for others."""
    if path.suffix.lower() not in (".las", ".laz"):
        return ""
    from ..pointcloud.las_reader import open_reader

    with open_reader(path) as file:
        day = file.header.creation_date
    return day.isoformat() if day is not None else ""


def check_cloud(settings: PointcloudToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """The dry run: header, CRS, density, ground, plots. Reads inputs, writes nothing.

    Raises:
        TreeDGSError: what would end the job.
    """
    findings = Findings(reporter)
    return dry_run(STAGES, CloudJob(settings, findings, _measured_by(settings)), findings, settings.output.parent)
