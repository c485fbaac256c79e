"""``evaluate``: accuracy of measured DBH against field (or true) DBH."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import param


@dataclass(frozen=True, kw_only=True)
class EvaluateSettings:
    """Options of ``evaluate``."""

    pairs: Path | None = param(None, kind="file", help="pairs layer of match-plots, checked by you", suffixes=("gpkg",))
    trees: Path | None = param(
        None,
        kind="file",
        help="instead of pairs: a tree layer of a simulated plot",
        suffixes=("gpkg", "shp", "geojson"),
    )
    truth: Path | None = param(None, kind="file", help="with --trees: the plot's truth/trees.csv", suffixes=("csv",))
    min_clear_views: int = param(
        0,
        kind="integer",
        minimum=0,
        advanced=True,
        help="with --truth: only stems with at least this many clear views count",
    )
    against: Path | None = param(
        None,
        kind="file",
        help="pairs layer of another method for the same field trees: both are also scored on the trees both measured",
        suffixes=("gpkg",),
    )
    min_dbh_cm: float = param(
        0.0,
        kind="number",
        unit="cm",
        minimum=0,
        help="smallest DBH that the field crew tallied; thinner measured trees are not counted as false",
    )
    lidar: Path | None = param(
        None,
        kind="file",
        help="LiDAR cloud of the plot: adds the published cylinder and circles (with tree_id: as segmented)",
        suffixes=("laz", "las"),
    )
    splats: Path | None = param(
        None,
        kind="file",
        help="stems.laz of a photos-to-dbh workspace with splats: the same fits on surface points",
        suffixes=("laz", "las"),
    )
    dtm: Path | None = param(
        None, kind="file", help="terrain for both clouds; without it each finds its own", suffixes=("tif", "tiff")
    )
    workspace_in: Path | None = param(
        None, kind="folder", help="workspace of photos-to-dbh: adds visibility of breast height and runtime by stage"
    )
    holdout_pct: float = param(
        10.0,
        kind="number",
        unit="%",
        minimum=1,
        maximum=90,
        advanced=True,
        help="stems held out to choose the exponent p, the same for every method",
    )
    output: Path = param(kind="output_folder", help="folder for metrics.json, tables, charts and evaluation.html")
    seed: int = param(
        0, kind="integer", minimum=0, advanced=True, help="seed of the bootstrap and of the held-out stems"
    )


def run(settings: EvaluateSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, score, write."""
    from .. import __version__
    from ..core.errors import InputError
    from ..core.files import ensure_writable, fingerprint
    from ..evaluation.compare import compare
    from ..evaluation.experiments import ExperimentInputs, run_experiments
    from ..evaluation.methods import Reference
    from ..evaluation.report import write_evaluation
    from ..evaluation.tables import evidence_from_pairs, evidence_from_truth, metrics_of
    from ..inventory.reviewed import reviewed
    from ..inventory.tree_reading import read_trees

    ensure_writable(settings.output / "metrics.json")
    if (settings.pairs is None) == (settings.trees is None) or (settings.trees is None) != (settings.truth is None):
        raise InputError("Give either --pairs (from match-plots), or both --trees and --truth (a simulated plot).")
    with reporter.stage("read", 0.0, 0.2):
        if settings.pairs is not None:
            inputs = [settings.pairs]
            evidence = evidence_from_pairs(settings.pairs, settings.min_dbh_cm)
        else:
            assert settings.trees is not None and settings.truth is not None
            inputs = [settings.trees, settings.truth]
            name = settings.truth.resolve().parent.parent.name if settings.truth.parent.name == "truth" else "plot"
            trees, _ = reviewed(read_trees(settings.trees), settings.trees)
            evidence = evidence_from_truth(trees, settings.truth, name or "plot", settings.min_clear_views)
    with reporter.stage("score", 0.2, 0.4):
        metrics = metrics_of(evidence, settings.seed)
    metrics["inputs"] = {path.name: fingerprint([path]) for path in inputs}
    metrics["version"] = __version__
    if settings.against is not None:
        if settings.pairs is None:
            raise InputError("--against: compares pairs layers, so it needs --pairs.")
        other = evidence_from_pairs(settings.against, settings.min_dbh_cm)
        metrics["against"] = {
            "file": settings.against.name,
            **compare(evidence, other, settings.seed),
        }
    more = ""
    if settings.lidar is not None or settings.splats is not None or settings.workspace_in is not None:
        reference = (
            Reference.from_pairs(settings.pairs)
            if settings.pairs is not None
            else Reference.from_truth(inputs[1], str(evidence.trees["plot_id"].iloc[0]))
        )
        asked = ExperimentInputs(
            settings.lidar,
            settings.splats,
            settings.dtm,
            settings.workspace_in,
            settings.truth,
            settings.holdout_pct / 100,
            settings.seed,
        )
        with reporter.stage("experiments", 0.4, 0.9):
            found, more = run_experiments(asked, reference, settings.output, reporter)
        metrics |= found
    for note in metrics["notes"]:
        reporter.warn(note)
    if metrics["bootstrap"]["note"]:
        reporter.info(f"Intervals: {metrics['bootstrap']['note']}.")
    with reporter.stage("write", 0.9, 1.0):
        facts = {
            "inputs": ", ".join(f"{name} ({mark})" for name, mark in metrics["inputs"].items()),
            "reference": evidence.reference,
            "TreeDGS": __version__,
        }
        paths = write_evaluation(settings.output, evidence, metrics, facts, more)
    return {
        "output": str(settings.output),
        "page": paths["page"],
        "metrics": paths["metrics"],
        **{
            name: metrics[name]
            for name in (
                "n",
                "n_reference",
                "success_rate",
                "rmse_cm",
                "rrmse_pct",
                "mae_cm",
                "me_cm",
                "n_false",
                "coverage_90",
            )
        },
    }


COMMAND = Command(
    name="evaluate",
    qgis_id="evaluate",
    title="Evaluate DBH accuracy",
    group="Inventory",
    summary="Accuracy tables and charts of measured DBH against field DBH.",
    help=(
        "From the pairs layer of match-plots (pair_status auto, ok and moved count; rejected never): number of "
        "trees, success rate (trees with a DBH of all field trees), RMSE, RRMSE (of the mean field DBH), MAE, "
        "mean error (measured minus field), share of trees inside the stated 90 % interval and false trees, per "
        "plot and pooled, with bootstrap intervals by plot. Writes metrics.json, per_plot.csv, trees.csv, "
        "table.tex, charts (SVG and PNG) and evaluation.html. Plots left to a hand check do not count and are "
        "named. With --lidar and --splats: cylinder, circle and weighted circle on both, p chosen on held-out stems, "
        "densities, trend over DBH, ablation, and (simulated plots) segmentation scores and true labels. With "
        "--workspace-in: how many photos show breast height, and runtime. Units: centimetres and per "
        "cent; rates in metrics.json are 0 to 1."
    ),
    settings=EvaluateSettings,
    run=run,
    example="treedgs evaluate --pairs pairs.gpkg --output evaluation",
    outputs={
        "output": "folder",
        "page": "the page to open",
        "metrics": "metrics.json",
        "n": "trees measured and compared",
        "n_reference": "field trees",
        "success_rate": "measured of field trees, 0 to 1",
        "rmse_cm": "RMSE, cm",
        "rrmse_pct": "RMSE, per cent of the mean field DBH",
        "mae_cm": "mean absolute error, cm",
        "me_cm": "mean error, cm",
        "n_false": "measured trees that are no field tree",
        "coverage_90": "share inside the stated 90 % interval, 0 to 1",
    },
)
