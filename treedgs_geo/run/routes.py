"""The two routes from cameras and ground to diameters, and how much each preset models."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.machine import available_threads
from ..core.progress import Reporter
from ..reconstruction.options import ReconstructOptions
from ..stems.photos.fit_records import KeptFits
from ..stems.photos.options import PhotoStemOptions
from ..stems.photos.route import Searched, search_photos
from ..stems.photos.targeted_fit import GivenStems
from ..stems.photos.trees import trees_of_photo_fits
from ..stems.quality.assessment import Assessment
from ..stems.quality.tree import Tree
from .context import Run, Site
from .second_measurement import stems_to_measure_again, with_second_measurements

if TYPE_CHECKING:
    from ..pointcloud.cloud import PointCloud
    from ..stems.splats.field import GaussianField
    from ..stems.splats.train import FoundStem


@dataclass(frozen=True)
class Preset:
    """How much of the scene is modelled. second: stems that are measured again with a primitive among Gaussians, where
    the route is ``auto``: ``none``, those of ``low confidence``, or ``all``; second_views: in so many photos at most,
    spread over the directions. sheets: trees that get an evidence sheet:
    ``all``, or those to ``check`` and not measured. heights: whether tree heights are measured in the photos."""

    reconstruct: ReconstructOptions
    stems: PhotoStemOptions
    second: str = "low confidence"
    second_views: int = 32
    sheets: str = "all"
    heights: bool = True


@dataclass(frozen=True)
class Found:
    """What a route found. trees: project coordinates. kept: the stems as the photos show them, local frame; the tree
    with ``tree_id`` N is that of ``kept.fits[N - 1]``. facts: what the route adds to the stage's result."""

    trees: list[Tree]
    kept: KeptFits
    facts: dict[str, Any] = field(default_factory=dict)


CHAIN_PRESETS = {
    "fast": Preset(
        ReconstructOptions(max_features=4000, neighbours=12),
        PhotoStemOptions(max_views=48, max_lean_deg=10.0, most_asked=0),
        second="none",
        sheets="check",
        heights=False,
    ),
    "balanced": Preset(ReconstructOptions(), PhotoStemOptions()),
    "best": Preset(ReconstructOptions(max_features=16000, neighbours=30), PhotoStemOptions(max_views=200), "all", 60),
    "paper": Preset(ReconstructOptions(), PhotoStemOptions()),
    "paper-crops": Preset(ReconstructOptions(), PhotoStemOptions()),
}


def preset_of(name: str, stem_network: str) -> Preset:
    """The preset ``name``, and what the network that tells stems is asked."""
    preset = CHAIN_PRESETS[name]
    return replace(preset, stems=replace(preset.stems, stem_network=stem_network))


def photo_route(site: Site, preset: Preset, bh_m: float, reporter: Reporter, given: GivenStems | None = None) -> Found:
    """Stems found and fitted straight in the photos. given: stems known to stand there."""
    searched = _searched(site, preset, bh_m, reporter, given)
    return Found(trees_of_photo_fits(searched.fits, site.frame), KeptFits(searched.fits, looks=searched.looks))


def _searched(site: Site, preset: Preset, bh_m: float, reporter: Reporter, given: GivenStems | None) -> Searched:
    options = replace(preset.stems, bh_m=bh_m)
    return search_photos(site.views, site.ground, site.area, options, reporter, given)


def auto_route(
    site: Site, preset: Preset, bh_m: float, seed: int, reporter: Reporter, given: GivenStems | None = None
) -> Found:
    """Stems fitted straight in the photos; those of low confidence are measured again among Gaussians.

    The facts have what the second measurement changed; none where no stem was measured again.
    """
    with reporter.stage("stems", 0.0, 0.6):
        found = photo_route(site, preset, bh_m, reporter, given)
    with reporter.stage("second measurement", 0.6, 1.0):
        return measured_again(found, range(len(found.trees)), site, preset, bh_m, seed, reporter)


def measured_again(
    found: Found, asked: Collection[int], site: Site, preset: Preset, bh_m: float, seed: int, reporter: Reporter
) -> Found:
    """The same with those of the stems ``asked`` for (indices) measured again that the preset wants so."""
    from ..stems.splats.options import GaussianOptions
    from ..stems.splats.train import fit_with_report

    fits = found.kept.fits
    if preset.second == "none" or not fits:
        return found
    places = np.array([fit.axis.p for fit in fits])
    inside = site.area.contains(places, 0.0) & np.isin(np.arange(len(fits)), list(asked))
    chosen = stems_to_measure_again(fits, inside, preset.second == "all")
    if not chosen:
        return found
    options = GaussianOptions(seed=seed, bh_m=bh_m, threads=available_threads(), max_views=preset.second_views)
    _, report = fit_with_report(site.views, site.frame, site.ground, places[chosen], None, options, reporter)
    primitives = {chosen[at]: stem for at, stem in report.primitives.items()}
    trees, again = with_second_measurements(found.trees, fits, primitives, bh_m)
    reporter.info(
        f"{len(chosen)} stems measured again with a model of their bark: {again.agreed} agree, {again.gained} "
        f"have a diameter now, {again.flagged} are to be checked."
    )
    second_cm = {number: stem.primitive.dbh_cm for number, stem in primitives.items()}
    kept = replace(found.kept, second_cm=found.kept.second_cm | second_cm)
    return Found(trees, kept, {"second_measurement": asdict(again)})


