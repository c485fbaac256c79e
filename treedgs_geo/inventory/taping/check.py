"""From the settings of ``tape-check`` to its files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np

from ... import __version__
from ...core.crs import project_crs
from ...core.errors import InputError
from ...core.files import ensure_writable, fingerprint, write_json
from ...core.geopackage import ensure_unlocked
from ...core.layer_files import write_layer
from ...core.progress import Reporter
from ...core.tables import write_csv
from ...report.blocks import Block, Cards, Column, Document, Heading, Picture, Sentences, Table, known
from ...report.charts import BLUE, FLAGS, SKY, chart_png, new_chart
from ...report.html import write_html
from ...report.pdf import load_fonts, write_pdf
from ..double_sampling.other_trees import tapes_of_other_trees
from ..double_sampling.tapes import join, read_taped
from .frame import Frame, read_frame
from .statistics import Checked, check_tapes

LAYER = "tape_check"
OWN_LAYERS = {LAYER: frozenset({"tree_id", "taped_cm", "error_cm"})}
_SHOWN = (
    "tree_id", "plot_id", "qc_flag", "dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "taped_cm", "error_cm", "inside", "state",
    "outlier", "note", "x", "y",
)  # fmt: skip


def check_tape_table(settings: Any, reporter: Reporter) -> dict[str, Any]:
    """settings: ``TapeCheckSettings``.

    Raises:
        InputError: inputs that do not fit together.
    """
    folder = Path(settings.output)
    ensure_writable(folder / "tape_check.json")
    load_fonts()  # says that the extra "reports" is missing before anything is written
    ensure_unlocked(folder / "tape_check.gpkg", OWN_LAYERS)
    with reporter.stage("read", 0.0, 0.4):
        taped = read_taped(settings.taped)
        frame = read_frame(settings.trees, project_crs(settings.crs) if settings.crs else None, settings.plots)
        rows, dbh_cm, notes = join(frame.trees, taped, settings.trees)
        others = tapes_of_other_trees(taped, frame.trees, rows, dbh_cm)
        if others is not None and others.certain:
            raise InputError(others.why)
    with reporter.stage("check", 0.4, 0.5):
        checked = check_tapes(frame, taped, rows, dbh_cm, settings.confidence_pct / 100)
    if others is not None:
        # What follows from the tapes says nothing until it is known whose they are.
        checked.warnings[:], checked.totals = [others.why], {}
    checked.notes[:0] = notes
    checked.warnings += frame.warnings
    restored = Frame(frame.trees.assign(dbh_cm=dbh_cm), frame.crs, frame.plots)
    if taped.frame and taped.frame != restored.mark or taped.n_frame not in (0, len(frame.trees)):
        checked.warnings.append(
            f"{settings.trees.name} is not quite the layer that the trees were drawn from ({taped.n_frame} trees then, "
            f"{len(frame.trees)} now; plots left out here count too): the totals hold for that layer only."
        )
    reporter.tell(checked.warnings, checked.notes)
    with reporter.stage("write", 0.5, 1.0):
        _write(folder, frame, checked, settings)
    f = checked.figures
    keys = ("n_taped", "bias_cm", "bias_lo_cm", "bias_hi_cm", "rmse_cm", "n_intervals", "n_inside")
    found: dict[str, Any] = {key: f[key] for key in keys}
    return {
        "output": str(folder),
        "page": str(folder / "tape_check.html"),
        "pdf": str(folder / "tape_check.pdf"),
        "layer": str(folder / "tape_check.gpkg"),
        **{key: round(value, 4) if isinstance(value, float) else value for key, value in found.items()},
        "n_outliers": int(checked.trees["outlier"].notna().sum()),
    }


def _write(folder: Path, frame: Frame, checked: Checked, settings: Any) -> None:
    (folder / "tape_check.json").unlink(missing_ok=True)
    document = _document(checked, settings)
    write_html(folder / "tape_check.html", document)
    write_pdf(folder / "tape_check.pdf", document)
    table = checked.trees[list(_SHOWN)].copy()
    table["inside"] = table["inside"].map({True: "yes", False: "no"}).astype(object)
    table["error_cm"] = table["error_cm"].round(2)
    write_csv(folder / "tape_check.csv", table)
    place = frame.trees.set_index("tree_id").loc[table["tree_id"], ["x", "y"]].to_numpy(float)
    layer = gpd.GeoDataFrame(
        table.assign(x=place[:, 0], y=place[:, 1]), geometry=gpd.points_from_xy(*place.T), crs=frame.crs
    )
    write_layer(folder / "tape_check.gpkg", OWN_LAYERS, LAYER, layer, "Point")
    write_json(
        folder / "tape_check.json",
        {
            **_plain(checked.figures),
            "outliers": [int(tree) for tree in checked.trees["tree_id"][checked.trees["outlier"].notna()]],
            "warnings": checked.warnings,
            "notes": checked.notes,
            "inputs": {Path(p).name: fingerprint([Path(p)]) for p in (settings.trees, settings.taped)},
            "version": __version__,
        },
    )


def _plain(value: Any) -> Any:
    """``None`` for what is not known."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return known(value) if isinstance(value, float) else value


