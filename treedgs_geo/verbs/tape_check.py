"""``tape-check``: what taped trees say of the measured ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.command import Command, run_by
from ..core.settings import PLOT_FILES, TREE_LAYERS, param


@dataclass(frozen=True, kw_only=True)
class TapeCheckSettings:
    """Options of ``tape-check``."""

    trees: Path = param(help="the tree layer that the taped trees were drawn from", suffixes=TREE_LAYERS)
    taped: Path = param(
        help="the tape table of tape-sample, filled in: tapes.gpkg or tapes.csv", suffixes=("gpkg", "csv")
    )
    plots: Path | None = param(None, help="the plots that were given to tape-sample", suffixes=PLOT_FILES)
    #: Of the intervals, per cent; of the library only.
    confidence_pct: float = 90.0
    crs: str | None = param(None, kind="crs", help="CRS of trees in a CSV, or of a layer without one")
    output: Path = param(
        kind="output_folder",
        help="folder for the page and the tables",
        holds=tuple(f"tape_check.{ending}" for ending in ("csv", "html", "pdf", "json", "gpkg")),
        known_by="tape_check.gpkg",
    )


COMMAND = Command(
    name="tape-check",
    title="Check diameters against tapes",
    group="3 Check",
    summary="What taped trees say of the measured ones: bias, intervals, flags, outliers, corrected totals.",
    help=(
        "Reads the filled-in table of tape-sample. Bias (measured minus taped) and RMSE of all trees of the layer, "
        "with intervals that follow from the draw; whether the layer's 90 % intervals hold; whether trees marked ok "
        "are better than those marked check; outliers by name (and whether two numbers were exchanged); number and "
        "basal area of the trees corrected by the difference estimator of double sampling, with standard "
        "errors and how many more tapes would halve them. Units that the values contradict (inches, girths) are "
        "refused. Writes tape_check.html, .pdf, .csv, .gpkg and .json. stand-table --taped takes the same table."
    ),
    settings=TapeCheckSettings,
    run=run_by("inventory.taping.check", "check_tape_table"),
    main=("trees", "taped", "plots", "output"),
    example="treedgs tape-check --trees trees.gpkg --taped tapes/tapes.csv --plots flight/plots.csv "
    "--output tape_check",
    outputs={
        "output": "folder",
        "page": "the page to open",
        "pdf": "the same as PDF",
        "layer": "the taped trees with their errors",
        "n_taped": "trees both measured and taped",
        "bias_cm": "mean error, measured minus taped, cm",
        "bias_lo_cm": "its interval from, cm",
        "bias_hi_cm": "its interval to, cm",
        "rmse_cm": "RMSE, cm",
        "n_intervals": "trees with an interval",
        "n_inside": "of these, with the tape inside",
        "n_outliers": "trees to look at again",
    },
)
