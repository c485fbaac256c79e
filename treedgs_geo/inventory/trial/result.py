"""The second step of ``trial``: the tapes are in, the seal is opened, the measured diameters are judged."""

from __future__ import annotations

from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
from scipy import stats

from ... import __version__
from ...core.errors import InputError
from ...core.files import content_hash, ensure_writable, write_json
from ...core.intervals import LEVEL
from ...core.progress import Reporter
from ...core.shown import count_of, some
from ...report.blocks import Block, Cards, Paragraph, Sentences
from ..accuracy.report import write_evaluation
from ..accuracy.tables import PairsEvidence, evidence_table, metrics_of
from ..double_sampling.estimators import coverage
from ..double_sampling.other_trees import outlier_sentences, outliers, tapes_of_other_trees
from ..double_sampling.tapes import Taped, read_taped
from .seal import MIN_TREES, RECORD, unsealed

#: Of the page and of the file that may be sent in.
PAGE, BUNDLE = "result", "bundle.json"
#: Of each of the two one-sided tests.
ALPHA = 0.05


def equivalence(error_cm: np.ndarray, plots: np.ndarray, limit_cm: float) -> dict[str, Any]:
    """Two one-sided t tests of the mean error against a limit (Schuirmann 1987; of forest measurements Robinson and
    Froese 2004): equivalent where the 90 % interval of the mean error lies within the limit.

    error_cm, plots: (N,) of at least two trees. Trees of one plot share errors, so that of several plots the plots are
    what varies by chance: standard error by leaving out one after the other (jackknife, Wolter 2007, 4.2), degrees of
    freedom of as many equal plots as theirs are worth (Kish 1965, 8.2), less one.

    Returns:
        ``limit_cm``; ``bias_cm`` (mean of measured minus taped) and its interval ``bias_lo_cm, bias_hi_cm``; ``p``, the
        larger of the tests; ``conclusion``: ``equivalent``, ``not equivalent`` (the interval lies beyond the limit) or
        ``undecided``; ``by`` (``plot`` or ``tree``) and ``n_units``: what varies.
    """
    names, unit = np.unique(plots.astype(str), return_inverse=True)
    by, unit = ("plot", unit) if len(names) > 1 else ("tree", np.arange(len(error_cm)))
    bias, k = float(np.mean(error_cm)), int(unit.max()) + 1
    size, n = np.bincount(unit), len(error_cm)
    without = (error_cm.sum() - np.bincount(unit, error_cm)) / (n - size)
    se = max(float(np.sqrt((k - 1) / k * np.sum((without - bias) ** 2))), 1e-9)
    df = max(float(n**2 / np.sum(size**2)) - 1, 1.0)
    half = float(stats.t.ppf(1 - ALPHA, df)) * se
    p = float(max(stats.t.sf((bias + limit_cm) / se, df), stats.t.cdf((bias - limit_cm) / se, df)))
    conclusion = "equivalent" if p < ALPHA else "not equivalent" if abs(bias) - half > limit_cm else "undecided"
    return {
        "limit_cm": limit_cm, "bias_cm": bias, "bias_lo_cm": bias - half, "bias_hi_cm": bias + half, "p": p,
        "conclusion": conclusion, "by": by, "n_units": k,
    }  # fmt: skip


