"""The two routes from cameras and ground to diameters, and how much each preset models."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core import workspace as names
from ..core.crs import LocalFrame
from ..core.machine import available_threads
from ..core.progress import Reporter
from ..core.workspace import Workspace
from ..from_photos.find import stems_from_photos
from ..from_photos.options import PhotoStemOptions
from ..from_photos.trees import trees_of_photo_fits
from ..reconstruction.area import Area
from ..reconstruction.cameras import View
from ..reconstruction.pipeline import ReconstructOptions
from ..terrain.dtm import Dtm
from ..trees.tree import Tree
from .second_measurement import SecondMeasurement, stems_to_measure_again, with_second_measurements


@dataclass(frozen=True)
class Preset:
    """How much of the scene is modelled. second: stems that are measured again with a primitive among Gaussians, where
    the route is ``auto``: ``none``, those of ``low confidence``, or ``all``."""

    reconstruct: ReconstructOptions
    stems: PhotoStemOptions
    second: str = "low confidence"


CHAIN_PRESETS = {
    "fast": Preset(
        ReconstructOptions(max_features=4000, neighbours=12), PhotoStemOptions(max_views=48, max_lean_deg=10.0), "none"
    ),
    "balanced": Preset(ReconstructOptions(), PhotoStemOptions()),
    "best": Preset(ReconstructOptions(max_features=16000, neighbours=30), PhotoStemOptions(max_views=200), "all"),
    "paper": Preset(ReconstructOptions(), PhotoStemOptions()),
}


def photo_route(
    preset: Preset, bh_m: float, frame: LocalFrame, views: list[View], dtm: Dtm, area: Area, reporter: Reporter
) -> list[Tree]:
    """Stems found and fitted straight in the photos."""
    options = replace(preset.stems, bh_m=bh_m)
    return trees_of_photo_fits(stems_from_photos(views, frame, dtm.local(frame).height, area, options, reporter), frame)


def auto_route(
    preset: Preset,
    bh_m: float,
    frame: LocalFrame,
    views: list[View],
    dtm: Dtm,
    area: Area,
    seed: int,
    reporter: Reporter,
) -> tuple[list[Tree], SecondMeasurement | None]:
    """Stems fitted straight in the photos; those of low confidence are measured again among Gaussians.

    Returns the trees, and what the second measurement changed (``None`` where no stem was measured again).
    """
    from ..gaussians.options import GaussianOptions
    from ..gaussians.train import fit_with_report

    ground = dtm.local(frame).height
    with reporter.stage("stems", 0.0, 0.6):
        fits = stems_from_photos(views, frame, ground, area, replace(preset.stems, bh_m=bh_m), reporter)
    trees = trees_of_photo_fits(fits, frame)
    if preset.second == "none" or not fits:
        return trees, None
    places = np.array([fit.axis.p for fit in fits])
    chosen = stems_to_measure_again(fits, area.contains(places, 0.0), preset.second == "all")
    if not chosen:
        return trees, None
    with reporter.stage("second opinion", 0.6, 1.0):
        options = GaussianOptions(seed=seed, bh_m=bh_m, threads=available_threads())
        _, report = fit_with_report(views, frame, ground, places[chosen], None, options, reporter)
        found = {chosen[at]: stem for at, stem in report.primitives.items()}
        trees, again = with_second_measurements(trees, fits, found, bh_m)
        reporter.info(
            f"{len(chosen)} stems measured again with a model of their bark: {again.agreed} agree, {again.gained} "
            f"have a diameter now, {again.flagged} are to be checked."
        )
    return trees, again


def splat_route(
    preset: str,
    bh_m: float,
    frame: LocalFrame,
    views: list[View],
    dtm: Dtm,
    area: Area,
    space: Workspace,
    reporter: Reporter,
    paper: bool,
    seed: int,
) -> list[Tree]:
    """Stem primitives and Gaussians in one loop; with ``paper`` the published route: Gaussians -> samples with
    reliability -> stem points -> slices, circles, taper, with the published constants.

    Stems are found in the photos (positions only; their diameters come in again only to flag a tree whose two
    diameters differ). ``field.ply``, ``surface.laz`` and ``stems.laz`` stay in the workspace.
    """
    from ..from_points.measuring.cloud import measure_stems
    from ..from_points.measuring.options import MeasureOptions
    from ..gaussians.options import PAPER_SAMPLING, GaussianOptions, SampleOptions
    from ..gaussians.ply import write_field
    from ..gaussians.sample import sample_surface
    from ..gaussians.train import fit_with_report
    from ..gaussians.trees import trees_of_primitives
    from ..pointcloud.cloud import PointCloud
    from ..pointcloud.files import write_cloud

    with reporter.stage("find stems", 0.0, 0.2):
        found = photo_route(CHAIN_PRESETS[preset], bh_m, frame, views, dtm, area, reporter)
    if not found:
        return []
    positions = frame.to_local(np.array([[tree.x, tree.y, tree.z_ground or 0.0] for tree in found]))[:, :2]
    with reporter.stage("fit Gaussians", 0.2, 0.8):
        options = GaussianOptions(
            preset="paper" if paper else preset, seed=seed, bh_m=bh_m, threads=available_threads()
        )
        field, report = fit_with_report(views, frame, dtm.local(frame).height, positions, None, options, reporter)
        write_field(space.path(names.FIELD), field, frame)
    with reporter.stage("sample surface", 0.8, 0.95):
        # Where the stems are measured already, the points are a picture: a fifth of them will do.
        sampling = SampleOptions(samples=100 if paper else 20, seed=seed)
        sampling = replace(sampling, **PAPER_SAMPLING) if paper else sampling
        points = sample_surface(field, views, sampling, reporter)
        cloud = PointCloud(
            frame.to_project(points.xyz),
            frame.crs,
            {"opacity": points.opacity, "n_views": points.n_views, "tree_id": (points.groups + 1).astype(np.int32)},
        )
        write_cloud(space.path(names.SURFACE), cloud)
        write_cloud(space.path(names.STEMS), cloud)
    with reporter.stage("measure stems", 0.95, 1.0):
        if paper:
            measuring = MeasureOptions(weights="opacity", method="paper", bh_m=bh_m, source="splat", seed=seed)
            trees = measure_stems(cloud, points.groups + 1, dtm, measuring, reporter)
        else:
            second = {number: tree.dbh_cm for number, tree in enumerate(found)}
            trees = trees_of_primitives(report.primitives, frame, bh_m, second)
    measured = {tree.tree_id for tree in trees}
    # A stem that gave nothing stays in the layer, with its reason.
    lost = [
        replace(tree, tree_id=number, qc_reason="").add_reason("few_points", "reject")
        for number, tree in enumerate(found, start=1)
        if number not in measured
    ]
    return sorted(trees + lost, key=lambda tree: tree.tree_id)
