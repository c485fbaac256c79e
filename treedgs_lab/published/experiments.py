"""The rest of an Experiments section: methods, ablation, segmentation, visibility, runtime; over one plot or many."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles, pooled_reference
from treedgs_geo.inventory.accuracy.reference import Reference
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.report.blocks import Block, Heading, Paragraph
from treedgs_geo.report.charts import write_chart
from treedgs_geo.stems.cloud.estimate.published import PublishedOptions
from treedgs_geo.stems.geometry.circles import SolidCircle
from treedgs_geo.stems.quality.priors import BREAST_HEIGHT_M
from treedgs_geo.terrain.dtm import Dtm, read_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud

from . import experiment_charts
from .labelled import LabelledPoints
from .methods import WEIGHTS, StemPoints, ablate, choose_power, compare_methods, measure, stem_points
from .photo_experiments import photo_experiments
from .sections import methods_latex, plain_latex, table_of, write_table, write_text
from .segmentation import score_segmentation, true_labels


@dataclass(frozen=True)
class ExperimentOptions:
    """share, seed: of the held-out stems. bh_m: breast height."""

    share: float = 0.1
    seed: int = 0
    bh_m: float = BREAST_HEIGHT_M


@dataclass(frozen=True)
class Experiments:
    """found: for ``metrics.json``. section: blocks of the page. references: stems of known DBH, plot by plot.
    sources: source -> segmented points of all of them. labelled: points about the stems with the stem that each was
    given."""

    found: dict[str, Any]
    section: list[Block]
    references: list[Reference]
    sources: dict[str, StemPoints]
    labelled: list[LabelledPoints]


def run_experiments(
    plots: list[PlotFiles], options: ExperimentOptions, folder: Path, reporter: Reporter
) -> Experiments:
    """Write tables (CSV, LaTeX) and charts (SVG, PNG) into ``folder``. The stems of all plots are judged together, and
    plot by plot.

    Raises:
        InputError: a cloud without the attribute that its weights need, or no workspace where one is named.
    """
    found: dict[str, Any] = {}
    parts: list[Block] = []
    references = [plot.reference() for plot in plots]
    sources: dict[str, StemPoints] = {}
    labelled: list[LabelledPoints] = []
    if any(plot.lidar or plot.splats for plot in plots):
        with reporter.stage("methods", 0.0, 0.6):
            gathered = _gather(plots, references, reporter)
            sources, labelled = gathered.sources, gathered.labelled
            found |= _methods(gathered, pooled_reference(references), options, folder, parts)
    seen = [(plot, ref) for plot, ref in zip(plots, references, strict=True) if plot.workspace_in is not None]
    if seen:
        with reporter.stage("visibility and runtime", 0.6, 1.0):
            found |= photo_experiments(seen, folder, parts, reporter)
    return Experiments(found, parts, references, sources, labelled)


@dataclass(frozen=True)
class _Gathered:
    """Of each source: the segmented points of all reference stems, the same with true labels, segmentation scores
    (``source, plot, ...``), and the points that were scored."""

    sources: dict[str, StemPoints]
    oracle: dict[str, StemPoints]
    scores: list[dict[str, Any]]
    labelled: list[LabelledPoints]


def _gather(plots: list[PlotFiles], references: list[Reference], reporter: Reporter) -> _Gathered:
    """Read every cloud once, plot by plot. Stems of plots without a source count as not found there; true labels are
    used only where every plot has them."""
    names = [name for name in WEIGHTS if any(getattr(plot, name) for plot in plots)]
    labelled = all(plot.truth is not None and plot.truth.with_name("stems.json").exists() for plot in plots)
    sources: dict[str, list[StemPoints]] = {name: [] for name in names}
    oracle: dict[str, list[StemPoints]] = {name: [] for name in names}
    scores: list[dict[str, Any]] = []
    shown: list[LabelledPoints] = []
    for number, (plot, reference) in enumerate(zip(plots, references, strict=True)):
        reporter.progress(number / len(plots))
        for name in names:
            nothing = StemPoints([None] * len(reference), [None] * len(reference))
            path = getattr(plot, name)
            if path is None:
                sources[name].append(nothing)
                oracle[name].append(nothing)
                continue
            cloud, dtm, label = _segmented(path, plot.dtm, name)
            sources[name].append(stem_points(cloud, label, dtm, reference, WEIGHTS[name]))
            height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
            band = _near(cloud, reference) & (height > 0.3) & (height < 5.0)
            place = np.column_stack([cloud.xyz[band, :2], height[band]])
            whole = bool((label <= 0).any())
            if not labelled:
                shown.append(LabelledPoints.thinned(name, plot.name, place, label[band], None, whole))
                continue
            assert plot.truth is not None
            true, _ = true_labels(cloud.xyz, plot.truth.with_name("stems.json"))
            shown.append(LabelledPoints.thinned(name, plot.name, place, label[band], true[band], whole))
            scores.append({"source": name, "plot": plot.name, **score_segmentation(label[band], true[band], whole)})
            oracle[name].append(stem_points(cloud, true, dtm, reference, WEIGHTS[name]))
    return _Gathered(_joined(sources), _joined(oracle) if labelled else {}, scores, shown)


def _joined(parts: dict[str, list[StemPoints]]) -> dict[str, StemPoints]:
    return {
        name: StemPoints([p for part in own for p in part.points], [w for part in own for w in part.weights])
        for name, own in parts.items()
    }


def _methods(
    gathered: _Gathered, reference: Reference, options: ExperimentOptions, folder: Path, parts: list[Block]
) -> dict[str, Any]:
    sources = gathered.sources
    found = compare_methods(sources, reference, options.share, options.seed, options.bh_m)
    names = [f"{p}/{t}" for p, t in zip(reference.plot, reference.tree, strict=True)]
    held = np.isin(names, found["split"]["held_out"])
    errors = {name: np.where(held, np.nan, read - reference.dbh_cm) for name, read in found["estimates"].items()}
    _method_tables(folder, found, reference, held)
    main = "splats" if "splats" in sources else "lidar"
    ablation = ablate(sources[main], reference, held, found["powers"][main], options.bh_m, options.seed)
    write_table(folder / "ablation.csv", ablation)
    write_text(folder / "ablation.tex", plain_latex(ablation, ("setting", "value", "n", "mae_cm", "rmse_cm", "me_cm")))
    split = found["split"]
    powers = ", ".join(f"{source} {p:g}" for source, p in found["powers"].items())
    parts += [
        Heading("Methods"),
        Paragraph(
            f"p chosen on {len(split['held_out'])} held-out stems (seed {split['seed']}): {powers}; figures on the "
            f"other {split['test']}. The paper's figures are of other plots: context, not a comparison."
        ),
        table_of(found["rows"]),
        write_chart(folder, "densities", experiment_charts.draw_densities(errors)),
        write_chart(folder, "trend", experiment_charts.draw_trend(reference.dbh_cm, errors)),
        write_chart(folder, "power", experiment_charts.draw_power(found["sweep"])),
        Heading(f"Ablation ({main}, weighted circle)"),
        table_of(ablation),
    ]
    result = {"methods": {key: found[key] for key in ("split", "powers", "sweep", "rows")}, "ablation": ablation}
    if gathered.scores:
        runs = _oracle(sources, gathered.oracle, reference, held, options)
        write_table(folder / "segmentation.csv", gathered.scores)
        write_table(folder / "oracle.csv", runs)
        result |= {"segmentation": gathered.scores, "oracle": runs}
        parts += [
            Heading("Segmentation"),
            table_of(gathered.scores),
            Heading("With true labels instead"),
            table_of(runs),
        ]
    return result


def _method_tables(folder: Path, found: dict[str, Any], reference: Reference, held: np.ndarray) -> None:
    write_table(folder / "methods.csv", found["rows"])
    write_table(folder / "power.csv", found["sweep"])
    write_table(
        folder / "method_trees.csv",
        [
            {
                "plot_id": p,
                "tree_id": t,
                "reference_cm": d,
                "held_out": bool(h),
                **{name: read[k] for name, read in found["estimates"].items()},
            }
            for k, (p, t, d, h) in enumerate(zip(reference.plot, reference.tree, reference.dbh_cm, held, strict=True))
        ],
    )
    write_text(folder / "methods.tex", methods_latex(found["rows"]))


def _segmented(path: Path, dtm_file: Path | None, name: str) -> tuple[PointCloud, Dtm, np.ndarray]:
    cloud = read_cloud(path)
    dtm = read_dtm(dtm_file, cloud.horizontal_crs) if dtm_file else dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs)
    if "tree_id" in cloud.attributes:
        return cloud, dtm, np.asarray(cloud.attributes["tree_id"]).astype(int)
    if name == "splats":
        raise InputError(f"{path}: has no tree_id; give the surface.laz of a workspace (photos-to-dbh --preset paper).")
    from treedgs_geo.stems.cloud.propose.segment import find_stems, label_points

    stems = find_stems(cloud, dtm)
    height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    return cloud, dtm, label_points(cloud.xyz, height, stems)


def _near(cloud: PointCloud, reference: Reference) -> np.ndarray:
    from scipy.spatial import cKDTree

    return cKDTree(reference.xy).query(cloud.xyz[:, :2], distance_upper_bound=1.5)[0] < 1.5


def _oracle(
    sources: dict[str, StemPoints],
    oracle: dict[str, StemPoints],
    reference: Reference,
    held: np.ndarray,
    options: ExperimentOptions,
) -> list[dict]:
    """The same fits with our labels and with the true ones, on the stems that both gave a figure."""
    rows = []
    for source in sources:
        power, _ = choose_power(sources[source], reference, held, "weighted circle", options.bh_m, options.seed)
        published = PublishedOptions(circle=SolidCircle(power=power))
        for fit in ("cylinder", "weighted circle"):
            reads = {
                name: measure(points[source], fit, published, options.bh_m, options.seed)
                for name, points in (("ours", sources), ("oracle", oracle))
            }
            both = ~held & np.isfinite(reads["ours"]) & np.isfinite(reads["oracle"])
            for name, read in reads.items():
                error = (read - reference.dbh_cm)[both]
                rows.append(
                    {
                        "source": source,
                        "fit": fit,
                        "labels": name,
                        "measured": int(np.isfinite(read).sum()),
                        "common": int(both.sum()),
                        "mae_cm": float(np.abs(error).mean()) if len(error) else None,
                        "rmse_cm": float(np.sqrt((error**2).mean())) if len(error) else None,
                        "me_cm": float(error.mean()) if len(error) else None,
                    }
                )
    return rows
