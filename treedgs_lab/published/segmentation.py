"""Point-wise scores of stem segmentation against a labelled cloud or a simulated plot's true stems."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from treedgs_geo.core.errors import InputError

#: A point belongs to a stem within this much of its true surface, outside and inside, m.
SHELL_M = 0.03


def true_labels(xyz: np.ndarray, stems_json: Path, top_m: float = 8.0) -> tuple[np.ndarray, list[str]]:
    """(N,) number of the true stem of each point (0 = none, 1 = first name), and the names.

    A point is stem when it lies within the stem's true radius + 3 cm of its axis, from the foot to ``top_m``. Profiles:
    ``truth/stems.json`` of a simulated plot.

    Raises:
        InputError: no such file or another content.
    """
    try:
        record = json.loads(Path(stems_json).read_text(encoding="utf-8"))
        origin, profiles = np.array(record["origin"], float), record["stems"]
    except (OSError, ValueError, KeyError) as problem:
        raise InputError(
            f"{stems_json}: is not the stems.json of a simulated plot ({problem}); give --truth of one."
        ) from None
    local = xyz - origin
    label = np.zeros(len(xyz), np.int32)
    tree = cKDTree(local[:, :2])
    for number, profile in enumerate(profiles.values(), start=1):
        rows = np.array(profile, float)
        rows = rows[rows[:, 0] <= top_m]
        z, x, y, radius = rows[:, 4], rows[:, 2], rows[:, 3], rows[:, 1] / 200
        reach = float(np.hypot(x - x[0], y - y[0]).max() + radius.max() + SHELL_M)
        near = np.array(tree.query_ball_point([x[0], y[0]], reach), int)
        if not len(near):
            continue
        at = local[near, 2]
        away = np.hypot(local[near, 0] - np.interp(at, z, x), local[near, 1] - np.interp(at, z, y))
        own = (at >= z[0]) & (at <= z[-1]) & (away <= np.interp(at, z, radius) + SHELL_M)
        label[near[own]] = number
    return label, list(profiles)


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
    right = 0
    for number in np.unique(np.asarray(predicted)[both]):
        right += int(np.bincount(np.asarray(true)[both & (predicted == number)]).max())
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
