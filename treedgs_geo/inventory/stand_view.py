"""The stand in three dimensions: one page that opens from the file, without a server or a network.

Stems are tapered tubes of their diameters in the colours of their flags, on the terrain with its orthophoto, between
the points of the survey. three.js (MIT) draws; its licence stands in the page.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd

from ..core.errors import OutputError
from ..core.outputs import is_foreign
from ..core.plots import Plot
from ..core.shown import shown_cm
from ..report.blocks import Document, Fragment, known
from ..report.charts import FLAGS
from ..report.html import write_html
from ..stems.quality.reasons import explain
from .report import address, extent
from .side_layers import StemCurves, along

#: Ground shown around the stems and plots, m; cells of the terrain and pixels of its picture along the longer side.
_BESIDE_M, _CELLS, _PIXELS = 2.0, 120, 1024
#: At most so many points and Gaussians are shown; Gaussians fainter than this are not.
MAX_POINTS, MAX_GAUSSIANS, _FAINT = 60_000, 100_000, 0.1
#: A stem without a height is drawn this high at least, m; one without a DBH as one of so many centimetres; a top is so
#: thin, cm.
_STUB_M, _UNKNOWN_CM, _TOP_CM = 5.0, 12.0, 1.0
#: Colours of points that have none, from the ground up, and the height at which the last one begins, m.
_BY_HEIGHT, _HIGH_M = ((120, 98, 72), (150, 142, 92), (86, 128, 70), (140, 178, 96)), 20.0


@dataclass(frozen=True)
class Dots:
    """Points or Gaussians to show, project coordinates."""

    #: (N, 3) metres.
    xyz: np.ndarray
    #: (N, 3) uint8, RGB; ``None``: by height above the ground.
    colours: np.ndarray | None = None
    #: (N,) standard deviation of each Gaussian, m; ``None``: points.
    size_m: np.ndarray | None = None
    #: (N,) opacity, 0 to 1, of each Gaussian.
    opacity: np.ndarray | None = None


@dataclass(frozen=True)
class Stand:
    """What the page shows, project coordinates."""

    #: Tree table (:func:`.tree_layer.tree_table`).
    trees: gpd.GeoDataFrame
    #: Plots whose outlines are drawn.
    plots: Sequence[Plot]
    #: x, y (N,) -> ground height (N,), m, NaN where unknown.
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray]
    #: What is known of the stems' courses.
    curves: StemCurves = field(default_factory=dict)
    #: Points of the survey.
    points: Dots | None = None
    #: Gaussians fitted to the photos.
    gaussians: Dots | None = None
    #: Orthophoto of the ground, a file that may not be there.
    orthophoto: Path | None = None
    #: Layer ``crowns``.
    crowns: gpd.GeoDataFrame | None = None
    #: ``tree_id`` -> evidence sheet.
    sheets: Mapping[int, Path] = field(default_factory=dict)


def view_of(report: Path) -> Path:
    """Where the page of a report lies: ``report.html`` -> ``report_3d.html``."""
    return report.with_name(f"{report.stem}_3d.html")


def write_view(path: Path, stand: Stand) -> Path:
    """Write the page, whole or not at all.

    Raises:
        OutputError: it cannot be written, or a file of somebody else is there.
    """
    if is_foreign(path):
        raise OutputError(f"{path}: is there already and was not written by TreeDGS; give the report another name.")
    low, high = extent(stand.trees, stand.plots)
    low, high = low - _BESIDE_M, high + _BESIDE_M
    heights = _grid(stand.ground, low, high)
    level = float(np.nanmin(heights)) if np.isfinite(heights).any() else 0.0
    heights = np.nan_to_num(heights, nan=-9999.0)
    stems = [_stem(tree, stand, level, path) for _, tree in stand.trees.sort_values("tree_id").iterrows()]
    data = {
        "low": [*low.tolist(), level],
        "span": (high - low).tolist(),
        "colours": {flag: colour for flag, (colour, _) in FLAGS.items()},
        "stems": stems,
        "plots": [{"name": plot.plot_id, "x": plot.x, "y": plot.y, "r": plot.radius_m} for plot in stand.plots],
        "ground": {"rows": len(heights), "columns": heights.shape[1], "z": _packed(heights, "<f4")},
        "picture": _picture(stand.orthophoto, low, high),
        "points": _dots(stand.points, stand, low, high, MAX_POINTS),
        "gaussians": _dots(stand.gaussians, stand, low, high, MAX_GAUSSIANS),
        "crowns": _crowns(stand),
    }
    folder = files(__package__) / "templates"
    texts = {name: (folder / name).read_text(encoding="utf-8") for name in ("stand_view.html", "three.min.js")}
    from markupsafe import Markup

    values = {
        "three": Markup(texts["three.min.js"]),
        "data": data,
        "flags": [(name, *FLAGS[name], sum(stem["flag"] == name for stem in stems)) for name in FLAGS],
    }
    words = "TreeDGS. Drag to turn; wheel or two fingers to come closer; right button to move; click a stem."
    return write_html(path, Document("The stand in 3D", words, [Fragment(texts["stand_view.html"], values)], wide=True))


def _grid(ground: Callable[..., np.ndarray], low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(R, C) ground heights at the nodes of a grid over the box, rows northwards."""
    columns, rows = np.maximum(np.round(_CELLS * (high - low) / (high - low).max()).astype(int), 2) + 1
    x, y = np.meshgrid(np.linspace(low[0], high[0], columns), np.linspace(low[1], high[1], rows))
    return ground(x.ravel(), y.ravel()).reshape(x.shape)


