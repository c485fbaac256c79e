"""The engine process of one plot: the verb, then the field trees.

Called as ``python -m treedgs_geo.campaign.plot JOB``. Speaks the JSON lines of
:mod:`treedgs_geo.core.progress` on stdout; the result is its last line.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from ..core.errors import TreeDGSError
from ..core.files import read_json
from ..core.progress import Reporter, make_reporter
from ..core.settings import build
from ..core.tables import write_csv
from .manifest import ROUTES, own_field, own_plots
from .places import TREES

#: The kernel's order of victims: the plot before the campaign.
_OOM_SCORE = 600


def run_plot(job: dict[str, Any], reporter: Reporter) -> dict[str, Any]:
    """Measure one plot in its folder.

    job: ``folder``, ``row`` (:class:`~treedgs_geo.campaign.manifest.PlotRow` as JSON).

    Returns:
        counts, mean DBH, CRS, bounds, reasons of refusal, accuracy where field trees are given.
    """
    from ..inventory.tree_reading import read_trees
    from ..stems.quality.reasons import split_reasons
    from ..verbs import get_command

    row, folder = job["row"], Path(job["folder"])
    values = dict(row["values"], output=str(folder / TREES))
    plots = ""
    if row["plots"]:
        # The row's circle out of its plots table; the whole table when the row's id is not in it.
        plots = str(_write_rows(folder / "plots.csv", own_plots(row)))
    if row["route"] == "photos":
        values["workspace"] = str(folder)
        if plots:
            values["plots"] = plots
    command = get_command(ROUTES[row["route"]])
    with reporter.stage("measure", 0.0, 0.95 if row["field"] else 1.0):
        found = command.run(build(command.settings, values), reporter)
    trees = read_trees(folder / TREES)
    refused = trees.loc[trees["qc_flag"] == "reject", "qc_reason"].fillna("")
    reasons = dict(Counter(reason for text in refused for reason in split_reasons(text)))
    has = trees["dbh_cm"].notna()
    result = {
        "n_trees": len(trees),
        "n_measured": int(has.sum()),
        "n_rejected": int((~has).sum()),
        "reasons": reasons,
        "mean_dbh_cm": round(float(trees.loc[has, "dbh_cm"].mean()), 2) if has.any() else None,
        "bounds": [round(float(v), 2) for v in trees.total_bounds] if len(trees) else None,
        "status": found.get("status") or f"{int(has.sum())} of the {len(trees)} stems found were measured",
        "warnings": list(found.get("warnings") or [])[:5],
        "accuracy": None,
    }
    if row["field"]:
        with reporter.stage("field trees", 0.95, 1.0):
            result["accuracy"] = _accuracy(row, plots, folder, len(trees), reporter)
    return {**result, "cpu_s": round(sum(os.times()[:4]), 2)}


def _write_rows(target: Path, rows: list[dict[str, str]]) -> Path:
    write_csv(target, pd.DataFrame(rows))
    return target


def _accuracy(row: dict[str, Any], plots: str, folder: Path, n_trees: int, reporter: Reporter) -> dict[str, Any]:
    """Errors against the field trees; a plot that cannot be paired says why and loses nothing else."""
    from ..inventory.accuracy.tables import evidence_from_pairs, metrics_of
    from ..verbs import get_command

    if not n_trees:
        return {"note": "no tree was measured"}
    try:
        tally = _write_rows(folder / "field_trees.csv", own_field(row))
        command = get_command("match-plots")
        pairs = folder / "pairs.gpkg"
        given = {"trees": str(folder / TREES), "field": str(tally), "plots": plots, "output": str(pairs)}
        command.run(build(command.settings, {**row["pairing"], **given}), reporter)
        pooled = metrics_of(evidence_from_pairs(pairs), repeats=100)["pooled"]
    except TreeDGSError as problem:
        reporter.warn(f"No accuracy: {problem}")
        return {"note": str(problem)}
    return {
        name: pooled.get(name)
        for name in ("n", "n_reference", "success_rate", "rmse_cm", "me_cm", "n_false", "coverage_90")
    }


def end_with_campaign() -> None:
    """End this process, and what it started, when the campaign's process is gone: it holds the other end of stdin. On
    Linux the kernel ends it at once, and picks it before the campaign when memory runs out."""
    pipe = os.dup(0)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)

    def watch() -> None:
        import psutil

        while os.read(pipe, 64):
            pass
        for child in psutil.Process().children(recursive=True):
            with suppress(psutil.Error):
                child.kill()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            import ctypes

            ctypes.CDLL(None).prctl(1, signal.SIGKILL)
            Path("/proc/self/oom_score_adj").write_text(str(_OOM_SCORE), encoding="ascii")


def main() -> int:
    """Run the job file's plot."""
    from ..cli import run_command
    from ..verbs import get_command

    end_with_campaign()
    reporter = make_reporter("json")
    # Native libraries print to stdout too: the protocol keeps its own stream.
    reporter._stream = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)  # type: ignore[attr-defined]
    os.dup2(2, 1)
    try:
        job = read_json(Path(sys.argv[1]))
    except TreeDGSError as problem:
        reporter.error(str(problem))
        return problem.exit_code
    # A verb that needs no settings, for what surrounds every run.
    verb = replace(get_command("doctor"), name="plot", run=lambda _, r: run_plot(job, r))
    return run_command(verb, {}, reporter)


if __name__ == "__main__":
    sys.exit(main())
