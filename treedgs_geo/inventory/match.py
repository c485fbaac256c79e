"""Pair every plot of a survey, keeping what a person locked; what plots mean that fit best at the largest turn
searched."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from datetime import date
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
from shapely import contains_xy
from shapely.geometry.base import BaseGeometry

from ..core.crs import grid_convergence_deg
from ..core.errors import InputError
from ..core.frames import own_degrees
from ..core.plots import Plot
from ..core.shown import some
from .declination import declination_deg, parse_date
from .double_sampling.other_trees import of_other_trees
from .options import FieldProtocol, PairingOptions
from .pairing import Registration, assign, at_limit, confirmed, fit_rigid, register
from .pairs_layer import SNAP_M, Locked, Matched

#: Measured trees are kept in the output up to this far outside a plot's circle.
_AROUND_M = 3.0
_FIELD_COLUMNS = [
    "plot_id", "field_id", "dbh_cm", "status", "species", "x", "y", "x_field", "y_field", "paired", "tree_id",
]  # fmt: skip
#: A field tree this near to searched ground stands on it: two maps do not agree to the decimetre, m.
_RIM_M = 0.5
#: Offsets of so many plots are compared. One stands apart by more than both, m and times the median: of Gaussian errors
#: of 0.5 to 3 m one in 1 to 2 % of the surveys. A shift that plots share is no chance below the last.
_COMPARED, _APART_M, _TIMES_APART, _BY_CHANCE = 4, 3.0, 5.0, 1e-3


def match_plots(
    field_trees: pd.DataFrame,
    measured: gpd.GeoDataFrame,
    plots: list[Plot],
    options: PairingOptions,
    locked: Locked | None = None,
    searched: BaseGeometry | None = None,
) -> Matched:
    """Pair the trees of every plot. searched: where stems were searched for (None: not known); a field tree elsewhere
    that has no partner was not missed.

    field_trees: ``plot_id, field_id, x, y, dbh_cm`` as surveyed. measured: as from :func:`.measured.read_measured`,
    after :func:`.reviewed.reviewed` where a person decided on trees.
    """
    locked = locked or Locked()
    result = Matched([], [], field_trees.copy(), measured.copy(), [], [])
    drawn, left_out = field_trees[["x", "y"]].to_numpy(float).copy(), np.zeros(len(field_trees), bool)
    beyond, taken = np.zeros(len(field_trees), bool), np.zeros(len(measured), bool)
    all_xy = measured[["x", "y"]].to_numpy(float)
    near_plot = np.full(len(measured), None, dtype=object)
    decisions = _resolve(locked, field_trees, measured, result.warnings)
    for plot in plots:
        rows = np.flatnonzero(field_trees["plot_id"].to_numpy() == plot.plot_id)
        if not len(rows):
            result.warnings.append(f"Plot {plot.plot_id}: has no field tree, left out.")
            continue
        centre = np.array([plot.x, plot.y])
        surveyed = field_trees[["x", "y"]].to_numpy(float)[rows]
        reach = max(plot.radius_m, np.linalg.norm(surveyed - centre, axis=1).max()) + 3 * options.centre_error_m + 2.0
        around = np.flatnonzero(np.linalg.norm(all_xy - centre, axis=1) <= reach)
        mine = [d for d in decisions if d["row"] in set(rows)]
        placed = _place(
            surveyed - centre, all_xy[around] - centre, options, mine, rows, around, locked.plots.get(plot.plot_id)
        )
        if not len(around):
            nearest = np.linalg.norm(all_xy - centre, axis=1).min() if len(all_xy) else np.inf
            far = f"the nearest measured tree is {nearest:,.0f} m away" if len(all_xy) else "there is no measured tree"
            placed = replace(placed, reason=f"{far}; check the plot's centre, its epsg and the CRS of the trees")
        moved = placed.apply(surveyed, centre)
        drawn[rows] = moved
        pairs, suggested = _pair_plot(plot, field_trees, measured, rows, around, moved, placed, options, mine, taken)
        result.pairs += pairs
        result.suggested += suggested
        left_out[rows] = [any(d["row"] == row and d["pair_status"] == "rejected" for d in mine) for row in rows]
        middle = centre + placed.offset_m
        away = np.linalg.norm(all_xy - middle, axis=1)
        inside = away <= plot.radius_m + _AROUND_M
        near_plot[inside & pd.isna(near_plot)] = plot.plot_id
        good = [p for p in pairs if p["pair_status"] != "rejected"]
        result.plots.append(
            {
                "plot_id": plot.plot_id,
                "status": placed.status,
                "reason": placed.reason,
                "offset_e_m": round(float(placed.offset_m[0]), 3),
                "offset_n_m": round(float(placed.offset_m[1]), 3),
                "rot_deg": round(placed.rotation_deg, 3),
                "ratio": _number(placed.ratio, 3),
                "margin": _number(placed.margin, 2),
                "residual_m": _number(np.sqrt(np.mean([p["dist_m"] ** 2 for p in good])) if good else np.nan, 3),
                "share": round(placed.share, 3),
                "n_field": len(rows),
                "n_measured": int((away <= plot.radius_m).sum()),
                "n_pairs": len(good),
                "n_sugg": len(suggested),
                "radius_m": plot.radius_m,
                "x": middle[0],
                "y": middle[1],
            }
        )
        if searched is not None:
            beyond[rows] = ~contains_xy(searched.buffer(_RIM_M), *moved.T)
        result.warnings += _remarks(plot, placed, rows[~beyond[rows]], good, suggested)
    _finish(result, drawn, np.select([left_out, beyond], ["rejected", "unsearched"], "no"), near_plot, plots)
    if n_beyond := int((result.field_trees["paired"] == "unsearched").sum()):
        result.warnings.append(
            f"{n_beyond} of {len(result.field_trees)} field trees stand where stems were not searched for: they are "
            "left unpaired, and no accuracy counts them as missed."
        )
    return result


def offsets_apart(plots: list[dict], path: Path) -> list[str]:
    """Sentences on centres that lie elsewhere than the others', and on a shift that all plots share. plots: rows of the
    layer ``plots``; those left to a hand check do not count. path: of the plots table."""
    known = [row for row in plots if row["status"] != "check"]
    if len(known) < _COMPARED:
        return []
    offsets = np.array([[row["offset_e_m"], row["offset_n_m"]] for row in known], float)
    away = np.linalg.norm(offsets - np.median(offsets, axis=0), axis=1)
    usual = float(np.median(away))
    odd = away > max(_APART_M, _TIMES_APART * usual)
    said = [
        f"{path}, plot {known[k]['plot_id']}: its trees stand {offsets[k][0]:+.1f} m east and {offsets[k][1]:+.1f} m "
        f"north of where its centre has them, {away[k]:.1f} m apart from the plots' median, the others {usual:.1f} m; "
        "the pairs hold, but correct the centre: a stand table counts the trees around it."
        for k in np.flatnonzero(odd)
    ]
    east, north = shift = (rest := offsets[~odd]).mean(axis=0)
    # The chance of such a mean where the errors of plots have nothing in common (F, 2 and 2 (n - 1) degrees).
    chance = (1 + len(rest) * (shift @ shift) / max(((rest - shift) ** 2).sum(), 1e-6)) ** (1 - len(rest))
    if np.hypot(east, north) > _APART_M and chance < _BY_CHANCE:
        said.append(
            f"{path}: {len(rest)} plots are moved alike, {east:+.1f} m east and {north:+.1f} m north; the pairs hold, "
            "but plots and trees are not in one frame: check epsg, datum and base station of both."
        )
    return said


def tally_of_other_trees(pairs: list[dict], tally: pd.DataFrame, path: Path) -> list[str]:
    """Warnings where a plot's DBHs, in the tally's order, hardly belong to the trees that they stand beside.

    Raises:
        InputError: they slipped by a row, were sorted alone, or filled down.
    """
    order = {(str(p), str(f)): k for k, (p, f) in enumerate(zip(tally["plot_id"], tally["field_id"], strict=True))}
    rows = pd.DataFrame(pairs, columns=["plot_id", "field_id", "field_cm", "dbh_cm", "pair_status"])
    rows = rows[rows["pair_status"] == "auto"]
    rows["row"] = [order.get(key, -1) for key in zip(rows["plot_id"].astype(str), rows["field_id"], strict=True)]
    warnings = []
    for plot, mine in rows.sort_values("row").groupby("plot_id"):
        d, t = (pd.to_numeric(mine[name]).to_numpy(float) for name in ("dbh_cm", "field_cm"))
        names = np.array([f"tree {name}" for name in mine["field_id"]], object)
        found = of_other_trees(t, d, np.full(len(t), np.nan), names)
        if found is None:
            continue
        text = f"{path}, plot {plot}: {found.why}; hold the DBHs against the form and correct them."
        if found.certain:
            raise InputError(text)
        warnings.append(text)
    return warnings


def _place(
    field_xy: np.ndarray,
    measured_xy: np.ndarray,
    options: PairingOptions,
    mine: list[dict],
    rows: np.ndarray,
    around: np.ndarray,
    typed: tuple[float, float, float] | None,
) -> Registration:
    """The plot's registration: from what a person locked where that is enough, else by search."""
    tree_at, stem_at = ({int(at): k for k, at in enumerate(each)} for each in (rows, around))
    sure = [d for d in mine if d["pair_status"] != "rejected" and d["stem"] in stem_at]
    anchors = np.array([[tree_at[d["row"]], stem_at[d["stem"]]] for d in sure], int).reshape(-1, 2)
    if typed is not None:
        return confirmed(field_xy, measured_xy, np.array(typed[:2]), typed[2])
    placed = register(field_xy, measured_xy, options, anchors if len(anchors) >= 2 else None)
    if placed.status == "check" and len(anchors) >= 2 and 2 * len(mine) >= len(rows):
        # A person paired most of the plot: as good as it gets, however badly the tally fits.
        fit = fit_rigid(field_xy[anchors[:, 0]], measured_xy[anchors[:, 1]])
        return replace(confirmed(field_xy, measured_xy, *fit), reason="paired by hand")
    return placed