def _stem(tree: pd.Series, stand: Stand, level: float, page: Path) -> dict[str, Any]:
    """A stem as the page draws it. ``path``: x, y, z (project coordinates) and radius (m), from the foot up. ``lines``:
    what is said of it."""
    number, flag = int(tree["tree_id"]), tree["qc_flag"] if tree["qc_flag"] in FLAGS else "check"
    dbh, height = known(tree["dbh_cm"]), known(tree["height_m"])
    lines = [FLAGS[flag][1]]
    if dbh is not None:
        error, low, high = (known(tree[name]) for name in ("dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm"))
        lines = [f"DBH {shown_cm(dbh)}" + (f" ± {shown_cm(error)}" if error is not None else "") + " cm", *lines]
        if low is not None and high is not None:
            lines.insert(1, f"90 % interval {shown_cm(low)} – {shown_cm(high)} cm")
    if height is not None:
        error = known(tree["height_se_m"])
        lines.append(f"height {height:.1f}" + (f" ± {error:.1f}" if error is not None else "") + " m")
    if tree["qc_reason"] and not pd.isna(tree["qc_reason"]):
        lines.append(explain(tree["qc_reason"]))
    foot = known(tree["z_ground"])
    if foot is None:
        foot = known(stand.ground(np.array([tree["x"]]), np.array([tree["y"]]))[0])
    foot = level if foot is None else foot
    return {
        "id": number,
        "flag": flag,
        "known": dbh is not None,
        "lines": lines,
        "sheet": address(stand.sheets[number], page) if number in stand.sheets else "",
        "path": np.round(_course(tree, stand.curves.get(number), dbh, height) + [0, 0, foot, 0], 3).tolist(),
    }


def _course(tree: pd.Series, curve: np.ndarray | None, dbh: float | None, height: float | None) -> np.ndarray:
    """(K, 4) x, y, height above the foot, radius (m) of a stem from its foot to its top."""
    if curve is None or not len(curve):
        curve = np.array([[tree["x"], tree["y"], known(tree["bh_m"]) or 1.3, dbh or _UNKNOWN_CM]])
    if height is not None:
        curve = curve[: max(int((curve[:, 2] < 0.98 * height).sum()), 1)]
    top = max(_STUB_M, curve[-1, 2] + 1.0) if height is None else height
    # A part of a stem ends as thick as it is there.
    last = max(curve[-1, 3] - (top - curve[-1, 2]), _TOP_CM) if height is None else _TOP_CM
    ends = [[*along(curve, 0.0), 0.0, curve[0, 3]], [*along(curve, top), top, last]]
    return np.vstack([ends[0], curve, ends[1]]) * (1, 1, 1, 0.005)


def _crowns(stand: Stand) -> list[dict[str, Any]]:
    """Rings (x, y) of the crowns and where they begin and end above the foot, by the number of their tree."""
    if stand.crowns is None:
        return []
    return [
        {"id": int(row.tree_id), "top": float(row.height_m), "ring": np.round(row.geometry.exterior.coords, 2).tolist()}
        for row in stand.crowns.itertuples()
    ]


def _dots(dots: Dots | None, stand: Stand, low: np.ndarray, high: np.ndarray, most: int) -> dict[str, Any] | None:
    """Every so many of the points over the box: places as parts of their extent (uint16), colours, sizes."""
    if dots is None:
        return None
    inside = ((dots.xyz[:, :2] >= low) & (dots.xyz[:, :2] <= high)).all(axis=1)
    if dots.opacity is not None:
        inside &= dots.opacity >= _FAINT
    chosen = np.flatnonzero(inside)
    chosen = chosen[:: max(-(-len(chosen) // most), 1)]
    if not len(chosen):
        return None
    xyz = dots.xyz[chosen]
    corner, span = xyz.min(axis=0), np.maximum(np.ptp(xyz, axis=0), 0.01)
    if dots.colours is None:
        above = (xyz[:, 2] - stand.ground(xyz[:, 0], xyz[:, 1])) / _HIGH_M
        steps = np.linspace(0, 1, len(_BY_HEIGHT))
        colours = np.column_stack(
            [np.interp(np.nan_to_num(above), steps, band) for band in zip(*_BY_HEIGHT, strict=True)]
        )
    else:
        colours = dots.colours[chosen]
    found = {"low": corner.tolist(), "span": span.tolist(), "xyz": _packed(65535 * (xyz - corner) / span, "<u2")}
    found["rgb"] = _packed(np.clip(colours, 0, 255), "u1")
    if dots.size_m is not None and dots.opacity is not None:
        found |= {"size": _packed(dots.size_m[chosen], "<f4"), "opacity": _packed(255 * dots.opacity[chosen], "u1")}
    return found


def _packed(values: np.ndarray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode()


def _picture(path: Path | None, low: np.ndarray, high: np.ndarray) -> str:
    """The part of an orthophoto that lies in the box, as the address of a JPEG; '' where there is none."""
    if path is None or not path.exists():
        return ""
    import rasterio
    from PIL import Image
    from rasterio.windows import from_bounds

    columns, rows = np.maximum(np.round(_PIXELS * (high - low) / (high - low).max()).astype(int), 1).tolist()
    with rasterio.open(path) as source:
        window = from_bounds(*low, *high, source.transform)
        seen = source.read(window=window, boundless=True, masked=True, out_shape=(source.count, rows, columns))
    if np.ma.getmaskarray(seen).all():
        return ""
    bare = np.array([176, 166, 138], np.uint8)[:, None, None]
    shown = np.where(np.ma.getmaskarray(seen[:3]), bare, seen[:3].data)
    stream = io.BytesIO()
    Image.fromarray(np.moveaxis(shown, 0, 2)).save(stream, "JPEG", quality=82)
    return f"data:image/jpeg;base64,{base64.b64encode(stream.getvalue()).decode()}"
