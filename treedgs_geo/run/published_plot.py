"""The published method over a whole plot: dense prior -> Gaussians -> samples with opacity -> segmentation -> slices,
circles, taper. Nothing is looked for in the photos by our own search.

The chain (``photos-to-dbh --preset paper``) and the verbs ``fit-gaussians`` and ``sample-surface`` do it by these
functions.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.crs import LocalFrame
from ..core.errors import InputError
from ..core.progress import Reporter
from ..stems.cloud.estimate.cloud import measure_stems
from ..stems.cloud.estimate.options import MeasureOptions
from ..stems.cloud.propose.labelling import Labeller
from ..stems.cloud.propose.options import SegmentOptions
from ..stems.cloud.propose.segment import find_stems
from ..stems.quality.priors import BREAST_HEIGHT_M
from ..stems.splats.options import SampleOptions, SceneOptions
from ..terrain.ground import height_above_ground
from .context import Site

if TYPE_CHECKING:
    from ..pointcloud.cloud import PointCloud
    from ..reconstruction.cameras import View
    from ..stems.quality.tree import Tree
    from ..stems.splats.field import GaussianField
    from ..stems.splats.scene_start import Box
    from .settings import PhotosToDbhSettings


def is_published(settings: PhotosToDbhSettings) -> bool:
    """The settings ask for the published route over the whole plot."""
    return settings.preset == "paper" or settings.fit in ("gaussians", "paper")


def check_published(settings: PhotosToDbhSettings) -> None:
    """What the published route needs and cannot do, said before anything expensive starts.

    Raises:
        InputError: an option that it has no use for; no such GPU. MissingComponentError: torch, or what a GPU needs, is
            not installed.
    """
    if not is_published(settings):
        used = {"device": settings.device != "cpu", "dense": settings.dense is not None}
        for name, given in used.items():
            if given:
                raise InputError(
                    f"--{name.replace('_', '-')}: only the published method (--fit gaussians, --preset paper) uses it; "
                    "leave it out, or add --preset paper."
                )
        return
    if settings.fit == "photos":
        raise InputError("--fit photos: the published method (--preset paper) has its own; leave one of the two out.")
    if settings.field_stems is not None:
        raise InputError(
            "--field-stems: the published method looks for no stem in the photos, so it cannot look at a given place; "
            "leave it out, or measure with --fit auto and another preset."
        )
    check_torch(settings.device)


def check_torch(device: str = "cpu") -> None:
    """What Gaussians need is installed.

    Raises:
        MissingComponentError: torch, or what a GPU needs, is not installed. InputError: no such GPU.
    """
    from ..stems.splats.on_torch import check_device  # says what to install

    check_device(device)


@dataclass(frozen=True, kw_only=True)
class Published:
    """What a run of the published method is asked for. scene: of the fit. dense: points to start from, else our own
    stereo. bh_m: breast height. max_dbh_cm: thicker stems are refused."""

    scene: SceneOptions
    dense: Path | None = None
    bh_m: float = BREAST_HEIGHT_M
    max_dbh_cm: float = MeasureOptions.max_dbh_cm

    @classmethod
    def of(cls, settings: PhotosToDbhSettings) -> Published:
        """As the chain's settings say."""
        scene = SceneOptions(time_limit_min=settings.time_limit, device=settings.device, seed=settings.seed)
        return cls(scene=scene, dense=settings.dense, bh_m=settings.bh_m, max_dbh_cm=settings.max_dbh_cm)


