"""The published paper's tables and figures, in its order, with these plots' data: one page, and its LaTeX tables.

What these inputs cannot give stands in its place with the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.report.blocks import Block, Document, Heading, Paragraph, Picture, Sentences
from treedgs_geo.report.html import write_html
from treedgs_geo.stems.splats.options import PUBLISHED_STEPS

from . import gallery, point_sets
from . import paper_pictures as pictures
from .sections import ABLATION_COLUMNS, RUNTIME_COLUMNS, methods_latex, plain_latex, table_of, write_text
from .segmentation import LabelledPoints, draw_labels
from .study import Study

Make = Callable[[Study], list[Block] | None]


class Item(NamedTuple):
    """One table or figure. place: in the paper. make: blocks of it, or ``None``; why: where there is none."""

    place: str
    title: str
    make: Make
    why: str = ""


def write_paper(study: Study) -> Path:
    """Write ``paper.html`` and ``paper_tables.tex`` into the folder; returns the page."""
    blocks: list[Block] = [
        Paragraph("Other trees and photos than the paper's: the same questions, not the same answers.")
    ]
    for item in ITEMS:
        blocks.append(Heading(f"{item.place}. {item.title}"))
        blocks += item.make(study) or [Paragraph(f"Not applicable: {item.why}.")]
    names = ", ".join(sorted(set(study.evidence.trees["plot_id"].astype(str))))
    words = f"In the paper's order, with the plots {names} ({study.evidence.reference})."
    path = write_html(study.folder / "paper.html", Document("Tables and figures of the paper", words, blocks))
    write_text(study.folder / "paper_tables.tex", tables_latex(study))
    return path


def plot_summary(trees: pd.DataFrame) -> list[dict[str, Any]]:
    """Reference stems by plot, and all: number, mean, standard deviation and range of DBH."""
    groups = [*trees.groupby("plot_id", sort=True)["reference_cm"], ("All", trees["reference_cm"])]
    return [
        {
            "plot": str(name),
            "trees": len(dbh),
            "mean_cm": float(dbh.mean()),
            "sd_cm": float(dbh.std(ddof=1)) if len(dbh) > 1 else None,
            "low_cm": float(dbh.min()),
            "high_cm": float(dbh.max()),
        }
        for name, dbh in groups
    ]


def tables_latex(study: Study) -> str:
    """The tables with figures, one after the other."""
    metrics, summary = study.metrics, plot_summary(study.evidence.trees)
    parts = [plain_latex(summary, tuple(summary[0]))]
    if "methods" in metrics:
        parts.append(methods_latex(metrics["methods"]["rows"]))
        parts.append(plain_latex(metrics["ablation"], ABLATION_COLUMNS))
    if "segmentation" in metrics:
        columns = ("source", "plot", "precision", "recall", "f1", "iou", "accuracy", "tp", "fp", "fn", "tn")
        parts.append(plain_latex(metrics["segmentation"], columns))
        judged = ("source", "fit", "labels", "common", "mae_cm", "rmse_cm", "me_cm")
        parts.append(plain_latex(metrics["oracle"], judged))
    if study.sets:
        rows = point_sets.table(study.sets)
        parts.append(plain_latex(rows, tuple(rows[0])))
    if "runtime" in metrics:
        parts.append(plain_latex(metrics["runtime"], RUNTIME_COLUMNS))
    return "\n".join(parts)


def _table(name: str) -> Make:
    """A table that the evaluation has made."""
    return lambda study: [table_of(rows)] if (rows := study.metrics.get(name)) else None


def _chart(name: str, asked: str = "methods") -> Make:
    """A chart that the evaluation has drawn."""

    def make(study: Study) -> list[Block] | None:
        path = study.folder / f"{name}.svg"
        return [Picture(name, path.read_bytes())] if asked in study.metrics and path.exists() else None

    return make


def _of_workspace(draw: Callable[..., Any | None], name: str) -> Make:
    """A picture of the first plot with a workspace that gives one."""
    return lambda study: study.first_drawn(study.workspaces, draw, name)


def _overview(study: Study) -> list[Block] | None:
    shown = study.first_drawn(study.gaussians, lambda plot, _: point_sets.draw_overview(plot), "paper_overview")
    return None if shown is None else [*filter(None, map(_how_far, study.gaussians)), *shown]


def _how_far(plot: PlotFiles) -> Paragraph | None:
    """How far the published fit of a plot came; nothing of other Gaussians."""
    assert plot.workspace_in is not None
    stages = read_json(plot.workspace_in / "run.json").get("stages", {})
    fit = stages.get("measure", {}).get("result", {}).get("published_fit")
    if fit is None:
        return None
    return Paragraph(
        f"{plot.name}: {fit['steps']:,} of the {PUBLISHED_STEPS:,} published steps on {fit['photos']} "
        f"photos of {100 * fit['factor']:.0f} % of their size, {fit['gaussians_first']:,} Gaussians grown to "
        f"{fit['gaussians']:,}."
    )


def _beside_samples(other: str, name: str) -> Make:
    """The picture of another way from Gaussians to points beside the samples, and the table of all three."""

    def make(study: Study) -> list[Block] | None:
        shown = study.chart(name, point_sets.draw_pair(study.sets, other))
        if shown is None:
            return None
        stems = "; ".join(f"{sets.plot} {', '.join(sets.stems)}" for sets in study.sets)
        words = Paragraph(
            f"Points within {pictures.NEAR_M:g} m of up to {point_sets.COMPARED} stems a plot, evenly over the "
            f"diameters ({stems}), {pictures.STEM_M[0]:g} to {pictures.STEM_M[1]:g} m above the ground, "
            "before any segmentation; covered height: 10 cm steps that hold a point."
        )
        return [words, table_of(point_sets.table(study.sets)), *shown]

    return make


def _matching(study: Study) -> list[Block] | None:
    pairs = [pictures.matched(plot, ref) for plot, ref in zip(study.plots, study.references, strict=True)]
    away = np.concatenate([np.linalg.norm(measured - field, axis=1) for field, measured in pairs])
    if not len(away):
        return None
    text = f"Paired: {len(away)}; mean planimetric offset {away.mean():.3f} m, largest {away.max():.3f} m."
    figure = pictures.draw_matching(study.plots, study.references, pairs)
    return [Paragraph(text), *(study.chart("paper_matching", figure) or ())]


def _density(study: Study) -> list[Block] | None:
    sets: dict[str, list[np.ndarray]] = {}
    if study.workspaces:
        near = [pictures.sparse_near(plot, study.reference_of(plot)) for plot in study.plots]
        sets["SfM points"] = [own for part in near for own in part]
    for name, stems in study.sources.items():
        sets[f"{name}, segmented"] = [np.empty((0, 3)) if own is None else own[0] for own in stems]
    if not any(len(own) for stems in sets.values() for own in stems):
        return None
    rows = []
    for name, own in sets.items():
        counts = [len(points) for points in own if len(points)]
        row = {"points": name, "stems with any": len(counts), "of": len(own)}
        rows.append({**row, "median of these": round(float(np.median(counts or [0]))), "in all": sum(counts)})
    shown = study.chart("paper_density", pictures.draw_density(sets, study.reference))
    return [table_of(rows), *(shown or ())]


def _visibility(study: Study) -> list[Block] | None:
    chart = _chart("visibility", "visibility")(study)
    return None if chart is None else [table_of(study.metrics["visibility"]["correlations"]), *chart]


def _methods(study: Study) -> list[Block] | None:
    found = study.metrics.get("methods")
    if found is None:
        return None
    split = found["split"]
    said = Paragraph(f"{split['test']} stems tested, {len(split['held_out'])} held out for p.")
    rows = [{k: v for k, v in row.items() if k != "subset"} for row in found["rows"] if row["subset"] == "own"]
    return [said, table_of(rows)]


def _labels(study: Study) -> list[Block] | None:
    picture = study.chart("paper_segmentation", draw_labels(study.labelled)) or []
    whose = Sentences([f"{own.plot}, {own.source}: {_labeller(own, study.plots)}." for own in study.labelled])
    if rows := study.metrics.get("segmentation"):
        return [Paragraph("Whose labels are scored:"), whose, table_of(rows), *picture]
    said = Paragraph("No true labels, so nothing is scored. Whose labels are shown:")
    return [said, whose, *picture] if picture else None


def _labeller(cloud: LabelledPoints, plots: list[PlotFiles]) -> str:
    """Whose labels a cloud's are."""
    if cloud.source == "lidar":
        return "stems found in the cloud, or its own tree_id"
    plot = next(plot for plot in plots if plot.name == cloud.plot)
    whole = "" if cloud.whole else "; the file holds stem points only, so recall and what needs it are not known"
    named = "tree_id of the file" if plot.workspace_in is None else "found in the surface points by our own segmenter"
    return named + whole