def _pair_plot(
    plot: Plot,
    field_trees: pd.DataFrame,
    measured: gpd.GeoDataFrame,
    rows: np.ndarray,
    around: np.ndarray,
    moved: np.ndarray,
    placed: Registration,
    options: PairingOptions,
    mine: list[dict],
    taken: np.ndarray,
) -> tuple[list[dict], list[dict]]:
    """Pairs and suggestions of one plot; ``taken`` marks measured trees that already have a partner."""
    xy = measured[["x", "y"]].to_numpy(float)
    pairs: list[dict] = []
    suggested: list[dict] = []
    for decision in mine:
        k, stem = int(np.flatnonzero(rows == decision["row"])[0]), decision["stem"]
        end = xy[stem] if stem is not None else np.array([decision["mx"], decision["my"]])
        partner, status = measured.iloc[stem] if stem is not None else {}, decision["pair_status"]
        note = decision["note"] or ""
        pairs.append(_row(plot, field_trees.iloc[rows[k]], partner, moved[k], end, np.nan, status, note))
        if stem is not None and status != "rejected":
            taken[stem] = True
    done = {d["row"] for d in mine}
    free_f = np.array([k for k, row in enumerate(rows) if row not in done], int)
    free_m = around[~taken[around]]
    middle = np.array([plot.x, plot.y]) + placed.offset_m
    inside = int((np.linalg.norm(xy[free_m] - middle, axis=1) <= plot.radius_m).sum())
    found = assign(moved[free_f], xy[free_m], placed.sigma_m, options.gate_m, inside)
    for (i, j), margin in zip(found.index, found.margin, strict=True):
        k, stem = free_f[i], free_m[j]
        sure = placed.status in ("auto", "ok") and margin >= options.min_margin
        doubt = "plot needs a hand check" if placed.status == "check" else "another tree fits about as well"
        note = "" if sure else doubt
        row = _row(plot, field_trees.iloc[rows[k]], measured.iloc[stem], moved[k], xy[stem], margin, "auto", note)
        (pairs if sure else suggested).append(row)
        if sure:
            taken[stem] = True
    return pairs, suggested


