"""``compare``: two tree layers of the same ground at two dates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.command import Command, run_by
from ..core.settings import PLOT_FILES, TREE_LAYERS, param


@dataclass(frozen=True, kw_only=True)
class CompareSettings:
    """Options of ``compare``."""

    before: Path = param(help="tree layer of the first date", suffixes=TREE_LAYERS)
    after: Path = param(help="tree layer of the second date", suffixes=TREE_LAYERS)
    years: float | None = param(
        None,
        minimum=0.1,
        maximum=100,
        help="years (seasons of growth) between the dates; needed where the layers do not say when they were flown",
    )
    plots: Path | None = param(
        None,
        help="plots, as for stand-table; without: all trees together, and nothing per hectare",
        suffixes=PLOT_FILES,
    )
    min_dbh_cm: float = param(0.0, unit="cm", minimum=0, maximum=100, help="smallest DBH that counts")
    max_yearly_growth_cm: float = param(
        3.0,
        unit="cm",
        minimum=0.1,
        maximum=20,
        help="what no tree grows more in a year: a new one that is thicker than this allows was missed at the first "
        "date",
    )
    common_se_cm: float = param(
        0.2, unit="cm", minimum=0, maximum=20, help="standard error of a bias that all DBHs of one date share"
    )
    block_before_pct: float = param(
        0.0,
        unit="%",
        minimum=0,
        maximum=10,
        help="relative standard error of lengths in the first date's block (scale_sd in the workspace's run.json, "
        "times 100)",
    )
    block_after_pct: float = param(0.0, unit="%", minimum=0, maximum=10, help="the same of the second date's block")
    centre_error_m: float = param(
        1.0,
        unit="m",
        minimum=0.05,
        maximum=20,
        help="how far the two maps may be shifted against each other, standard error (0.05 with RTK or PPK, 3 without)",
    )
    #: Of the intervals, per cent; of the library only.
    confidence_pct: float = 90.0
    crs: str | None = param(None, kind="crs", help="CRS of trees in a CSV, or of a layer without one")
    output: Path = param(
        kind="output_folder",
        help="folder for the page, the layer and the tables",
        holds=tuple(f"change.{ending}" for ending in ("csv", "html", "pdf", "json", "gpkg")),
        known_by="change.gpkg",
    )


COMMAND = Command(
    name="compare",
    title="Compare two dates",
    group="4 Report",
    summary="Growth, ingrowth and mortality between two tree layers of the same ground, per tree and per hectare.",
    help=(
        "Pairs the trees of both dates by position, plot by plot, as match-plots pairs field plots (the maps may be "
        "shifted and turned against each other; a plot whose placing is not sure is left out and named). Per tree: "
        "growth of DBH with its interval. Per hectare (with plots): growth of survivors, ingrowth, mortality and net "
        "change of basal area and of the number of trees, with errors from the spread of the plots and from what all "
        "trees of a date share (bias of the camera, scale of the block), which does not average out. A new tree that "
        "is too thick to be new was missed at the first date; the share of such trees says how many of those that are "
        "not found again are dead. Reviewed trees count as reviewed. Writes change.gpkg, change.csv, change.html, "
        "change.pdf and change.json."
    ),
    settings=CompareSettings,
    run=run_by("inventory.change.run", "compare_dates"),
    main=("before", "after", "years", "plots", "min_dbh_cm", "output"),
    example="treedgs compare --before 2024/trees.gpkg --after 2029/trees.gpkg --years 5 --plots flight/plots.csv "
    "--output change",
    outputs={
        "output": "folder",
        "report": "the page to open",
        "pdf": "the same as PDF",
        "layer": "every tree with what became of it",
        "n_survivors": "trees measured at both dates",
        "n_ingrowth": "trees that grew into the count",
        "n_mortality": "trees not found again, or dead",
        "n_unsure": "trees whose partner is not sure",
        "growth_cm_a": "mean growth of DBH of the survivors, cm a year",
        "ba_change_m2_ha": "net change of basal area, m²/ha",
    },
)
