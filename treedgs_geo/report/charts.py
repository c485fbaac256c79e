"""One style of charts: readable in print and by colour-blind readers (marks differ in shape as well as in colour)."""

from __future__ import annotations

import io
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import atomic_path
from .blocks import Picture

#: Okabe and Ito's colours: distinguished by colour-blind readers and in grey print.
BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION = "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00"
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION)
GREY, LIGHT_GREY = "#555555", "#999999"
#: What a tree's flag looks like, and what it says.
FLAGS = {"ok": (GREEN, "measured"), "check": (ORANGE, "measured, to be checked"), "reject": (VERMILION, "seen, no DBH")}
MARKS = {"ok": "o", "check": "^", "reject": "x"}
#: Dots an inch of pictures on pages, in notebooks, and of those that ``figure.savefig`` writes.
DPI, NOTEBOOK_DPI, PRINT_DPI = 160, 100, 300
_STYLE: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 11,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.6,
}


def new_chart(width: float = 6.2, height: float = 4.6, grid: bool = True, **more: Any) -> tuple[Any, Any]:
    """A figure (inches) and its axes, laid out so that nothing overlaps.

    more: of matplotlib's ``Figure.subplots`` (``nrows``, ``ncols``, ``squeeze``, ...), or with ``mosaic`` of its
    ``subplot_mosaic``: axes by name. A notebook shows the figure. The user's own pyplot is not touched.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    style: Any = {**_STYLE, "axes.grid": grid}
    with matplotlib.rc_context(style):
        figure = Figure(figsize=(width, height), layout="constrained", dpi=PRINT_DPI)
        FigureCanvasAgg(figure)
        figure._repr_png_ = partial(chart_png, figure, NOTEBOOK_DPI)  # type: ignore[attr-defined]
        return figure, figure.subplot_mosaic(**more) if "mosaic" in more else figure.subplots(**more)


def polygons_of(shape: Any) -> list[Any]:
    """The polygons of a shape of one or several; none of ``None``."""
    return [part for part in getattr(shape, "geoms", [shape]) if getattr(part, "geom_type", "") == "Polygon"]


def draw_outline(axes: Any, shape: Any, origin: np.ndarray, **line: Any) -> None:
    """The rings of polygons as lines. origin: (2,), taken off their coordinates."""
    for part in polygons_of(shape):
        for ring in (part.exterior, *part.interiors):
            axes.plot(*(np.asarray(ring.coords)[:, :2] - origin).T, **line)


def chart_png(figure: Any, dpi: float = DPI) -> bytes:
    """The figure as PNG."""
    return _rendered(figure, "png", dpi=dpi)


def chart_svg(figure: Any) -> bytes:
    """The figure as SVG: text stays text, and the file is the same for the same figure."""
    return _rendered(figure, "svg", metadata={"Date": None})


def write_chart(folder: Path, name: str, figure: Any, text: str = "") -> Picture:
    """Write ``name.svg`` and ``name.png``; returns the picture for a page."""
    svg = chart_svg(figure)
    for kind, data in (("svg", svg), ("png", chart_png(figure))):
        with atomic_path(Path(folder) / f"{name}.{kind}") as temporary:
            temporary.write_bytes(data)
    return Picture(text or name, svg)


def _rendered(figure: Any, kind: str, **more: Any) -> bytes:
    import matplotlib

    for legend in [*figure.legends, *(axes.get_legend() for axes in figure.axes)]:
        if legend is not None:
            legend.set_frame_on(False)
    stream = io.BytesIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "treedgs"}), warnings.catch_warnings():
        # A letter that the font lacks is drawn as a box; that is all there is to say.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(stream, format=kind, bbox_inches="tight", **more)
    return stream.getvalue()
