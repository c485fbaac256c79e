"""A campaign from manifest to layer and report."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.costs import CostModel, makespan, time_text
from ..core.errors import Incomplete, InputError, OutputError, TreeDGSError
from ..core.folder_lock import Busy, Lease
from ..core.machine import cores
from ..core.progress import Reporter
from ..core.resource_errors import is_full
from .clusters import QUEUES, Shape, memory_for_plots, open_crew, shape_of
from .coordinate import Coordinator, Tally
from .layer import check_output, twins, write_layer
from .places import COSTS, PLOTS, REPORT, STATUS, TABLE, TREES
from .progress import write_text
from .report import rows_of, write_report
from .state import Campaign, Plan, make_plan
from .task import run_plot

if TYPE_CHECKING:
    from .settings import CampaignSettings


def run_campaign(
    settings: CampaignSettings,
    reporter: Reporter,
    function: Callable[[dict[str, Any]], dict[str, Any]] = run_plot,
) -> dict[str, Any]:
    """Check, run what is missing, write one layer and the report.

    function: what a worker does with a plot's job (another one only in benchmarks of the coordinator itself).

    Raises:
        InputError: rows that cannot be used, an unknown scheduler, or a campaign that another process runs.
        OutputError: outputs that cannot be written. SchedulerLost: nobody is left to run plots. Incomplete: some plots
            could not be measured; layer and report are written.
    """
    workspace = Path(settings.workspace)
    output = Path(settings.output) if settings.output else workspace / TREES
    check_scheduler(settings.scheduler)
    check_output(output)
    if (workspace / "run.json").exists():
        raise InputError(f"{workspace}: is the workspace of a single plot; choose another folder for the campaign.")
    try:
        lease = Lease.take(workspace)
    except Busy as busy:
        raise InputError(f"{workspace}: this campaign is being run by {busy}; wait for it, or stop it.") from None
    except OSError as problem:
        raise OutputError(f"{workspace}: cannot be written ({problem.strerror}); choose another workspace.") from None
    try:
        return _run(settings, workspace, output, reporter, function, lease)
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


def _run(
    settings: CampaignSettings,
    workspace: Path,
    output: Path,
    reporter: Reporter,
    function: Callable[[dict[str, Any]], dict[str, Any]],
    lease: Lease,
) -> dict[str, Any]:
    began = time.monotonic()
    campaign = Campaign(workspace)
    costs = workspace / COSTS
    model = CostModel.load(costs if costs.exists() else None)
    with reporter.stage("check the manifest", 0.0, 0.03):
        plan = make_plan(settings.manifest, settings.crs, workspace, model, reporter, settings.run_programs)
    shape = _shape(settings, plan)
    forecast = predict(plan, model, shape, settings, reporter)
    if settings.predict:
        return {
            "n_plots": len(plan),
            "status": forecast.sentence,
            "predicted_s": round(forecast.seconds),
            "predicted_cpu_s": round(forecast.cpu_s),
            "needed_disk_gb": round(forecast.disk_gb, 2),
            "largest_memory_gb": round(float(plan.memory_gb.max()), 2),
        }
    campaign.begin(entry["row"]["plot_id"] for entry in plan.entries())
    with (
        reporter.stage("plots", 0.03, 0.96),
        open_crew(
            settings.scheduler,
            shape,
            settings.threads,
            settings.dashboard,
            settings.queue_options or "",
            workspace,
            reporter,
        ) as crew,
    ):
        if crew.dashboard:
            reporter.info(f"Live view: {crew.dashboard}; table: {workspace / STATUS}")
        tally = Coordinator(
            plan,
            campaign,
            crew,
            settings.threads,
            settings.time_limit_min,
            settings.patience_s,
            reporter,
            function,
            lease.renew,
        ).run()
    lease.check()
    with reporter.stage("write", 0.96, 1.0):
        result = _write(campaign, plan, model, tally, output, forecast, time.monotonic() - began, reporter)
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


def check_scheduler(scheduler: str) -> None:
    """Refuse what is neither ``local``, a queue, nor an address.

    Raises:
        InputError: with what is expected.
    """
    if scheduler == "local" or scheduler in QUEUES or scheduler.startswith(("tcp://", "tls://", "ws://", "wss://")):
        return
    raise InputError(
        f"--scheduler: found {scheduler!r}, expected local, tls://host:8786 (a running Dask scheduler), "
        f"{' or '.join(QUEUES)}."
    )


def _shape(settings: CampaignSettings, plan: Plan) -> Shape:
    memory = settings.memory_gb or memory_for_plots()
    fitting = plan.memory_gb[plan.memory_gb <= memory]
    if settings.scheduler in QUEUES:
        # Each job is one worker with room for its plots at once.
        at_once = settings.workers or min(len(plan), 10)
        return Shape(at_once, 1, settings.memory_gb or float(plan.memory_gb.max()))
    return shape_of(
        min(settings.workers or 10**6, len(plan)) if settings.workers else 0,
        settings.threads,
        memory,
        float(fitting.max()) if len(fitting) else memory,
        cores(),
    )


@dataclass(frozen=True)
class Forecast:
    """seconds: wall clock with this shape; cpu_s: of all plots; disk_gb: of all workspaces; sentence: in words."""

    seconds: float
    cpu_s: float
    disk_gb: float
    sentence: str


def predict(plan: Plan, model: CostModel, shape: Shape, settings: CampaignSettings, reporter: Reporter) -> Forecast:
    """Time, memory and disk of the whole manifest, in a few lines."""
    slots = shape.processes * shape.slots
    cpu = float(plan.seconds.sum())
    seconds = makespan(plan.seconds, slots)
    spread = max(model.routes[route]["spread"]["seconds"] for route in plan.routes)
    rested = ", ".join(f"{model.routes[route]['n']} {route} plots" for route in plan.routes)
    parts = ", ".join(f"{n} from {'photos' if route == 'photos' else 'clouds'}" for route, n in plan.routes.items())
    sentence = (
        f"{len(plan)} plots ({parts}): about {time_text(seconds)} with {slots} at once "
        f"({time_text(cpu)} on one core), up to {plan.memory_gb.max():.1f} GB a plot, "
        f"{plan.disk_gb.sum():.2f} GB of disk"
    )
    reporter.info(sentence + f" (from {rested}; single plots within a factor of {spread:g}).")
    other = {
        name
        for entry in plan.entries()
        for name in ("preset", "fit")
        if entry["row"]["values"].get(name) not in (None, "balanced", "auto", "photos", "circle")
    }
    if other:
        reporter.warn(
            f"The forecast rests on runs with the default settings; rows set {' and '.join(sorted(other))} "
            "otherwise, which takes other times."
        )
    if plan.n_outside:
        reporter.warn(f"{plan.n_outside} plots are larger than any the forecast rests on: their time is a guess.")
    if settings.scheduler == "local" and (plan.memory_gb > shape.memory_gb).any():
        count = int((plan.memory_gb > shape.memory_gb).sum())
        reporter.warn(
            f"{count} plots need more memory than this machine has for plots ({shape.memory_gb:.1f} GB); "
            "they will not be tried."
        )
    import psutil

    free = psutil.disk_usage(str(settings.workspace)).free / 1e9
    if plan.disk_gb.sum() > free:
        reporter.warn(
            f"{settings.workspace}: {free:.1f} GB of disk are free, about {plan.disk_gb.sum():.1f} GB are "
            "needed; plots that find no room will fail and can be run again."
        )
    return Forecast(seconds, cpu, float(plan.disk_gb.sum()), sentence)


def _write(
    campaign: Campaign,
    plan: Plan,
    model: CostModel,
    tally: Tally,
    output: Path,
    forecast: Forecast,
    seconds: float,
    reporter: Reporter,
) -> dict[str, Any]:
    """Layer, report, costs."""
    workspace = campaign.workspace
    n_trees = write_layer(output, _finished(plan, campaign), plan.crs, reporter)
    warnings: list[str] = []
    boxes: list[tuple[str, Path, Any]] = []
    runs: list[dict[str, Any]] = []
    counts = {"done": 0, "failed": 0}
    for row in rows_of(plan, campaign):
        if row["state"] != "done":
            counts["failed"] += 1
            if len(warnings) < 200:
                warnings.append(f"{row['plot_id']}: {row['remark'] or 'was not run'}")
            continue
        counts["done"] += 1
        if row["bounds"] and row["crs"] == plan.crs:
            boxes.append((row["plot_id"], Path(row["folder"]), tuple(row["bounds"])))
        if row["runs"] == 1 and len(runs) < 5000:
            # A plot that resumed an earlier attempt was cheaper than it is.
            runs.append(
                {
                    name: row[name]
                    for name in ("route", "photos", "megapixels", "points_m", "seconds", "memory_gb", "disk_gb")
                }
            )
    for one, other, both in twins(boxes):
        warnings.append(
            f"{one} and {other} overlap: {both} trees stand in both and are in the layer twice, "
            "once for each plot; count them once in totals over plots"
        )
    for sentence in warnings[:20]:
        reporter.warn(sentence.rstrip(".") + ".")
    fitted = model.refit(runs)
    fitted.save(workspace / COSTS)
    ratio = f", {seconds / forecast.seconds:.2f} times the forecast" if not tally.kept and tally.done else ""
    status = (
        f"{counts['done']} of {len(plan)} plots measured, {counts['failed']} failed; "
        f"{tally.measured} of the {n_trees} stems found have a DBH"
    )
    reasons = ", ".join(f"{n} {name}" for name, n in sorted(tally.reasons.items(), key=lambda item: -item[1]))
    facts = {
        "result": status + ".",
        "trees layer": str(output),
        "refused because": reasons or "none",
        "this start": f"{tally.done} plots run, {tally.kept} kept, {tally.retried} retries, {tally.interrupted} "
        f"interruptions, {time_text(seconds)}{ratio}",
        "CRS": plan.crs,
        "forecast": forecast.sentence,
        "plots' folders": str(workspace / PLOTS),
        "table": str(workspace / TABLE),
    }
    write_report(campaign, rows_of(plan, campaign), facts, warnings)
    write_text(workspace / STATUS, status + ".\n")
    if plan.routes:
        reporter.info(status + ".")
    return {
        "output": str(output),
        "report": str(workspace / REPORT),
        "table": str(workspace / TABLE),
        "n_plots": len(plan),
        "n_done": counts["done"],
        "n_run": tally.done,
        "n_kept": tally.kept,
        "n_failed": counts["failed"],
        "n_trees": n_trees,
        "n_measured": tally.measured,
        "n_rejected": n_trees - tally.measured,
        "n_retried": tally.retried,
        "n_interrupted": tally.interrupted,
        "seconds": round(seconds, 1),
        "predicted_s": round(forecast.seconds, 1),
        "status": status,
    }


def _finished(plan: Plan, campaign: Campaign) -> Iterator[dict[str, Any]]:
    """The plots whose trees belong into the layer, in the manifest's order."""
    for row in rows_of(plan, campaign):
        if row["state"] == "done":
            yield {name: row[name] for name in ("plot_id", "number", "folder", "crs", "table")}
