"""Successes and failures: slices at breast height with the circle that was fitted, and evidence sheets of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.scores import pair_by_position
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.report.blocks import Block, Heading, Picture
from treedgs_geo.report.charts import BLUE, VERMILION
from treedgs_geo.stems.cloud.estimate.published import measure_published
from treedgs_geo.stems.quality.priors import BREAST_HEIGHT_M

from .methods import SEED, StemPoints, with_power
from .paper_pictures import dress, panels, ring
from .reference import Reference

#: Stems of each kind in the gallery of slices; half width of a picture, m.
EACH, HALF_M = 3, 0.5
#: Another stem this near is worth a word, m.
NEIGHBOUR_M = 1.5


@dataclass(frozen=True)
class Fitted:
    """One stem of the gallery. points: (N, 2) of its slice, m. circle: x, y, diameter in cm, ``None`` where the slice
    gave none. dbh_cm: NaN where the taper gave none."""

    number: int
    points: np.ndarray
    circle: tuple[float, float, float] | None
    dbh_cm: float


def fitted_stems(stems: StemPoints, power: float) -> list[Fitted]:
    """The weighted circles of the published fit at every reference stem; a stem without points has an empty slice."""
    options, found = with_power(power), []
    for k, given in enumerate(stems):
        if given is None:
            found.append(Fitted(k, np.empty((0, 2)), None, float("nan")))
            continue
        points = given[0]
        (own,) = measure_published([given], BREAST_HEIGHT_M, options, SEED)
        slices = own.slices[np.isfinite(own.slices[:, 3])]
        circle, at = None, BREAST_HEIGHT_M
        if len(slices):
            at, x, y, diameter = slices[np.argmin(np.abs(slices[:, 0] - at))]
            circle = float(x), float(y), float(diameter)
        here = np.abs(points[:, 2] - at) < options.thickness_m / 2
        dbh = float("nan") if own.taper is None else float(own.taper.at_bh_cm)
        found.append(Fitted(k, points[here, :2], circle, dbh))
    return found


def chosen(fits: list[Fitted], reference: Reference) -> list[tuple[str, Fitted]]:
    """Up to :data:`EACH` stems without a diameter, those with the largest and those with the smallest errors."""
    missing = [fit for fit in fits if not np.isfinite(fit.dbh_cm)]
    measured = [fit for fit in fits if np.isfinite(fit.dbh_cm)]
    measured.sort(key=lambda fit: abs(fit.dbh_cm - reference.dbh_cm[fit.number]))
    best = measured[: min(EACH, -(-len(measured) // 2))]
    rest = measured[len(best) :]
    return [
        *(("no diameter", fit) for fit in missing[:EACH]),
        *(("largest error", fit) for fit in rest[::-1][:EACH]),
        *(("smallest error", fit) for fit in best),
    ]


def circumstances(number: int, reference: Reference, seen: pd.DataFrame | None) -> str:
    """What is known of a stem that bears on its diameter. seen: ``visibility.csv`` of the workspaces."""
    said = []
    if seen is not None:
        own = seen[(seen["plot"] == reference.plot[number]) & (seen["reference"] == reference.tree[number])]
        said += [f"free in {int(row.free_views)} photos" for row in own.itertuples()]
    same = np.flatnonzero(reference.plot == reference.plot[number])
    away = np.hypot(*(reference.xy[same] - reference.xy[number]).T)
    if (near := away[(away > 0) & (away < NEIGHBOUR_M)]).size:
        said.append(f"another stem {near.min():.1f} m away")
    return "; ".join(said)


def draw_fits(
    source: str, picks: list[tuple[str, Fitted]], reference: Reference, seen: pd.DataFrame | None
) -> Any | None:
    """The slice of each chosen stem from above, the fitted circle, and the true size about the same centre."""
    if not picks:
        return None
    figure, grid = panels(len(picks), EACH, 3.4, 3.9)
    for axes, (kind, fit) in zip(grid, picks, strict=True):
        true = float(reference.dbh_cm[fit.number])
        middle = np.array(fit.circle[:2]) if fit.circle else np.median(fit.points, axis=0) if len(fit.points) else 0.0
        if len(fit.points):
            size = 3 if len(fit.points) > 300 else 14
            axes.scatter(*(fit.points - middle).T, s=size, color="0.45", linewidths=0, rasterized=True)
        if fit.circle is not None:
            axes.add_patch(ring((0, 0), fit.circle[2] / 200, fill=False, color=VERMILION, lw=1.5))
        axes.add_patch(ring((0, 0), true / 200, fill=False, color=BLUE, ls="--", lw=1.5))
        estimate = f"est. {fit.dbh_cm:.1f}" if np.isfinite(fit.dbh_cm) else "no estimate"
        name = f"{reference.plot[fit.number]} {reference.tree[fit.number]}"
        words = circumstances(fit.number, reference, seen)
        title = f"{kind}: {name}\n{estimate}, reference {true:.1f} cm; {len(fit.points)} points\n{words}"
        dress(axes, title, aspect="equal", xlim=(-HALF_M, HALF_M), ylim=(-HALF_M, HALF_M))
    figure.supxlabel(f"{source}: slice at breast height, m; solid: circle fitted there, dashed: reference", fontsize=8)
    return figure


def sheets(plot: PlotFiles, reference: Reference) -> list[Block]:
    """Evidence sheets: the two best diameters of a plot, the two worst, and up to two stems without one."""
    assert plot.workspace_in is not None
    trees = read_trees(plot.workspace_in / "trees.gpkg")
    partner = {int(j): int(i) for i, j in pair_by_position(reference.xy, trees[["x", "y"]].to_numpy(float))}
    rows = []
    for k, tree in trees.iterrows():
        file = plot.workspace_in / "sheets" / str(tree.get("run_id")) / f"{tree['tree_id']}.jpg"
        if k in partner and file.is_file():
            rows.append((float(tree["dbh_cm"]) - reference.dbh_cm[partner[k]], tree["tree_id"], file))
    measured = sorted((row for row in rows if np.isfinite(row[0])), key=lambda row: abs(row[0]))
    kinds = {
        "success, {:+.2f} cm": measured[:2],
        "largest error, {:+.2f} cm": measured[2:][-2:],
        "no diameter": [row for row in rows if not np.isfinite(row[0])][:2],
    }
    shown: list[Block] = []
    for words, part in kinds.items():
        for error, tree_id, file in part:
            shown.append(Heading(f"{plot.name}, tree {tree_id}: {words.format(error)}", 3))
            shown.append(Picture("evidence sheet", file.read_bytes()))
    return shown
