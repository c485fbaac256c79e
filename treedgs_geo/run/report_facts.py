"""What a report says about its photos: when, how fine, how well placed, and what they did not see."""

from __future__ import annotations

from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.crs import LocalFrame
from ..core.errors import InputError
from ..core.plots import Plot, plot_cells
from ..core.workspace import Workspace
from ..geotags.stations import Stations, read_stations_layer
from ..inventory.tree_layer import tree_table
from ..inventory.tree_reading import read_trees
from ..reconstruction.cameras import View
from ..reconstruction.model import FRAME
from ..stems.quality.tree import Tree
from ..terrain.dtm import read_dtm

if TYPE_CHECKING:
    import geopandas as gpd
    from pyproj import CRS

#: A place counts as seen when this many photos look at it from the side, as where stems are looked for without plots.
ENOUGH_VIEWS = 6
#: Sine of the angle from straight down that is "from the side".
SIDE_SIN = 0.3


def photo_facts(space: Workspace, views: list[View], plots: list[Plot], sfm: dict[str, Any]) -> dict[str, str]:
    """Rows of the run card: flight, positions, their residuals, ground sample distance, area not seen.

    sfm: report of the reconstruction; a row whose figures it (or the workspace) lacks is left out.
    """
    facts: dict[str, str] = {}
    if space.path(names.GEOTAGS).exists():
        stations = read_stations_layer(space.path(names.GEOTAGS))
        facts["flown"] = flown(stations)
        facts["positions"] = positions(stations)
    if sfm.get("geotag_rms_e_n_u_m"):
        e, n, u = (100 * float(value) for value in sfm["geotag_rms_e_n_u_m"])
        facts["cameras against their positions"] = (
            f"east {e:.1f}, north {n:.1f}, height {u:.1f} cm (root mean square, {sfm['geotag_residual_quality']}); "
            f"points in the photos {sfm['reprojection_rms_px']:.2f} px"
        )
    if sfm.get("level"):
        facts["photos matched"] = matched(sfm)
    if views and space.path(names.DTM).exists():
        crs = LocalFrame.load(space.path(names.SFM) / FRAME)
        cells = plot_cells(plots) if plots else None
        if cells is not None:
            facts.update(_seen(space, crs, views, plots, *cells))
    return {name: text for name, text in facts.items() if text}


def flown(stations: Stations) -> str:
    """Day or days of the photos (UTC), ''  where they do not say."""
    known = stations.utc[np.isfinite(stations.utc)]
    if not len(known):
        return ""
    days = sorted({datetime.fromtimestamp(t, timezone.utc).date().isoformat() for t in (known.min(), known.max())})
    flights = len(np.unique(stations.flight))
    return " to ".join(days) + " (UTC)" + (f", {flights} flights" if flights > 1 else "")


def positions(stations: Stations) -> str:
    """``59 of 61 photos fixed (97 %), 2 float``."""
    counts, total = stations.counts(), len(stations)
    fixed = counts.pop("fix", 0)
    rest = "".join(f", {count} {name if name != 'none' else 'without'}" for name, count in counts.items())
    return f"{fixed} of {total} photos fixed ({100 * fixed / max(total, 1):.0f} %){rest}"


def matched(sfm: dict[str, Any]) -> str:
    """How far the reconstruction went, why, and how sure its photos are at the stems."""
    ways = {"guided": "where geotags and gimbals say, ", "fine": "where geotags, gimbals and a first block say, "}
    text = ways.get(sfm["level"], "without a guide, ")
    text += f"{sfm['pairs']} pairs"
    if sfm.get("poses_px_median") is not None:
        text += f"; sure to {sfm['poses_px_median']:.2f} px at the stems, the worst to {sfm['poses_px_worst']:.2f} px"
    if sfm.get("climbed_because") and sfm["level"] == "guided":
        text += f" (more pairs gave no better block, but {sfm['climbed_because']})"
    elif sfm.get("climbed_because"):
        text += f" (fewer pairs were tried first, but {sfm['climbed_because']})"
    elif sfm["level"] == "guided":
        text += " (sure enough: more pairs would not show in the diameters)"
    return text


def _seen(
    space: Workspace, frame: LocalFrame, views: list[View], plots: list[Plot], xy: np.ndarray, owner: np.ndarray
) -> dict[str, str]:
    """Ground sample distance at breast height, and the share of each plot that too few photos see from the side."""
    ground = read_dtm(space.path(names.DTM), frame.crs).height(xy[:, 0], xy[:, 1])
    if not np.isfinite(ground).any():
        return {}
    ground = np.where(np.isfinite(ground), ground, np.nanmedian(ground))
    points = frame.to_local(np.column_stack([xy, ground + 1.3]))
    count, sizes = np.zeros(len(points), int), []
    for view in views:
        pixels, depth = view.project(points)
        inside = view.contains(pixels) & (depth > 0)
        offset = points - view.centre
        side = np.hypot(offset[:, 0], offset[:, 1]) >= SIDE_SIN * np.linalg.norm(offset, axis=1)
        count += inside & side
        if inside.any():
            sizes.append(100 * float(np.median(depth[inside])) / view.camera.fx)
    facts = {}
    if sizes:
        low, middle, high = np.percentile(sizes, [5, 50, 95])
        facts["ground sample distance"] = (
            f"{middle:.2f} cm a pixel at breast height in the plots ({low:.2f} to {high:.2f}; {len(sizes)} photos)"
        )
    facts["plot area not seen"] = not_seen(plots, owner, count < ENOUGH_VIEWS) + (
        f" is seen from the side by fewer than {ENOUGH_VIEWS} photos (trunks and leaves in the way not counted)"
    )
    return facts


def not_seen(plots: list[Plot], owner: np.ndarray, missing: np.ndarray) -> str:
    """``4 % (A 9 %, B 0 %)``: the share of cells that are missing, all together and, of several plots, the worst."""
    text = f"{_percent(missing.mean())}"
    if len(plots) > 1:
        shares = sorted(((missing[owner == k].mean(), plot.plot_id) for k, plot in enumerate(plots)), reverse=True)
        text += f" ({', '.join(f'{name} {_percent(share)}' for share, name in shares[:8])}"
        text += ", the others less)" if len(shares) > 8 else ")"
    return text


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if not 0 < share < 0.01 else "less than 1 %"


def kept_table(path: Path, trees: list[Tree], crs: CRS) -> gpd.GeoDataFrame:
    """The trees as the layer ``path`` holds them, with what a person wrote; as measured where it is not to be read."""
    with suppress(InputError):
        found = read_trees(path)
        if len(found) >= len(trees):
            return found
    return tree_table(trees, crs)