def open_trial(settings: Any, reporter: Reporter) -> dict[str, Any]:
    """settings: ``TrialSettings`` with ``taped``. Writes the page, its tables and the bundle.

    Raises:
        InputError: something is not as it was sealed; tapes that cannot be those of the drawn trees.
    """
    folder = Path(settings.output)
    ensure_writable(folder / BUNDLE)
    with reporter.stage("read", 0.0, 0.4):
        record, trees = unsealed(settings)
        taped = read_taped(settings.taped, trees["dbh_cm"])
        evidence, warnings = evidence_from_tapes(taped, trees, record["sealed"])
    with reporter.stage("score", 0.4, 0.6):
        metrics, done = metrics_of(evidence), evidence.trees[evidence.trees["error_cm"].notna()]
        if len(done) < MIN_TREES:
            raise InputError(
                f"{taped.path}: {count_of(len(done), 'tree')} with both a measured and a taped DBH, expected at least "
                f"{MIN_TREES}."
            )
        judged = equivalence(
            done["error_cm"].to_numpy(), done["plot_id"].to_numpy(object), record["sealed"]["limit_cm"]
        )
        inside = coverage(done["inside_90"].dropna().astype(bool), LEVEL)
        metrics["trial"] = {**judged, **inside, **taped.repeatability()}
    openings, mark = record["opened"], content_hash(settings.taped)
    if mark not in [each["tapes"] for each in openings]:
        openings.append({"at": datetime.now(timezone.utc).isoformat(timespec="seconds"), "tapes": mark})
    if len(openings) > 1:
        warnings.append(
            f"The seal was opened before ({openings[0]['at']}), with other tapes: whoever changed them could see the "
            "measured diameters."
        )
    reporter.tell(warnings, evidence.notes)
    metrics["trial"] |= {"n_openings": len(openings), "seal": record["seal"]}
    with reporter.stage("write", 0.6, 1.0):
        facts = {
            "sealed": f"{record['sealed_at']} with TreeDGS {record['sealed']['version']}, seal {record['seal']}",
            "limit of the mean error": f"{judged['limit_cm']:g} cm, given before",
            "trees": f"{len(record['sealed']['drawn'])} drawn of {Path(record['trees']).name}",
            "settings of the run": "not known" if record["sealed"]["run"] is None else "sealed",
        }
        paths = write_evaluation(folder / PAGE, evidence, metrics, facts, first=_first(metrics, warnings))
        write_json(folder / BUNDLE, bundle(record, metrics, evidence, taped))
        write_json(folder / RECORD, record)
    shown = {name: metrics["trial"][name] for name in ("conclusion", "bias_cm", "bias_lo_cm", "bias_hi_cm")}
    return {
        "output": str(folder),
        "page": paths["page"],
        "bundle": str(folder / BUNDLE),
        "seal": record["seal"],
        "n": len(done),
        **shown,
        "rmse_cm": metrics["rmse_cm"],
        "coverage_90": metrics["coverage_90"],
    }


def evidence_from_tapes(
    taped: Taped, trees: gpd.GeoDataFrame, sealed: dict[str, Any]
) -> tuple[PairsEvidence, list[str]]:
    """What accuracy is computed from, and warnings. trees: of the layer, by ``tree_id``. sealed: of the record.

    Raises:
        InputError: a tree that was not drawn, or the taped values fit other trees.
    """
    table, drawn = taped.trees, sealed["drawn"]
    if strangers := [tree for tree in table["tree_id"] if str(tree) not in drawn]:
        raise InputError(f"{taped.path}: tree {some(strangers, 5)} was not drawn; leave the drawn trees only.")
    mine = trees.reindex(table["tree_id"]).reset_index(drop=True)
    rows = np.arange(len(mine))
    others = tapes_of_other_trees(taped, mine, rows, mine["dbh_cm"].to_numpy(float))
    warnings = [others] if others else []
    plots = pd.Series([drawn[str(tree)] or "all" for tree in table["tree_id"]], dtype=object)
    found = mine.assign(plot_id=plots, reference_cm=table["taped_cm"].to_numpy(float))
    has = found["reference_cm"].notna()
    missed = taped.extra.assign(
        tree_id=[f"+{k + 1}" for k in range(len(taped.extra))],
        plot_id=taped.extra["plot_id"].fillna("all"),
        reference_cm=taped.extra["taped_cm"],
        qc_flag="not found",
    )
    false = plots[(table["state"] == "none") & mine["dbh_cm"].notna()].value_counts()
    open_ = [*table["tree_id"][~taped.answered], *(int(t) for t in drawn if int(t) not in set(table["tree_id"]))]
    if open_:
        warnings.append(
            f"Not taped: {count_of(len(open_), 'drawn tree')} ({some(open_, 10)}); the result is of the others."
        )
    errors = mine["dbh_cm"].to_numpy(float), table["taped_cm"].to_numpy(float)
    warnings += outlier_sentences(table["tree_id"], outliers(*errors, table["tree_id"].to_numpy()))
    notes = []
    if len(false):
        notes.append(f"{count_of(int(false.sum()), 'measured tree')} where the crew found none.")
    if len(missed) and len(drawn) < sealed["n_frame"]:
        notes.append(
            f"{count_of(len(missed), 'tree')} that the map lacks, taped by the crew, do not count: of those on the map "
            "a sample was taped."
        )
        missed = missed[:0]
    elif len(missed):
        notes.append(f"{count_of(len(missed), 'tree')} that the map lacks, taped by the crew, count as not measured.")
    rows_of_both = pd.concat([found[has], missed], ignore_index=True) if len(missed) else found[has]
    counts = {str(plot): int(n) for plot, n in false.items()}
    return PairsEvidence(evidence_table(rows_of_both), counts, "taped DBH", notes), warnings


