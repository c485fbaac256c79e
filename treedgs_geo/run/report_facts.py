"""What a report says about its photos: when, how fine, how well placed, and what they did not see."""

from __future__ import annotations

from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError
from ..core.plots import Plot, plot_cells
from ..geotags.stations import Stations
from ..inventory.searched import not_seen
from ..inventory.tree_layer import tree_table
from ..inventory.tree_reading import read_trees
from ..stems.quality.tree import Tree
from .context import Site
from .searched import ENOUGH_VIEWS, over_ground, photos_looking

if TYPE_CHECKING:
    import geopandas as gpd
    from pyproj import CRS


def photo_facts(
    stations: Stations,
    plots: list[Plot],
    sfm: dict[str, Any],
    site: Site | None,
    searched: gpd.GeoDataFrame | None = None,
) -> dict[str, str]:
    """Rows of the run card: flight, positions, their residuals, ground sample distance, area not seen.

    sfm: report of the reconstruction; searched: :func:`.inventory.searched.searched_table`. A row whose figures they
    lack is left out.
    """
    facts = {"flown": flown(stations), "positions": positions(stations)}
    if sfm.get("geotag_rms_e_n_u_m"):
        facts["cameras against their positions"] = (
            f"{_rms(sfm['geotag_rms_e_n_u_m'])} (root mean square, {sfm['geotag_residual_quality']}); "
            f"points in the photos {sfm['reprojection_rms_px']:.2f} px"
        )
    for kind in ("control", "check"):
        if sfm.get(f"{kind}_rms_e_n_u_m"):
            facts[f"block against {kind} points"] = f"{_rms(sfm[f'{kind}_rms_e_n_u_m'])} (root mean square)"
    if sfm.get("bars"):
        told = (
            f"{bar['label']} {bar['length_m']:.3f} m, "
            + ("not seen" if bar["block_m"] is None else f"in the block {bar['block_m']:.3f} m")
            for bar in sfm["bars"]
        )
        facts["known lengths"] = f"{'; '.join(told)}; scale sure to {100 * sfm['scale_sd']:.2f} %"
    if sfm.get("level"):
        facts["photos matched"] = matched(sfm)
    if site is not None and plots:
        facts["ground sample distance"] = _sample_distance(site, plots)
    if plots and searched is not None:
        facts["plot area not seen"] = (
            f"{not_seen(searched)} is seen from the side by fewer than {ENOUGH_VIEWS} photos (trunks and leaves in the "
            "way not counted)"
        )
    return {name: text for name, text in facts.items() if text}


def _rms(metres: list[float]) -> str:
    """East, north and height in words."""
    e, n, u = (100 * float(value) for value in metres)
    return f"east {e:.1f}, north {n:.1f}, height {u:.1f} cm"


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


def _sample_distance(site: Site, plots: list[Plot]) -> str:
    """Ground sample distance at breast height in the plots; '' without ground."""
    points = over_ground(site, plot_cells(plots, cell_m=2.0)[0])
    sizes = [] if points is None else photos_looking(site.views, points)[1]
    if not sizes:
        return ""
    low, middle, high = np.percentile(sizes, [5, 50, 95])
    return f"{middle:.2f} cm a pixel at breast height in the plots ({low:.2f} to {high:.2f}; {len(sizes)} photos)"


def kept_table(path: Path, trees: list[Tree], crs: CRS) -> gpd.GeoDataFrame:
    """The trees as the layer ``path`` holds them, with what a person wrote; as measured where it is not to be read."""
    with suppress(InputError):
        found = read_trees(path)
        if len(found) >= len(trees):
            return found
    return tree_table(trees, crs)
