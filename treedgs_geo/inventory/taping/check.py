"""From the settings of ``tape-check`` to its files: what the tapes say of the measured diameters."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
from scipy import stats

from ... import __version__
from ...core.crs import project_crs
from ...core.errors import InputError
from ...core.files import fingerprint, write_json
from ...core.intervals import LEVEL
from ...core.layer_files import write_layer
from ...core.progress import Reporter
from ...core.shown import count_of, some
from ...core.tables import write_csv
from ...report.blocks import Block, Cards, Column, Document, Heading, Picture, Sentences, Table, known
from ...report.charts import BLUE, SKY, chart_png, new_chart
from ...report.pdf import ensure_pages, write_pages
from ..charts import draw_by_flag, draw_scatter
from ..double_sampling.estimators import (
    Corrected,
    Tapes,
    correct_total,
    coverage,
    more_tapes_to_halve,
    share_out,
    t_factor,
)
from ..double_sampling.other_trees import outlier_sentences, outliers, tapes_of_other_trees
from ..double_sampling.tapes import DRAWN, SAME_CM, Taped, join, read_taped
from ..reviewed import TAPE_SE_CM
from ..stand.treelist import TreeList
from ..stand.values import BA
from .sample import mark_of, read_frame

#: Below this probability a difference of ``ok`` and ``check`` trees is more than chance.
CHANCE = 0.1


@dataclass
class Checked:
    """trees: one row a drawn tree (``tree_id, plot_id, qc_flag, dbh_cm, dbh_lo_cm, dbh_hi_cm, taped_cm, error_cm,
    inside, state, outlier, note, x, y``). figures: what ``summary.json`` holds. totals: quantity ->
    corrected total. warnings, notes: sentences."""

    trees: pd.DataFrame
    figures: dict[str, Any]
    totals: dict[str, Corrected]
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def check_tapes(frame: TreeList, taped: Taped, rows: np.ndarray, dbh_cm: np.ndarray, confidence: float) -> Checked:
    """rows: (n,) positions of the drawn trees in the frame; dbh_cm: DBHs of the frame as they were when drawn.

    Raises:
        InputError: fewer than two trees have both a measured and a taped DBH.
    """
    now, measured = (frame.trees[name].to_numpy()[rows] for name in ("dbh_cm", "meas_cm"))
    typed = np.isclose(dbh_cm[rows], now, rtol=0, atol=SAME_CM) & ~np.isclose(now, measured, rtol=0, atol=SAME_CM)
    table = taped.trees.assign(
        dbh_cm=np.where(typed, measured, dbh_cm[rows]),
        **{name: frame.trees[name].to_numpy()[rows] for name in ("qc_flag", "plot_id")},
        **{f"dbh_{end}_cm": frame.trees[f"meas_{end}_cm"].to_numpy()[rows] for end in ("lo", "hi")},
    )
    table["error_cm"] = table["dbh_cm"] - table["taped_cm"]
    both = table["error_cm"].notna().to_numpy()
    if both.sum() < 2:
        raise InputError(
            f"{taped.path}: {count_of(int(both.sum()), 'tree')} with both a measured and a taped DBH, expected at "
            "least 2."
        )
    # An interval that does not hold its own DBH is that of another one.
    own = (table["dbh_lo_cm"] <= table["dbh_cm"] + 1e-6) & (table["dbh_hi_cm"] >= table["dbh_cm"] - 1e-6)
    table[["dbh_lo_cm", "dbh_hi_cm"]] = table[["dbh_lo_cm", "dbh_hi_cm"]].where(own)
    known = both & own.to_numpy()
    table["inside"] = np.where(known, table["taped_cm"].between(table["dbh_lo_cm"], table["dbh_hi_cm"]), None)
    table["outlier"] = outliers(*(table[name].to_numpy() for name in ("dbh_cm", "taped_cm", "tree_id")))
    made = Checked(table, {}, {})
    if typed.any():
        named = some(table["tree_id"][typed], 10)
        made.notes.append(
            f"{count_of(int(typed.sum()), 'drawn tree')} had a DBH typed by a person ({named}): errors are those of "
            "the measured one."
        )
    answered = taped.answered
    if taped.n_frame:
        tapes = taped.sample()
    else:
        tapes = Tapes(np.full(int(answered.sum()), 1e-9), np.full(int(answered.sum()), "all", object))
        made.warnings.append(
            f"{taped.path.name} does not hold the chances of the draw ({', '.join(DRAWN)}): "
            "the taped trees are taken as a simple random sample, and no total is corrected."
        )
    _errors(made, tapes, answered, both, confidence)
    made.figures |= coverage(table["inside"][known].astype(bool), confidence)
    groups = {flag: table["error_cm"][both & (table["qc_flag"] == flag)].to_numpy(float) for flag in ("ok", "check")}
    for flag, errors in groups.items():
        made.figures[f"n_{flag}"] = len(errors)
        made.figures[f"rmse_{flag}_cm"] = float(np.sqrt(np.mean(errors**2))) if len(errors) else None
    if min(len(errors) for errors in groups.values()) >= 3:
        test = stats.mannwhitneyu(np.abs(groups["check"]), np.abs(groups["ok"]), alternative="greater")
        made.figures["check_worse_p"] = float(test.pvalue)
    if taped.n_frame:
        _totals(made, frame, taped, tapes, rows, dbh_cm, confidence)
    _remark(made, taped)
    return made


def _errors(made: Checked, tapes: Tapes, answered: np.ndarray, both: np.ndarray, confidence: float) -> None:
    """Mean error and RMSE of the layer's trees, weighted by what each tape stands for."""
    error = np.where(both, made.trees["error_cm"], 0.0)[answered]
    has = both[answered].astype(float)
    count = tapes.total(has)

    def mean(value: np.ndarray, slope: np.ndarray | float) -> tuple[float, float, float]:
        middle = tapes.total(value * has) / count
        variance, df = tapes.variance((value - middle) * has / count, TAPE_SE_CM * slope * has / count)
        return middle, float(np.sqrt(variance)), t_factor(confidence, df)

    bias, se, t = mean(error, 1.0)
    square, se_square, t_square = mean(error**2, 2 * error)
    spread = t_square * se_square / square if square > 0 else 0.0
    made.figures |= {
        "n_taped": int(both.sum()),
        "confidence": confidence,
        "bias_cm": bias,
        "bias_se_cm": se,
        "bias_lo_cm": bias - t * se,
        "bias_hi_cm": bias + t * se,
        "rmse_cm": np.sqrt(square),
        # On the log scale, so that no limit falls below 0.
        "rmse_lo_cm": np.sqrt(square * np.exp(-spread)),
        "rmse_hi_cm": np.sqrt(square * np.exp(spread)),
        "mae_cm": mean(np.abs(error), 1.0)[0],
        "sd_cm": np.sqrt(max(square - bias**2, 0.0)),
    }


