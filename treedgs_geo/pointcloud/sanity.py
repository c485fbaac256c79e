"""Whether a cloud can be a stand of trees in metres, asked before any work: extent, axes, heights, thickness.

Every fault that is found gets its own sentence. Some end the job, because nothing right can come of them; the others
are warnings, and :mod:`treedgs_geo.stems.quality.odd_heights` marks the trees that they touch.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from ..core.progress import Reporter
from .survey import Extent, sample, survey

#: The tallest trees on earth reach 116 m, few stands 55 m and hardly one 75 m: beyond, the heights are remarked,
#: flagged (every tree to check) or refused.
REMARKED_M, TALL_M, IMPOSSIBLE_M = 55.0, 75.0, 130.0
#: So many points, and this share of all, have to be that high (birds, wires and multipath are not the stand).
TALL_POINTS, TALL_SHARE, IMPOSSIBLE_SHARE = 20, 1e-4, 5e-3
#: This share of all points lies above this part of such a height, in a stand.
CARRIED, CARRIED_SHARE = 0.6, 0.02
#: Below this the cloud is a slice, below the second a thin layer: stems are looked for from 0.5 to 5 m.
SLICE_M, THIN_M = 0.6, 2.0
#: No cloud is wider; below this density (points a square metre) one wider than a kilometre shows no stem.
WIDEST_M, SPARSEST, WIDE_M = 100_000.0, 0.05, 1000.0
#: Coordinates in degrees: a plot's extent is at most this (6 km), or the file stores steps finer than a micrometre.
DEGREES_SPAN, DEGREES_SCALE = 0.05, 1.1e-6
#: Smooth share of the lowest points (see :class:`Ground`) above which an axis may be asked for instead of z, which has
#: less than the second and :data:`AHEAD` less than it; how much of the other two axes' extent (metres, at least) the
#: points then fill. Seen on 26 real clouds: 0.05-1.0 along the right axis, below 0.25 along others (0.53 around single
#: trees), up to 0.81 across cut-out trees without ground, which fill less than 0.4.
UP, NOT_UP, AHEAD, UP_FILLED, UP_SPAN_M = 0.7, 0.5, 0.3, 0.55, 2.0
#: A dense cloud (points a square metre) whose lowest points are less smooth than this shows little ground.
LITTLE_GROUND, DENSE = 0.2, 100.0
#: What lengths may be in instead of metres: name, its length in metres.
_UNITS = (("millimetres", 0.001), ("centimetres", 0.01), ("feet", 0.3048))


@dataclass(frozen=True)
class Finding:
    """One fault. kind: ``degrees``, ``extent``, ``strays``, ``axis``, ``tall``, ``thin`` or ``ground``. sentence: what
    the user reads. refuse: the job cannot give anything right."""

    kind: str
    sentence: str
    refuse: bool = False


@dataclass(frozen=True)
class Ground:
    """What the lowest points of the cells of a grid say when one axis is taken for up.

    cell_m: width of the cells. filled: share of the cells that hold points. smooth: share of the cells whose lowest
    point lies near the line through its neighbours', as ground does on any slope. above: (M,) metres of each point
    above the lowest of its cell.
    """

    cell_m: float
    filled: float
    smooth: float
    above: np.ndarray


def examine(
    xyz: np.ndarray, path: Path, stems: bool = True, scale: np.ndarray | None = None, own_ground: bool = False
) -> tuple[Extent, list[Finding]]:
    """The extent of (N, 3) finite points without strays, and everything that is wrong, what ends the job first.

    stems: stems are to be found in it (for a terrain model a thin, sparse cloud is fine). scale: (3,) coordinate steps
    of the file. own_ground: heights come from a terrain model of the user.
    """
    extent = survey(xyz)
    if not extent.n_points:
        return extent, []
    found = _examine(xyz, extent, stems, scale, own_ground)
    findings = [replace(finding, sentence=f"{path}: {finding.sentence}") for finding in found]
    return extent, sorted(findings, key=lambda finding: not finding.refuse)


def report(findings: list[Finding], reporter: Reporter) -> None:
    """Say all; end with the first that refuses.

    Raises:
        InputError: what a finding that refuses says.
    """
    for finding in findings:
        if finding.refuse:
            raise InputError(finding.sentence)
        reporter.warn(finding.sentence)


def _examine(
    xyz: np.ndarray, extent: Extent, stems: bool, scale: np.ndarray | None, own_ground: bool
) -> Iterator[Finding]:
    """What is wrong, in sentences about the file."""
    if sentence := _degrees(extent, scale):
        yield Finding("degrees", sentence, True)
        return
    if extent.n_strays:
        most = f" to {extent.n_strays_most:,}" if extent.n_strays_most > extent.n_strays else ""
        yield Finding(
            "strays",
            f"{extent.n_strays:,}{most} of {extent.n_points:,} points lie up to {_distance(extent.reach_m)} away from "
            "all others and are left out; remove them if the file is used elsewhere.",
        )
    points = sample(xyz, extent)
    if len(points) < 50:
        return
    span = extent.high - extent.low
    density = extent.n_points / float(np.prod(np.maximum(span[:2], 1.0)))
    up = ground_along(points, 2)
    if up.smooth < NOT_UP and (name := _other_axis(points, up.smooth)):
        yield Finding(
            "axis",
            f"the ground lies across the {name} axis, expected heights in z; turn the cloud so that z points up (in "
            "CloudCompare: Edit > Apply transformation) and export it again.",
            True,
        )
        return
    tall = _tall(up)
    if tall is not None:
        yield tall
    if span[:2].max() > WIDEST_M or stems and span[:2].max() > WIDE_M and density < SPARSEST:
        yield Finding("extent", _wide(extent, span, density), True)
    if stems and (tall is None or not tall.refuse):
        thickness = float(np.percentile(up.above, 99.9))
        is_slice = thickness < SLICE_M
        what, so = (", a slice or bare ground", "") if is_slice else ("", ", so few or none will be found")
        if thickness < THIN_M:
            yield Finding(
                "thin",
                f"is only {thickness:.2f} m thick (heights {extent.low[2]:.2f} to {extent.high[2]:.2f} m){what}; stems "
                f"are looked for from 0.5 to 5 m above ground{so}: give the whole cloud.",
                is_slice,
            )
        if not own_ground and up.smooth < LITTLE_GROUND and up.filled > UP_FILLED and density > DENSE:
            yield Finding(
                "ground",
                f"shows little ground (the lowest points of {100 * up.smooth:.0f} % of its {up.cell_m:.1f} m cells "
                "lie on a smooth surface, expected most), so breast height may be off; give a terrain model with "
                "--dtm, or the cloud with its ground points.",
            )


def ground_along(points: np.ndarray, axis: int, sign: float = 1.0) -> Ground:
    """Take ``sign`` times an axis of (M, 3) points for up and look at the lowest points."""
    height = sign * points[:, axis]
    flat = np.delete(points, axis, axis=1)
    low, high = np.percentile(flat, [0.5, 99.5], axis=0)
    inside = ((flat >= low) & (flat <= high)).all(axis=1)
    flat, height = flat[inside], height[inside]
    span = np.maximum(high - low, 1e-6)
    # Cells of thirty points, not below half a metre; at least eight along the longer side.
    cell = float(min(max(0.5, np.sqrt(30 * span[0] * span[1] / max(len(flat), 1))), span.max() / 8))
    index = np.floor((flat - low) / cell).astype(np.int64)
    shape = tuple(index.max(axis=0) + 1)
    key = index[:, 0] * shape[1] + index[:, 1]
    lowest = np.full(shape[0] * shape[1], np.inf)
    np.minimum.at(lowest, key, height)
    grid = np.where(np.isfinite(lowest), lowest, np.nan).reshape(shape)
    bend = np.full((2, *shape), np.nan)
    bend[0, 1:-1] = np.abs(grid[1:-1] - (grid[:-2] + grid[2:]) / 2)
    bend[1, :, 1:-1] = np.abs(grid[:, 1:-1] - (grid[:, :-2] + grid[:, 2:]) / 2)
    worst = np.fmax(*bend)
    worst = worst[np.isfinite(worst)]
    smooth = float(np.mean(worst < 0.1 + 0.1 * cell)) if len(worst) >= 9 else 0.0
    return Ground(cell, float(np.isfinite(grid).mean()), smooth, height - lowest[key])


def _other_axis(points: np.ndarray, smooth: float) -> str:
    """The axis that points up when z does not, empty where none clearly does."""
    points = points[:: max(len(points) // 300_000, 1)]
    span = np.ptp(points, axis=0)
    for axis, sign in ((1, 1.0), (0, 1.0), (2, -1.0), (1, -1.0), (0, -1.0)):
        if np.delete(span, axis).min() < UP_SPAN_M:
            continue
        ground = ground_along(points, axis, sign)
        if ground.smooth >= max(UP, smooth + AHEAD) and ground.filled >= UP_FILLED:
            return f"{'downward ' * (sign < 0)}{'xyz'[axis]}"
    return ""


def _degrees(extent: Extent, scale: np.ndarray | None) -> str:
    """Longitude and latitude beside heights in metres."""
    span = extent.high - extent.low
    inside = max(abs(extent.low[0]), abs(extent.high[0])) <= 180 and max(abs(extent.low[1]), abs(extent.high[1])) <= 90
    fine = scale is not None and scale[:2].max() < DEGREES_SCALE and scale[2] > 100 * scale[0] and span[:2].max() < 5
    if not inside or not (fine or span[:2].max() < DEGREES_SPAN and span[2] > 1.0):
        return ""
    return (
        f"spans {span[0]:.2g} x {span[1]:.2g} in x and y (around {extent.low[0]:.4f}, {extent.low[1]:.4f}) and "
        f"{span[2]:.1f} in z, which looks like degrees, expected metres; project it to the UTM zone of the plot "
        "and export it again."
    )


def tall_share(above: np.ndarray, limit_m: float, slack_m: float = 0.0) -> float:
    """Share of (N,) heights above ground beyond a limit; 0 where they are too few to be a stand's, or no crowns below
    carry them (birds, wires, noise in the air)."""
    count = int((above > limit_m + slack_m).sum())
    carried = np.mean(above > CARRIED * limit_m) >= CARRIED_SHARE if count else False
    return count / len(above) if count >= TALL_POINTS and carried else 0.0


def _tall(up: Ground) -> Finding | None:
    """Points higher above the ground than trees reach."""
    if tall_share(up.above, IMPOSSIBLE_M, up.cell_m) >= IMPOSSIBLE_SHARE:
        top = float(np.percentile(up.above, 99.5))
        likely = [f"{name} ({top * metres:.1f} m)" for name, metres in _UNITS if 3 <= top * metres <= 100]
        unit = f", which looks like {' or '.join(likely)}" if likely else ""
        return Finding(
            "tall",
            f"its points reach {top:,.0f} m above the ground below them{unit}, expected trees in metres (none reaches "
            f"{IMPOSSIBLE_M:.0f} m); convert x, y and z to metres.",
            True,
        )
    if tall_share(up.above, REMARKED_M, up.cell_m) >= TALL_SHARE:
        top = float(np.partition(up.above, -TALL_POINTS)[-TALL_POINTS])
        is_marked = tall_share(up.above, TALL_M, up.cell_m) >= TALL_SHARE
        return Finding(
            "tall",
            f"its trees are {top:.0f} m tall, as few stands on earth are; if heights are in feet ({top * 0.3048:.0f} "
            "m), convert them to metres, because diameters are measured at a third of breast height otherwise"
            f"{'; every tree is marked for checking (odd_heights)' * is_marked}.",
        )
    return None


def _wide(extent: Extent, span: np.ndarray, density: float) -> str:
    if extent.n_groups_off:
        return (
            f"{extent.n_groups_off:,} of its {extent.n_points:,} points lie up to {_distance(extent.reach_m)} away "
            "from the others, expected one plot or block; cut the groups apart, or delete what is wrong."
        )
    return (
        f"spans {_distance(span[0])} x {_distance(span[1])} with {density:.2g} points a square metre, expected a plot "
        "or block in metres; check the unit of x and y (millimetres?) and which columns they are, or cut the plot out."
    )


def _distance(metres: float) -> str:
    return f"{metres:,.0f} m" if metres < 2000 else f"{metres / 1000:,.0f} km"
