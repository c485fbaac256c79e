"""The files of an evaluation: JSON, CSV, LaTeX, charts, and one self-contained page."""

from __future__ import annotations

import html
from importlib.resources import files
from pathlib import Path
from string import Template

import pandas as pd

from ...core.files import atomic_path, write_json
from ...core.tables import safe_frame
from . import charts
from .sections import inline, write_text
from .tables import INTERVALS, PairsEvidence

#: key in metrics.json -> (heading, decimals, factor)
COLUMNS = {
    "n_reference": ("Reference trees", 0, 1),
    "n": ("Measured", 0, 1),
    "success_rate": ("Success %", 1, 100),
    "rmse_cm": ("RMSE cm", 2, 1),
    "rrmse_pct": ("RRMSE %", 1, 1),
    "mae_cm": ("MAE cm", 2, 1),
    "me_cm": ("ME cm", 2, 1),
    "max_abs_cm": ("Largest cm", 2, 1),
    "n_false": ("False", 0, 1),
    "coverage_90": ("In 90 % interval %", 1, 100),
}


def write_evaluation(
    folder: Path, evidence: PairsEvidence, metrics: dict, facts: dict[str, str] | None = None, more: str = ""
) -> dict[str, str]:
    """Write everything into ``folder``; ``metrics.json`` comes last, so that its presence means the rest is there.

    Returns:
        name -> path of ``metrics, per_plot, trees, table, page``.
    """
    folder = Path(folder)
    rows = {**metrics["per_plot"], "pooled": metrics["pooled"]}
    table = pd.DataFrame([{"plot_id": name, **row} for name, row in rows.items()])
    paths = {
        "per_plot": folder / "per_plot.csv",
        "trees": folder / "trees.csv",
        "table": folder / "table.tex",
        "page": folder / "evaluation.html",
        "metrics": folder / "metrics.json",
    }
    write_text(paths["per_plot"], safe_frame(table).to_csv(index=False, lineterminator="\n"))
    write_text(paths["trees"], safe_frame(evidence.trees.round(3)).to_csv(index=False, lineterminator="\n"))
    write_text(paths["table"], latex(metrics))
    figures = {
        "errors": charts.draw_errors(evidence.trees, metrics),
        "scatter": charts.draw_scatter(evidence.trees, evidence.reference),
        "plots": charts.draw_plots(metrics),
    }
    drawn = {}
    for name, figure in figures.items():
        drawn[name] = charts.render(figure, "svg").decode("utf-8")
        write_text(folder / f"{name}.svg", drawn[name])
        with atomic_path(folder / f"{name}.png") as temporary:
            temporary.write_bytes(charts.render(figure, "png"))
        charts.close(figure)
    write_text(paths["page"], page(metrics, evidence, drawn, facts or {}, more))
    write_json(paths["metrics"], metrics)
    return {name: str(path) for name, path in paths.items()}


def latex(metrics: dict) -> str:
    """A booktabs table, one row a plot and one pooled."""
    names = list(COLUMNS)
    heads = " & ".join(COLUMNS[name][0].replace("%", r"\%") for name in names)
    lines = [rf"\begin{{tabular}}{{l{'r' * len(names)}}}", r"\toprule", rf"Plot & {heads} \\", r"\midrule"]
    for plot, row in metrics["per_plot"].items():
        lines.append(rf"{_escape_latex(plot)} & {' & '.join(cell(row, name) for name in names)} \\")
    if "over_plots" in metrics:
        spread = [over_plots(metrics, name).replace("±", r"$\pm$").replace("–", "--") or "--" for name in names]
        lines += [r"\midrule", rf"Mean $\pm$ sd of plots (range) & {' & '.join(spread)} \\"]
    lines += [
        r"\midrule",
        rf"Pooled & {' & '.join(cell(metrics['pooled'], name) for name in names)} \\",
        r"\bottomrule",
        r"\end{tabular}",
        "",
    ]
    return "\n".join(lines)


def cell(row: dict, name: str) -> str:
    """One figure as text; a dash where there is none."""
    _, decimals, factor = COLUMNS[name]
    return "--" if row[name] is None else f"{row[name] * factor:.{decimals}f}"


def over_plots(metrics: dict, name: str) -> str:
    """``mean ± sd (lowest–highest)`` over plots; empty for what is not averaged."""
    found = metrics["over_plots"].get(name)
    if found is None:
        return ""
    _, decimals, factor = COLUMNS[name]
    mean, low, high = (f"{factor * found[key]:.{decimals}f}" for key in ("mean", "low", "high"))
    sd = "" if found["sd"] is None else f" ± {factor * found['sd']:.{decimals}f}"
    return f"{mean}{sd} ({low}–{high})"