def _totals(
    made: Checked, frame: TreeList, taped: Taped, tapes: Tapes, rows: np.ndarray, dbh_cm: np.ndarray, confidence: float
) -> None:
    """Number and basal area of the frame's trees, corrected."""
    has = np.isfinite(dbh_cm)
    x_ba = np.where(has, BA * dbh_cm**2, frame.trees["size"].to_numpy(float))
    mine, table = taped.answered, made.trees
    live = (table["state"] == "taped").to_numpy()[mine]
    y_cm = np.where(live, table["taped_cm"].to_numpy(float)[mine], 0.0)
    ids, plots = table["tree_id"].to_numpy(object)[mine], table["plot_id"].to_numpy(object)[mine]
    keys = [(row.plot_id, None if pd.isna(row.near_id) else row.near_id) for row in taped.extra.itertuples()]
    worth = BA * taped.extra["taped_cm"].to_numpy(float) ** 2
    members = frame.trees["plot_id"].value_counts().to_dict()
    halve = more_tapes_to_halve(int(mine.sum()), taped.n_frame)
    for name, x, y, own, extra in (
        ("trees", np.ones(len(dbh_cm)), live.astype(float), 0.0 * y_cm, np.ones(len(keys))),
        ("ba_m2", x_ba, BA * y_cm**2, 2 * BA * y_cm * TAPE_SE_CM, worth),
    ):
        shared = share_out(ids, plots, members, [(*key, w) for key, w in zip(keys, extra, strict=True)])
        found = correct_total(tapes, float(x.sum()), x[rows][mine], y + shared, own)
        made.totals[name] = found
        low, high = found.interval(confidence)
        made.figures[name] = {
            "measured": found.measured,
            "corrected": found.total,
            "se": found.se,
            "low": low,
            "high": high,
            "more_tapes_to_halve_se": halve,
        }
    made.figures |= {"n_frame": taped.n_frame, "n_extra": len(keys)}