def _document(checked: Checked, settings: Any) -> Document:
    f = checked.figures
    level = f"{100 * f['confidence']:g} %"
    cards = [
        ("Taped and measured", f"{f['n_taped']} trees", ""),
        ("Bias, measured − taped", f"{f['bias_cm']:+.2f} cm", f"{f['bias_lo_cm']:+.2f} to {f['bias_hi_cm']:+.2f}"),
        ("RMSE", f"{f['rmse_cm']:.2f} cm", f"{f['rmse_lo_cm']:.2f} to {f['rmse_hi_cm']:.2f}"),
    ]
    if f["n_intervals"]:
        cards.append(
            (
                "Inside the 90 % interval",
                f"{f['n_inside']} of {f['n_intervals']}",
                f"{100 * f['inside_lo']:.0f} to {100 * f['inside_hi']:.0f} %",
            )
        )
    blocks: list[Block] = [
        Cards(cards),
        Sentences(checked.warnings, "Read this first"),
        Picture("measured against taped diameters", _draw(checked)),
        Sentences(checked.notes),
    ]
    if checked.totals:
        blocks += [Heading("Totals of the trees that were drawn from"), _totals_table(checked, level)]
    return Document(
        f"Tape check: {settings.trees.stem}",
        f"{f['n_taped']} taped trees; intervals are {level}; TreeDGS {__version__}",
        [*blocks, Heading("Trees"), _trees_table(checked)],
    )


def _totals_table(checked: Checked, level: str) -> Table:
    words = {"trees": "Trees", "ba_m2": "Basal area, m²"}
    rows = [
        {
            **checked.figures[f"{name}_{estimator}"],
            "quantity": words[name],
            "estimator": estimator,
            "change": 100 * (found.total / found.measured - 1) if found.measured else None,
        }
        for (name, estimator), found in checked.totals.items()
    ]
    return Table(
        "totals",
        "Measured and corrected",
        [
            Column("quantity", "Quantity"),
            Column("estimator", "Estimator"),
            Column("measured", "As measured", 2),
            Column("corrected", "Corrected", 2),
            Column("change", "Change, %", 1),
            Column("se", "s.e.", 3),
            Column("low", f"{level} from", 2),
            Column("high", f"{level} to", 2),
            Column("more_tapes_to_halve_se", "Tapes more that halve the s.e.", 0),
        ],
        rows,
        "Design-based: the chances of the draw alone make the standard errors, nothing is assumed of the errors of the "
        "diameters. Stems without a DBH count as the median tree until tapes say more. Difference and ratio "
        "estimators: Särndal, Swensson and Wretman 1992, 6.3 and 7.3; Cochran 1977, ch. 6 and 12. Per hectare, with "
        "volume and biomass: stand-table --taped.",
    )


def _trees_table(checked: Checked) -> Table:
    trees = checked.trees
    said = trees["note"].fillna("")
    shown = trees.assign(
        tree_id=trees["tree_id"].astype(str),
        plot_id=trees["plot_id"].fillna(""),
        inside=trees["inside"].map({True: "yes", False: "no"}).fillna(""),
        note=said.where(trees["outlier"].isna(), "look again" + said.where(said == "", "; " + said)),
    )
    return Table(
        "tapes",
        "Taped trees",
        [
            Column("tree_id", "Tree"),
            Column("plot_id", "Plot"),
            Column("qc_flag", "Flag"),
            Column("dbh_cm", "Measured, cm", 1),
            Column("dbh_lo_cm", "90 % from", 1),
            Column("dbh_hi_cm", "to", 1),
            Column("taped_cm", "Taped, cm", 1),
            Column("error_cm", "Error, cm", 1),
            Column("inside", "Inside"),
            Column("state", "State"),
            Column("note", "Note"),
        ],
        shown.to_dict("records"),
        "Error: measured minus taped.",
    )


def _draw(checked: Checked) -> bytes:
    """PNG: measured against taped, and the errors over the taped diameter with each tree's interval."""
    table = checked.trees[checked.trees["error_cm"].notna()]
    figure, axes = new_chart(9.2, 3.9, ncols=2)
    limits = [
        float(table[["dbh_cm", "taped_cm"]].min(axis=None)) - 2,
        float(table[["dbh_cm", "taped_cm"]].max(axis=None)) + 2,
    ]
    axes[0].plot(limits, limits, color="0.6", lw=1)
    axes[1].axhline(0, color="0.6", lw=1)
    axes[1].axhspan(checked.figures["bias_lo_cm"], checked.figures["bias_hi_cm"], color=SKY, alpha=0.25, lw=0)
    axes[1].axhline(checked.figures["bias_cm"], color=BLUE, lw=1.2, label="bias and its interval")
    for flag, (colour, _) in FLAGS.items():
        mine = table[table["qc_flag"] == flag]
        if not len(mine):
            continue
        axes[0].scatter(mine["taped_cm"], mine["dbh_cm"], s=26, color=colour, label=flag, zorder=3)
        below, above = mine["dbh_cm"] - mine["dbh_lo_cm"], mine["dbh_hi_cm"] - mine["dbh_cm"]
        axes[1].errorbar(
            mine["taped_cm"], mine["error_cm"], yerr=np.nan_to_num([below, above]), fmt="o", ms=4.5, color=colour,
            elinewidth=1, zorder=3,
        )  # fmt: skip
    for tree in table[table["outlier"].notna()].itertuples():
        for axis, y in ((axes[0], tree.dbh_cm), (axes[1], tree.error_cm)):
            axis.annotate(str(tree.tree_id), (tree.taped_cm, y), xytext=(5, 4), textcoords="offset points", fontsize=8)
    axes[0].set(xlabel="Taped DBH, cm", ylabel="Measured DBH, cm", xlim=limits, ylim=limits, aspect="equal")
    axes[1].set(xlabel="Taped DBH, cm", ylabel="Measured − taped, cm")
    for axis in axes:
        axis.legend(fontsize=9)
    return chart_png(figure)
