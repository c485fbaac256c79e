"""Stem segmentation, point by point: against a simulated plot's true stems in figures, and in pictures which stem a
point was given and which points are wrong."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.report.charts import BLUE, ORANGE, VERMILION

from .paper_pictures import dress, panels

#: A point belongs to a stem within this much of its true surface, outside and inside, m.
SHELL_M = 0.03
#: Stems are labelled up to here, m.
TOP_M = 8.0
#: Most points of a cloud that are kept for its picture.
MOST_POINTS = 40_000


def stems_json(plot: PlotFiles) -> Path | None:
    """Where the true stems of a simulated plot are; ``None`` where nobody knows them."""
    path = None if plot.truth is None else plot.truth.with_name("stems.json")
    return path if path is not None and path.exists() else None


def true_labels(xyz: np.ndarray, profiles: Path) -> np.ndarray:
    """(N,) number of the true stem of each point (0 = none, 1 = the first).

    A point is stem when it lies within the stem's true radius + 3 cm of its axis, from the foot to ``TOP_M``. profiles:
    ``truth/stems.json`` of a simulated plot.

    Raises:
        InputError: no such file or another content.
    """
    try:
        record = json.loads(profiles.read_text(encoding="utf-8"))
        origin, stems = np.array(record["origin"], float), record["stems"]
    except (OSError, ValueError, KeyError) as problem:
        raise InputError(
            f"{profiles}: is not the stems.json of a simulated plot ({problem}); give --truth of one."
        ) from None
    local = xyz - origin
    label = np.zeros(len(xyz), np.int32)
    tree = cKDTree(local[:, :2])
    for number, profile in enumerate(stems.values(), start=1):
        rows = np.array(profile, float)
        rows = rows[rows[:, 0] <= TOP_M]
        z, x, y, radius = rows[:, 4], rows[:, 2], rows[:, 3], rows[:, 1] / 200
        reach = float(np.hypot(x - x[0], y - y[0]).max() + radius.max() + SHELL_M)
        near = np.array(tree.query_ball_point([x[0], y[0]], reach), int)
        if not len(near):
            continue
        at = local[near, 2]
        away = np.hypot(local[near, 0] - np.interp(at, z, x), local[near, 1] - np.interp(at, z, y))
        own = (at >= z[0]) & (at <= z[-1]) & (away <= np.interp(at, z, radius) + SHELL_M)
        label[near[own]] = number
    return label


def score_segmentation(predicted: np.ndarray, true: np.ndarray, whole: bool = True) -> dict:
    """Stem or not, point by point. predicted, true: (N,) stem numbers, <= 0 = none. whole: the cloud holds the points
    that were called no stem; without them nothing can be missed, so what depends on that is ``None``.

    Returns:
        ``tp, fp, fn, tn, precision, recall, f1, iou, accuracy``; ``same_stem``: share of the points rightly called
        stem that also carry their stem's number (each predicted number stands for the true stem it holds most of).
    """
    p, t = np.asarray(predicted) > 0, np.asarray(true) > 0
    tp, fp, fn = int((p & t).sum()), int((p & ~t).sum()), int((~p & t).sum())
    tn = len(p) - tp - fp - fn

    def share(a: float, b: float) -> float | None:
        return round(a / b, 4) if b else None

    both = p & t
    right = int(pd.crosstab(np.asarray(predicted)[both], np.asarray(true)[both]).max(axis=1).sum())
    return {
        "tp": tp,
        "fp": fp,
        "fn": fn if whole else None,
        "tn": tn if whole else None,
        "precision": share(tp, tp + fp),
        "recall": share(tp, tp + fn) if whole else None,
        "f1": share(2 * tp, 2 * tp + fp + fn) if whole else None,
        "iou": share(tp, tp + fp + fn) if whole else None,
        "accuracy": share(tp + tn, len(p)) if whole else None,
        "same_stem": share(right, tp),
    }


@dataclass(frozen=True)
class LabelledPoints:
    """A cloud's points about the reference stems, in the band that is scored (evenly thinned).

    xyz: (N, 3) east and north of the plot's middle, height above the ground, m. label: (N,) stem number given, <= 0 =
    none. true: (N,) true stem number, 0 = none; ``None`` without truth. of: points before thinning. whole: the cloud
    holds points that were called no stem, too.
    """

    source: str
    plot: str
    xyz: np.ndarray
    label: np.ndarray
    true: np.ndarray | None
    of: int
    whole: bool

    @classmethod
    def thinned(
        cls, source: str, plot: str, xyz: np.ndarray, label: np.ndarray, true: np.ndarray | None, whole: bool
    ) -> LabelledPoints:
        """Every so-manyth point, at most :data:`MOST_POINTS` of them."""
        step = max(-(-len(xyz) // MOST_POINTS), 1)
        own = xyz[::step] - [*(xyz[:, :2].mean(axis=0) if len(xyz) else (0.0, 0.0)), 0.0]
        return cls(source, plot, own, label[::step], None if true is None else true[::step], len(xyz), whole)


def draw_labels(clouds: list[LabelledPoints]) -> Any | None:
    """A row a cloud: labels from above, true labels from above, right and wrong ones from the side."""
    shown = [cloud for cloud in clouds if len(cloud.xyz)]
    if not shown:
        return None
    figure, grid = panels(3 * len(shown), 3, 3.8, 3.6)
    for row, cloud in enumerate(shown):
        given, true, beside = grid[3 * row : 3 * row + 3]
        _from_above(given, cloud.xyz, cloud.label, f"{cloud.plot}, {cloud.source}: labels given")
        if cloud.true is None:
            true.set_visible(False)
        else:
            _from_above(true, cloud.xyz, cloud.true, "true labels")
        _from_beside(beside, cloud)
    return figure


def _from_above(axes: Any, xyz: np.ndarray, label: np.ndarray, title: str) -> None:
    import matplotlib

    stem = label > 0
    # Neighbouring numbers get colours far apart; grey means no stem.
    colours = np.delete(matplotlib.colormaps["tab20"](np.arange(20)), (14, 15), axis=0)
    colour = colours[label[stem] * 7 % len(colours)]
    axes.scatter(*xyz[~stem, :2].T, s=1.5, color="0.8", linewidths=0, rasterized=True)
    axes.scatter(*xyz[stem, :2].T, s=2.5, c=colour, linewidths=0, rasterized=True)
    dress(axes, f"{title}\n{len(np.unique(label[stem]))} stems", "east, m", aspect="equal")


def _from_beside(axes: Any, cloud: LabelledPoints) -> None:
    given = cloud.label > 0
    true = given if cloud.true is None else cloud.true > 0
    parts = [
        ("neither", ~given & ~true, "0.85"),
        ("stem, rightly" if cloud.true is not None else "stem", given & true, BLUE),
    ]
    if cloud.true is not None:
        parts += [("stem, wrongly", given & ~true, VERMILION), ("stem missed", ~given & true, ORANGE)]
    for name, which, colour in parts:
        axes.scatter(
            cloud.xyz[which, 0], cloud.xyz[which, 2], s=2, color=colour, linewidths=0, rasterized=True,
            label=f"{name} ({100 * which.mean():.0f} %)",
        )  # fmt: skip
    axes.legend(fontsize=6.5, markerscale=4, loc="upper left", bbox_to_anchor=(0, 1.02), ncols=2)
    top = 1.3 * max(float(cloud.xyz[:, 2].max()), 1.0)
    dress(axes, f"from the south; {len(cloud.xyz)} of {cloud.of} points", "east, m", "height, m", ylim=(0, top))
