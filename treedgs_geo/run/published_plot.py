"""The published route over a whole plot: dense prior -> Gaussians -> samples with opacity -> segmentation -> slices,
circles, taper. Nothing is looked for in the photos by our own search.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError
from ..core.progress import Reporter
from ..stems.cloud.estimate.cloud import measure_stems
from ..stems.cloud.estimate.options import MeasureOptions
from ..stems.cloud.propose.external_segmenters import check_segmenter, segment_other
from ..stems.cloud.propose.options import SegmentOptions
from ..stems.cloud.propose.segment import StemMap, find_stems, label_points
from ..stems.photos.fit_records import KeptFits
from ..stems.quality.priors import BREAST_HEIGHT_M
from ..stems.quality.tree import Tree
from ..stems.splats.options import SceneOptions
from ..terrain.ground import height_above_ground
from .context import Site
from .routes import Found

if TYPE_CHECKING:
    from ..pointcloud.cloud import PointCloud
    from ..stems.splats.field import GaussianField
    from ..stems.splats.on_torch.scene_report import SceneReport
    from ..stems.splats.scene_start import Box
    from .settings import PhotosToDbhSettings


def is_published(settings: PhotosToDbhSettings) -> bool:
    """The settings ask for the published route over the whole plot."""
    return settings.preset == "paper"


def check_published(settings: PhotosToDbhSettings) -> None:
    """What the published route needs and cannot do, said before anything expensive starts.

    Raises:
        InputError: an option that it has no use for; no such GPU. MissingComponentError: torch, or what a GPU needs, is
            not installed.
    """
    _check_device(settings)
    if not is_published(settings):
        used = {"dense": settings.dense is not None, "segmenter": settings.segmenter != "own"}
        used["segmenter_command"] = settings.segmenter_command is not None
        used["segmenter_model"] = settings.segmenter_model is not None
        for name, given in used.items():
            if given:
                raise InputError(
                    f"--{name.replace('_', '-')}: only the published method (--preset paper) uses it; leave it out, or "
                    "add --preset paper."
                )
        return
    if settings.fit != "auto":
        raise InputError(
            f"--fit {settings.fit}: the published method (--preset paper) has its own; leave one of the two out."
        )
    if settings.field_stems is not None:
        raise InputError(
            "--field-stems: the published method looks for no stem in the photos, so it cannot look at a given place; "
            "leave it out, or use --preset balanced."
        )
    check_segmenter(settings.segmenter, settings.segmenter_command, settings.segmenter_model)
    from ..stems.splats import on_torch  # noqa: F401  (says what to install)


def _check_device(settings: PhotosToDbhSettings) -> None:
    """A GPU is there, and the route that is asked for uses it."""
    if settings.device == "cpu":
        return
    if not is_published(settings):
        raise InputError(
            f"--device {settings.device}: only the published method fits its Gaussians there; leave it out, or add "
            "--preset paper."
        )
    from ..stems.splats.on_torch import check_device

    check_device(settings.device)


@dataclass(frozen=True, kw_only=True)
class Published:
    """What a run of the published method is asked for. scene: of the fit. dense: points to start from, else our own
    stereo. segmenter, segmenter_command, segmenter_model: as ``segment-stems`` has them. bh_m: breast height."""

    scene: SceneOptions
    dense: Path | None = None
    segmenter: str = "own"
    segmenter_command: str | None = None
    segmenter_model: Path | None = None
    bh_m: float = BREAST_HEIGHT_M

    @classmethod
    def of(cls, settings: PhotosToDbhSettings) -> Published:
        """As the chain's settings say."""
        scene = SceneOptions(
            time_limit_min=settings.time_limit,
            device=settings.device,
            seed=settings.seed,
        )
        return cls(
            scene=scene,
            dense=settings.dense,
            segmenter=settings.segmenter,
            segmenter_command=settings.segmenter_command,
            segmenter_model=settings.segmenter_model,
            bh_m=settings.bh_m,
        )


@dataclass(frozen=True)
class PublishedTrees:
    """trees: project coordinates. field: the Gaussians, local. cloud: their samples with ``opacity`` and ``n_views``,
    project coordinates. tree_id: (P,) stem of each sample, 0 = none. facts: where the start was from, how far the fit
    came, CPU seconds of each part."""

    trees: list[Tree]
    field: GaussianField
    cloud: PointCloud
    tree_id: np.ndarray
    facts: dict[str, Any]


