"""The sheet of a stem in a cloud: slices with their circles, the stem from two sides, its taper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...stems.quality.tree import Tree
from .canvas import BLUE, FAINT, INK, LINE, Canvas
from .parts import MARGIN, Box, DiameterChart, amount, begin_sheet

#: Heights of the slices, metres, and the thickness of one that shows this many points; thinner clouds get thicker ones.
SLICE_HEIGHTS = np.arange(0.5, 4.51, 0.5)
_THIN_M, _THICK_M, _ENOUGH = 0.2, 0.5, 24
#: Most points drawn of a slice and of a side view.
_MAX_POINTS = 4000
_TOP, _SIDE, _HIGH_M = 92, 122, 5.0
_POINTS, _OTHERS = (70, 70, 70), (200, 200, 200)


@dataclass(frozen=True)
class CloudEvidence:
    """What a sheet of a stem in a cloud says. points: (N, 3) metres from the stem at breast height and its ground, of
    this tree; around: (M, 3) those beside it. slices: its rows of ``stems.cloud.estimate.sections.stem_sections``."""

    tree: Tree
    points: np.ndarray
    around: np.ndarray
    slices: list[dict[str, Any]]


def cloud_sheet(evidence: CloudEvidence) -> Canvas:
    """Draw the sheet."""
    tree = evidence.tree
    below = _TOP + _SIDE + 60
    canvas = begin_sheet(tree, below, 350, _rows(evidence))
    half_m = max(1.9 * _radius(evidence), 0.12)
    words = "Slices of the stem from above, north up.  Blue: the circle in a slice.  Dashed: the stem as reported."
    canvas.text(MARGIN, _TOP - 22, words, 12, FAINT)
    for number, height in enumerate(SLICE_HEIGHTS):
        _slice(canvas, evidence, float(height), MARGIN + number * (_SIDE + 9), half_m)
    for column, (axis, name) in enumerate(((0, "seen from the south"), (1, "seen from the east"))):
        _side_view(canvas, evidence, axis, name, (MARGIN + column * 142, below, 132, 340), half_m)
    _taper(canvas, evidence, (MARGIN + 296, below, 270, 340))
    return canvas


def _radius(evidence: CloudEvidence) -> float:
    """Of the stem, or of its points where it has no DBH, metres."""
    if evidence.tree.dbh_cm is not None:
        return evidence.tree.dbh_cm / 200
    low = evidence.points[(evidence.points[:, 2] > 0.3) & (evidence.points[:, 2] < 3.0)]
    if len(low) < 3:
        return 0.15
    return float(np.clip(np.percentile(np.hypot(*(low[:, :2] - np.median(low[:, :2], axis=0)).T), 80), 0.05, 1.0))


def _reported(evidence: CloudEvidence, height_m: np.ndarray) -> np.ndarray:
    """Diameter at heights by the DBH and the taper in the layer, cm; NaN without a DBH."""
    tree = evidence.tree
    if tree.dbh_cm is None:
        return np.full(np.shape(height_m), np.nan)
    return np.maximum(tree.dbh_cm + (tree.taper_cm_m or 0.0) * (np.asarray(height_m, float) - tree.bh_m), 0.0)


def _axis(evidence: CloudEvidence, height: float) -> np.ndarray:
    """(2,) where the stem is expected at a height: along the circles found in other slices."""
    tree = evidence.tree
    if len(evidence.slices) < 2:
        return np.zeros(2)
    known = np.array([[row["height_m"], row["x"] - tree.x, row["y"] - tree.y] for row in evidence.slices])
    slope, middle = np.polyfit(known[:, 0], known[:, 1:], 1)
    return middle + slope * height


def _slice(canvas: Canvas, evidence: CloudEvidence, height: float, left: float, half_m: float) -> None:
    points, top = evidence.points, _TOP
    scale = 0.5 * _SIDE / half_m
    here, thickness = _cut(points, height)
    found = next((row for row in evidence.slices if abs(row["height_m"] - height) < 0.01), None)
    tree = evidence.tree
    middle = _axis(evidence, height)
    if found is not None:
        middle = np.array([found["x"] - tree.x, found["y"] - tree.y])

    def place(xy: np.ndarray) -> np.ndarray:
        return np.column_stack(
            [left + 0.5 * _SIDE + scale * (xy[:, 0] - middle[0]), top + 0.5 * _SIDE - scale * (xy[:, 1] - middle[1])]
        )

    beside = evidence.around[np.abs(evidence.around[:, 2] - height) <= thickness / 2]
    for cloud, colour in ((beside, _OTHERS), (here, _POINTS)):
        at = place(cloud[:: max(len(cloud) // _MAX_POINTS, 1), :2])
        inside = (at[:, 0] > left) & (at[:, 0] < left + _SIDE - 2) & (at[:, 1] > top) & (at[:, 1] < top + _SIDE - 2)
        size = 3 if len(here) < 100 else 2 if len(here) < 400 else 1
        canvas.dots(at[inside], colour, size, size)
    centre = left + 0.5 * _SIDE, top + 0.5 * _SIDE
    reported = float(_reported(evidence, np.array([height]))[0])
    if np.isfinite(reported):
        canvas.ring(*centre, scale * reported / 200, FAINT)
    if found is not None:
        canvas.circle(*centre, scale * found["d_cm"] / 200, BLUE, 2)
    canvas.box(left, top, _SIDE, _SIDE, LINE)
    said = f"{found['d_cm']:.1f} cm" if found else ("no circle" if len(here) else "no points")
    canvas.text(centre[0], top + _SIDE + 5, f"at {height:g} m", 12, INK, True, "ma")
    canvas.text(centre[0], top + _SIDE + 21, said, 11, BLUE if found else FAINT, at="ma")
    canvas.text(centre[0], top + _SIDE + 36, f"{len(here)} points", 9, FAINT, at="ma")


def _cut(points: np.ndarray, height: float) -> tuple[np.ndarray, float]:
    """Points of a slice, and its thickness."""
    for thickness in (_THIN_M, _THICK_M):
        here = points[np.abs(points[:, 2] - height) <= thickness / 2]
        if len(here) >= _ENOUGH:
            break
    return here, thickness


def _side_view(canvas: Canvas, evidence: CloudEvidence, axis: int, name: str, box: Box, half_m: float) -> None:
    """The lower stem from one side; widths are drawn larger than heights where the stem is slim."""
    left, top, width, height = box
    canvas.text(left, top, name, 11, FAINT)
    top, height = top + 20, height - 46
    across, up = 0.5 * width / (1.3 * half_m), height / _HIGH_M
    for cloud, colour in ((evidence.around, _OTHERS), (evidence.points, _POINTS)):
        cloud = cloud[(cloud[:, 2] > 0) & (cloud[:, 2] < _HIGH_M) & (np.abs(cloud[:, axis]) < 1.3 * half_m)]
        cloud = cloud[:: max(len(cloud) // _MAX_POINTS, 1)]
        # From the east, north lies to the right.
        at = np.column_stack([left + 0.5 * width + across * cloud[:, axis], top + height - up * cloud[:, 2]])
        canvas.dots(at[at[:, 0] < left + width - 2], colour, 1, 1)
    heights = np.array([row["height_m"] for row in evidence.slices])
    for row, z in zip(evidence.slices, heights, strict=True):
        middle = (row["x"] - evidence.tree.x, row["y"] - evidence.tree.y)[axis]
        ends = left + 0.5 * width + across * (middle + np.array([-1, 1]) * row["d_cm"] / 200)
        canvas.line([(ends[0], top + height - up * z), (ends[1], top + height - up * z)], BLUE, 2)
    y = top + height - up * evidence.tree.bh_m
    canvas.dashed([(left, y), (left + width, y)], FAINT)
    canvas.box(left, top, width, height, LINE)
    canvas.text(left + 2, y - 2, "BH", 10, FAINT, at="ls")
    length_cm = next(c for c in (100, 50, 20, 10, 5) if c / 100 * across <= 0.6 * width or c == 5)
    end = left + length_cm / 100 * across
    canvas.line([(left, top + height + 8), (end, top + height + 8)], INK, 3)
    canvas.text(end + 4, top + height + 8, f"{length_cm} cm", 10, INK, at="lm")


def _taper(canvas: Canvas, evidence: CloudEvidence, box: Box) -> None:
    heights = np.linspace(0.3, 4.7, 9)
    found = np.array([[row["height_m"], row["d_cm"], row["rms_cm"]] for row in evidence.slices]).reshape(-1, 3)
    seen = np.column_stack([found[:, :2], found[:, 1, None] + found[:, 2, None] * [-1.0, 1.0]])
    DiameterChart(canvas, box, evidence.tree, seen, np.array([heights, _reported(evidence, heights)]), _HIGH_M, np.nan)


def _rows(evidence: CloudEvidence) -> list[tuple[str, str]]:
    tree = evidence.tree
    rough_cm = float(np.median([row["rms_cm"] for row in evidence.slices])) if evidence.slices else None
    return [
        ("points of the stem used", f"{tree.n_pts or 0:,}"),
        ("circumference with points", amount(tree.arc_deg, "{:.0f}°")),
        ("slices with a circle", f"{len(evidence.slices)} of {len(SLICE_HEIGHTS)}"),
        ("roughness in a slice (rms)", amount(rough_cm, "{:.1f} cm")),
        ("taper", amount(tree.taper_cm_m, "{:+.2f} cm a metre")),
        ("lean", amount(tree.lean_deg, "{:.1f}°")),
        ("height", amount(tree.height_m, "{:.1f} m")),
    ]
