"""A run's Gaussians: as one photo shows them, their surface points by opacity, by views and as segmented, and three
ways from them to points about the same stems: centres, fused depth maps, surface samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from treedgs_geo.core import workspace as names
from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.report.charts import VERMILION
from treedgs_geo.stems.splats.camera import CropCamera
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.ply import read_field
from treedgs_geo.stems.splats.scene_start import WholePhotos
from treedgs_geo.terrain.dtm import Dtm, read_dtm

from .paper_pictures import NEAR_M, STEM_M, dress, near_stem, panels, scene
from .reference import Reference
from .segmentation import stems_json, true_labels

#: Stems that are compared, evenly over the diameters; depth maps of a whole scene are drawn for each of them.
COMPARED = 4
MEANS, DEPTH, SAMPLES = "means of the Gaussians", "fused depth maps", "surface samples"
#: A fused point needs so much alpha in its map, and so many maps, its own included, that agree within this, m.
MIN_ALPHA, MIN_MAPS, AGREE_M = 0.5, 2, 0.05
#: Widest picture, px; most points of a panel.
WIDE_PX, MOST_POINTS = 900, 40_000


@dataclass(frozen=True)
class PointSets:
    """points: set -> (N, 3) of each compared stem: east and north of the stem, height above the ground, m. true: set ->
    (N,) whether a point lies in a true stem, of each stem; ``None`` without truth."""

    plot: str
    stems: list[str]
    points: dict[str, list[np.ndarray]]
    true: dict[str, list[np.ndarray]] | None


def open_field(plot: PlotFiles) -> tuple[LocalFrame, list[View], GaussianField, Dtm]:
    """Photos, Gaussians and ground of a workspace.

    Raises:
        InputError: the Gaussians lie in another local frame than the photos.
    """
    assert plot.workspace_in is not None
    frame, views = scene(plot)
    field = read_field(plot.workspace_in / names.FIELD, frame)
    return frame, views, field, read_dtm(plot.workspace_in / names.DTM, frame.crs)


def compared_stems(reference: Reference) -> list[int]:
    """Up to :data:`COMPARED` stems, evenly over the diameters: no set has a say in which."""
    order = np.argsort(reference.dbh_cm, kind="stable")
    return [int(order[k]) for k in np.unique(np.linspace(0, len(order) - 1, COMPARED).round().astype(int))]


def point_sets(plot: PlotFiles, reference: Reference) -> PointSets:
    """The three sets within ``NEAR_M`` of each compared stem; every Gaussian of the scene takes part.

    Raises:
        InputError: the Gaussians lie in another local frame than the photos.
    """
    assert plot.workspace_in is not None
    frame, views, field, dtm = open_field(plot)
    samples = read_cloud(plot.workspace_in / names.SURFACE).xyz
    centres = frame.to_project(field.means.astype(float))
    points: dict[str, list[np.ndarray]] = {MEANS: [], DEPTH: [], SAMPLES: []}
    true: dict[str, list[np.ndarray]] = {MEANS: [], DEPTH: [], SAMPLES: []}
    truth, stems = stems_json(plot), compared_stems(reference)
    for k in stems:
        xy = reference.xy[k]
        turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
        rim = xy + NEAR_M * np.column_stack([np.cos(turn), np.sin(turn)])
        ground = float(dtm.height(xy[:1], xy[1:])[0])
        about = np.concatenate([np.column_stack([rim, np.full(len(rim), ground + height)]) for height in STEM_M])
        fused = frame.to_project(fuse_depth(field, views, frame.to_local(about)))
        for name, cloud in ((MEANS, centres), (DEPTH, fused), (SAMPLES, samples)):
            near, own = near_stem(cloud, dtm, xy)
            points[name].append(own)
            if truth is not None:
                true[name].append(true_labels(near, truth) > 0)
    return PointSets(plot.name, [str(reference.tree[k]) for k in stems], points, None if truth is None else true)


def fuse_depth(field: GaussianField, views: Sequence[View], about: np.ndarray) -> np.ndarray:
    """(P, 3) local points of the median-depth maps of all views about some points (M, 3, local), kept where other
    views' maps agree. All Gaussians are drawn at once, as a whole scene is seen.

    Raises:
        InputError: empty field or no view.
    """
    if len(field) == 0 or not views:
        raise InputError("Depth fusion needs a field with Gaussians and at least one photo; run fit-gaussians first.")
    maps = [made for view in views if (made := _depth_map(field, about, view)) is not None]
    found = [np.empty((0, 3))]
    for camera, depth in maps:
        rows, columns = np.nonzero(np.isfinite(depth))
        rays = camera.pixel_rays()[rows, columns] @ camera.rotation
        points = camera.centre + depth[rows, columns, None] * rays
        agree = sum((_agrees(points, *other) for other in maps), np.zeros(len(points), int))
        found.append(points[agree >= MIN_MAPS])
    return np.concatenate(found)


def _depth_map(field: GaussianField, about: np.ndarray, view: View) -> tuple[CropCamera, np.ndarray] | None:
    """Pinhole crop around the (M, 3) points and the field's median depth (H, W), NaN where it is not known; None where
    the points are out of sight."""
    from treedgs_geo.stems.splats.on_torch.rasterize import draw  # torch is not everywhere

    pixels, depth = view.project(about)
    inside = view.contains(pixels) & (depth > 0)
    if inside.sum() < 3:
        return None
    whole = CropCamera.of(view)
    pixels = whole.project(about[inside])[0]
    low, high = np.floor(pixels.min(axis=0)).astype(int) - 3, np.ceil(pixels.max(axis=0)).astype(int) + 3
    crop = whole.part(*low, *(high - low))
    planes = draw(field.packed, crop, full=True)
    return crop, np.where(1 - planes[3] >= MIN_ALPHA, planes[5], np.nan)


def _agrees(points: np.ndarray, camera: CropCamera, depth: np.ndarray) -> np.ndarray:
    """(P,) bool: the map shows a depth near the point's own."""
    pixels = np.nan_to_num(camera.project(points)[0], nan=-1.0)
    inside = ((pixels >= 0) & (pixels < [camera.width, camera.height])).all(axis=1)
    columns, rows = np.floor(pixels[inside]).astype(int).T
    result = np.zeros(len(points), bool)
    result[inside] = np.abs(depth[rows, columns] - np.linalg.norm(points[inside] - camera.centre, axis=1)) < AGREE_M
    return result


