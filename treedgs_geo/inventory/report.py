"""One self-contained page about a run: the map of stems, each DBH, what was modelled and what it cost."""

from __future__ import annotations

import base64
import html
import io
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd

from ..core.files import atomic_path
from ..core.plots import Plot
from ..trees.reasons import explain

# Okabe-Ito colours: distinguished by colour-blind readers and in grey print.
_COLOURS = {"ok": "#009E73", "check": "#E69F00", "reject": "#D55E00"}


def draw_stem_map(trees: gpd.GeoDataFrame, plots: list[Plot], title: str = "") -> bytes:
    """PNG of the stems on the plot: discs grow with DBH, labels give tree_id (as in the table) and DBH in cm, rejected
    stems are hollow."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 8), dpi=110)
    if len(trees):
        origin = trees[["x", "y"]].mean().round(0).to_numpy()
    else:
        origin = np.array([plots[0].x, plots[0].y]).round(0) if plots else np.zeros(2)
    for plot in plots:
        axes.add_patch(
            plt.Circle((plot.x - origin[0], plot.y - origin[1]), plot.radius_m, fill=False, ls="--", color="0.5")
        )
        axes.annotate(
            plot.plot_id,
            (plot.x - origin[0], plot.y - origin[1] + plot.radius_m),
            color="0.4",
            ha="center",
            va="bottom",
            fontsize=9,
        )
    for flag, colour in _COLOURS.items():
        chosen = trees[trees["qc_flag"] == flag]
        if not len(chosen):
            continue
        size = (chosen["dbh_cm"].fillna(12).astype(float) / 2.2) ** 2
        axes.scatter(
            chosen["x"] - origin[0],
            chosen["y"] - origin[1],
            s=size,
            label=f"{flag} ({len(chosen)})",
            zorder=3,
            facecolors="none" if flag == "reject" else colour,
            edgecolors=colour,
            linewidths=1.5,
            alpha=0.9,
        )
    for _, tree in trees.iterrows():
        at = tree["x"] - origin[0], tree["y"] - origin[1]
        text = f"{tree['dbh_cm']:.1f}" if pd.notna(tree["dbh_cm"]) else "–"
        near: dict[str, Any] = {"textcoords": "offset points", "zorder": 4, "annotation_clip": True}
        beside = 3 + (tree["dbh_cm"] if pd.notna(tree["dbh_cm"]) else 12) / 4.4
        axes.annotate(str(tree["tree_id"]), at, xytext=(beside, 1), fontsize=8, fontweight="bold", **near)
        axes.annotate(text, at, xytext=(beside, -7), fontsize=7, color="0.3", **near)
    axes.set_aspect("equal")
    axes.margins(0.12)
    axes.set_xlabel(f"Easting − {origin[0]:.0f} m")
    axes.set_ylabel(f"Northing − {origin[1]:.0f} m")
    axes.set_title(title or "Tree number as in the table, and DBH in cm")
    axes.grid(alpha=0.25)
    if len(trees):
        axes.legend(loc="upper left", framealpha=0.9)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", bbox_inches="tight")
    plt.close(figure)
    return picture.getvalue()


def draw_dbh_histogram(trees: gpd.GeoDataFrame, width_cm: float = 5.0) -> bytes:
    """PNG of the number of stems by DBH class, stacked by flag; refused stems have no DBH and are counted beside it."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import MaxNLocator

    figure, axes = plt.subplots(figsize=(8, 3.2), dpi=110, layout="constrained")
    known = trees[trees["dbh_cm"].notna()]
    number = np.floor(known["dbh_cm"].astype(float) / width_cm + 1e-9).astype(int)
    classes = range(int(number.min()), int(number.max()) + 1) if len(known) else range(0)
    base = np.zeros(len(classes))
    for flag, colour in _COLOURS.items():
        counts = np.array([int(((number == k) & (known["qc_flag"] == flag)).sum()) for k in classes])
        if counts.sum():
            axes.bar(
                [k * width_cm for k in classes], counts, width_cm * 0.9, base, align="edge", color=colour, label=flag
            )
            base += counts
    n_refused = len(trees) - len(known)
    axes.set_xlabel("DBH, cm")
    axes.set_ylabel("Stems")
    axes.set_title(f"{len(known)} stems with a DBH, {n_refused} without", fontsize=11)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", alpha=0.3)
    axes.set_axisbelow(True)
    if len(known):
        axes.legend(frameon=False)
    picture = io.BytesIO()
    figure.savefig(picture, format="png")
    plt.close(figure)
    return picture.getvalue()


def write_report(
    path: Path,
    trees: gpd.GeoDataFrame,
    plots: list[Plot],
    facts: dict[str, Any],
    warnings: list[str],
    stages: dict[str, dict[str, Any]],
) -> Path:
    """Write the page. facts: label -> value rows of the run card; stages: name -> ``seconds``, ``peak_memory_mb``."""
    measured = trees[trees["dbh_cm"].notna()]
    rows = []
    for _, tree in trees.sort_values("tree_id").iterrows():
        has = pd.notna(tree["dbh_cm"])
        cells = (
            str(tree["tree_id"]),
            html.escape(str(tree["plot_id"] or "")),
            f"{tree['x']:.2f}",
            f"{tree['y']:.2f}",
            f"{tree['dbh_cm']:.1f}" if has else "",
            f"± {tree['dbh_se_cm']:.1f}" if has and pd.notna(tree["dbh_se_cm"]) else "",
            f"{tree['dbh_lo_cm']:.1f} – {tree['dbh_hi_cm']:.1f}" if has and pd.notna(tree["dbh_lo_cm"]) else "",
            _whole(tree["n_views"]),
            _whole(tree["n_pts"]),
            tree["qc_flag"],
            html.escape(explain(tree["qc_reason"] or "")),
        )
        row = "".join(f"<td>{cell}</td>" for cell in cells)
        rows.append(f"<tr id='tree-{tree['tree_id']}' class='{tree['qc_flag']}'>{row}</tr>")
    card = "".join(f"<tr><th>{html.escape(str(k))}</th><td>{html.escape(str(v))}</td></tr>" for k, v in facts.items())
    cost = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{entry['seconds']:.1f}</td><td>{entry['peak_memory_mb']}</td></tr>"
        for name, entry in stages.items()
        if "seconds" in entry
    )
    notes = "".join(f"<li>{html.escape(text)}</li>" for text in warnings)
    if len(trees):
        n_check, n_refused = int((trees["qc_flag"] == "check").sum()), len(trees) - len(measured)
        summary = (
            f"{len(measured)} stems have a DBH ({n_check} of them to check); {n_refused} more were found and refused, "
            "with the reason below. Stems that were not found are in no list: how many there are, only trees counted "
            "in the field can show (Pair field and measured trees)."
        )
        found = _template("report_trees.html").substitute(
            picture=base64.b64encode(draw_stem_map(trees, plots)).decode(),
            histogram=base64.b64encode(draw_dbh_histogram(trees)).decode(),
            rows="".join(rows),
        )
    else:
        summary, found = "No stem was found; the reason is below.", ""
    page = _template("report.html").substitute(
        summary=summary,
        warnings=f"<div class='warn'><b>Warnings</b><ul>{notes}</ul></div>" if notes else "",
        trees=found,
        card=card,
        cost=cost,
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return Path(path)


def _template(name: str) -> Template:
    return Template((files(__package__) / "templates" / name).read_text(encoding="utf-8"))


def _whole(value: Any) -> str:
    return "" if pd.isna(value) else str(int(value))