def _row(
    plot: Plot, field_tree, stem, start: np.ndarray, end: np.ndarray, margin: float, status: str, note: str
) -> dict:
    """One line of ``pairs``; stem: the measured tree, empty where there is none."""
    field_cm = _number(field_tree["dbh_cm"], 2)
    dbh_cm = _number(stem.get("dbh_cm"), 2)
    return {
        "plot_id": plot.plot_id,
        "field_id": str(field_tree["field_id"]),
        "tree_id": int(stem["tree_id"]) if len(stem) else None,
        "field_cm": field_cm,
        "dbh_cm": dbh_cm,
        "delta_cm": round(dbh_cm - field_cm, 2) if dbh_cm is not None and field_cm is not None else None,
        "dbh_lo_cm": _number(stem.get("dbh_lo_cm"), 2),
        "dbh_hi_cm": _number(stem.get("dbh_hi_cm"), 2),
        "qc_flag": stem.get("qc_flag"),
        "meas_cm": _number(stem.get("meas_cm", dbh_cm), 2),
        "rev_flag": stem.get("rev_flag"),
        "dist_m": round(float(np.linalg.norm(start - end)), 3),
        "margin": _number(margin, 2),
        "pair_status": status,
        "note": note,
        "line": (tuple(start), tuple(end)),
    }


