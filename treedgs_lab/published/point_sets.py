"""Three ways from a run's Gaussians to points, about the same stems: centres, fused depth maps, surface samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core import workspace as names
from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.reference import Reference
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.ply import read_field
from treedgs_geo.terrain.dtm import Dtm, read_dtm

from .baseline_points import fuse_depth, means_only
from .paper_pictures import NEAR_M, STEM_M, panels, scene
from .segmentation import true_labels

#: Stems that are compared, evenly over the diameters; depth maps of a whole scene are drawn for each of them.
COMPARED = 4
MEANS, DEPTH, SAMPLES = "means of the Gaussians", "fused depth maps", "surface samples"


@dataclass(frozen=True)
class PointSets:
    """points: set -> (N, 3) of each compared stem: east and north of the stem, height above the ground, m. true: set ->
    (N,) whether a point lies in a true stem, of each stem; ``None`` without truth."""

    plot: str
    stems: list[str]
    points: dict[str, list[np.ndarray]]
    true: dict[str, list[np.ndarray]] | None


def has_gaussians(plot: PlotFiles) -> bool:
    """A workspace with a field and its surface samples."""
    folder = plot.workspace_in
    return folder is not None and (folder / names.FIELD).is_file() and (folder / names.SURFACE).is_file()


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
    stems = compared_stems(reference)
    samples = read_cloud(plot.workspace_in / names.SURFACE).xyz
    centres = frame.to_project(means_only(field)[0])
    points: dict[str, list[np.ndarray]] = {MEANS: [], DEPTH: [], SAMPLES: []}
    true: dict[str, list[np.ndarray]] = {MEANS: [], DEPTH: [], SAMPLES: []}
    truth = None if plot.truth is None else plot.truth.with_name("stems.json")
    for k in stems:
        xy = reference.xy[k]
        fused = _fused(field, views, frame, dtm, xy)
        for name, cloud in ((MEANS, centres), (DEPTH, fused), (SAMPLES, samples)):
            own, inside = _about(cloud, dtm, xy, truth)
            points[name].append(own)
            true[name].append(inside)
    labelled = truth is not None and truth.exists()
    return PointSets(plot.name, [str(reference.tree[k]) for k in stems], points, true if labelled else None)


def _fused(field: GaussianField, views: Sequence[View], frame: LocalFrame, dtm: Dtm, xy: np.ndarray) -> np.ndarray:
    """(N, 3) fused depth about a stem, project coordinates."""
    ground = float(dtm.height(xy[:1], xy[1:])[0])
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    rim = [xy[0] + NEAR_M * np.cos(turn), xy[1] + NEAR_M * np.sin(turn)]
    ends = np.concatenate([np.column_stack([*rim, np.full(len(turn), ground + h)]) for h in STEM_M])
    return frame.to_project(fuse_depth(field, views, about=frame.to_local(ends))[0])


def _about(xyz: np.ndarray, dtm: Dtm, xy: np.ndarray, truth: Path | None) -> tuple[np.ndarray, np.ndarray]:
    """The points about a stem, and which of them lie in a true stem."""
    near = xyz[np.hypot(*(xyz[:, :2] - xy).T) < NEAR_M]
    height = near[:, 2] - dtm.height(near[:, 0], near[:, 1])
    here = (height > STEM_M[0]) & (height < STEM_M[1])
    near, height = near[here], height[here]
    inside = np.zeros(len(near), bool)
    if truth is not None and truth.exists() and len(near):
        inside = true_labels(near, truth)[0] > 0
    return np.column_stack([near[:, :2] - xy, height]), inside


def table(plots: list[PointSets]) -> list[dict[str, Any]]:
    """One row a plot and set: points, stems with any, gaps along the stem, and how many of the points lie in a true
    stem."""
    return [row for sets in plots for row in _rows(sets)]


def _rows(sets: PointSets) -> list[dict[str, Any]]:
    rows = []
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
        points = sets.points[name][k]
        axes.scatter(
            points[:, 0], points[:, 2], c=points[:, 2], s=3, cmap="turbo", vmin=STEM_M[0], vmax=STEM_M[1],
            linewidths=0, rasterized=True,
        )  # fmt: skip
        axes.set_xlim(-NEAR_M, NEAR_M)
        axes.set_ylim(0, STEM_M[1])
        axes.set_title(f"{name}\n{len(points)} points about {sets.plot} {sets.stems[k]}", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.set_xlabel("east, m", fontsize=8)
    grid[0].set_ylabel("height above the ground, m", fontsize=8)
    return figure