def _remark(made: Checked, taped: Taped) -> None:
    """Sentences that a reader of the numbers needs."""
    f, table = made.figures, made.trees
    level = f"{100 * f['confidence']:g} %"
    if f["bias_lo_cm"] > 0 or f["bias_hi_cm"] < 0:
        made.warnings.append(
            f"The measured diameters are {'too thick' if f['bias_cm'] > 0 else 'too thin'} by {abs(f['bias_cm']):.2f} "
            f"cm on average ({level} interval {f['bias_lo_cm']:+.2f} to {f['bias_hi_cm']:+.2f}): correct the totals "
            "by stand-table, which takes this tape table (--taped)."
        )
    if f["n_intervals"] and not f["inside_lo"] <= LEVEL <= f["inside_hi"]:
        wrong = "too narrow" if f["inside"] < LEVEL else "too wide"
        made.warnings.append(
            f"The {100 * LEVEL:g} % intervals of the layer are {wrong}: {f['n_inside']} of {f['n_intervals']} hold the "
            f"tape ({level} interval of that share: {100 * f['inside_lo']:.0f} to {100 * f['inside_hi']:.0f} %)."
        )
    made.warnings += outlier_sentences(table["tree_id"], table["outlier"])
    warnings, notes = taped.remarks()
    made.warnings += warnings
    made.notes += notes if taped.n_frame or len(taped.extra) else []
    if (tape := taped.repeatability())["n_twice"]:
        made.figures |= tape
        made.notes.append(
            f"{count_of(tape['n_twice'], 'tree')} taped twice: one tape has a standard deviation of "
            f"{tape['tape_sd_cm']:.2f} cm, which is part of the RMSE."
        )
    if "check_worse_p" in f:
        p, sure = f["check_worse_p"], f["check_worse_p"] < CHANCE
        made.notes.append(
            f"Trees marked ok have an RMSE of {f['rmse_ok_cm']:.2f} cm ({f['n_ok']}), those marked check "
            f"{f['rmse_check_cm']:.2f} cm ({f['n_check']}): "
            + ("the flag tells them apart" if sure else "so few tapes cannot tell whether the flag tells them apart")
            + f" (Mann and Whitney's test, p = {p:.2f})."
        )
    else:
        made.notes.append(
            f"Whether ok trees are better than check ones: too few of them were taped to say ({f['n_ok']} and "
            f"{f['n_check']}, at least 3 each are needed)."
        )


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
    ensure_pages(folder, "tape_check.json", "tape_check.gpkg", OWN_LAYERS)
    with reporter.stage("read", 0.0, 0.4):
        taped = read_taped(settings.taped)
        frame = read_frame(settings.trees, project_crs(settings.crs) if settings.crs else None, settings.plots)
        rows, dbh_cm, notes = join(frame.trees, taped, settings.trees)
        others = tapes_of_other_trees(taped, frame.trees, rows, dbh_cm)
    with reporter.stage("check", 0.4, 0.5):
        checked = check_tapes(frame, taped, rows, dbh_cm, settings.confidence_pct / 100)
    if others:
        # What follows from the tapes says nothing until it is known whose they are.
        checked.warnings[:], checked.totals = [others], {}
    checked.notes[:0] = notes
    checked.warnings += frame.warnings
    mark = mark_of(frame.trees.assign(dbh_cm=dbh_cm))
    if taped.frame and taped.frame != mark or taped.n_frame not in (0, len(frame.trees)):
        checked.warnings.append(
            f"{settings.trees.name} is not quite the layer that the trees were drawn from ({taped.n_frame} trees then, "
            f"{len(frame.trees)} now; plots left out here count too): the totals hold for that layer only."
        )
    reporter.tell(checked.warnings, checked.notes)
    with reporter.stage("write", 0.5, 1.0):
        _write(folder, frame, checked, settings)
    keys = ("n_taped", "bias_cm", "bias_lo_cm", "bias_hi_cm", "rmse_cm", "n_intervals", "n_inside")
    found = {key: checked.figures[key] for key in keys}
    return {
        "output": str(folder),
        "page": str(folder / "tape_check.html"),
        "pdf": str(folder / "tape_check.pdf"),
        "layer": str(folder / "tape_check.gpkg"),
        **{key: round(value, 4) if isinstance(value, float) else value for key, value in found.items()},
        "n_outliers": int(checked.trees["outlier"].notna().sum()),
    }


