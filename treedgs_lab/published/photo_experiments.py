"""What the photos show of each stem, what that does to the error, and what the run's stages cost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import pearsonr

from treedgs_geo.core.files import read_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.scores import pair_by_position
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.report.blocks import Heading, Paragraph
from treedgs_geo.report.charts import write_chart

from .experiment_charts import draw_visibility
from .paper_pictures import scene
from .reference import Reference
from .sections import RUNTIME_COLUMNS, plain_latex, table_of, write_table, write_text
from .study import Study
from .visibility import SeenStem, agreement, classify, per_stem

#: What the error is set against: column of the table -> words.
AGAINST = {
    "free_views": "photos that show breast height",
    "width_px": "mean width there, px",
    "score": "photos × width, px",
}


def photo_experiments(study: Study, reporter: Reporter) -> None:
    """Visibility and runtime of every plot with a workspace: tables, charts, blocks and metrics of the study."""
    tables, runtime, checks, folder = [], [], [], study.folder
    for number, plot in enumerate(study.workspaces):
        reporter.progress(number / len(study.workspaces))
        assert plot.workspace_in is not None
        runtime += _runtime(plot.name, read_json(plot.workspace_in / "run.json").get("stages", {}))
        table, agreed = _visibility(plot, study.reference_of(plot))
        tables.append(table)
        checks += [{"plot": plot.name, **agreed}] if agreed else []
    table = pd.concat(tables, ignore_index=True)
    related = correlations(table)
    for name, rows in {"visibility": table.to_dict("records"), "correlations": related, "runtime": runtime}.items():
        write_table(folder / f"{name}.csv", rows)
    write_text(folder / "runtime.tex", plain_latex(runtime, RUNTIME_COLUMNS))
    width = table["width_px"]
    seen: dict[str, Any] = {
        "stems": len(table),
        "mean_free_views": round(float(table["free_views"].mean()), 2) if len(table) else None,
        "mean_width_px": round(float(width.mean()), 2) if width.notna().any() else None,
        "correlations": related,
    }
    if checks:
        seen["against_truth"] = checks
    study.metrics |= {"runtime": runtime, "visibility": seen}
    study.blocks += [
        Heading("Visibility of breast height"),
        Paragraph(
            "Bands called free from the photos' own colours; Pearson's r with the absolute error, p of no relation."
        ),
        table_of(related),
        *([table_of(checks, "Against the simulator, views called free and stems' counts")] if checks else ()),
        write_chart(folder, "visibility", draw_visibility(table, AGAINST)),
        Heading("Runtime by stage"),
        table_of(runtime),
    ]


def _runtime(plot: str, stages: dict[str, Any]) -> list[dict[str, Any]]:
    """A row a stage of a run and, below it, what its parts took of a processor where the run has noted that."""
    rows = []
    for name, entry in stages.items():
        memory = entry.get("peak_memory_mb")
        rows.append({"plot": plot, "stage": name, "seconds": entry.get("seconds"), "peak_memory_mb": memory})
        parts = entry.get("result", {}).get("stages_cpu_s", {})
        rows += [
            {"plot": plot, "stage": f"{name}, CPU: {part}", "seconds": taken, "peak_memory_mb": None}
            for part, taken in parts.items()
        ]
    return rows


def correlations(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Absolute error against each of :data:`AGAINST`, over stems with an error that some photo shows free.

    table: columns of :data:`AGAINST` and ``error_cm``. Returns rows ``against, n, r, p``; r and p ``None`` with fewer
    than three stems, or where nothing varies.
    """
    known = table[table["error_cm"].notna() & (table["free_views"] > 0)]
    rows = []
    for name, words in AGAINST.items():
        x, y = known[name].to_numpy(float), known["error_cm"].abs().to_numpy(float)
        r = p = None
        if len(x) > 2 and x.std() > 0 and y.std() > 0:
            r, p = (float(value) for value in pearsonr(x, y))
        rows.append({"against": words, "n": len(x), "r": r, "p": p})
    return rows


def _visibility(plot: PlotFiles, reference: Reference) -> tuple[pd.DataFrame, dict[str, Any]]:
    """One row a tree of the workspace; and, on a simulated plot, how right "free" is."""
    assert plot.workspace_in is not None
    frame, views = scene(plot)
    trees = read_trees(plot.workspace_in / "trees.gpkg")
    trees = trees[trees["z_ground"].notna()].reset_index(drop=True)
    place = trees[["x", "y"]].to_numpy(float)
    local = frame.to_local(np.column_stack([place, trees["z_ground"].to_numpy(float)]))
    usual = float(np.nanmedian(trees["dbh_cm"])) if trees["dbh_cm"].notna().any() else 25.0
    width = trees["dbh_cm"].fillna(usual).to_numpy(float) / 100
    partner = {int(j): int(i) for i, j in pair_by_position(reference.xy, place)}
    stems = [SeenStem(*map(float, (*at, w))) for at, w in zip(local, width, strict=True)]
    seen = classify(views, stems)
    of = [partner.get(k) for k in range(len(trees))]
    names = ["" if i is None else str(reference.tree[i]) for i in of]
    table = per_stem(seen, len(stems)).assign(
        plot=plot.name,
        tree_id=trees["tree_id"],
        reference=[name or None for name in names],
        error_cm=[np.nan if i is None else trees["dbh_cm"][k] - reference.dbh_cm[i] for k, i in enumerate(of)],
    )
    truth = None if plot.truth is None else plot.truth.with_name("visibility.csv")
    return table, agreement(seen, names, pd.read_csv(truth)) if truth is not None and truth.exists() else {}
