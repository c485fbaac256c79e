"""The routes from cameras and ground to diameters, and how much each preset models."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
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
from .context import Site
from .second_measurement import stems_to_measure_again, with_second_measurements

if TYPE_CHECKING:
    from ..stems.splats.field import GaussianField


@dataclass(frozen=True)
class Preset:
    """How much of the scene is modelled. second: stems that are measured again with a stem primitive, where
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
}


def photo_route(site: Site, preset: Preset, bh_m: float, reporter: Reporter, given: GivenStems | None = None) -> Found:
    """Stems found and fitted straight in the photos. given: stems known to stand there."""
    searched = _searched(site, preset, bh_m, reporter, given)
    return Found(trees_of_photo_fits(searched.fits, site.frame), KeptFits(searched.fits, looks=searched.looks))


def _searched(site: Site, preset: Preset, bh_m: float, reporter: Reporter, given: GivenStems | None) -> Searched:
    options = replace(preset.stems, bh_m=bh_m)
    with reporter.placed(site.frame):
        return search_photos(site.views, site.ground, site.area, options, reporter, given)


def auto_route(site: Site, preset: Preset, bh_m: float, reporter: Reporter, given: GivenStems | None = None) -> Found:
    """Stems fitted straight in the photos; those of low confidence are measured again by a stem primitive.

    The facts have what the second measurement changed; none where no stem was measured again.
    """
    with reporter.stage("stems", 0.0, 0.6):
        found = photo_route(site, preset, bh_m, reporter, given)
    with reporter.stage("second measurement", 0.6, 1.0):
        return measured_again(found, range(len(found.trees)), site, preset, bh_m, reporter)


def measured_again(
    found: Found, asked: Collection[int], site: Site, preset: Preset, bh_m: float, reporter: Reporter
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
    options = GaussianOptions(bh_m=bh_m, threads=available_threads(), max_views=preset.second_views)
    _, report = fit_with_report(site.views, site.frame, site.ground, places[chosen], options, reporter)
    primitives = {chosen[at]: stem for at, stem in report.primitives.items()}
    trees, again = with_second_measurements(found.trees, fits, primitives, bh_m)
    reporter.info(
        f"{len(chosen)} stems measured again with a model of their bark: {again.agreed} agree, {again.gained} "
        f"have a diameter now, {again.flagged} are to be checked."
    )
    second_cm = {number: stem.primitive.dbh_cm for number, stem in primitives.items()}
    kept = replace(found.kept, second_cm=found.kept.second_cm | second_cm)
    return Found(trees, kept, {"second_measurement": asdict(again)})


def splat_route(
    site: Site,
    preset: Preset,
    bh_m: float,
    seed: int,
    path: Callable[[str], Path],
    reporter: Reporter,
    given: GivenStems | None = None,
) -> Found:
    """Stem primitives, and Gaussians on their bark.

    Stems are found in the photos (positions only; their diameters come in again only to flag a tree whose two
    diameters differ). path: of a file of the workspace by its name; ``field.ply``, ``surface.laz`` and ``stems.laz``
    stay there.
    """
    from ..stems.splats.options import GaussianOptions
    from ..stems.splats.ply import write_field
    from ..stems.splats.train import fit_with_report
    from ..stems.splats.trees import trees_of_primitives

    frame = site.frame
    with reporter.stage("find stems", 0.0, 0.2):
        looked = photo_route(site, preset, bh_m, reporter, given)
    found = looked.trees
    if not found:
        return looked
    positions = frame.to_local(np.array([[tree.x, tree.y, tree.z_ground or 0.0] for tree in found]))[:, :2]
    with reporter.stage("fit Gaussians", 0.2, 0.85):
        options = GaussianOptions(bh_m=bh_m, threads=available_threads())
        field, report = fit_with_report(site.views, frame, site.ground, positions, options, reporter)
        write_field(path(names.FIELD), field, frame)
    with reporter.stage("sample surface", 0.85, 1.0):
        _write_surface(site, path, field, seed, reporter)
    second = {number: tree.dbh_cm for number, tree in enumerate(found)}
    soft_cm = {number: fit.soft_cm for number, fit in enumerate(looked.kept.fits)}
    trees = trees_of_primitives(report.primitives, frame, bh_m, second, soft_cm)
    measured = {tree.tree_id for tree in trees}
    # A stem that gave nothing stays in the layer, with its reason.
    lost = [
        replace(tree, tree_id=number, **Assessment.refused("few_points").of_tree()).finish()
        for number, tree in enumerate(found, start=1)
        if number not in measured
    ]
    return replace(looked, trees=sorted(trees + lost, key=lambda tree: tree.tree_id))


def _write_surface(
    site: Site, path: Callable[[str], Path], field: GaussianField, seed: int, reporter: Reporter
) -> None:
    """Sampled points in project coordinates, ``surface.laz`` and ``stems.laz``: stems are measured already, so the
    points are a picture."""
    from ..pointcloud.cloud import PointCloud
    from ..pointcloud.files import write_cloud
    from ..stems.splats.options import SampleOptions
    from ..stems.splats.sample import sample_surface

    points = sample_surface(field, site.views, SampleOptions(samples=20, seed=seed), reporter)
    cloud = PointCloud(
        site.frame.to_project(points.xyz),
        site.frame.crs,
        {"opacity": points.opacity, "n_views": points.n_views, "tree_id": (points.groups + 1).astype(np.int32)},
    )
    write_cloud(path(names.SURFACE), cloud)
    write_cloud(path(names.STEMS), cloud)
