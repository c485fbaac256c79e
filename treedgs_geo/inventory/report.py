"""One self-contained page about a run: the map of stems, each DBH, what was modelled and what it cost."""

from __future__ import annotations

import base64
import html
import io
import os
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

import geopandas as gpd
import numpy as np

from ..core.calibration import CALIBRATION, NETWORK, TAPE
from ..core.files import atomic_path
from ..core.plots import Plot
from .report_map import FLAGS, stem_map
from .report_table import empty_columns, flag_boxes, heads, plot_options, tree_rows


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
    for flag, (colour, words) in FLAGS.items():
        counts = np.array([int(((number == k) & (known["qc_flag"] == flag)).sum()) for k in classes])
        if counts.sum():
            axes.bar(
                [k * width_cm for k in classes], counts, width_cm * 0.9, base, align="edge", color=colour, label=words
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
    sheets: Mapping[int, Path] | None = None,
) -> Path:
    """Write the page. facts: label -> value rows of the run card; stages: name -> ``seconds``, ``peak_memory_mb``.
    sheets: ``tree_id`` -> evidence sheet, to be linked from where the page lies."""
    measured = trees[trees["dbh_cm"].notna()]
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
            map=stem_map(trees, plots),
            flags=flag_boxes(trees),
            plots=plot_options(trees),
            heads=heads(),
            empty=empty_columns(trees),
            rows=tree_rows(trees, {number: _address(sheet, path) for number, sheet in (sheets or {}).items()}),
            histogram=base64.b64encode(draw_dbh_histogram(trees)).decode(),
        )
    else:
        summary, found = "No stem was found; the reason is below.", ""
    page = _template("report.html").substitute(
        summary=summary,
        warnings=f"<div class='warn'><b>Warnings</b><ul>{notes}</ul></div>" if notes else "",
        trees=found,
        card=card,
        cost=cost,
        rests_on=f"{CALIBRATION} {NETWORK if trees['method'].str.startswith('photos').any() else ''} {TAPE}",
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return Path(path)


def _template(name: str) -> Template:
    return Template((files(__package__) / "templates" / name).read_text(encoding="utf-8"))


def _address(file: Path, page: Path) -> str:
    """A file as the page links to it: relative, so that both can be moved together."""
    try:
        return quote(Path(os.path.relpath(file, Path(page).absolute().parent)).as_posix())
    except ValueError:  # another drive
        return Path(file).absolute().as_uri()
