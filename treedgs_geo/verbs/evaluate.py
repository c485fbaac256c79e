"""``evaluate``: accuracy of measured DBH against field (or true) DBH."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import param

if TYPE_CHECKING:
    from ..inventory.accuracy.plot_files import PlotFiles


@dataclass(frozen=True, kw_only=True)
class EvaluateSettings:
    """Options of ``evaluate``."""

    plots: Path | None = param(
        None,
        help="CSV with a row a plot and the columns plot_id, trees and truth (or pairs), and where there are any "
        "lidar, splats (surface.laz or stems.laz), dtm, workspace_in (of photos-to-dbh); paths count from the CSV's "
        "folder",
        suffixes=("csv",),
    )
    pairs: Path | None = param(None, help="pairs layer of match-plots, checked by you", suffixes=("gpkg",))
    trees: Path | None = param(
        None, help="instead of pairs: a tree layer of a simulated plot", suffixes=("gpkg", "shp", "geojson")
    )
    truth: Path | None = param(None, help="with --trees: the plot's truth/trees.csv", suffixes=("csv",))
    against: Path | None = param(
        None,
        help="pairs layer of another method for the same field trees: both are also scored on the trees both measured",
        suffixes=("gpkg",),
    )
    min_dbh_cm: float = param(
        0.0,
        unit="cm",
        minimum=0,
        help="smallest DBH that the field crew tallied; thinner measured trees are not counted as false",
    )
    paper: bool = param(
        False,
        help="also write paper.html and paper_tables.tex: every table and figure of the published paper, in its order, "
        "with these data, or why not",
        dialog=False,
    )
    output: Path = param(
        kind="output_folder",
        help="folder for metrics.json, tables, charts and evaluation.html",
        holds=("metrics.json", "per_plot.csv", "trees.csv", "table.tex", "evaluation.html"),
        known_by="metrics.json",
    )


def run(settings: EvaluateSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, score, write."""
    from .. import __version__
    from ..core.errors import InputError
    from ..core.files import ensure_writable, fingerprint
    from ..inventory.accuracy.plot_files import pooled_evidence
    from ..inventory.accuracy.report import write_evaluation
    from ..inventory.accuracy.tables import compare, evidence_from_pairs, metrics_of

    ensure_writable(settings.output / "metrics.json")
    plots = _plots(settings)
    with reporter.stage("read", 0.0, 0.2):
        evidence = pooled_evidence([plot.evidence(settings.min_dbh_cm) for plot in plots])
    with reporter.stage("score", 0.2, 0.4):
        metrics = metrics_of(evidence)
    given = [path for plot in plots for path in plot.scored]
    names = [path.name for path in given]
    metrics["inputs"] = {path.name if names.count(path.name) == 1 else str(path): fingerprint([path]) for path in given}
    metrics["version"] = __version__
    if settings.against is not None:
        if settings.pairs is None:
            raise InputError("--against: compares pairs layers, so it needs --pairs.")
        other = evidence_from_pairs(settings.against, settings.min_dbh_cm)
        metrics["against"] = {"file": settings.against.name, **compare(evidence, other)}
    more, paper = (), None
    if settings.paper or any(plot.has_experiments for plot in plots):
        from ..core.extras import lab

        published = lab("published.experiments", "evaluate with clouds, a workspace or --paper")
        more, paper = published.add_experiments(settings, plots, evidence, metrics, reporter)
    reporter.tell(metrics["notes"])
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
        "paper": None if paper is None else str(paper),
        "metrics": paths["metrics"],
        **{name: value for name, value in metrics["pooled"].items() if name != "max_abs_cm"},
    }


def _plots(settings: EvaluateSettings) -> list[PlotFiles]:
    """The plot of the single files, or those of the table.

    Raises:
        InputError: both, or neither.
    """
    from ..core.errors import InputError
    from ..inventory.accuracy.plot_files import PlotFiles, read_plot_files

    names = ("pairs", "trees", "truth", "against")
    given = {name: getattr(settings, name) for name in names if getattr(settings, name) is not None}
    if settings.plots is not None:
        if given:
            one = next(iter(given))
            raise InputError(f"--plots: names the files of every plot, so --{one} cannot be given beside it.")
        return read_plot_files(settings.plots)
    plot = PlotFiles(pairs=settings.pairs, trees=settings.trees, truth=settings.truth)
    plot.check("Nothing to evaluate")
    return [plot]


COMMAND = Command(
    name="evaluate",
    title="Evaluate DBH accuracy",
    group="3 Check",
    summary="Accuracy tables and charts of measured DBH against field DBH.",
    help=(
        "From the pairs layer of match-plots (pair_status auto, ok and moved count; rejected never): number of trees, "
        "success rate (trees with a DBH of all field trees), RMSE, RRMSE (of the mean field DBH), MAE, mean error "
        "(measured minus field), share of trees inside the stated 90 % interval and false trees, per plot and pooled, "
        "with bootstrap intervals by plot. Writes metrics.json, per_plot.csv, trees.csv, table.tex, charts (SVG and "
        "PNG) and evaluation.html. Plots left to a hand check do not count and are named. With --plots: several plots "
        "in one table, with mean, standard deviation and range over plots. With its columns lidar and splats: "
        "cylinder, circle and weighted circle on both, p chosen on held-out stems, densities, trend over DBH, "
        "ablation, and (simulated plots) segmentation scores and true labels. With workspace_in: how many photos show "
        "breast height, and runtime. Units: centimetres and per cent; rates in metrics.json are 0 to 1."
    ),
    settings=EvaluateSettings,
    run=run,
    main=("plots", "pairs", "trees", "output", "min_dbh_cm"),
    example="treedgs evaluate --pairs pairs.gpkg --output evaluation",
    outputs={
        "output": "folder",
        "page": "the page to open",
        "paper": "page with the paper's tables and figures",
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
