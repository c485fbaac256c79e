"""``trial``: measured diameters tested on a plot of one's own, without knowing the tapes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import PLOT_FILES, TREE_LAYERS, param
from ..inventory.options import Bearings


@dataclass(frozen=True, kw_only=True)
class TrialSettings(Bearings):
    """Options of ``trial``."""

    trees: Path | None = param(
        None,
        help="first step: the tree layer to test; the trees.gpkg of a workspace seals the run's settings too. "
        "Second step: only where the layer was moved since",
        suffixes=TREE_LAYERS,
    )
    limit_cm: float | None = param(
        None,
        unit="cm",
        minimum=0.01,
        maximum=50,
        help="first step: the mean error, either way, that you would still accept",
    )
    n: int | None = param(None, minimum=2, maximum=10000, help="trees to tape, drawn at random; without: all")
    plots: Path | None = param(
        None, help="plots, as for tape-sample: only trees in them are drawn", suffixes=PLOT_FILES
    )
    taped: Path | None = param(
        None,
        help="second step: the table of the first one, filled in: tapes.gpkg or tapes.csv",
        suffixes=("gpkg", "csv"),
    )
    #: Of the draw; of the library only.
    seed: int = 0
    crs: str | None = param(None, kind="crs", help="CRS of trees in a CSV, or of a layer without one")
    output: Path = param(
        kind="output_folder",
        help="folder of the trial, the same for both steps",
        holds=("trial.json", "bundle.json", "tape_form.html", "tape_form.pdf", "tapes.gpx"),
        known_by="trial.json",
    )


def run(settings: TrialSettings, reporter: Reporter) -> dict[str, Any]:
    """Seal, or open."""
    from ..core.errors import InputError
    from ..inventory.trial.result import open_trial
    from ..inventory.trial.seal import seal_trial

    if settings.taped is not None:
        return open_trial(settings, reporter)
    if settings.trees is None or settings.limit_cm is None:
        raise InputError(
            "--trees, --limit-cm: the first step needs both, the layer and the mean error that you would accept; the "
            "second one --taped."
        )
    return seal_trial(settings, reporter)


COMMAND = Command(
    name="trial",
    title="Test on your own taped plot",
    group="3 Check",
    summary="Seals measured diameters, has trees taped without knowing them, and judges them by the tapes.",
    help=(
        "Two steps in one folder. First --trees and --limit-cm: seals the layer's rows, the run's settings (where its "
        "run.json lies beside the layer), version and limit by SHA-256 in trial.json, and writes the files for the "
        "field as tape-sample does, without any diameter: all trees, or --n drawn at random. second_taped_cm takes a "
        "second tape of some trees. Then --taped: what was changed since is named and refused. Otherwise "
        "result/evaluation.html says RMSE, bias with its 90 % interval, whether measured and taped diameters are "
        "equivalent within the limit (two one-sided tests), how many 90 % intervals hold the tape, and how well tapes "
        "repeat; the figures are those of evaluate. bundle.json has the numbers without places, names and dates: send "
        "it in if you like."
    ),
    settings=TrialSettings,
    run=run,
    main=("trees", "limit_cm", "n", "plots", "taped", "output"),
    example="treedgs trial --trees trees.gpkg --plots flight/plots.csv --limit-cm 1 --output trial",
    outputs={
        "output": "folder",
        "page": "the page to open: the form, then the result",
        "layer": "first step: the drawn trees, to fill in",
        "bundle": "second step: the numbers, without places and names",
        "seal": "SHA-256 of all that is sealed",
        "n": "trees drawn, then trees both measured and taped",
        "conclusion": "equivalent, not equivalent or undecided",
        "bias_cm": "mean error, measured minus taped, cm",
        "bias_lo_cm": "its interval from, cm",
        "bias_hi_cm": "its interval to, cm",
        "rmse_cm": "RMSE, cm",
        "coverage_90": "share inside the stated 90 % interval, 0 to 1",
    },
)