def _resolve(locked: Locked, field_trees: pd.DataFrame, measured: gpd.GeoDataFrame, warnings: list[str]) -> list[dict]:
    """Which rows of the present tables the locked lines mean; lines that mean nothing any more are reported."""
    key_rows = {
        (str(p), str(f)): k
        for k, (p, f) in enumerate(zip(field_trees["plot_id"], field_trees["field_id"], strict=True))
    }
    ids = {int(t): k for k, t in enumerate(measured["tree_id"])}
    xy = measured[["x", "y"]].to_numpy(float).reshape(-1, 2)
    names = [key for key in locked.field_xy if key in key_rows]
    drawn = np.array([locked.field_xy[key] for key in names], float).reshape(-1, 2)
    decisions: list[dict] = []
    rows_seen: Counter = Counter()
    for line in locked.pairs:
        start, end = np.array([line["fx"], line["fy"]]), np.array([line["mx"], line["my"]])
        label = f"Locked pair {line['plot_id'] or '?'}/{line['field_id'] or '?'}"
        row = key_rows.get((str(line["plot_id"]), str(line["field_id"]))) if line["field_id"] else None
        # A line whose end a person moved means the tree it now ends at.
        if len(drawn) and (row is None or line["pair_status"] == "moved"):
            away = np.linalg.norm(drawn - start, axis=1)
            if away.min() <= SNAP_M:
                row = key_rows[names[int(away.argmin())]]
        away = np.linalg.norm(xy - end, axis=1) if len(xy) else np.array([np.inf])
        stem = ids.get(line["tree_id"]) if line["tree_id"] is not None and line["pair_status"] != "moved" else None
        if stem is None or away[stem] > SNAP_M:
            stem = int(away.argmin()) if away.min() <= SNAP_M else None
        if row is None:
            warnings.append(f"{label}: no field tree stands where the line starts; the line is dropped.")
            continue
        if stem is None and line["pair_status"] != "rejected":
            warnings.append(
                f"{label}: no measured tree within {SNAP_M:g} m of the line's end any more; the line is kept "
                "without a DBH."
            )
        rows_seen[row] += 1
        if (
            rows_seen[row] > 1
            or stem is not None
            and line["pair_status"] != "rejected"
            and any(d["stem"] == stem and d["pair_status"] != "rejected" for d in decisions)
        ):
            warnings.append(
                f"{label}: its field tree or its measured tree is in another locked pair too; only the first is kept."
            )
            continue
        decisions.append({**line, "row": row, "stem": stem})
    return decisions