def page(metrics: dict, evidence: PairsEvidence, drawn: dict[str, str], facts: dict[str, str], more: str = "") -> str:
    """The HTML page, charts inside as SVG. more: further sections (``treedgs_lab/published/experiments.py``)."""
    pooled, spread = metrics["pooled"], metrics["bootstrap"]

    def row(name: str, figures: dict, kind: str = "") -> str:
        cells = "".join(f"<td>{cell(figures, key).replace('--', '–')}</td>" for key in COLUMNS)
        return f"<tr class='{kind}'><th>{html.escape(name)}</th>{cells}</tr>"

    body = [row(name, figures) for name, figures in metrics["per_plot"].items()]
    if "over_plots" in metrics:
        cells = "".join(f"<td>{over_plots(metrics, key)}</td>" for key in COLUMNS)
        body.append(f"<tr><th>mean ± sd of plots (range)</th>{cells}</tr>")
    body += [row("pooled", pooled, "total"), row("pooled, qc_flag = ok only", metrics["ok_only"])]
    body += [row("pooled, as measured", metrics["as_measured"])] if "as_measured" in metrics else []
    factor = {name: COLUMNS[name][2] for name in INTERVALS}
    intervals = "".join(
        f"<tr><th>{COLUMNS[name][0]}</th><td>{cell(pooled, name)}</td>"
        f"<td>{spread[name][0] * factor[name]:.2f} to {spread[name][1] * factor[name]:.2f}</td></tr>"
        for name in INTERVALS
        if spread[name] is not None and pooled[name] is not None
    )
    if pooled["n"]:
        headline = (
            f"{pooled['n']} of {pooled['n_reference']} trees have a DBH; over these, RMSE is {pooled['rmse_cm']:.2f} "
            f"cm and the mean error {pooled['me_cm']:+.2f} cm (measured − {evidence.reference})."
        )
    else:
        headline = f"None of the {pooled['n_reference']} reference trees was measured."
    trees = "".join(
        f"<tr><td>{html.escape(str(t['plot_id']))}</td><td>{html.escape(str(t['tree_id']))}</td><td>{t['reference_cm']:.1f}</td>"
        + (
            f"<td>{t['dbh_cm']:.1f}</td><td>{t['error_cm']:+.2f}</td>"
            if pd.notna(t["error_cm"])
            else "<td>–</td><td>–</td>"
        )
        + f"<td>{html.escape('' if pd.isna(t['qc_flag']) else str(t['qc_flag']))}</td></tr>"
        for _, t in evidence.trees.iterrows()
    )
    template = Template((files(__package__) / "templates" / "evaluation.html").read_text(encoding="utf-8"))
    notes = list(metrics["notes"]) + ([spread["note"][0].upper() + spread["note"][1:] + "."] if spread["note"] else [])
    return template.substitute(
        against=(_against(metrics["against"]) if "against" in metrics else "") + more,
        headline=html.escape(headline),
        heads="".join(f"<th>{head}</th>" for head, _, _ in COLUMNS.values()),
        body="".join(body),
        notes="".join(f"<li>{html.escape(note)}</li>" for note in notes) or "<li>Nothing was left out.</li>",
        intervals=intervals,
        by=spread["by"],
        repeats=spread["repeats"],
        seed=spread["seed"],
        level=f"{100 * spread['level']:.0f}",
        errors=inline(drawn["errors"]),
        scatter=inline(drawn["scatter"]),
        plots=inline(drawn["plots"]),
        trees=trees,
        facts="".join(f"<tr><th>{html.escape(k)}</th><td>{html.escape(v)}</td></tr>" for k, v in facts.items()),
    )


def _against(found: dict) -> str:
    """The comparison with another method, as a section of the page."""
    names = ("n", "rmse_cm", "rrmse_pct", "mae_cm", "me_cm", "max_abs_cm", "coverage_90")
    heads = "".join(f"<th>{COLUMNS[name][0]}</th>" for name in names)
    rows = "".join(
        f"<tr><th>{label}</th>{''.join(f'<td>{cell(found[side], name)}</td>' for name in names)}</tr>"
        for side, label in (("this", "this one"), ("other", "the other"))
    )
    gain = "no tree was measured by both."
    if found["rmse_gain_cm"] is not None:
        low, high = found["rmse_gain_interval_cm"]
        gain = (
            f"RMSE of this one minus the other: {found['rmse_gain_cm']:+.2f} cm "
            f"({low:+.2f} to {high:+.2f}; resampled by {found['by']})."
        )
    return (
        f"<h2>Against {html.escape(found['file'])}</h2><p>{found['n_common']} trees were measured by both, "
        f"{found['n_only_this']} only here, {found['n_only_other']} only there. On the common trees:</p>"
        f"<table><tr><th></th>{heads}</tr>{rows}</table><p>{gain}</p>"
    )


def _escape_latex(text: str) -> str:
    for mark in "&%$#_{}":
        text = text.replace(mark, "\\" + mark)
    return text