def bundle(record: dict[str, Any], metrics: dict[str, Any], evidence: PairsEvidence, taped: Taped) -> dict[str, Any]:
    """What somebody may send in: figures, and the trees by plot and taped diameter; no names, places or dates."""
    keep = ["plot_id", "reference_cm", "dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "qc_flag"]
    second = taped.trees.set_index(taped.trees["tree_id"].astype(str))["second_cm"]
    rows = evidence.trees[keep].assign(second_cm=evidence.trees["tree_id"].astype(str).map(second))
    rows["plot_id"] = pd.factorize(rows["plot_id"])[0] + 1
    rows = rows.sort_values(["plot_id", "reference_cm"]).astype(object)
    return {
        "versions": {"sealed": record["sealed"]["version"], "opened": __version__},
        "pooled": metrics["pooled"],
        "ok_only": metrics["ok_only"],
        "trial": metrics["trial"],
        "trees": rows.where(rows.notna(), None).to_dict("records"),
    }


def _first(metrics: dict[str, Any], warnings: list[str]) -> list[Block]:
    """What stands above the tables of accuracy."""
    t = metrics["trial"]
    interval = f"{t['bias_lo_cm']:+.2f} to {t['bias_hi_cm']:+.2f}"
    low, high = metrics["bootstrap"]["rmse_cm"]
    cards = [
        ("Against the limit", t["conclusion"], f"±{t['limit_cm']:g} cm, p = {t['p']:.3f}"),
        ("Bias, measured − taped", f"{t['bias_cm']:+.2f} cm", f"90 %: {interval}"),
        ("RMSE", f"{metrics['rmse_cm']:.2f} cm", f"95 %: {low:.2f} to {high:.2f}"),
    ]
    if t["n_intervals"]:
        share = f"90 %: {100 * t['inside_lo']:.0f} to {100 * t['inside_hi']:.0f} %"
        cards.append(("Inside the 90 % interval", f"{t['n_inside']} of {t['n_intervals']}", share))
    if t["n_twice"]:
        cards.append(
            ("One tape's standard deviation", f"{t['tape_sd_cm']:.2f} cm", f"{t['n_twice']} trees taped twice")
        )
    said = {
        "equivalent": "lies within it: the measured diameters are equivalent to taped ones on average.",
        "not equivalent": "lies beyond it: the measured diameters are not equivalent to taped ones.",
        "undecided": "crosses it: these tapes do not decide; more trees or plots would.",
    }
    text = (
        f"The limit for the mean error was ±{t['limit_cm']:g} cm, given before. Its 90 % interval, {interval} cm, "
        f"{said[t['conclusion']]} Two one-sided tests at 5 %; what varies by chance is the {t['by']} ({t['n_units']})."
        + (" That holds for this plot and flight; what another would share is not in it." if t["by"] == "tree" else "")
    )
    return [Cards(cards), Sentences(warnings, "Read this first"), Paragraph(text)]
