"""Evidence sheets of a cloud run: each stem's own points, what lies beside them, and the circles in its slices."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

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
    from .cloud import CloudJob

#: Points this far beside a stem are drawn, metres; of at most so many of the cloud's.
_AROUND_M, _MAX_AROUND = 3.0, 300_000


def name_run(job: CloudJob) -> None:
    """Give the trees their ``run_id``: the same settings and results give the same."""
    said = {name: value for name, value in to_json(job.settings).items() if name not in _OUTPUTS}
    run_id = short_hash(__version__, said, [asdict(tree) for tree in job.trees])
    for tree in job.trees:
        tree.run_id = run_id


_OUTPUTS = ("output", "report", "sheets", "dry_run")


def sheets_of(output: Path) -> Path:
    """Folder of the sheets beside a tree layer: ``trees_sheets`` beside ``trees.gpkg``."""
    return output.with_name(f"{output.stem}_sheets")


def make_cloud_sheets(job: CloudJob, reporter: Reporter) -> None:
    """``job.sheets`` beside the tree layer; trouble with a sheet is a warning."""
    wanted, folder = job.settings.sheets, sheets_of(job.settings.output)
    chosen = trees_with_sheets(job.trees, "check" if wanted == "auto" else wanted, wanted != "auto")
    if not chosen:
        return
    try:
        with sheets_folder(folder, chosen[0].run_id) as made:
            _write(job, chosen, made, reporter)
    except OutputError as problem:
        reporter.warn(f"No evidence sheets: {problem}")
    job.sheets = written_sheets(folder, chosen[0].run_id)


def _write(job: CloudJob, trees: list[Tree], folder: Path, reporter: Reporter) -> None:
    xyz, tree_id = job.cloud.xyz, job.tree_id
    wanted = {tree.tree_id for tree in trees}
    own = {int(number): xyz[group] for number, group in zip(*grouped(tree_id), strict=True) if number in wanted}
    others = np.flatnonzero(tree_id <= 0)
    around = xyz[others[:: max(len(others) // _MAX_AROUND, 1)]]
    index = cKDTree(around[:, :2])
    slices = defaultdict(list)
    for row in job.sections:
        if row["height_m"] <= SLICE_HEIGHTS[-1]:
            slices[row["tree_id"]].append(row)
    for number, tree in enumerate(trees):
        points = own.get(tree.tree_id, np.empty((0, 3)))
        beside = around[np.sort(index.query_ball_point([tree.x, tree.y], _AROUND_M, p=np.inf)).astype(int)]
        ground = tree.z_ground
        if ground is None:
            ground = float(points[:, 2].min()) if len(points) else 0.0
        foot = np.array([tree.x, tree.y, ground])
        evidence = CloudEvidence(tree, points - foot, beside - foot, slices[tree.tree_id])
        try:
            write_sheet(folder, tree, cloud_sheet(evidence))
        except (ValueError, IndexError, ArithmeticError, cv2.error) as problem:
            reporter.warn(f"Tree {tree.tree_id}: its evidence sheet could not be drawn ({problem}).")
        reporter.progress((number + 1) / len(trees))