def table(plots: list[PointSets]) -> list[dict[str, Any]]:
    """One row a plot and set: points, stems with any, gaps along the stem, and how many of the points lie in a true
    stem."""
    rows = []
    for sets in plots:
        for name, stems in sets.points.items():
            count = sum(len(own) for own in stems)
            row: dict[str, Any] = {
                "points": name,
                "plot": sets.plot,
                "stems with any": sum(len(own) > 0 for own in stems),
                "of": len(stems),
                "median a stem": round(float(np.median([len(own) for own in stems]))),
                "covered height %": 100 * float(np.mean([covered(own[:, 2]) for own in stems])),
            }
            if sets.true is not None:
                inside = sum(int(own.sum()) for own in sets.true[name])
                row["in a true stem %"] = 100 * inside / count if count else None
            rows.append(row)
    return rows


def covered(height_m: np.ndarray) -> float:
    """Share of the 10 cm steps of ``STEM_M`` that hold a point, 0 to 1."""
    steps = np.arange(STEM_M[0], STEM_M[1] + 1e-9, 0.1)
    return float((np.histogram(height_m, steps)[0] > 0).mean())


def draw_pair(plots: list[PointSets], other: str) -> Any | None:
    """``other`` beside the surface samples: the stem with most samples from the side, colour by height; ``None`` where
    neither has a point."""
    stems = [(sets, k) for sets in plots for k in range(len(sets.stems))]
    if not stems:
        return None
    sets, k = max(stems, key=lambda stem: len(stem[0].points[SAMPLES][stem[1]]))
    if not len(sets.points[SAMPLES][k]) and not len(sets.points[other][k]):
        return None
    figure, grid = panels(2, 2, 3.4, 4.4)
    for axes, name in zip(grid, (other, SAMPLES), strict=True):
        x, _, height = sets.points[name][k].T
        axes.scatter(x, height, c=height, s=3, cmap="turbo", vmin=STEM_M[0], vmax=STEM_M[1], linewidths=0,
                     rasterized=True)  # fmt: skip
        title = f"{name}\n{len(x)} points about {sets.plot} {sets.stems[k]}"
        dress(axes, title, "east, m", xlim=(-NEAR_M, NEAR_M), ylim=(0, STEM_M[1]))
    grid[0].set_ylabel("height above the ground, m")
    return figure


def draw_overview(plot: PlotFiles) -> Any | None:
    """The photo that shows most Gaussians, what the Gaussians give from there, and the segmented surface points from
    the south (stems in red); ``None`` where no photo shows any."""
    from treedgs_geo.stems.splats.on_torch.rasterize import draw

    assert plot.workspace_in is not None
    _, views, field, dtm = open_field(plot)
    if (view := _widest(field, views)) is None:
        return None
    photo = WholePhotos.load([view], min(WIDE_PX / view.camera.width, 1.0))
    shown = draw(field.packed, photo.cameras[0])
    surface, stems = _thinned(plot, names.SURFACE), _thinned(plot, names.STEMS)
    figure, grid = panels(3, 3, 4.4, 3.6)
    for axes, picture, title in (
        (grid[0], photo.images[0], view.name.rpartition("/")[2]),
        (grid[1], np.clip(np.moveaxis(shown[:3], 0, 2) + shown[3][:, :, None], 0, 1), f"{len(field):,} Gaussians"),
    ):
        axes.imshow(picture)
        dress(axes, title, xticks=[], yticks=[])
    middle = surface[:, 0].mean()
    for xyz, colour, size in ((surface, "0.75", 1.0), (stems, VERMILION, 1.5)):
        height = xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1])
        grid[2].scatter(xyz[:, 0] - middle, height, s=size, color=colour, linewidths=0, rasterized=True)
    dress(grid[2], "surface points from the south, stems red", "east, m", "height above the ground, m")
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
    limits: dict[str, Any] = {"xlim": (-NEAR_M, NEAR_M), "ylim": (0, STEM_M[1])}
    for axes, name, words in ((grid[0], "opacity", "opacity α"), (grid[1], "n_views", "photos w")):
        values = np.asarray(near.attributes[name], float)
        dots = axes.scatter(across, height, c=values, s=2, cmap="viridis", linewidths=0, rasterized=True)
        figure.colorbar(dots, ax=axes).ax.tick_params(labelsize=7)
        dress(axes, f"{words}\n{len(near)} points", "east, m", **limits)
    for x, y, colour in (
        (across, height, "0.8"),
        (stems[:, 0] - reference.xy[best, 0], stems[:, 2] - dtm.height(*stems[:, :2].T), VERMILION),
    ):
        grid[2].scatter(x, y, color=colour, s=2, linewidths=0, rasterized=True)
    dress(grid[2], f"segmented as stem (T)\n{len(stems)} points", "east, m", **limits)
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
