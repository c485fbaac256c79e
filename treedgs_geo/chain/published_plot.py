"""The published route over a whole plot: dense prior -> Gaussians -> samples with opacity -> segmentation -> slices,
circles, taper. Nothing is looked for in the photos by our own search.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError
from ..core.progress import Reporter
from ..from_photos.kept import KeptFits
from ..trees.tree import Tree
from .routes import Found
from .run import Aligned, Run, Site

if TYPE_CHECKING:
    from ..gaussians.field import GaussianField
    from ..gaussians.on_torch.scene_fit import SceneReport
    from ..gaussians.scene_start import Box
    from ..pointcloud.cloud import PointCloud
    from .settings import PhotosToDbhSettings

#: RLGS tries its proposals in every so-manyth phase: in each of them a fit would take seven times as long.
TRIED_EVERY = 4


def is_published(settings: PhotosToDbhSettings) -> bool:
    """The settings ask for the published route over the whole plot."""
    return settings.fit == "paper" or (settings.preset == "paper" and settings.fit == "auto")


def check_published(settings: PhotosToDbhSettings) -> None:
    """What the published route needs and cannot do, said before anything expensive starts.

    Raises:
        InputError: an option that it has no use for. MissingComponentError: torch is not installed.
    """
    if not is_published(settings):
        for name in ("dense", "segmenter_command"):
            if getattr(settings, name) is not None:
                raise InputError(
                    f"--{name.replace('_', '-')}: only the published method (--preset paper) uses it; leave it out, or "
                    "add --preset paper."
                )
        return
    if settings.field_stems is not None:
        raise InputError(
            "--field-stems: the published method looks for no stem in the photos, so it cannot look at a given place; "
            "leave it out, or use --preset balanced."
        )
    if settings.segmenter != "own" and not settings.segmenter_command:
        raise InputError(
            f"--segmenter {settings.segmenter}: needs its command line, give --segmenter-command "
            "(docs/analyst/measuring.md has one)."
        )
    from ..gaussians import on_torch  # noqa: F401  (says what to install)


def published_route(run: Run, site: Site, aligned: Aligned, reporter: Reporter) -> Found:
    """Trees by the published method. ``field.ply``, ``surface.laz`` and ``stems.laz`` stay in the workspace; the facts
    say how far the fit came."""
    from ..gaussians.options import PAPER_SAMPLING, SampleOptions
    from ..gaussians.ply import write_field
    from ..gaussians.sample import sample_surface
    from ..pointcloud.cloud import PointCloud
    from ..pointcloud.files import write_cloud

    field, report, prior = _fitted(run, site, aligned, reporter)
    write_field(run.path(names.FIELD), field, site.frame)
    reporter.info(f"Gaussians over the whole plot: {report.sentence()}")
    if report.steps < 30_000 or report.factor < 1:
        reporter.warn(
            f"The published fit was cut short by the time limit of {run.settings.time_limit:g} minutes: "
            f"{report.sentence()} Diameters may be better with a longer --time-limit."
        )
    with reporter.stage("sample surface", 0.8, 0.9):
        sampling = SampleOptions(seed=run.settings.seed, **PAPER_SAMPLING)
        points = sample_surface(field, site.views, sampling, reporter)
        cloud = PointCloud(
            site.frame.to_project(points.xyz), site.frame.crs, {"opacity": points.opacity, "n_views": points.n_views}
        )
        write_cloud(run.path(names.SURFACE), cloud)
    with reporter.stage("segment stems", 0.9, 0.97):
        tree_id, stems, height = _segmented(run, site, cloud, reporter)
        write_cloud(run.path(names.STEMS), cloud.with_attribute("tree_id", tree_id).select(tree_id > 0))
    with reporter.stage("measure stems", 0.97, 1.0):
        trees = _measured(run, site, cloud, tree_id, stems, height, reporter)
    facts = {"prior": prior, "published_fit": report.as_dict(), "samples": len(points), "segmented": len(trees)}
    return Found(trees, KeptFits([]), facts)


def _fitted(
    run: Run, site: Site, aligned: Aligned, reporter: Reporter
) -> tuple[GaussianField, SceneReport, dict[str, Any]]:
    """Gaussians in the plot's box, how far the fit came, and where its start was from."""
    from ..gaussians.on_torch.scene_fit import fit_scene
    from ..gaussians.options import SceneOptions
    from ..gaussians.scene_start import Box
    from ..gaussians.whole_photos import WholePhotos

    options = SceneOptions(time_limit_min=run.settings.time_limit, tried_every=TRIED_EVERY, seed=run.settings.seed)
    box = Box.of(site.area, site.ground, options)
    with reporter.stage("dense prior", 0.0, 0.1):
        points, colours, source = _prior(run, site, aligned, box, reporter)
    with reporter.stage("fit Gaussians", 0.1, 0.8):
        field, report = fit_scene(WholePhotos.load(site.views), box, points, colours, options, reporter)
    return field, report, {"source": source, "points": len(points)}


def _prior(run: Run, site: Site, aligned: Aligned, box: Box, reporter: Reporter) -> tuple[np.ndarray, np.ndarray, str]:
    """(M, 3) points to start from, local, (M, 3) their colours, and whose they are."""
    from ..gaussians.scene_start import dense_prior
    from ..gaussians.seeds import read_dense

    given = run.settings.dense
    if given is not None:
        points, colours = read_dense(given, site.frame)
        source = given.name
    else:
        points, colours = dense_prior(site.views, site.ground, site.area, box, reporter)
        source = "multi-view stereo"
    if colours is None:
        colours = np.full((len(points), 3), 0.5)
    # What matching the photos found stands in where stereo saw nothing.
    points = np.concatenate([points, aligned.points])
    colours = np.concatenate([colours, np.full((len(aligned.points), 3), 0.5)])
    inside = box.contains(points)
    return points[inside], colours[inside], source


def _segmented(run: Run, site: Site, cloud: PointCloud, reporter: Reporter) -> tuple:
    """(P,) stem of each point, 0 = none; the stems where our own segmenter found them; (P,) height above ground."""
    from ..from_points.segmentation.options import SegmentOptions
    from ..from_points.segmentation.segment import find_stems, label_points
    from ..terrain.ground import height_above_ground

    settings = run.settings
    height = height_above_ground(cloud.xyz, site.dtm)
    if settings.segmenter != "own":
        from ..from_points.segmentation.external import segment_external

        return (
            segment_external(cloud, settings.segmenter, settings.segmenter_command or "", reporter).tree_id,
            None,
            height,
        )
    stems = find_stems(cloud, site.dtm, SegmentOptions(source="splat"), reporter, height=height)
    return label_points(cloud.xyz, height, stems), stems, height


def _measured(
    run: Run, site: Site, cloud: PointCloud, tree_id: np.ndarray, stems: Any, height: np.ndarray, reporter: Reporter
) -> list[Tree]:
    from ..from_points.measuring.cloud import measure_stems
    from ..from_points.measuring.options import MeasureOptions

    settings = run.settings
    options = MeasureOptions(weights="opacity", method="paper", bh_m=settings.bh_m, source="splat", seed=settings.seed)
    return measure_stems(cloud, tree_id, site.dtm, options, reporter, stems=stems, height=height)
