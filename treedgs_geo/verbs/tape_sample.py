"""``tape-sample``: which trees to tape, drawn with known chances."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.command import Command, run_by
from ..core.settings import PLOT_FILES, TREE_LAYERS, param
from ..inventory.options import Bearings


@dataclass(frozen=True, kw_only=True)
class TapeSampleSettings(Bearings):
    """Options of ``tape-sample``."""

    trees: Path = param(help="measured trees: the tree layer", suffixes=TREE_LAYERS)
    plots: Path | None = param(
        None,
        help="plots, as for stand-table: only trees in them are drawn, and the form gives bearing and distance from "
        "the plot's centre; without: the trees that have a plot_id, or all",
        suffixes=PLOT_FILES,
    )
    n: int = param(20, minimum=2, maximum=2000, help="trees to tape")
    seed: int = param(0, minimum=0, help="another number draws other trees; the same draws the same again")
    crs: str | None = param(None, kind="crs", help="CRS of trees in a CSV, or of a layer without one")
    output: Path = param(
        kind="output_folder",
        help="folder for the tape table, the form and the phone's waypoints",
        holds=("tapes.gpkg", "tapes.csv", "tapes.gpx", "tape_form.html", "tape_form.pdf"),
        known_by="tapes.gpkg",
    )


COMMAND = Command(
    name="tape-sample",
    title="Choose trees to tape",
    group="3 Check",
    summary="Draws the trees to tape with known chances, with a map and form to print and waypoints for the phone.",
    help=(
        "Draws trees of a tree layer so that the tapes can correct its totals (tape-check, stand-table): stratified "
        "by flag and DBH class, simple random in each. Stems without a DBH can be drawn too; dead trees are not. "
        "Writes tapes.gpkg and tapes.csv to fill in (taped_cm, or girth_cm; state none, dead or not reached; a row "
        "without tree_id is a tree that the map lacks), tapes.gpx for the phone, and tape_form.pdf and tape_form.html "
        "to print: per plot a map, the trees in the order of a walk, and room for trees that the map lacks. The form "
        "shows the measured DBH rounded to 5 cm, so that nobody reads the tape towards it. A folder whose table is "
        "filled in already is not written over."
    ),
    settings=TapeSampleSettings,
    run=run_by("inventory.taping.sample", "sample_tapes"),
    main=("trees", "plots", "n", "output"),
    example="treedgs tape-sample --trees trees.gpkg --plots flight/plots.csv --n 5 --output tapes",
    outputs={
        "output": "folder",
        "layer": "the drawn trees, to fill in",
        "table": "the same as CSV",
        "form": "the form to print (PDF)",
        "page": "the form as a page",
        "gpx": "waypoints",
        "n": "trees drawn",
        "n_frame": "trees they were drawn from",
    },
)
