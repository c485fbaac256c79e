"""A campaign from manifest to layer and report."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from .. import __version__
from ..core.costs import CostModel, makespan, time_text
from ..core.errors import Incomplete, InputError, OutputError, TreeDGSError
from ..core.folder_lock import Busy, Lease
from ..core.machine import cores, free_memory
from ..core.progress import Reporter
from ..core.resource_errors import is_full
from ..core.tables import write_csv
from ..report.blocks import Block, Column, Document, Sentences, Table, facts_table
from ..report.html import write_html
from .coordinate import Capacity, Coordinator, Tally, write_text
from .layer import check_output, twins, write_layer
from .places import COSTS, PLOTS, REPORT, STATUS, TABLE, TREES, plot_folder
from .state import Campaign, Plan, layer_crs, make_plan
from .supervise import Record

if TYPE_CHECKING:
    from .command import CampaignSettings

#: Share of the free memory that plots may declare; the rest is for the coordinator, the page cache and QGIS.
MEMORY_SHARE = 0.8


def run_campaign(settings: CampaignSettings, reporter: Reporter) -> dict[str, Any]:
    """Check, run what is missing, write one layer and the report; or take part where another process does.

    Raises:
        InputError: rows that cannot be used, or a campaign that another process runs. OutputError: outputs that cannot
            be written. TreeDGSError: no plot can be run on this computer. Incomplete: some plots could not be
            measured; layer and report are written.
    """
    workspace = Path(settings.workspace)
    output = Path(settings.output) if settings.output else workspace / TREES
    check_output(output)
    if (workspace / "run.json").exists():
        raise InputError(f"{workspace}: is the workspace of a single plot; choose another folder for the campaign.")
    while True:
        try:
            lease = Lease.take(workspace)
            break
        except Busy as busy:
            if not settings.join:
                raise InputError(
                    f"{workspace}: this campaign is being run by {busy}; wait for it, stop it, or give --join to take "
                    "plots of it."
                ) from None
            if busy.holder.get("key") and Campaign(workspace).record.get("leader") == busy.holder["key"]:
                return _join(settings, workspace, reporter)
            time.sleep(1)  # it still checks the manifest
        except OSError as problem:
            raise OutputError(
                f"{workspace}: cannot be written ({problem.strerror}); choose another workspace."
            ) from None
    try:
        return _run(settings, workspace, output, reporter, lease)
    except TreeDGSError:
        raise
    except Exception as problem:
        # SQLite, GDAL and Python each have their own error for a full disk.
        if not is_full(str(problem)):
            raise
        raise OutputError(
            f"{workspace}: the disk is full ({problem}); what was finished is kept, make room and run again."
        ) from None
    finally:
        lease.free()


def capacity_of(settings: CampaignSettings) -> Capacity:
    """As many plots at once as were asked for, else one a core; and the memory that they may use together."""
    return Capacity(
        settings.workers or max(1, cores() // settings.threads),
        settings.memory_gb or max(MEMORY_SHARE * free_memory() / 1e9, 0.3),
        settings.threads,
    )


def _join(settings: CampaignSettings, workspace: Path, reporter: Reporter) -> dict[str, Any]:
    """Run plots of a campaign that another process leads, until none is left to take."""
    campaign = Campaign(workspace)
    if campaign.record["version"] != __version__:
        raise InputError(
            f"{workspace}: the campaign was started with TreeDGS {campaign.record['version']}, here is {__version__}; "
            "install the same."
        )
    plan = Plan.load(workspace)
    with reporter.stage("plots"):
        tally = Coordinator(plan, campaign, capacity_of(settings), reporter, joined=True).run()
    status = f"{tally.done} of {len(plan)} plots were measured since this computer joined"
    reporter.info(status + ".")
    return {"n_plots": len(plan), "n_run": tally.done, "n_kept": tally.kept, "status": status}


def _run(settings: CampaignSettings, workspace: Path, output: Path, reporter: Reporter, lease: Lease) -> dict[str, Any]:
    began = time.monotonic()
    campaign = Campaign(workspace)
    costs = workspace / COSTS
    model = CostModel.load(costs if costs.exists() else None)
    with reporter.stage("check the manifest", 0.0, 0.03):
        plan = make_plan(settings.manifest, settings.crs, workspace, model, reporter)
    capacity = capacity_of(settings)
    predicted_s, forecast = predict(plan, model, capacity, workspace, reporter)
    if settings.predict:
        return {
            "n_plots": len(plan),
            "status": forecast,
            "predicted_s": round(predicted_s),
            "predicted_cpu_s": round(float(plan.column("seconds").sum())),
            "needed_disk_gb": round(float(plan.column("disk_gb").sum()), 2),
            "largest_memory_gb": round(float(plan.column("memory_gb").max()), 2),
        }
    campaign.begin((entry["row"]["plot_id"] for entry in plan.entries), lease.key)
    with reporter.stage("plots", 0.03, 0.96):
        tally = Coordinator(plan, campaign, capacity, reporter, lease.renew).run()
    lease.check()
    with reporter.stage("write", 0.96, 1.0):
        crs, seconds = layer_crs(plan, settings.crs), time.monotonic() - began
        result = _write(campaign, plan, crs, model, tally, output, seconds, predicted_s, forecast, reporter)
    campaign.end()
    if tally.failed == len(plan):
        raise InputError(f"{settings.manifest}: no plot could be measured, see {workspace / REPORT} for the reasons.")
    if result["n_failed"]:
        raise Incomplete(
            f"{settings.manifest}: {result['n_failed']} of {len(plan)} plots could not be measured, the layer "
            f"{output} holds the others; see {workspace / REPORT} for the reasons, correct them and run again.",
            result,
        )
    return result


def predict(plan: Plan, model: CostModel, capacity: Capacity, workspace: Path, reporter: Reporter) -> tuple[float, str]:
    """Time, memory and disk of the whole manifest, reported in a few lines; the seconds, and all in one sentence."""
    slots = min(capacity.plots, len(plan))
    each, memory_gb, disk_gb = (plan.column(name) for name in ("seconds", "memory_gb", "disk_gb"))
    cpu, disk = float(each.sum()), float(disk_gb.sum())
    seconds = makespan(each, slots)
    spread = max(model.routes[route]["spread"]["seconds"] for route in plan.routes)
    rested = ", ".join(f"{model.routes[route]['n']} {route} plots" for route in plan.routes)
    parts = ", ".join(f"{n} from {'photos' if route == 'photos' else 'clouds'}" for route, n in plan.routes.items())
    sentence = (
        f"{len(plan)} plots ({parts}): about {time_text(seconds)} with {slots} at once ({time_text(cpu)} on one core), "
        f"up to {memory_gb.max():.1f} GB a plot, {disk:.2f} GB of disk"
    )
    reporter.info(sentence + f" (from {rested}; single plots within a factor of {spread:g}).")
    other = {
        name
        for entry in plan.entries
        for name in ("preset", "fit")
        if entry["row"]["values"].get(name) not in (None, "balanced", "auto", "photos", "circle")
    }
    if other:
        reporter.warn(
            f"The forecast rests on runs with the default settings; rows set {' and '.join(sorted(other))} "
            "otherwise, which takes other times."
        )
    if n_outside := sum(entry["outside"] for entry in plan.entries):
        reporter.warn(f"{n_outside} plots are larger than any the forecast rests on: their time is a guess.")
    if count := int((memory_gb > capacity.memory_gb).sum()):
        reporter.warn(
            f"{count} plots need more memory than this machine has for plots ({capacity.memory_gb:.1f} GB); "
            "they will not be tried."
        )
    import psutil

    free = psutil.disk_usage(str(workspace)).free / 1e9
    if disk > free:
        reporter.warn(
            f"{workspace}: {free:.1f} GB of disk are free, about {disk:.1f} GB are "
            "needed; plots that find no room will fail and can be run again."
        )
    return seconds, sentence


def _write(
    campaign: Campaign,
    plan: Plan,
    crs: str,
    model: CostModel,
    tally: Tally,
    output: Path,
    seconds: float,
    predicted_s: float,
    forecast: str,
    reporter: Reporter,
) -> dict[str, Any]:
    """Layer, report, costs."""
    workspace, rows = campaign.workspace, list(rows_of(plan, campaign))
    done = [row for row in rows if row["state"] == "done"]
    failed = [row for row in rows if row["state"] != "done"]
    n_trees = write_layer(output, done, crs, reporter)
    warnings = [f"{row['plot_id']}: {row['remark'] or 'was not run'}" for row in failed[:200]]
    placed = [row for row in done if row["bounds"] and row["crs"] == crs]
    warnings += [
        f"{one} and {other} overlap: {both} trees stand in both and are in the layer twice, once for each plot; count "
        "them once in totals over plots"
        for one, other, both in twins([(row["plot_id"], Path(row["folder"]), tuple(row["bounds"])) for row in placed])
    ]
    for sentence in warnings[:20]:
        reporter.warn(sentence.rstrip(".") + ".")
    # A plot that resumed an earlier attempt was cheaper than it is.
    model.refit([row for row in done if row["attempts"] == 1][:5000]).save(workspace / COSTS)
    ratio = f", {seconds / predicted_s:.2f} times the forecast" if not tally.kept and tally.done else ""
    status = (
        f"{len(done)} of {len(plan)} plots measured, {len(failed)} failed; {tally.measured} of the {n_trees} stems "
        "found have a DBH"
    )
    reasons = ", ".join(f"{n} {name}" for name, n in sorted(tally.reasons.items(), key=lambda item: -item[1]))
    facts = {
        "result": status + ".",
        "trees layer": str(output),
        "refused because": reasons or "none",
        "this start": f"{tally.done} plots run, {tally.kept} kept, {tally.retried} retries, {tally.interrupted} "
        f"interruptions, {time_text(seconds)}{ratio}",
        "CRS": crs,
        "forecast": forecast,
        "plots' folders": str(workspace / PLOTS),
        "table": str(workspace / TABLE),
    }
    table = pd.DataFrame(rows, columns=list(COLUMNS), dtype=object)
    write_csv(workspace / TABLE, table, encoding="utf-8-sig", lineterminator="\n")
    more = [f"and {len(warnings) - _MAX_REPORTED} more, in {TABLE}"] if len(warnings) > _MAX_REPORTED else []
    blocks: list[Block] = [
        Sentences([*warnings[:_MAX_REPORTED], *more], "Look at these"),
        Table("plots", "Plots", list(_SHOWN), [_shown(row) for row in rows]),
        facts_table("campaign", "This campaign", facts),
    ]
    write_html(workspace / REPORT, Document("Campaign", facts["result"], blocks, wide=True))
    write_text(workspace / STATUS, status + ".\n")
    reporter.info(status + ".")
    return {
        "output": str(output),
        "report": str(workspace / REPORT),
        "table": str(workspace / TABLE),
        "n_plots": len(plan),
        "n_done": len(done),
        "n_run": tally.done,
        "n_kept": tally.kept,
        "n_failed": len(failed),
        "n_trees": n_trees,
        "n_measured": tally.measured,
        "n_rejected": n_trees - tally.measured,
        "n_retried": tally.retried,
        "n_interrupted": tally.interrupted,
        "seconds": round(seconds, 1),
        "predicted_s": round(predicted_s, 1),
        "status": status,
    }


COLUMNS = (
    "plot_id", "state", "route", "n_trees", "n_measured", "n_rejected", "reasons", "mean_dbh_cm", "seconds", "cpu_s",
    "memory_gb", "disk_gb", "photos", "megapixels", "points_m", "predicted_s", "attempts", "host", "n_field",
    "n_field_measured", "rmse_cm", "me_cm", "coverage_90", "n_false", "remark", "folder",
)  # fmt: skip
#: Columns that are so in a plot's result, and in its accuracy.
_OF_RESULT = ("n_trees", "n_measured", "n_rejected", "mean_dbh_cm", "seconds", "cpu_s", "host", "bounds")
_OF_ACCURACY = ("rmse_cm", "me_cm", "coverage_90", "n_false")
#: Problems repeated above the table.
_MAX_REPORTED = 30


def rows_of(plan: Plan, campaign: Campaign) -> Iterator[dict[str, Any]]:
    """What is known of each plot of the plan, in the manifest's order, one at a time."""
    for entry in plan.entries:
        row, inputs = entry["row"], entry["inputs"]
        folder = plot_folder(campaign.workspace, row["plot_id"])
        record = Record.read(folder)
        fits = record.key.split(":")[0] == entry["settings"] and record.stamp == inputs["stamp"]
        if record.is_unchanged(inputs["stamp"], entry["settings"]):
            state = "done"
        else:
            tried = record.status == "failed" or any(a.get("outcome") for a in record.attempts)
            state = "failed" if tried else "not run"
        result = record.result if state == "done" else {}
        accuracy = result.get("accuracy") or {}
        size = (path.lstat().st_size for path in folder.rglob("*") if path.is_file())
        attempts = [a for a in record.attempts if a.get("key") == record.key] if fits else record.attempts
        yield {
            **{name: result.get(name) for name in _OF_RESULT},
            **{name: None if accuracy.get(name) is None else round(accuracy[name], 3) for name in _OF_ACCURACY},
            "plot_id": row["plot_id"],
            "state": state,
            "route": row["route"],
            "number": int(campaign.record["numbers"][row["plot_id"]]),
            "reasons": ", ".join(f"{n} {name}" for name, n in sorted((result.get("reasons") or {}).items())),
            "memory_gb": result.get("peak_gb"),
            "disk_gb": round(sum(size) / 1e9, 4) if state == "done" else None,
            "photos": inputs["photos"],
            "megapixels": round(inputs["megapixels"], 2),
            "points_m": round(inputs["points_m"], 4),
            "predicted_s": round(entry["seconds"], 1),
            "attempts": len(attempts),
            "n_field": accuracy.get("n_reference"),
            "n_field_measured": accuracy.get("n"),
            "remark": {"done": accuracy.get("note") or "", "failed": record.last_problem()}.get(state, ""),
            "folder": str(folder),
            "crs": inputs["crs"],
            "table": bool(row["plots"]),
            "warnings": result.get("warnings") or [],
        }


_SHOWN = (
    Column("plot_id", "Plot"),
    Column("state", "State"),
    Column("n_trees", "Stems", 0),
    Column("n_measured", "With DBH", 0),
    Column("n_rejected", "Refused", 0),
    Column("reasons", "Why refused"),
    Column("mean_dbh_cm", "Mean DBH cm", 1),
    Column("seconds", "Seconds", 0),
    Column("memory_gb", "Memory GB", 2),
    Column("attempts", "Attempts", 0),
    Column("field", "Field trees measured"),
    Column("rmse_cm", "RMSE cm", 2),
    Column("me_cm", "Bias cm", 2, signed=True),
    Column("coverage_90", "In 90 % interval, %", 0, 100),
    Column("remark", "Remarks"),
)


def _shown(row: dict[str, Any]) -> dict[str, Any]:
    """What the page shows of a plot."""
    return {
        **row,
        "field": "" if row["n_field"] is None else f"{row['n_field_measured']} of {row['n_field']}",
        "remark": row["remark"] or "; ".join(row["warnings"]),
        "mark": "done" if row["state"] == "done" else "failed",
    }
