"""The report's map: every stem at its place, as SVG that the page's script can zoom and mark."""

from __future__ import annotations

import html

import geopandas as gpd
import numpy as np
import pandas as pd

from ..core.plots import Plot

#: Okabe-Ito colours, distinguished by colour-blind readers and in grey print, and what the flags mean in words.
FLAGS = {
    "ok": ("#009E73", "measured"),
    "check": ("#E69F00", "measured, to be checked"),
    "reject": ("#D55E00", "seen, no DBH"),
}
#: Drawing units of the longer side, and what is left free around the stems.
_SIDE, _FREE = 760.0, 44.0
#: A stem without a DBH is drawn as one of this many centimetres; drawing units a centimetre, and the smallest disc.
_UNKNOWN_CM, _UNITS_CM, _LEAST = 12.0, 0.2, 2.5
#: Beyond this many stems numbers are shown for the marked one only.
_MOST_LABELS = 160


def stem_map(trees: gpd.GeoDataFrame, plots: list[Plot]) -> str:
    """An ``<svg>``: discs grow with DBH, labels are ``tree_id``, stems without a DBH are hollow; plots are dashed,
    north is up. Each stem is a link to its row, ``#tree-ID``."""
    low, high = _extent(trees, plots)
    scale = (_SIDE - 2 * _FREE) / float(max(high - low))
    width, height = (scale * (high - low) + 2 * _FREE).tolist()

    def place(x: float, y: float) -> tuple[float, float]:
        return round(_FREE + scale * (x - low[0]), 1), round(height - _FREE - scale * (y - low[1]), 1)

    parts = []
    for plot in plots:
        x, y = place(plot.x, plot.y)
        r = plot.radius_m * scale
        name = html.escape(plot.plot_id)
        parts.append(f"<circle class='plot' cx='{x}' cy='{y}' r='{r:.1f}'/>")
        parts.append(f"<text class='plotname' x='{x}' y='{max(y - r - 5, 12):.1f}'>{name}</text>")
    labelled = len(trees) <= _MOST_LABELS
    # Small ones on top, so that none is hidden.
    order = np.argsort(-trees["dbh_cm"].astype(float).fillna(0.0).to_numpy(), kind="stable")
    for number in order:
        parts.append(_stem(trees.iloc[int(number)], place, labelled))
    parts += [_scale_bar(scale, height), _north(width)]
    return (
        f"<svg id='map' viewBox='0 0 {width:.0f} {height:.0f}' role='group' aria-label='map of the stems'>"
        f"{''.join(parts)}</svg>"
    )


def _extent(trees: gpd.GeoDataFrame, plots: list[Plot]) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner, at least two metres apart."""
    corners = [trees[["x", "y"]].to_numpy(float)]
    corners += [np.array([[p.x - p.radius_m, p.y - p.radius_m], [p.x + p.radius_m, p.y + p.radius_m]]) for p in plots]
    points = np.vstack(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1.0)
    return middle - half, middle + half


def _stem(tree: pd.Series, place, labelled: bool) -> str:
    x, y = place(tree["x"], tree["y"])
    has = pd.notna(tree["dbh_cm"])
    flag = tree["qc_flag"] if tree["qc_flag"] in FLAGS else "check"
    radius = max(_UNITS_CM * float(tree["dbh_cm"] if has else _UNKNOWN_CM), _LEAST)
    number = html.escape(str(tree["tree_id"]))
    said = f"tree {number}: " + (f"{tree['dbh_cm']:.1f} cm, " if has else "") + FLAGS[flag][1]
    name = "" if labelled else " quiet"
    return (
        f"<a class='stem {flag}{name}' href='#tree-{number}' data-tree='{number}' data-x='{x}' data-y='{y}' "
        f"transform='translate({x},{y})'><title>{said}</title><circle r='{radius:.1f}'/>"
        f"<text x='{radius + 2:.1f}' y='3.5'>{number}</text></a>"
    )


def _scale_bar(scale: float, height: float) -> str:
    length = next(m for m in (1000, 500, 200, 100, 50, 20, 10, 5, 2, 1) if m * scale <= 0.3 * _SIDE or m == 1)
    end = 12 + length * scale
    y = height - 12
    return (
        f"<g class='still'><path d='M12 {y:.0f}v-6v6H{end:.1f}v-6' fill='none' stroke='#555'/>"
        f"<text x='{end + 5:.1f}' y='{y:.0f}'>{length} m</text></g>"
    )


def _north(width: float) -> str:
    x = width - 16
    return (
        f"<g class='still'><path d='M{x:.0f} 34V12l-4 8m4-8l4 8' fill='none' stroke='#555'/>"
        f"<text x='{x:.0f}' y='46' text-anchor='middle'>N</text></g>"
    )
