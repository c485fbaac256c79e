"""``benchmark``: speed against accuracy, stability where methods fail, and what work costs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from treedgs_geo.core.command import Command
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.settings import param

#: ``--quick`` begins nothing new after this many minutes: what has begun ends within two more.
QUICK_MIN = 9.5


@dataclass(frozen=True, kw_only=True)
class BenchmarkSettings:
    """Options of ``benchmark``."""

    plots: Path | None = param(
        None, kind="folder", help="simulated plot, or a folder of them, to measure on; without it plots are simulated"
    )
    output: Path = param(
        kind="output_folder",
        help="folder for charts and tables; finished runs are kept there, so that a stopped benchmark resumes",
        holds=("trees.csv",),
        known_by="benchmark.json",
    )
    suite: str = param(
        "chart",
        choices=("chart", "stability", "cost"),
        help="chart: seconds against error; stability: one factor at a time from harmless to hopeless; cost: seconds "
        "and memory of each stage against photos, megapixels, stems and points, fitted",
    )
    quick: bool = param(False, help="one small plot and a dozen configurations: about 10 minutes on two idle cores")
    seeds: str = param("1,2,3", help="seeds of the stability suite", dialog=False)
    only: str = param(
        "", help="only these configurations of the chart, or factors and methods of the suite, by commas", dialog=False
    )


def run(settings: BenchmarkSettings, reporter: Reporter) -> dict[str, Any]:
    """Chart, suite or cost model."""
    from treedgs_geo.core.errors import InputError

    from ..benchmarks.stability.suite import StabilityChoice, run_stability

    def words(text: str) -> list[str]:
        return [word.strip() for word in text.split(",") if word.strip()]

    budget_min = QUICK_MIN if settings.quick else float("inf")
    if settings.suite == "stability":
        try:
            seeds = [int(word) for word in words(settings.seeds)]
        except ValueError:
            raise InputError(f"--seeds: found {settings.seeds!r}, expected whole numbers by commas.") from None
        if not seeds:
            raise InputError("--seeds: is empty, expected at least one whole number.")
        if settings.quick:
            seeds = seeds[:1]
        return run_stability(settings.output, StabilityChoice(seeds, words(settings.only)), budget_min, reporter)
    if settings.suite == "cost":
        from ..benchmarks.speed.cost import run_cost

        return run_cost(settings.output, settings.plots, reporter)
    from ..benchmarks.speed.configurations import run_chart

    return run_chart(settings.output, settings.plots, settings.quick, words(settings.only), budget_min, reporter)


COMMAND = Command(
    name="benchmark",
    title="Benchmark speed and accuracy",
    group="5 Steps and research",
    summary="Chart seconds against DBH error for every preset and method; or test where they fail.",
    help=(
        "Runs each configuration (presets, number of photos, photo size, features, LiDAR methods) on simulated "
        "plots with known truth and charts seconds, memory, RMSE and success rate, with the Pareto front and a "
        "recommended configuration for each preset. With --suite stability: one trouble at a time (few photos, wind, "
        "lean, pose noise, clutter, ...) at rising severity: errors, refusals, interval coverage, and every accepted "
        "tree that is more than 2 cm or three stated errors off. With --suite cost: how seconds and memory grow. "
        "Writes SVG, PNG, CSV, JSON, Markdown and a page without outside files. Compare seconds only within one run on "
        "an idle machine."
    ),
    settings=BenchmarkSettings,
    run=run,
    main=("plots", "output", "suite", "quick"),
    example="treedgs benchmark --quick --output benchmark",
    outputs={
        "output": "folder",
        "page": "the page to open",
        "chart": "the chart (SVG)",
        "n_runs": "runs of the chart",
        "recommended": "configuration for each preset",
        "left_out": "what there was no time for",
        "n_cases": "cases of the stability suite",
        "n_wanted": "cases that it has",
        "n_ok": "trees accepted by the photo method",
        "n_lies": "of them wrong: 2 cm or three stated errors off",
        "coverage_90": "of them inside the stated 90 % interval, 0 to 1",
        "claim_holds": "at most 2 % of the accepted trees are wrong: 2 cm or three stated errors off",
        "predicted_min": "the paper's own case on this machine, minutes",
        "seconds": "seconds it took",
    },
)
