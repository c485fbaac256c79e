"""The stand in 3D beside a run's report: what a photo run and a cloud run know of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.crs import LocalFrame
from ..core.progress import Collector
from ..inventory.evidence.files import written_sheets
from ..inventory.reviewed import reviewed
from ..inventory.side_layers import StemCurves, crown_table
from ..inventory.stand_view import Dots, Stand, write_view
from ..inventory.tree_layer import tree_table
from ..reconstruction.model import load_coloured_points
from ..stems.cloud.estimate.heights import canopies_over
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.quality.tree import Tree
from ..stems.splats.ply import frame_path, read_field
from ..terrain.ground import height_above_ground
from .context import PhotoJob
from .given_store import fits_by_id
from .outputs import kept_table, write_page
from .stage import Stage

if TYPE_CHECKING:
    import geopandas as gpd

    from .cloud import CloudJob

#: Heights at which the axis of a photo's stem is drawn, m: where photos see it.
_FITTED_M = (0.3, 1.3, 2.5, 4.0)


def show_stand(job: PhotoJob, trees: list[Tree], reporter: Collector) -> None:
    """The page of a photo run, whose trees are written; then the report again, which links to it."""
    site, page = job.place, job.path(names.VIEW)
    table = reviewed(kept_table(job.path(names.TREES), trees, site.frame.crs), job.settings.output)[0]
    xyz, colours = load_coloured_points(job.path(names.SFM))
    fits = fits_by_id(job.space).fits if job.path(names.FITS).exists() else {}
    stand = Stand(
        table,
        job.plots,
        site.dtm.height,
        photo_curves(fits, site.frame),
        Dots(site.frame.to_project(xyz), colours),
        _gaussians(job),
        job.path(names.ORTHO),
        sheets=written_sheets(job.path(names.SHEETS), job.run_id),
    )
    write_view(page, stand)
    write_page(job, trees, reporter, page)


def _gaussians(job: PhotoJob) -> Dots | None:
    """The field in the workspace, where there is one."""
    path = job.path(names.FIELD)
    if not path.exists() or not frame_path(path).exists():
        return None
    field, frame = read_field(path), LocalFrame.load(frame_path(path))
    # The middle one of three axes: Gaussians of surfaces are flat.
    size, opacity = np.exp(np.median(field.log_scales, axis=1)), 1 / (1 + np.exp(-field.opacity_logits))
    return Dots(frame.to_project(field.means), 255 * field.colours, size, opacity)


def photo_curves(fits: Mapping[int, PhotoFit], frame: LocalFrame) -> StemCurves:
    """Stems as the photos show them. fits: by ``tree_id``, in ``frame``."""
    heights = np.array(_FITTED_M)
    curves = {}
    for number, fit in fits.items():
        diameter = 200 * np.maximum(fit.r0 + fit.r1 * (heights - fit.axis.bh_m), 0.01)
        curves[number] = np.column_stack([frame.to_project(fit.axis.at(heights))[:, :2], heights, diameter])
    return curves


def cloud_curves(sections: Iterable[Mapping[str, Any]]) -> StemCurves:
    """Stems through their sections (:func:`treedgs_geo.stems.cloud.estimate.sections.stem_sections`)."""
    rows: dict[int, list[list[float]]] = {}
    for section in sections:
        rows.setdefault(section["tree_id"], []).append([section[name] for name in ("x", "y", "height_m", "d_cm")])
    return {number: np.array(curve) for number, curve in rows.items()}


def cloud_crowns(job: CloudJob) -> gpd.GeoDataFrame:
    """The crowns of a cloud's trees."""
    xyz = job.cloud.xyz
    counted = [tree for tree in job.trees if tree.height_m is not None]
    places = np.array([[tree.x, tree.y] for tree in counted]).reshape(-1, 2)
    canopies = canopies_over(xyz, height_above_ground(xyz, job.ground.dtm), places) if counted else ()
    return crown_table(counted, cloud_curves(job.sections), (found[:3] for _, found in canopies), job.crs)


def show_cloud(job: CloudJob, page: Path) -> None:
    """The page of a cloud run."""
    stand = Stand(
        tree_table(job.trees, job.crs),
        job.plots,
        job.ground.dtm.height,
        cloud_curves(job.sections),
        Dots(job.cloud.xyz),
        crowns=job.crowns,
        sheets=job.sheets,
    )
    write_view(page, stand)


# After the layer is written: no trouble with a picture costs a tree. A person may have changed the layer: always anew.
VIEW: Stage[PhotoJob] = Stage(
    "view",
    0.01,
    lambda job, reporter: show_stand(job, job.trees, reporter),
    outputs=lambda job: [job.path(names.VIEW)],
    wanted=lambda job: job.site is not None and bool(job.trees),
    always=True,
)