def published_route(
    site: Site, sparse: np.ndarray, asked: Published, path: Callable[[str], Path], reporter: Reporter
) -> Found:
    """The chain's stage: ``field.ply``, ``surface.laz`` and ``stems.laz`` stay in the workspace; the facts say how far
    the fit came. sparse: as for :func:`published_trees`. path: of a file of the workspace by its name."""
    from ..pointcloud.files import write_cloud
    from ..stems.splats.ply import write_field

    made = published_trees(site, sparse, asked, reporter)
    write_field(path(names.FIELD), made.field, site.frame)
    cloud = made.cloud.with_attribute("tree_id", made.tree_id)
    write_cloud(path(names.SURFACE), cloud)
    write_cloud(path(names.STEMS), cloud.select(made.tree_id > 0))
    return Found(made.trees, KeptFits([]), made.facts)


def published_trees(site: Site, sparse: np.ndarray, asked: Published, reporter: Reporter) -> PublishedTrees:
    """The published method over a plot with cameras and ground. sparse: (M, 3) points of the reconstruction, local.

    Raises:
        InputError: nothing to start from, or nothing left to sample. MissingComponentError: torch is not installed.
    """
    from ..pointcloud.cloud import PointCloud
    from ..stems.splats.on_torch.scene_fit import fit_scene
    from ..stems.splats.options import PAPER_SAMPLING, SampleOptions
    from ..stems.splats.sample import sample_surface
    from ..stems.splats.scene_start import Box, WholePhotos

    box, clock = Box.of(site.area, site.ground), [time.process_time()]
    with reporter.stage("dense prior", 0.0, 0.1):
        points, colours, source = _prior(site, sparse, asked.dense, box, reporter)
    clock.append(time.process_time())
    with reporter.stage("fit Gaussians", 0.1, 0.8):
        photos = WholePhotos.load(site.views)
        field, report = fit_scene(photos, box, points, colours, asked.scene, reporter)
    _say(report, asked.scene, reporter)
    clock.append(time.process_time())
    with reporter.stage("sample surface", 0.8, 0.9):
        sampled = sample_surface(field, site.views, SampleOptions(seed=asked.scene.seed, **PAPER_SAMPLING), reporter)
        cloud = PointCloud(
            site.frame.to_project(sampled.xyz), site.frame.crs, {"opacity": sampled.opacity, "n_views": sampled.n_views}
        )
    clock.append(time.process_time())
    with reporter.stage("segment stems", 0.9, 0.97):
        tree_id, stems, height = _segmented(site, cloud, asked, reporter)
    clock.append(time.process_time())
    with reporter.stage("measure stems", 0.97, 1.0):
        options = MeasureOptions(
            weights="opacity", method="paper", bh_m=asked.bh_m, source="splat", seed=asked.scene.seed
        )
        trees = measure_stems(cloud, tree_id, site.dtm, options, reporter, stems=stems, height=height)
    clock.append(time.process_time())
    stages = ("dense prior", "fit Gaussians", "sample surface", "segment stems", "measure stems")
    facts = {
        "stages_cpu_s": {name: round(float(taken), 1) for name, taken in zip(stages, np.diff(clock), strict=True)},
        "prior": {"source": source, "points": len(points)},
        "published_fit": asdict(report),
        "samples": len(cloud),
        "segmented": len(trees),
    }
    return PublishedTrees(trees, field, cloud, tree_id, facts)


def _say(report: SceneReport, options: SceneOptions, reporter: Reporter) -> None:
    """How far the fit came, and what is to be known of it."""
    reporter.info(f"Gaussians over the whole plot: {report.sentence()}")
    for warning in report.warnings(options):
        reporter.warn(warning)


def _prior(
    site: Site, sparse: np.ndarray, dense: Path | None, box: Box, reporter: Reporter
) -> tuple[np.ndarray, np.ndarray, str]:
    """(M, 3) points to start from, local, (M, 3) their colours, and whose they are."""
    from ..stems.splats.scene_start import dense_prior, read_dense

    if dense is not None:
        points, colours = read_dense(dense, site.frame)
        source = dense.name
    else:
        points, colours = dense_prior(site.views, site.ground, site.area, box, reporter)
        source = "multi-view stereo"
    if colours is None:
        colours = np.full((len(points), 3), 0.5)
    # What matching the photos found stands in where stereo saw nothing.
    points = np.concatenate([points, sparse])
    colours = np.concatenate([colours, np.full((len(sparse), 3), 0.5)])
    inside = box.contains(points)
    return points[inside], colours[inside], source


def _segmented(
    site: Site, cloud: PointCloud, asked: Published, reporter: Reporter
) -> tuple[np.ndarray, StemMap | None, np.ndarray]:
    """(P,) stem of each point, 0 = none; the stems where our own segmenter found them; (P,) height above ground."""
    height = height_above_ground(cloud.xyz, site.dtm)
    if asked.segmenter != "own":
        found = segment_other(cloud, asked.segmenter, asked.segmenter_command, asked.segmenter_model, reporter)
        return found.tree_id, None, height
    stems = find_stems(cloud, site.dtm, SegmentOptions(source="splat"), reporter, height=height)
    return label_points(cloud.xyz, height, stems), stems, height
