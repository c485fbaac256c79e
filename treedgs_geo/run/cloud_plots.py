"""Plots and the report of ``pointcloud-to-dbh``: stems are looked for in the plots only, as in photos."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyproj

from ..core.errors import CRSError, InputError
from ..core.plots import Plot, read_plots
from ..core.progress import Reporter
from ..core.workspace import peak_memory_mb
from ..inventory.searched import not_seen
from ..pointcloud.cloud import extent
from ..pointcloud.file_crs import LOCAL_CRS
from .searched import LOW_M
from .stages import Collector

if TYPE_CHECKING:
    import geopandas as gpd

    from ..pointcloud.cloud import PointCloud
    from .settings import PointcloudToDbhSettings

#: Points this far around a plot stay: the ground, and stems whose points reach over the edge.
MARGIN_M = 5.0


class RunLog(Collector):
    """Remembers warnings and how long the verb's stages took, for the report."""

    def __init__(self, inner: Reporter) -> None:
        super().__init__(inner)
        self.stages: dict[str, dict[str, Any]] = {}
        self._depth = 0
        self.began = time.monotonic()

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        self._depth += {"stage": 1, "stage_done": -1}.get(kind, 0)
        if kind == "stage_done" and self._depth == 0:
            self.stages[body["name"]] = {"seconds": body["seconds"], "peak_memory_mb": peak_memory_mb()}
        super()._emit(kind, body)


def plots_under(
    settings: PointcloudToDbhSettings, crs: pyproj.CRS | None, low: np.ndarray, high: np.ndarray, reporter: Reporter
) -> list[Plot]:
    """The plots that lie on the cloud; empty when none were asked for. low, high: its corners, project coordinates.

    Raises:
        InputError: none does. CRSError: the table's coordinates cannot be brought into the cloud's CRS.
    """
    if settings.plots is None:
        return []
    try:
        plots = read_plots(settings.plots, crs or LOCAL_CRS)
    except pyproj.exceptions.ProjError:
        raise CRSError(
            f"{settings.plots}: has an epsg, but {settings.input} has no CRS to bring it into; give the "
            "cloud's with --crs, or the centres in the cloud's own metres."
        ) from None
    inside = [
        plot
        for plot in plots
        if low[0] - plot.radius_m < plot.x < high[0] + plot.radius_m
        and low[1] - plot.radius_m < plot.y < high[1] + plot.radius_m
    ]
    if not inside:
        plot = plots[0]
        raise InputError(
            f"{settings.plots}: no plot lies on {settings.input}: {plot.plot_id!r} is at x {plot.x:.1f}, "
            f"y {plot.y:.1f}, the cloud covers x {low[0]:.1f} to {high[0]:.1f}, y {low[1]:.1f} to {high[1]:.1f}; check "
            "the coordinates and their CRS (column epsg)."
        )
    if len(inside) < len(plots):
        away = [plot.plot_id for plot in plots if plot not in inside]
        reporter.warn(
            f"{settings.plots}: {len(away)} of {len(plots)} plots do not lie on the cloud and are left out: "
            f"{', '.join(away[:5])}{' …' if len(away) > 5 else ''}."
        )
    return inside


def cut_to_plots(
    settings: PointcloudToDbhSettings, cloud: PointCloud, reporter: Reporter
) -> tuple[list[Plot], PointCloud]:
    """``(plots, the cloud within MARGIN_M of them)``; everything where no plots were given."""
    plots = plots_under(settings, cloud.horizontal_crs, *extent(cloud.xyz), reporter)
    if not plots:
        return [], cloud
    kept = np.zeros(len(cloud), bool)
    for plot in plots:
        kept |= _within(plot, cloud.xyz, MARGIN_M)
    if not any(_within(plot, cloud.xyz[kept], 0.0).any() for plot in plots):
        raise InputError(f"{settings.input}: holds no point in the plots of {settings.plots}; check their coordinates.")
    reporter.info(f"{int(kept.sum()):,} points in {len(plots)} plots and {MARGIN_M:g} m around them.")
    return plots, cloud.select(kept)


def trees_in_plots(
    trees: list[Any], tree_id: np.ndarray, plots: list[Plot], reporter: Reporter
) -> tuple[list[Any], np.ndarray]:
    """Trees that stand in a plot at breast height, with its id; the others' points lose their tree_id."""
    if not plots:
        return trees, tree_id
    inside = []
    for tree in trees:
        tree.plot_id = next((p.plot_id for p in plots if np.hypot(tree.x - p.x, tree.y - p.y) <= p.radius_m), None)
        if tree.plot_id is not None:
            inside.append(tree)
    if len(inside) < len(trees):
        reporter.info(f"{len(trees) - len(inside)} stems stand outside the plots and are left out.")
    if trees and not inside:
        reporter.warn("All stems found stand outside the plots; check the plot centres.")
    return inside, np.where(np.isin(tree_id, [tree.tree_id for tree in inside]), tree_id, 0)


def write_cloud_report(
    settings: PointcloudToDbhSettings,
    cloud: PointCloud,
    trees: list[Any],
    plots: list[Plot],
    searched: gpd.GeoDataFrame,
    log: RunLog,
    sheets: dict[int, Path],
) -> str | None:
    """The page ``--report`` asks for, as ``photos-to-dbh`` writes it; its path. sheets: ``tree_id`` -> picture."""
    if settings.report is None:
        return None
    from .. import __version__
    from ..inventory.report import write_report
    from ..inventory.tree_layer import tree_table

    crs = cloud.horizontal_crs or LOCAL_CRS
    span = np.ptp(cloud.xyz[:, :2], axis=0)
    facts = {
        "cloud": f"{settings.input.name}, {len(cloud):,} points{' in and around the plots' if plots else ''}"
        + ("" if plots else f", {len(cloud) / max(span[0] * span[1], 1.0):,.0f} a square metre"),
        "date in the file": _date(settings.input),
        "ground": str(settings.dtm) if settings.dtm else "from the cloud",
        "plot area not seen": f"{not_seen(searched)} holds no point in the lowest {LOW_M:g} m" if plots else "",
        "method": f"{settings.method}, {settings.fit}",
        "breast height": f"{settings.bh_m:g} m",
        "CRS": crs.to_string() if cloud.horizontal_crs is not None else "local metres, none",
        "TreeDGS": __version__,
    }
    log.stages["in all"] = {"seconds": time.monotonic() - log.began, "peak_memory_mb": peak_memory_mb()}
    path = write_report(
        settings.report,
        tree_table(trees, crs),
        plots,
        {k: v for k, v in facts.items() if v},
        list(dict.fromkeys(log.warnings)),
        log.stages,
        sheets,
    )
    return str(path)


def _within(plot: Plot, xyz: np.ndarray, margin_m: float) -> np.ndarray:
    return np.hypot(xyz[:, 0] - plot.x, xyz[:, 1] - plot.y) <= plot.radius_m + margin_m


def _date(path: Path) -> str:
    """When the LAS file says that it was made; '' for others."""
    if path.suffix.lower() not in (".las", ".laz"):
        return ""
    from ..pointcloud.las_reader import open_reader

    with open_reader(path) as file:
        day = file.header.creation_date
    return day.isoformat() if day is not None else ""
