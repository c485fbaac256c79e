"""``campaign``: many plots from one table, on this machine or several."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.command import Command, run_by
from ..core.settings import param
from .places import CAMPAIGN, PLAN, REPORT, STATUS, TABLE, TREES


@dataclass(frozen=True, kw_only=True)
class CampaignSettings:
    """Options of ``campaign``."""

    manifest: Path = param(
        help="CSV with one row a plot: plot_id, photos (folder) or cloud (file), and where wanted geotags, dtm, crs, "
        "plots, field and any setting of the verb by its name; paths count from the table's folder",
        suffixes=(".csv", ".txt", ".tsv"),
    )
    crs: str | None = param(
        None, kind="crs", help="CRS of rows that give none, and of the layer when rows have different ones"
    )
    workers: int = param(0, minimum=0, maximum=100000, help="plots at once; 0 = as many as cores and memory carry")
    predict: bool = param(False, help="only check the table and say how long it will take and what it needs")
    join: bool = param(
        False,
        help="take plots of this campaign too if another process leads it already: for further computers that share "
        "the folder, and for the jobs of a cluster's queue",
        dialog=False,
    )
    threads: int = param(1, minimum=1, maximum=256, help="processor threads a plot")
    memory_gb: float = param(
        0.0,
        unit="GB",
        minimum=0,
        maximum=100000,
        help="memory for all plots together; 0 = what is free, less a reserve",
    )
    workspace: Path = param(
        kind="output_folder",
        help="folder for the campaign; a second start does what is missing",
        holds=(PLAN, CAMPAIGN, TREES, STATUS, TABLE, REPORT),
        known_by=PLAN,
    )
    output: Path | None = param(
        None,
        kind="output_file",
        help="the one trees layer (.gpkg or .csv); without it trees.gpkg in the workspace",
        suffixes=(".gpkg", ".csv"),
    )


COMMAND = Command(
    name="campaign",
    title="Measure many plots",
    group="2 Measure",
    summary="Many plots from one table, on this machine or several: one trees layer, one report.",
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
    run=run_by("campaign.run", "run_campaign"),
    main=("manifest", "crs", "workers", "predict", "workspace", "output"),
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