def published_route(
    site: Site, sparse: np.ndarray, asked: Published, path: Callable[[str], Path], reporter: Reporter
) -> tuple[list[Tree], dict[str, Any]]:
    """Trees of a plot with cameras and ground, and facts; ``field.ply``, ``surface.laz`` and ``stems.laz`` stay in the
    workspace.

    sparse: (M, 3) points of the reconstruction, local. path: of a file of the workspace by its name. The facts say how
    far the fit came, and the CPU seconds of each part.

    Raises:
        InputError: nothing to start from, or nothing left to sample. MissingComponentError: torch is not installed.
    """
    from ..pointcloud.files import write_cloud
    from ..stems.splats.ply import write_field

    field, facts = fit_gaussians(site, sparse, asked.scene, asked.dense, reporter, 0.8)
    write_field(path(names.FIELD), field, site.frame)
    seconds, seed = facts["stages_cpu_s"], asked.scene.seed
    with _timed(seconds, reporter, "sample surface", 0.8, 0.9):
        cloud = sample_gaussians(field, site.frame, site.views, SampleOptions(seed=seed), reporter)
    with _timed(seconds, reporter, "segment stems", 0.9, 0.97):
        height = height_above_ground(cloud.xyz, site.dtm)
        searched = SegmentOptions(source="splat", max_dbh_cm=asked.max_dbh_cm)
        stems = find_stems(cloud, site.dtm, searched, reporter, height=height)
        tree_id = Labeller(stems)(cloud.xyz, height)
        labelled = cloud.with_attribute("tree_id", tree_id.astype(np.int32))
        write_cloud(path(names.SURFACE), labelled)
        write_cloud(path(names.STEMS), labelled.select(tree_id > 0))
    with _timed(seconds, reporter, "measure stems", 0.97, 1.0):
        options = MeasureOptions(
            weights="opacity",
            method="paper",
            bh_m=asked.bh_m,
            max_dbh_cm=asked.max_dbh_cm,
            source="splat",
            seed=seed,
        )
        trees = measure_stems(cloud, tree_id, site.dtm, options, reporter, stems=stems, height=height)
    return trees, facts | {"samples": len(cloud)}


def fit_gaussians(
    site: Site, sparse: np.ndarray, scene: SceneOptions, dense: Path | None, reporter: Reporter, share: float = 1.0
) -> tuple[GaussianField, dict[str, Any]]:
    """The Gaussians of a plot, local, and facts: what they started from, how far the fit came, CPU seconds.

    sparse: (M, 3) points of the reconstruction, local. dense: points to start from, else our own stereo. share: of the
    progress.

    Raises:
        InputError: nothing to start from. MissingComponentError: torch is not installed.
    """
    from ..stems.splats.on_torch.scene_fit import fit_scene
    from ..stems.splats.scene_start import Box, WholePhotos

    box, seconds = Box.of(site.area, site.ground), dict[str, float]()
    with _timed(seconds, reporter, "dense prior", 0.0, 0.12 * share):
        points, colours, source = dense_start(site, sparse, dense, box, reporter)
    with _timed(seconds, reporter, "fit Gaussians", 0.12 * share, share):
        field, report = fit_scene(WholePhotos.load(site.views), box, points, colours, scene, reporter)
    reporter.info(f"Gaussians over the whole plot: {report.sentence()}")
    reporter.tell(report.warnings(scene))
    prior = {"source": source, "points": len(points)}
    return field, {"stages_cpu_s": seconds, "prior": prior, "published_fit": asdict(report)}


@contextmanager
def _timed(seconds: dict[str, float], reporter: Reporter, name: str, low: float, high: float) -> Iterator[None]:
    """A part of the progress; its CPU seconds by its name."""
    began = time.process_time()
    with reporter.stage(name, low, high):
        yield
    seconds[name] = round(time.process_time() - began, 1)


def sample_gaussians(
    field: GaussianField, frame: LocalFrame, views: list[View], options: SampleOptions, reporter: Reporter
) -> PointCloud:
    """Surface points of the Gaussians with ``opacity`` and ``n_views``, project coordinates.

    Raises:
        InputError: no Gaussian, or none that a photo shows. MissingComponentError: torch is not installed.
    """
    from ..stems.splats.on_torch.sample import sample_surface

    points = sample_surface(field, views, options, reporter)
    return replace(points, xyz=frame.to_project(points.xyz), crs=frame.crs)


def dense_start(
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