def _remarks(plot: Plot, placed: Registration, rows: np.ndarray, good: list[dict], suggested: list[dict]) -> list[str]:
    """Sentences about a plot that a technician should read."""
    remarks = []
    if placed.status == "check":
        todo = "; look at the layer 'suggested', set the plot's status to ok (or draw two or more pairs) and run again"
        remarks.append(f"Plot {plot.plot_id}: left to a hand check ({placed.reason}){todo if suggested else ''}.")
    elif abs(placed.rotation_deg) >= 4:
        remarks.append(
            f"Plot {plot.plot_id}: is turned by {placed.rotation_deg:+.1f} degrees; check --north and the declination."
        )
    if placed.status != "check" and len(good) < 0.6 * len(rows):
        remarks.append(
            f"Plot {plot.plot_id}: only {len(good)} of {len(rows)} field trees are paired "
            f"({len(suggested)} more are suggested for a hand check)."
        )
    return remarks


def _finish(result: Matched, drawn: np.ndarray, without: np.ndarray, near_plot: np.ndarray, plots: list[Plot]) -> None:
    """Fill the two point layers: where each tree stands and whether it has a partner; ``without``: the word for each
    field tree that has none."""
    used = [p for p in result.pairs if p["pair_status"] != "rejected"]
    by_field = {(p["plot_id"], p["field_id"]): p["tree_id"] for p in used}
    by_stem = {p["tree_id"]: p for p in used if p["tree_id"] is not None}
    table = result.field_trees
    keys = list(zip(table["plot_id"], table["field_id"].astype(str), strict=True))
    status = {row["plot_id"]: row["status"] for row in result.plots}
    out = table.assign(
        field_id=table["field_id"].astype(str),
        x=drawn[:, 0],
        y=drawn[:, 1],
        x_field=table["x"],
        y_field=table["y"],
        paired=[
            "yes" if key in by_field else "check" if word == "no" and status.get(key[0]) == "check" else str(word)
            for key, word in zip(keys, without, strict=True)
        ],
        tree_id=pd.array([by_field.get(key) for key in keys], dtype="Int64"),
    ).reindex(columns=_FIELD_COLUMNS)
    result.field_trees = out[out["plot_id"].isin([plot.plot_id for plot in plots])].reset_index(drop=True)
    measured = result.measured
    partners = [by_stem.get(t, {"plot_id": p}) for t, p in zip(measured["tree_id"], near_plot, strict=True)]
    for name in ("plot_id", "field_id"):
        measured[name] = [partner.get(name) for partner in partners]
    measured["paired"] = ["yes" if "field_id" in partner else "no" for partner in partners]
    depth = np.full(len(measured), -np.inf)
    for row in result.plots:
        away = np.hypot(measured["x"] - row["x"], measured["y"] - row["y"])
        depth = np.maximum(depth, row["radius_m"] - away)
    # A stem on the circle may be in or out by the crew's tape: it is no evidence for a false tree.
    measured["in_plot"] = np.select([depth > SNAP_M, depth >= -SNAP_M], ["in", "edge"], "out")
    wanted = [
        "tree_id", "plot_id", "field_id", "x", "y", "dbh_cm", "dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm", "qc_flag",
        "qc_reason", "meas_cm", "rev_flag", "method", "paired", "in_plot",
    ]  # fmt: skip
    names = [name for name in wanted if name in measured]
    result.measured = measured.loc[measured["plot_id"].notna(), [*names, "geometry"]].reset_index(drop=True)


