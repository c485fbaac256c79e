"""A rendered or simulated plot as benchmarks need it: photos and ground, true or of a workspace, and the reference."""

from __future__ import annotations

import csv
from dataclasses import asdict
from pathlib import Path

import numpy as np

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.plots import read_plots
from treedgs_geo.inventory.accuracy.scores import score
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.model import load_views
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.dtm import Dtm, read_dtm
from treedgs_lab.benchmarking.plot import TruePlot, score_trees

#: A stem counts as visible with so many clear photos of its breast height.
CLEAR_VIEWS = 3
#: Of a plot whose cloud is used: as few and small photos as the simulator allows.
FEW_PHOTOS: dict = {"photos": 10, "image_width": 320, "image_height": 240, "gsd_cm": 2.5, "samples": 1}
#: Pulses per square metre, one after the other: plots of different sizes.
DENSITIES = (400.0, 700.0, 1000.0, 1400.0)


def scene_of(plot: Path, workspace: Path | None = None) -> tuple[LocalFrame, list[View], Dtm]:
    """Frame, photos and ground (project coordinates): the renderer's own, or those of a workspace of the chain."""
    truth = TruePlot.load(plot)
    if workspace is None:
        return truth.frame, truth.views(), truth.dtm
    frame, views = load_views(workspace / "sfm", plot / "images")
    own = workspace / "dtm.tif"
    return frame, views, read_dtm(own, frame.crs) if own.exists() else truth.dtm


def area_of(plot: Path, frame: LocalFrame) -> Area:
    """The circles of ``plots.csv``, local."""
    plots = read_plots(plot / "plots.csv", frame.crs)
    centres = frame.to_local(np.array([[p.x, p.y, 0.0] for p in plots]))[:, :2]
    return Area.circles(centres, np.array([p.radius_m for p in plots]))


def plot_inputs(plot: Path, workspace: Path | None = None) -> tuple:
    """Photos, frame, ground function of local x and y, and area: what finds stems in photos."""
    frame, views, dtm = scene_of(plot, workspace)
    return views, frame, dtm.local(frame).height, area_of(plot, frame)


def judged(plot: TruePlot, trees: list[Tree]) -> tuple[dict, dict[str, float]]:
    """Accuracy of trees on the plot's clearly visible stems, and its diameters' errors by stem."""
    rows = score_trees(plot, trees, plot.clear_views({view.name for view in plot.views()}))
    inside = set(plot.trees.loc[plot.trees["in_plot"].astype(str).str.lower() == "true", "tree_id"].astype(str))
    counted = [row for row in rows if row["tree_id"] in inside and (row["clear"] or 0) >= CLEAR_VIEWS]
    read = [row for row in counted if row["read_cm"] is not None]
    errors = np.array([row["read_cm"] - row["true_cm"] for row in read])
    accuracy = asdict(score(errors, np.array([row["true_cm"] for row in read]), len(counted)))
    accuracy["n_false"] = sum(bool(row.get("false")) for row in rows)
    return accuracy, {row["tree_id"]: row["read_cm"] - row["true_cm"] for row in read}


def truth_rows(plot: Path, least_clear: int = 0, in_plot: bool = True) -> list[dict[str, str]]:
    """Rows of ``truth/trees.csv`` with at least so many clear photos of breast height; all plots' or the plot's own."""
    with open(plot / "truth" / "trees.csv", newline="", encoding="utf-8") as stream:
        return [
            row
            for row in csv.DictReader(stream)
            if (row["in_plot"] == "True" or not in_plot) and int(row["n_unoccluded_bh_views"] or 0) >= least_clear
        ]


def local_places(rows: list[dict[str, str]], frame: LocalFrame) -> np.ndarray:
    """(T, 2) true breast heights in local metres."""
    return frame.to_local(np.array([[float(row["E_bh"]), float(row["N_bh"]), 0.0] for row in rows]).reshape(-1, 3))[
        :, :2
    ]
