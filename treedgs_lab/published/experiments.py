"""What ``evaluate`` adds where there are clouds or a workspace, or where the paper's tables and figures are wanted:
methods, ablation, segmentation, visibility, runtime; over one plot or many.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.tables import PairsEvidence
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.report.blocks import Block, Heading, Paragraph
from treedgs_geo.report.charts import write_chart
from treedgs_geo.stems.cloud.propose.labelling import Labeller
from treedgs_geo.stems.cloud.propose.segment import find_stems
from treedgs_geo.terrain.dtm import Dtm, read_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_geo.verbs.evaluate import EvaluateSettings

from . import experiment_charts
from .methods import WEIGHTS, ablate, compare_methods, figures, measure, stem_points, with_power
from .paper_document import write_paper
from .photo_experiments import photo_experiments
from .reference import reference_of
from .sections import ABLATION_COLUMNS, methods_latex, plain_latex, table_of, write_table, write_text
from .segmentation import LabelledPoints, score_segmentation, stems_json, true_labels
from .study import Study

#: Points are scored within this of a reference stem, and between these heights above the ground, m.
NEAR_M, BAND_M = 1.5, (0.3, 5.0)


def add_experiments(
    settings: EvaluateSettings,
    plots: list[PlotFiles],
    evidence: PairsEvidence,
    metrics: dict[str, Any],
    reporter: Reporter,
) -> tuple[list[Block], Path | None]:
    """Run the experiments, write tables (CSV, LaTeX) and charts (SVG, PNG), and add their figures to ``metrics``:
    ``(blocks of the page, the paper's page)``. The stems of all plots are judged together, and plot by plot.

    Raises:
        InputError: a cloud without the attribute that its weights need, or no workspace where one is named.
    """
    study = Study(evidence, metrics, plots, [reference_of(plot) for plot in plots], settings.output)
    with reporter.stage("experiments", 0.4, 0.85):
        if any(plot.lidar or plot.splats for plot in plots):
            with reporter.stage("methods", 0.0, 0.6):
                _gather(study, reporter)
                _methods(study)
        if study.workspaces:
            with reporter.stage("visibility and runtime", 0.6, 1.0):
                photo_experiments(study, reporter)
    if not settings.paper:
        return study.blocks, None
    with reporter.stage("figures of the paper", 0.85, 0.9):
        return study.blocks, write_paper(study)


def _gather(study: Study, reporter: Reporter) -> None:
    """Read every cloud once, plot by plot. Stems of plots without a source count as not found there; true labels are
    used only where every plot has them."""
    names = [name for name in WEIGHTS if any(getattr(plot, name) for plot in study.plots)]
    truths = [stems_json(plot) for plot in study.plots]
    scored = all(truth is not None for truth in truths)
    study.sources = {name: [] for name in names}
    study.oracle = {name: [] for name in names} if scored else {}
    scores: list[dict[str, Any]] = []
    for number, (plot, reference, truth) in enumerate(zip(study.plots, study.references, truths, strict=True)):
        reporter.progress(number / len(study.plots))
        for name in names:
            path = getattr(plot, name)
            if path is None:
                for found in (study.sources, study.oracle):
                    found.get(name, []).extend([None] * len(reference))
                continue
            cloud, dtm, label = _segmented(path, plot.dtm, name)
            study.sources[name].extend(stem_points(cloud, label, dtm, reference, WEIGHTS[name]))
            height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
            away, _ = cKDTree(reference.xy).query(cloud.xyz[:, :2], distance_upper_bound=NEAR_M)
            band = (away < NEAR_M) & (height > BAND_M[0]) & (height < BAND_M[1])
            place, whole, true = np.column_stack([cloud.xyz[band, :2], height[band]]), bool((label <= 0).any()), None
            if scored and truth is not None:
                every = true_labels(cloud.xyz, truth)
                study.oracle[name].extend(stem_points(cloud, every, dtm, reference, WEIGHTS[name]))
                true = every[band]
                scores.append({"source": name, "plot": plot.name, **score_segmentation(label[band], true, whole)})
            study.labelled.append(LabelledPoints.thinned(name, plot.name, place, label[band], true, whole))
    if scores:
        study.metrics["segmentation"] = scores


def _segmented(path: Path, dtm_file: Path | None, name: str) -> tuple[PointCloud, Dtm, np.ndarray]:
    """A cloud, its ground and the stem of each point: the file's ``tree_id``, or ours."""
    cloud = read_cloud(path)
    dtm = read_dtm(dtm_file, cloud.horizontal_crs) if dtm_file else dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs)
    if "tree_id" in cloud.attributes:
        return cloud, dtm, np.asarray(cloud.attributes["tree_id"]).astype(int)
    if name == "splats":
        raise InputError(f"{path}: has no tree_id; give the surface.laz of a workspace (photos-to-dbh --preset paper).")
    height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    return cloud, dtm, Labeller(find_stems(cloud, dtm))(cloud.xyz, height)