def _number(value, decimals: int) -> float | None:
    return None if value is None or pd.isna(value) else round(float(value), decimals)


#: How far a wider search looks, degrees, and in how many plots.
_WIDE_DEG, _WIDE_PLOTS = 45.0, 5


def is_stuck(plot: dict, options: PairingOptions) -> bool:
    """Whether a row of the layer ``plots`` is left to check and turned by the most that is searched."""
    return plot["status"] == "check" and at_limit(plot["rot_deg"], options.rotation_deg)


def turn_advice(
    plots: list[dict],
    survey: list[Plot],
    field_trees: pd.DataFrame,
    measured_xy: np.ndarray,
    options: PairingOptions,
    protocol: FieldProtocol,
    crs: pyproj.CRS,
) -> list[str]:
    """One sentence where plots are turned to the limit: how many, where a wider search finds them, what to change.

    plots: rows of the layer ``plots``. field_trees: with ``plot_id, x_field, y_field``. measured_xy: (M, 2).
    """
    stuck = [row["plot_id"] for row in plots if is_stuck(row, options)]
    if not stuck:
        return []
    known = {plot.plot_id: plot for plot in survey}
    tried = [known[name] for name in stuck[:_WIDE_PLOTS]]
    found = [_wider(plot, field_trees, measured_xy, options) for plot in tried]
    turns = [placed.rotation_deg for placed in found if placed is not None]
    text = (
        f"{len(stuck)} of {len(plots)} plots fit best at the largest turn searched, {options.rotation_deg:g} degrees "
        f"({some(stuck, 10)}), and are left to a hand check: their bearings may refer to another north or be "
        "in another unit."
    )
    if turns:
        more = f" to {max(turns):+.1f}, median {np.median(turns):+.1f}" if len(turns) > 1 else ""
        span = f"{min(turns):+.1f}{more}"
        text += f" Searched up to {_WIDE_DEG:g} degrees, {len(turns)} of {len(tried)} fit clearly, at {span}."
    return [f"{text} {_what_to_change(tried[0], protocol, crs)}"]


def _wider(
    plot: Plot, field_trees: pd.DataFrame, measured_xy: np.ndarray, options: PairingOptions
) -> Registration | None:
    """The plot placed with turns up to :data:`_WIDE_DEG`; ``None`` where that is unclear too."""
    centre = np.array([plot.x, plot.y])
    mine = field_trees.loc[field_trees["plot_id"] == plot.plot_id, ["x_field", "y_field"]].to_numpy(float) - centre
    reach = np.linalg.norm(mine, axis=1).max() + 3 * options.centre_error_m + 2.0
    there = measured_xy - centre
    there = there[np.linalg.norm(there, axis=1) <= reach]
    placed = register(mine, there, replace(options, rotation_deg=_WIDE_DEG))
    return placed if placed.status != "check" else None


def _what_to_change(plot: Plot, protocol: FieldProtocol, crs: pyproj.CRS) -> str:
    """The settings that turn a plot, with what the declination and the convergence are there."""
    ways = []
    if (degrees := own_degrees(crs, plot.x, plot.y)) is not None:
        lon, lat = degrees
        day = protocol.field_date or date.today().isoformat()
        try:
            declination = declination_deg(lon, lat, 0.0, parse_date(day, "field date"), plot.plot_id)
            magnetic = f"magnetic with --field-date or --declination-deg (there {declination:+.1f} degrees on {day})"
        except InputError:
            magnetic = "magnetic with --declination-deg"
        convergence = grid_convergence_deg(crs, lon, lat)
        ways.append(
            f"--north (now {protocol.north}: {magnetic}, true, or grid, which lies {abs(convergence):.1f} degrees "
            f"{'east' if convergence > 0 else 'west'} of true)"
        )
    ways.append("the unit in the name of the bearings' column (azimuth_deg, azimuth_gon, azimuth_mil)")
    return f"Change {'; '.join(ways)}; or give --rotation-deg for a larger turn."
