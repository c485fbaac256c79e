"""What ``evaluate`` adds where there are clouds or a workspace, or where the paper's tables and figures are wanted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.tables import PairsEvidence
from treedgs_geo.report.blocks import Block
from treedgs_geo.verbs.evaluate import EvaluateSettings

from .experiments import ExperimentOptions, run_experiments
from .paper_document import write_paper
from .paper_inputs import PaperInputs


def add_experiments(
    settings: EvaluateSettings,
    plots: list[PlotFiles],
    evidence: PairsEvidence,
    metrics: dict[str, Any],
    reporter: Reporter,
) -> tuple[list[Block], Path | None]:
    """Run the experiments and add their figures to ``metrics``: ``(blocks of the page, the paper's page)``."""
    options = ExperimentOptions()
    with reporter.stage("experiments", 0.4, 0.85):
        found = run_experiments(plots, options, settings.output, reporter)
    metrics |= found.found
    if not settings.paper:
        return found.section, None
    with reporter.stage("figures of the paper", 0.85, 0.9):
        drawn = PaperInputs(evidence, metrics, plots, found.references, found.sources, settings.output, found.labelled)
        return found.section, write_paper(drawn)
