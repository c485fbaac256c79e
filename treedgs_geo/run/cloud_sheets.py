"""Evidence sheets of a cloud run: each stem's own points, what lies beside them, and the circles in its slices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from scipy.spatial import cKDTree

from .. import __version__
from ..core.errors import OutputError
from ..core.files import short_hash
from ..core.progress import Reporter
from ..core.settings import to_json
from ..inventory.evidence.cloud_sheet import SLICE_HEIGHTS, CloudEvidence, cloud_sheet
from ..inventory.evidence.files import sheets_folder, trees_with_sheets, write_sheet, written_sheets
from ..pointcloud.cloud import grouped
from ..stems.quality.tree import Tree

if TYPE_CHECKING:
    from .settings import PointcloudToDbhSettings

#: Points this far beside a stem are drawn, metres; of at most so many of the cloud's.
_AROUND_M, _MAX_AROUND = 3.0, 300_000


def name_run(settings: PointcloudToDbhSettings, trees: list[Tree]) -> None:
    """Give the trees their ``run_id``: the same settings and results give the same."""
    said = {name: value for name, value in to_json(settings).items() if name not in _OUTPUTS}
    run_id = short_hash(__version__, said, [asdict(tree) for tree in trees])
    for tree in trees:
        tree.run_id = run_id


_OUTPUTS = ("output", "report", "sheets", "dry_run")


def sheets_of(output: Path) -> Path:
    """Folder of the sheets beside a tree layer: ``trees_sheets`` beside ``trees.gpkg``."""
    return output.with_name(f"{output.stem}_sheets")


def make_cloud_sheets(
    wanted: str,
    output: Path,
    xyz: np.ndarray,
    tree_id: np.ndarray,
    trees: list[Tree],
    slices: list[dict[str, Any]],
    reporter: Reporter,
) -> dict[int, Path]:
    """``tree_id`` -> evidence sheet; trouble with a sheet is a warning. wanted: of whom. output: the tree
    layer. xyz: (N, 3) project metres. slices: of
    :func:`treedgs_geo.stems.cloud.estimate.sections.stem_sections`."""
    chosen = trees_with_sheets(trees, "check" if wanted == "auto" else wanted, wanted != "auto")
    folder = sheets_of(output)
    if not chosen:
        return {}
    try:
        with sheets_folder(folder, chosen[0].run_id) as made:
            _write(chosen, _own_points(xyz, tree_id, chosen), _neighbourhood(xyz, tree_id), slices, made, reporter)
    except OutputError as problem:
        reporter.warn(f"No evidence sheets: {problem}")
    return written_sheets(folder, chosen[0].run_id)


def _write(
    trees: list[Tree],
    own: dict[int, np.ndarray],
    around: Callable[[float, float], np.ndarray],
    slices: list[dict[str, Any]],
    folder: Path,
    reporter: Reporter,
) -> None:
    of_tree: dict[int, list[dict[str, Any]]] = {}
    for row in slices:
        if row["height_m"] > SLICE_HEIGHTS[-1]:
            continue
        of_tree.setdefault(row["tree_id"], []).append(row)
    for number, tree in enumerate(trees):
        points = own.get(tree.tree_id, np.empty((0, 3)))
        beside = around(tree.x, tree.y)
        ground = tree.z_ground
        if ground is None:
            ground = float(points[:, 2].min()) if len(points) else 0.0
        foot = np.array([tree.x, tree.y, ground])
        evidence = CloudEvidence(tree, points - foot, beside - foot, of_tree.get(tree.tree_id, []))
        try:
            write_sheet(folder, tree, cloud_sheet(evidence))
        except (ValueError, IndexError, ArithmeticError, cv2.error) as problem:
            reporter.warn(f"Tree {tree.tree_id}: its evidence sheet could not be drawn ({problem}).")
        reporter.progress((number + 1) / len(trees))


def _own_points(xyz: np.ndarray, tree_id: np.ndarray, trees: list[Tree]) -> dict[int, np.ndarray]:
    """``tree_id`` -> (N, 3) its points."""
    wanted = {tree.tree_id for tree in trees}
    return {int(number): xyz[group] for number, group in zip(*grouped(tree_id), strict=True) if number in wanted}


def _neighbourhood(xyz: np.ndarray, tree_id: np.ndarray) -> Callable[[float, float], np.ndarray]:
    """A function of x, y -> (M, 3) points within some metres that belong to no stem."""
    others = np.flatnonzero(tree_id <= 0)
    others = others[:: max(len(others) // _MAX_AROUND, 1)]
    points = xyz[others]
    index = cKDTree(points[:, :2])

    def around(x: float, y: float) -> np.ndarray:
        return points[np.sort(index.query_ball_point([x, y], _AROUND_M, p=np.inf)).astype(int)]

    return around