def _methods(study: Study) -> None:
    """Every source by every fit, ablation, segmentation and true labels."""
    sources, reference, folder = study.sources, study.reference, study.folder
    found = compare_methods(sources, reference)
    split, powers, estimates = found["split"], found["powers"], found["estimates"]
    names = [f"{p}/{t}" for p, t in zip(reference.plot, reference.tree, strict=True)]
    held = np.isin(names, split["held_out"])
    errors = {name: np.where(held, np.nan, read - reference.dbh_cm) for name, read in estimates.items()}
    trees = {"plot_id": reference.plot, "tree_id": reference.tree, "reference_cm": reference.dbh_cm, "held_out": held}
    main = "splats" if "splats" in sources else "lidar"
    ablation = ablate(sources[main], reference, held, powers[main])
    for name, rows in {"methods": found["rows"], "power": found["sweep"], "method_trees": trees | estimates}.items():
        write_table(folder / f"{name}.csv", rows)
    write_text(folder / "methods.tex", methods_latex(found["rows"]))
    write_table(folder / "ablation.csv", ablation)
    write_text(folder / "ablation.tex", plain_latex(ablation, ABLATION_COLUMNS))
    study.metrics |= {"methods": {key: found[key] for key in ("split", "powers", "sweep", "rows")}}
    study.metrics |= {"ablation": ablation}
    chosen = ", ".join(f"{source} {p:g}" for source, p in powers.items())
    study.blocks += [
        Heading("Methods"),
        Paragraph(
            f"p chosen on {len(split['held_out'])} held-out stems (seed {split['seed']}): {chosen}; figures on the "
            f"other {split['test']}. The paper's figures are of other plots: context, not a comparison."
        ),
        table_of(found["rows"]),
        write_chart(folder, "densities", experiment_charts.draw_densities(errors)),
        write_chart(folder, "trend", experiment_charts.draw_trend(reference.dbh_cm, errors)),
        write_chart(folder, "power", experiment_charts.draw_power(found["sweep"])),
        Heading(f"Ablation ({main}, weighted circle)"),
        table_of(ablation),
    ]
    if "segmentation" in study.metrics:
        scores, runs = study.metrics["segmentation"], _oracle(study, held, powers)
        study.metrics["oracle"] = runs
        write_table(folder / "segmentation.csv", scores)
        write_table(folder / "oracle.csv", runs)
        study.blocks += [Heading("Segmentation"), table_of(scores), Heading("With true labels instead"), table_of(runs)]


def _oracle(study: Study, held: np.ndarray, powers: dict[str, float]) -> list[dict]:
    """The same fits with our labels and with the true ones, on the stems that both gave a figure."""
    rows, true_cm = [], study.reference.dbh_cm
    for source, power in powers.items():
        for fit in ("cylinder", "weighted circle"):
            reads = {
                name: measure(points[source], fit, with_power(power))
                for name, points in (("ours", study.sources), ("oracle", study.oracle))
            }
            both = ~held & np.isfinite(reads["ours"]) & np.isfinite(reads["oracle"])
            for name, read in reads.items():
                found = figures(read, true_cm, both)
                row = {"source": source, "fit": fit, "labels": name, "measured": int(np.isfinite(read).sum())}
                rows.append(
                    {**row, "common": found["n"], **{key: found[key] for key in ("mae_cm", "rmse_cm", "me_cm")}}
                )
    return rows
