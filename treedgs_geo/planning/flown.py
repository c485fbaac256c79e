"""After the flight: what was planned against what came."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.layer_files import read_layer

if TYPE_CHECKING:
    import geopandas as gpd

    from ..stems.quality.tree import Tree

#: Layers of a plan.
PHOTOS, PLOTS = "plan_photos", "plan_plots"
#: The share measured may fall short by this much, and the error exceed by this factor, before it is worth a sentence.
SHARE_SLACK, ERROR_SLACK = 0.10, 1.3


def read_expected(path: Path) -> gpd.GeoDataFrame:
    """What the plan expects, one row a plot: ``plot_id, exp_stems, exp_views, exp_share, exp_err_cm, n_photos``.

    Raises:
        InputError: not a flight plan.
    """
    wanted = ("plot_id", "exp_stems", "exp_views", "exp_share", "exp_err_cm", "n_photos")
    return read_layer(path, PLOTS, wanted, "plan-flight")


def planned_and_got(path: Path, trees: list[Tree], n_photos: int) -> dict[str, Any]:
    """Planned against got, all plots of the plan together.

    trees: of the run, with their plots. n_photos: that were used. The share is of the stems expected, or of those found
    where more were found: a stem that no photo shows is in no layer.

    Returns:
        ``planned, got``: each ``photos, stems, views, share, error_cm``; ``sentences``. Planned views are clear ones,
        those got are all that the fits used, partly hidden ones too.

    Raises:
        InputError: not a flight plan.
    """
    expected = read_expected(path)
    stems = expected["exp_stems"]

    def mean(name: str) -> float:
        known = expected[name].notna() & (stems > 0)
        return float(np.average(expected[name][known], weights=stems[known])) if known.any() else np.nan

    planned = {
        "photos": len(read_layer(path, PHOTOS, {"photo"}, "plan-flight")),
        "stems": round(float(stems.sum()), 1),
        "views": round(mean("exp_views"), 2),
        "share": round(mean("exp_share"), 3),
        "error_cm": round(mean("exp_err_cm"), 3),
    }
    # Plots may have got other names since; trees beside them are none of the plan's.
    plots = set(expected["plot_id"].astype(str))
    own = [tree for tree in trees if tree.plot_id in plots] or [tree for tree in trees if tree.plot_id] or trees
    measured = [tree for tree in own if tree.dbh_cm is not None]
    views = [tree.n_views for tree in measured if tree.n_views is not None]
    errors = [tree.dbh_se_cm for tree in measured if tree.dbh_se_cm is not None]
    got = {
        "photos": n_photos,
        "stems": len(own),
        "views": round(float(np.mean(views)), 2) if views else None,
        "share": round(len(measured) / max(len(own), planned["stems"], 1.0), 3),
        "error_cm": round(float(np.median(errors)), 3) if errors else None,
    }
    return {"planned": planned, "got": got, "sentences": _sentences(planned, got)}


def _sentences(planned: dict[str, Any], got: dict[str, Any]) -> list[str]:
    """What came, and what to do where it fell short."""

    def text(row: dict[str, Any], kind: str) -> str:
        views = "–" if row["views"] is None else f"{row['views']:.1f}"
        error = "–" if row["error_cm"] is None else f"{row['error_cm']:.2f} cm"
        return f"{row['photos']} photos, {views} {kind} views a stem, {100 * row['share']:.0f} % of the stems, {error}"

    said = [f"Planned {text(planned, 'clear')}; got {text(got, 'used')}."]
    if got["photos"] < 0.9 * planned["photos"]:
        said.append(
            f"{planned['photos'] - got['photos']:.0f} planned photos are missing: look for a card or a battery change."
        )
    if got["share"] < planned["share"] - SHARE_SLACK:
        said.append(
            "Fewer stems were measured than planned: the stand is denser than it was described, or photos are not "
            "sharp; describe it with the new tree layer (--stand) and plan the next flight again."
        )
    if got["error_cm"] is not None and got["error_cm"] > ERROR_SLACK * planned["error_cm"]:
        said.append(
            "Standard errors are larger than planned: compare height, sharpness and fixed positions with the brief."
        )
    return said
