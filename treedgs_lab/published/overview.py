"""The Gaussians of a run as one photo shows them, and its surface points by opacity, by views and as segmented."""

from __future__ import annotations

from typing import Any

import numpy as np

from treedgs_geo.core import workspace as names
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.reference import Reference
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.report.charts import VERMILION
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.raster import draw
from treedgs_geo.stems.splats.scene_start import WholePhotos

from .paper_pictures import NEAR_M, STEM_M, panels
from .point_sets import compared_stems, open_field

#: Widest picture, px; most points of a panel.
WIDE_PX, MOST_POINTS = 900, 40_000


def draw_overview(plot: PlotFiles) -> Any | None:
    """The photo that shows most Gaussians, what the Gaussians give from there, and the segmented surface points from
    the south (stems in red); ``None`` where no photo shows any."""
    assert plot.workspace_in is not None
    _, views, field, dtm = open_field(plot)
    if (view := _widest(field, views)) is None:
        return None
    photo = WholePhotos.load([view], min(WIDE_PX / view.camera.width, 1.0))
    shown = draw(field.packed, photo.cameras[0]).planes
    surface, stems = _thinned(plot, names.SURFACE), _thinned(plot, names.STEMS)
    figure, grid = panels(3, 3, 4.4, 3.6)
    for axes, picture, title in (
        (grid[0], photo.images[0], view.name.rpartition("/")[2]),
        (grid[1], np.clip(np.moveaxis(shown[:3], 0, 2) + shown[3][:, :, None], 0, 1), f"{len(field):,} Gaussians"),
    ):
        axes.imshow(picture)
        axes.set_title(title, fontsize=8)
        axes.set_xticks([])
        axes.set_yticks([])
    middle = surface[:, 0].mean()
    for xyz, colour, size in ((surface, "0.75", 1.0), (stems, VERMILION, 1.5)):
        height = xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1])
        grid[2].scatter(xyz[:, 0] - middle, height, s=size, color=colour, linewidths=0, rasterized=True)
    grid[2].set_title("surface points from the south, stems red", fontsize=8)
    grid[2].set_xlabel("east, m", fontsize=8)
    grid[2].set_ylabel("height above the ground, m", fontsize=8)
    grid[2].tick_params(labelsize=7)
    return figure


def draw_pipeline(plot: PlotFiles, reference: Reference) -> Any | None:
    """Surface points about a stem by opacity, by the number of views, and as segmented: the compared stem with most
    points; ``None`` where no compared stem has any."""
    assert plot.workspace_in is not None
    _, _, _, dtm = open_field(plot)
    cloud = read_cloud(plot.workspace_in / names.SURFACE)
    away = {k: np.hypot(*(cloud.xyz[:, :2] - reference.xy[k]).T) < NEAR_M for k in compared_stems(reference)}
    best = max(away, key=lambda k: int(away[k].sum()))
    if not away[best].any():
        return None
    near = cloud.select(away[best])
    stems = read_cloud(plot.workspace_in / names.STEMS).xyz
    stems = stems[np.hypot(*(stems[:, :2] - reference.xy[best]).T) < NEAR_M]
    figure, grid = panels(3, 3, 2.8, 4.4)
    across, height = (near.xyz[:, 0] - reference.xy[best, 0]), near.xyz[:, 2] - dtm.height(*near.xyz[:, :2].T)
    for axes, name, words in ((grid[0], "opacity", "opacity α"), (grid[1], "n_views", "photos w")):
        values = np.asarray(near.attributes[name], float)
        dots = axes.scatter(across, height, c=values, s=2, cmap="viridis", linewidths=0, rasterized=True)
        figure.colorbar(dots, ax=axes).ax.tick_params(labelsize=7)
        axes.set_title(f"{words}\n{len(near)} points", fontsize=8)
    grid[2].scatter(across, height, color="0.8", s=2, linewidths=0, rasterized=True)
    grid[2].scatter(
        stems[:, 0] - reference.xy[best, 0], stems[:, 2] - dtm.height(*stems[:, :2].T), color=VERMILION, s=2,
        linewidths=0, rasterized=True,
    )  # fmt: skip
    grid[2].set_title(f"segmented as stem (T)\n{len(stems)} points", fontsize=8)
    for axes in grid:
        axes.set_xlim(-NEAR_M, NEAR_M)
        axes.set_ylim(0, STEM_M[1])
        axes.tick_params(labelsize=7)
        axes.set_xlabel("east, m", fontsize=8)
    grid[0].set_ylabel(f"height above the ground at {reference.tree[best]}, m", fontsize=8)
    return figure


def _widest(field: GaussianField, views: list[View]) -> View | None:
    """The photo with most of the Gaussians' centres inside."""
    some = field.means[:: max(len(field) // 5000, 1)].astype(float)
    inside = []
    for view in views:
        pixels, depth = view.project(some)
        inside.append(int((view.contains(pixels) & (depth > 0)).sum()))
    return views[int(np.argmax(inside))] if max(inside, default=0) else None


def _thinned(plot: PlotFiles, name: str) -> np.ndarray:
    assert plot.workspace_in is not None
    xyz = read_cloud(plot.workspace_in / name).xyz
    return xyz[:: max(-(-len(xyz) // MOST_POINTS), 1)]
