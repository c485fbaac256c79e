"""Labels of a cloud beside the true ones, as pictures: which stem a point was given, and which points are wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from treedgs_geo.report.charts import BLUE, ORANGE, VERMILION

from .paper_pictures import panels

#: Most points of a cloud that are kept for its picture.
MOST_POINTS = 40_000
MISSED = ORANGE


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
    axes.set_aspect("equal")
    axes.set_title(f"{title}\n{len(np.unique(label[stem]))} stems", fontsize=8)
    axes.tick_params(labelsize=7)
    axes.set_xlabel("east, m", fontsize=8)


def _from_beside(axes: Any, cloud: LabelledPoints) -> None:
    given = cloud.label > 0
    true = given if cloud.true is None else cloud.true > 0
    parts = [
        ("neither", ~given & ~true, "0.85"),
        ("stem, rightly" if cloud.true is not None else "stem", given & true, BLUE),
    ]
    if cloud.true is not None:
        parts += [("stem, wrongly", given & ~true, VERMILION), ("stem missed", ~given & true, MISSED)]
    for name, which, colour in parts:
        axes.scatter(
            cloud.xyz[which, 0], cloud.xyz[which, 2], s=2, color=colour, linewidths=0, rasterized=True,
            label=f"{name} ({100 * which.mean():.0f} %)",
        )  # fmt: skip
    axes.legend(fontsize=6.5, markerscale=4, loc="upper left", bbox_to_anchor=(0, 1.02), ncols=2)
    axes.set_ylim(0, 1.3 * max(float(cloud.xyz[:, 2].max()), 1.0))
    axes.set_title(f"from the south; {len(cloud.xyz)} of {cloud.of} points", fontsize=8)
    axes.tick_params(labelsize=7)
    axes.set_xlabel("east, m", fontsize=8)
    axes.set_ylabel("height, m", fontsize=8)