def splat_route(site: Site, run: Run, reporter: Reporter, paper: bool, given: GivenStems | None = None) -> Found:
    """Stem primitives and Gaussians in one loop; with ``paper`` the published constants: Gaussians -> samples with
    reliability -> stem points -> slices, circles, taper, with the published constants.

    Stems are found in the photos (positions only; their diameters come in again only to flag a tree whose two
    diameters differ). ``field.ply``, ``surface.laz`` and ``stems.laz`` stay in the workspace.
    """
    from ..stems.splats.options import GaussianOptions
    from ..stems.splats.ply import write_field
    from ..stems.splats.train import fit_with_report

    settings, frame = run.settings, site.frame
    with reporter.stage("find stems", 0.0, 0.2):
        looked = photo_route(site, run.preset, settings.bh_m, reporter, given)
    found = looked.trees
    if not found:
        return looked
    positions = frame.to_local(np.array([[tree.x, tree.y, tree.z_ground or 0.0] for tree in found]))[:, :2]
    with reporter.stage("fit Gaussians", 0.2, 0.8):
        preset, threads = settings.preset, available_threads()
        if paper or preset in ("paper", "paper-crops"):
            preset = "paper-crops" if paper else "balanced"
        options = GaussianOptions(
            preset=preset, seed=settings.seed, bh_m=settings.bh_m, threads=threads, device=settings.device
        )
        field, report = fit_with_report(site.views, frame, site.ground, positions, None, options, reporter)
        write_field(run.path(names.FIELD), field, frame)
    with reporter.stage("sample surface", 0.8, 0.95):
        cloud, groups = _surface(site, run, field, reporter, paper)
    with reporter.stage("measure stems", 0.95, 1.0):
        trees = _measured(site, run, looked, cloud, groups, report.primitives, reporter, paper)
    measured = {tree.tree_id for tree in trees}
    # A stem that gave nothing stays in the layer, with its reason.
    lost = [
        replace(tree, tree_id=number, **Assessment.refused("few_points").of_tree()).finish()
        for number, tree in enumerate(found, start=1)
        if number not in measured
    ]
    return replace(looked, trees=sorted(trees + lost, key=lambda tree: tree.tree_id))


def _surface(
    site: Site, run: Run, field: GaussianField, reporter: Reporter, paper: bool
) -> tuple[PointCloud, np.ndarray]:
    """Sampled points in project coordinates, kept as ``surface.laz`` and ``stems.laz``, and the stem of each, (N,)."""
    from ..pointcloud.cloud import PointCloud
    from ..pointcloud.files import write_cloud
    from ..stems.splats.options import PAPER_SAMPLING, SampleOptions
    from ..stems.splats.sample import sample_surface

    # Where the stems are measured already, the points are a picture: a fifth of them will do.
    sampling = SampleOptions(samples=100 if paper else 20, seed=run.settings.seed)
    sampling = replace(sampling, **PAPER_SAMPLING) if paper else sampling
    points = sample_surface(field, site.views, sampling, reporter)
    cloud = PointCloud(
        site.frame.to_project(points.xyz),
        site.frame.crs,
        {"opacity": points.opacity, "n_views": points.n_views, "tree_id": (points.groups + 1).astype(np.int32)},
    )
    write_cloud(run.path(names.SURFACE), cloud)
    write_cloud(run.path(names.STEMS), cloud)
    return cloud, points.groups


def _measured(
    site: Site,
    run: Run,
    looked: Found,
    cloud: PointCloud,
    groups: np.ndarray,
    primitives: dict[int, FoundStem],
    reporter: Reporter,
    paper: bool,
) -> list[Tree]:
    """Diameters from the points (``paper``), or from the primitives, compared with those of ``looked``."""
    from ..stems.cloud.estimate.cloud import measure_stems
    from ..stems.cloud.estimate.options import MeasureOptions
    from ..stems.splats.trees import trees_of_primitives

    settings = run.settings
    if paper:
        measuring = MeasureOptions(
            weights="opacity", method="paper", bh_m=settings.bh_m, source="splat", seed=settings.seed
        )
        return measure_stems(cloud, groups + 1, site.dtm, measuring, reporter)
    second = {number: tree.dbh_cm for number, tree in enumerate(looked.trees)}
    soft_cm = {number: fit.soft_cm for number, fit in enumerate(looked.kept.fits)}
    return trees_of_primitives(primitives, site.frame, settings.bh_m, second, soft_cm)
