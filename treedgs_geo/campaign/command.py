"""``campaign``: many plots from one table, on this machine or a cluster."""

from __future__ import annotations

from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from .settings import CampaignSettings


def run(settings: CampaignSettings, reporter: Reporter) -> dict[str, Any]:
    """Run the campaign; see :func:`treedgs_geo.campaign.run.run_campaign`."""
    from .run import run_campaign

    return run_campaign(settings, reporter)


COMMAND = Command(
    name="campaign",
    qgis_id="campaign",
    title="Measure many plots",
    group="2 Measure",
    summary="Many plots from one table, on this machine or a cluster: one trees layer, one report.",
    help=(
        "One row of the table is one plot, from photos or from a point cloud. All rows are checked before anything "
        "starts. Plots run side by side, as many as memory and cores carry, each in a folder of its own; a plot that "
        "fails is tried again at most twice and then reported, the others go on. A second start runs only what is "
        "missing or whose inputs or settings have changed. Writes one trees layer with plot ids, campaign.html and "
        "plots.csv (trees, refusals and reasons, seconds, memory, accuracy where field trees are given). Where plots "
        "failed it ends with an error (exit code 5) although layer and report are written. With --predict it only "
        "says how long it will take."
    ),
    settings=CampaignSettings,
    run=run,
    example="treedgs campaign --manifest season.csv --workspace season",
    outputs={
        "output": "trees layer of all plots (file)",
        "report": "campaign report (file)",
        "table": "one row a plot (file)",
        "n_plots": "plots in the table",
        "n_done": "plots measured, now or before",
        "n_run": "plots run by this start",
        "n_kept": "plots kept from an earlier start",
        "n_failed": "plots given up, each with its reason in the report",
        "n_trees": "stems found",
        "n_measured": "stems with a DBH",
        "n_rejected": "stems without one, each with a reason",
        "seconds": "seconds of this start",
        "predicted_s": "seconds that were forecast",
        "status": "what came out, in one sentence",
    },
)
