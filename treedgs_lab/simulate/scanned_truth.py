"""What is true of a plot whose world is a scan: the rings measured in it, and how wide its patches stand."""

from __future__ import annotations

from typing import Any

import numpy as np

from .scanned import ScannedForest, copied, is_true
from .scene import AXIS_STEP, PlantedStem, axis_at
from .world import World


def scanned_stems(scan: ScannedForest, radius_m: float) -> list[PlantedStem]:
    """The stems whose diameter is truth (:func:`.scanned.is_true`), and again in its copies beside the plot."""
    stems = []
    for tree in filter(is_true, scan.trees):
        curve = [row for row in scan.sections if row["tree_id"] == tree.tree_id]
        h = np.array([row["height_m"] for row in curve] or [tree.bh_m])
        xy = np.array([(row["x"], row["y"]) for row in curve] or [(tree.x, tree.y)])
        lean = np.polyfit(h, xy, 1)[0] if len(h) > 2 else np.zeros(2)
        s = AXIS_STEP * np.arange(int((tree.height_m or max(float(h.max()), 3.0)) / AXIS_STEP) + 1)
        rise = s / np.sqrt(1 + lean @ lean)
        axis = np.column_stack([np.array([tree.x, tree.y]) + (rise[:, None] - tree.bh_m) * lean, rise + tree.z_ground])
        axis, dbh_m = axis - scan.origin, (tree.dbh_cm or np.nan) / 100
        for i in range(-2, 3):
            for j in range(-2, 3):
                placed = copied(axis, scan, np.array([i, j]))
                at = float(np.hypot(*placed[round(tree.bh_m / AXIS_STEP), :2]))
                own = i == j == 0
                if not own and at > radius_m + 5:
                    continue
                stems.append(
                    PlantedStem(
                        f"S{tree.tree_id}" + ("" if own else f"_{i}_{j}"), "scanned" if own else "copy", "live",
                        own and at <= radius_m, placed, np.full(len(s), dbh_m / 2), dbh_m, float(s[-1]), float(s[-1]),
                        float(np.arctan2(*(lean * np.where((i % 2, j % 2), -1, 1))[::-1])), 2,
                    )
                )  # fmt: skip
    return stems


def rendered_width(world: World, stem: PlantedStem, s_m: float) -> float:
    """What a tape would read of the patches that stand for a stem at arc length ``s_m``, m: the mean over directions of
    its width, out to where nothing stands at half of nine heights; twigs that touch it count, too."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ahead = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(24)])[:, None, None]
    side = np.column_stack([-np.sin(turn), np.cos(turn), np.zeros(24)])[:, None, None]
    centre = axis_at(stem, s_m + np.linspace(-0.12, 0.12, 9))[0][None, :, None]
    back, offset = stem.dbh_m / 2 + 0.03, stem.dbh_m * np.linspace(0, 0.8, 241)
    width = np.zeros(24)
    for sign in (-1, 1):
        start = centre - back * ahead + sign * offset[:, None] * side
        way = np.broadcast_to(2 * back * ahead, start.shape).reshape(-1, 3)
        met = (world.first_hits(start.reshape(-1, 3), way)[0] <= 1).reshape(24, 9, -1)
        open_ = met.mean(axis=1) < 0.5
        width += offset[np.where(open_.any(axis=1), np.argmax(open_, axis=1) - 1, -1)]
    return float(width.mean())


def scanned_table(
    scan: ScannedForest, stems: list[PlantedStem], world: World
) -> tuple[list[dict[str, Any]], dict[str, list], list[list[float]]]:
    """As :func:`.truth.stem_table`, from the rings measured in the scan. Its other stems (not :func:`.scanned.is_true`)
    stand with the saplings: they are no truth, and nothing false either."""
    trees, rows = {tree.tree_id: tree for tree in scan.trees}, []
    for index, stem in enumerate(stems):
        tree = trees[int(stem.tree_id[1:].split("_")[0])]
        top = stem.axis[-1] - stem.axis[0]
        lean = float(np.degrees(np.arctan2(np.hypot(*top[:2]), top[2])))
        rows.append(
            {
                "tree_id": stem.tree_id, "kind": stem.kind, "status": stem.status, "in_plot": bool(stem.in_plot),
                "bh": stem.axis[round(tree.bh_m / AXIS_STEP)], "base": stem.axis[0], "dbh_cm": tree.dbh_cm,
                "dbh_se_cm": tree.dbh_se_cm, "w_min_cm": None, "w_max_cm": None, "height_m": stem.height_m,
                "lean_deg": lean, "lean_bh_deg": lean, "crown_base_m": None,
                "lean_az_grid_deg": float(np.degrees(np.arctan2(*top[:2])) % 360),
                "taper_cm_m": None if tree.taper_cm_m is None else -tree.taper_cm_m,
                "index": index,
                "rendered_cm": 100 * rendered_width(world, stem, tree.bh_m) if stem.kind == "scanned" else None,
            }
        )  # fmt: skip
    curves: dict[str, list] = {}
    for row in scan.sections:
        z = (trees[row["tree_id"]].z_ground or 0.0) + row["height_m"]
        place = (np.array([row["x"], row["y"], z]) - scan.origin).tolist()
        curves.setdefault(f"S{row['tree_id']}", []).append([row["height_m"], row["d_cm"], *place])
    others = []
    for tree in (tree for tree in scan.trees if not is_true(tree)):
        place = np.array([[tree.x, tree.y, scan.origin[2]]]) - scan.origin
        copies = [copied(place, scan, np.array([i, j]))[0] for i in range(-2, 3) for j in range(-2, 3)]
        others += [[*copy[:2].tolist(), tree.dbh_cm or 0.0] for copy in copies]
    return rows, curves, others
