"""Settings of ``campaign`` (standard library only)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.settings import param
from .places import CAMPAIGN, PLAN, REPORT, STATUS, TABLE, TREES


@dataclass(frozen=True, kw_only=True)
class CampaignSettings:
    """Options of ``campaign``."""

    manifest: Path = param(
        kind="file",
        help="CSV with one row a plot: plot_id, photos (folder) or cloud (file), and where wanted geotags, dtm, crs, "
        "plots, field and any setting of the verb by its name; paths count from the table's folder",
        suffixes=(".csv", ".txt", ".tsv"),
    )
    crs: str | None = param(
        None, kind="crs", help="CRS of rows that give none, and of the layer when rows have different ones"
    )
    scheduler: str = param(
        "local",
        kind="text",
        help="where plots run: local, tls://host:8786 (a running Dask scheduler), slurm or pbs",
    )
    workers: int = param(
        0, kind="integer", minimum=0, maximum=100000, help="plots at once; 0 = as many as cores and memory carry"
    )
    predict: bool = param(
        False, kind="flag", help="only check the table and say how long it will take and what it needs"
    )
    run_programs: bool = param(
        False,
        kind="flag",
        advanced=True,
        help="run the programs that the table names (segmenter_command, segmenter_model)",
    )
    threads: int = param(1, kind="integer", minimum=1, maximum=256, help="processor threads a plot", advanced=True)
    memory_gb: float = param(
        0.0,
        kind="number",
        unit="GB",
        minimum=0,
        maximum=100000,
        help="memory for all plots together (in a queue: of each job); 0 = what is free, less a reserve",
        advanced=True,
    )
    time_limit_min: float = param(
        0.0, kind="number", unit="min", minimum=0, help="end a plot that takes longer; 0 = never", advanced=True
    )
    patience_s: float = param(
        120.0,
        kind="number",
        unit="s",
        minimum=1,
        help="how long to wait for a scheduler or workers that are lost",
        dialog=False,
    )
    dashboard: str = param(
        "auto",
        kind="text",
        help="Dask's live view, for this machine only: auto (a free port), off, or a port like :8787; what is given as "
        "host:port can be looked at by whoever reaches that host",
        advanced=True,
    )
    queue_options: str | None = param(
        None,
        kind="text",
        help="for slurm and pbs: queue=…,walltime=08:00:00,account=…,jobs=20,memory=16GB,cores=4",
        advanced=True,
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