def _gallery(study: Study) -> list[Block] | None:
    """Slices of stems that were and were not measured, one picture a source, and evidence sheets."""
    parts: list[Block] = []
    methods: dict[str, Any] = study.metrics.get("methods", {})
    path = study.folder / "visibility.csv"
    seen = pd.read_csv(path) if "visibility" in study.metrics and path.exists() else None
    for source, power in methods["powers"].items() if methods else ():
        fits = gallery.fitted_stems(study.sources[source], power)
        picture = gallery.draw_fits(source, gallery.chosen(fits, study.reference), study.reference, seen)
        if shown := study.chart(f"paper_gallery_{source}", picture):
            words = f"{sum(np.isfinite(fit.dbh_cm) for fit in fits)} of {len(fits)} stems have a diameter"
            parts += [Heading(f"Weighted circles, {source}: {words}", 3), *shown]
    for plot in study.workspaces:
        parts += gallery.sheets(plot, study.reference_of(plot))
    return parts or None


#: Why a picture of Gaussians may be missing.
NO_GAUSSIANS = (
    "no workspace of photos-to-dbh with Gaussians (--preset paper, --fit gaussians) is given, none of them is near a "
    "reference stem, or the package torch is not installed"
)
#: Why a stem's photos may be missing.
NO_STEM = (
    "no workspace of photos-to-dbh is given, or none has a diameter at a reference stem that some photos show free at "
    "breast height"
)
#: In the order of the paper.
ITEMS = (
    Item("Figure 1", "Overview (errors: Figure 11)", _overview, NO_GAUSSIANS),
    Item("Figure 2", "A stem in distant photos", _of_workspace(pictures.draw_pixels, "paper_pixels"), NO_STEM),
    Item("Table 1", "Plots and their trees", lambda study: [table_of(plot_summary(study.evidence.trees))]),
    Item("Figure 3", "Plot layout", lambda study: study.chart("paper_plots", pictures.draw_layout(study.references))),
    Item(
        "Figure 4",
        "Flight pattern",
        lambda study: study.chart("paper_flight", pictures.draw_flight(study.workspaces)) if study.workspaces else None,
        "no workspace of photos-to-dbh is given",
    ),
    Item("Figure 5", "Field and measured stems, paired", _matching, "no stem was paired"),
    Item(
        "Figure 6",
        "The pipeline: opacity, views, segmented stem",
        lambda study: study.first_drawn(study.gaussians, point_sets.draw_pipeline, "paper_pipeline"),
        NO_GAUSSIANS,
    ),
    Item(
        "Figure 7",
        "Depth fusion beside surface samples",
        _beside_samples(point_sets.DEPTH, "paper_depth_fusion"),
        NO_GAUSSIANS,
    ),
    Item(
        "Figure 8",
        "Intensity and opacity as reliability",
        lambda study: study.chart("paper_reliability", pictures.draw_reliability(study.sources, study.reference)),
        "no cloud shows breast height of a stem",
    ),
    Item("Figure 9", "Points of each source", _density, "neither a workspace nor a cloud is given"),
    Item("Figure 10", "Choice of the exponent p", _chart("power"), "no cloud is given"),
    Item("Tables 2 and 3", "Accuracy by plot and method", _methods, "no cloud is given"),
    Item("Figure 11", "Distribution of the errors", _chart("densities"), "no cloud is given"),
    Item("Figure 12", "Error over DBH", _chart("trend"), "no cloud is given"),
    Item("Figure 13", "Error over visibility", _visibility, "no workspace of photos-to-dbh is given"),
    Item(
        "Figure 14", "Breast height called free and hidden", _of_workspace(pictures.draw_bands, "paper_bands"), NO_STEM
    ),
    Item(
        "Figure 15",
        "Means alone beside surface samples",
        _beside_samples(point_sets.MEANS, "paper_means_only"),
        NO_GAUSSIANS,
    ),
    Item("Table 4", "Ablation", _table("ablation"), "no cloud is given"),
    Item("Figure 16 and Table 5", "Segmentation", _labels, "no cloud is given"),
    Item(
        "Table 6",
        "With true labels instead",
        _table("oracle"),
        "it needs a cloud and the true stems of a simulated plot",
    ),
    Item("Table 7", "Runtime", _table("runtime"), "no workspace of photos-to-dbh is given"),
    Item("Figure 17", "Successes and failures", _gallery, "neither a cloud nor a workspace with sheets is given"),
)