def _write(folder: Path, frame: TreeList, checked: Checked, settings: Any) -> None:
    (folder / "tape_check.json").unlink(missing_ok=True)
    write_pages(folder / "tape_check", _document(checked, settings))
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
        share = f"{100 * f['inside_lo']:.0f} to {100 * f['inside_hi']:.0f} %"
        cards.append(("Inside the 90 % interval", f"{f['n_inside']} of {f['n_intervals']}", share))
    rows = []
    for name, found in checked.totals.items():
        change = 100 * (found.total / found.measured - 1) if found.measured else None
        words = {"trees": "Trees", "ba_m2": "Basal area, m²"}[name]
        rows.append({**checked.figures[name], "quantity": words, "change": change})
    totals = Table(
        "totals",
        "Measured and corrected",
        [
            Column("quantity", "Quantity"),
            Column("measured", "As measured", 2),
            Column("corrected", "Corrected", 2),
            Column("change", "Change, %", 1),
            Column("se", "s.e.", 3),
            Column("low", f"{level} from", 2),
            Column("high", f"{level} to", 2),
            Column("more_tapes_to_halve_se", "Tapes more that halve the s.e.", 0),
        ],
        rows,
        f"Design-based: the chances of the draw and the tapes' own error ({TAPE_SE_CM:g} cm each) make the standard "
        "errors, nothing is assumed of the errors of the measured diameters. Stems without a DBH count as the median "
        "tree until tapes say more. Difference estimator: Särndal, Swensson and Wretman 1992, 6.3; Cochran 1977, "
        "ch. 12. Per hectare, with volume and biomass: stand-table, which takes this tape table.",
    )
    trees = checked.trees
    said = trees["note"].fillna("")
    shown = trees.assign(
        tree_id=trees["tree_id"].astype(str),
        plot_id=trees["plot_id"].fillna(""),
        inside=trees["inside"].map({True: "yes", False: "no"}).fillna(""),
        note=said.where(trees["outlier"].isna(), "look again" + said.where(said == "", "; " + said)),
    )
    tapes = Table(
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
    shown_totals: list[Block] = [Heading("Totals of the trees that were drawn from"), totals] if checked.totals else []
    return Document(
        f"Tape check: {settings.trees.stem}",
        f"{f['n_taped']} taped trees; intervals are {level}; TreeDGS {__version__}",
        [
            Cards(cards),
            Sentences(checked.warnings, "Read this first"),
            Picture("measured against taped diameters", _draw(checked)),
            Sentences(checked.notes),
            *shown_totals,
            Heading("Trees"),
            tapes,
        ],
    )


def _draw(checked: Checked) -> bytes:
    """PNG: measured against taped, and the errors over the taped diameter with each tree's interval."""
    table = checked.trees[checked.trees["error_cm"].notna()]
    figure, axes = new_chart(9.2, 3.9, ncols=2)
    draw_scatter(table, "taped_cm", axes[0])
    axes[1].axhline(0, color="0.6", lw=1)
    axes[1].axhspan(checked.figures["bias_lo_cm"], checked.figures["bias_hi_cm"], color=SKY, alpha=0.25, lw=0)
    axes[1].axhline(checked.figures["bias_cm"], color=BLUE, lw=1.2, label="bias and its interval")
    ends = {"low": table["dbh_lo_cm"] - table["taped_cm"], "high": table["dbh_hi_cm"] - table["taped_cm"]}
    draw_by_flag(axes[1], table.assign(**ends), "taped_cm", "error_cm", ("low", "high"))
    for tree in table[table["outlier"].notna()].itertuples():
        for axis, y in ((axes[0], tree.dbh_cm), (axes[1], tree.error_cm)):
            axis.annotate(str(tree.tree_id), (tree.taped_cm, y), xytext=(5, 4), textcoords="offset points", fontsize=8)
    axes[0].set_xlabel("Taped DBH, cm")
    axes[1].set(xlabel="Taped DBH, cm", ylabel="Measured − taped, cm")
    for axis in axes:
        axis.legend(fontsize=9)
    return chart_png(figure)
