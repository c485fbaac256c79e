"""The published paper's tables and figures, in its order, with these plots' data: one page, and its LaTeX tables.

What these inputs cannot give stands in its place with the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles, pooled_reference
from treedgs_geo.report.blocks import Block, Document, Heading, Paragraph, Picture, Sentences
from treedgs_geo.report.charts import write_chart
from treedgs_geo.report.html import write_html
from treedgs_geo.stems.splats.options import PUBLISHED_STEPS

from . import gallery, overview, point_sets
from . import paper_pictures as pictures
from .labelled import LabelledPoints, draw_labels
from .paper_inputs import PaperInputs
from .sections import methods_latex, plain_latex, table_of, write_text


@dataclass(frozen=True)
class Item:
    """One table or figure. place: in the paper. make: blocks of it, or ``None``; why: where there is none."""

    place: str
    title: str
    make: Callable[[PaperInputs], list[Block] | None]
    why: str


def write_paper(inputs: PaperInputs) -> Path:
    """Write ``paper.html`` and ``paper_tables.tex`` into the folder; returns the page."""
    blocks: list[Block] = [
        Paragraph("Other trees and photos than the paper's: the same questions, not the same answers.")
    ]
    for item in ITEMS:
        blocks.append(Heading(f"{item.place}. {item.title}"))
        blocks += item.make(inputs) or [Paragraph(f"Not applicable: {item.why}.")]
    names = ", ".join(sorted(set(inputs.evidence.trees["plot_id"].astype(str))))
    words = f"In the paper's order, with the plots {names} ({inputs.evidence.reference})."
    path = write_html(inputs.folder / "paper.html", Document("Tables and figures of the paper", words, blocks))
    write_text(inputs.folder / "paper_tables.tex", tables_latex(inputs))
    return path


def plot_summary(trees: pd.DataFrame) -> list[dict[str, Any]]:
    """Reference stems by plot, and all: number, mean, standard deviation and range of DBH."""
    groups = [(str(name), part) for name, part in trees.groupby("plot_id", sort=True)]
    rows = []
    for name, part in [*groups, ("All", trees)]:
        dbh = part["reference_cm"]
        rows.append(
            {
                "plot": name,
                "trees": len(part),
                "mean_cm": float(dbh.mean()),
                "sd_cm": float(dbh.std(ddof=1)) if len(part) > 1 else None,
                "low_cm": float(dbh.min()),
                "high_cm": float(dbh.max()),
            }
        )
    return rows


def tables_latex(inputs: PaperInputs) -> str:
    """The tables with figures, one after the other."""
    metrics = inputs.metrics
    parts = [
        plain_latex(plot_summary(inputs.evidence.trees), ("plot", "trees", "mean_cm", "sd_cm", "low_cm", "high_cm"))
    ]
    if "methods" in metrics:
        parts.append(methods_latex(metrics["methods"]["rows"]))
        parts.append(plain_latex(metrics["ablation"], ("setting", "value", "n", "mae_cm", "rmse_cm", "me_cm")))
    if "segmentation" in metrics:
        columns = ("source", "plot", "precision", "recall", "f1", "iou", "accuracy", "tp", "fp", "fn", "tn")
        parts.append(plain_latex(metrics["segmentation"], columns))
        parts.append(
            plain_latex(metrics["oracle"], ("source", "fit", "labels", "common", "mae_cm", "rmse_cm", "me_cm"))
        )
    if inputs.sets:
        rows = point_sets.table(inputs.sets)
        parts.append(plain_latex(rows, tuple(rows[0])))
    if "runtime" in metrics:
        parts.append(plain_latex(metrics["runtime"], ("plot", "stage", "seconds", "peak_memory_mb")))
    return "\n".join(parts)


def _overview(inputs: PaperInputs) -> list[Block] | None:
    shown = inputs.first_drawn(inputs.gaussians, overview.draw_overview, "paper_overview")
    return None if shown is None else [*filter(None, map(_how_far, inputs.gaussians)), *shown]


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


def _pipeline(inputs: PaperInputs) -> list[Block] | None:
    return inputs.first_drawn(
        inputs.gaussians,
        lambda plot: overview.draw_pipeline(plot, inputs.reference_of(plot)),
        "paper_pipeline",
    )


def _beside_samples(other: str, name: str) -> Callable[[PaperInputs], list[Block] | None]:
    """The picture of another way from Gaussians to points beside the samples, and the table of all three."""

    def make(inputs: PaperInputs) -> list[Block] | None:
        found = point_sets.draw_pair(inputs.sets, other)
        if found is None:
            return None
        stems = "; ".join(f"{sets.plot} {', '.join(sets.stems)}" for sets in inputs.sets)
        words = Paragraph(
            f"Points within {pictures.NEAR_M:g} m of up to {point_sets.COMPARED} stems a plot, evenly over the "
            f"diameters ({stems}), {pictures.STEM_M[0]:g} to {pictures.STEM_M[1]:g} m above the ground, "
            "before any segmentation; covered height: 10 cm steps that hold a point."
        )
        return [words, table_of(point_sets.table(inputs.sets)), write_chart(inputs.folder, name, found)]

    return make


def _summary(inputs: PaperInputs) -> list[Block]:
    return [table_of(plot_summary(inputs.evidence.trees))]


def _layout(inputs: PaperInputs) -> list[Block]:
    return [write_chart(inputs.folder, "paper_plots", pictures.draw_layout(inputs.references))]


def _flight(inputs: PaperInputs) -> list[Block] | None:
    plots = inputs.workspaces
    return [write_chart(inputs.folder, "paper_flight", pictures.draw_flight(plots))] if plots else None


def _pixels(inputs: PaperInputs) -> list[Block] | None:
    return inputs.first_drawn(
        inputs.workspaces,
        lambda plot: pictures.draw_pixels(plot, inputs.reference_of(plot)),
        "paper_pixels",
    )


def _matching(inputs: PaperInputs) -> list[Block] | None:
    pairs = [pictures.matched(plot, ref) for plot, ref in zip(inputs.plots, inputs.references, strict=True)]
    away = np.concatenate([np.linalg.norm(measured - field, axis=1) for field, measured in pairs])
    if not len(away):
        return None
    text = f"Paired: {len(away)}; mean planimetric offset {away.mean():.3f} m, largest {away.max():.3f} m."
    figure = pictures.draw_matching(inputs.plots, inputs.references, pairs)
    return [Paragraph(text), write_chart(inputs.folder, "paper_matching", figure)]


def _sources(inputs: PaperInputs) -> list[Block] | None:
    if not inputs.gathered:
        return None
    found = pictures.draw_reliability(inputs.gathered, pooled_reference(inputs.references))
    return None if found is None else [write_chart(inputs.folder, "paper_reliability", found)]


def _density(inputs: PaperInputs) -> list[Block] | None:
    sets: dict[str, list[np.ndarray]] = {}
    if inputs.workspaces:
        near = [pictures.sparse_near(plot, inputs.reference_of(plot)) for plot in inputs.plots]
        sets["SfM points"] = [own for part in near for own in part]
    for name, stems in inputs.gathered.items():
        sets[f"{name}, segmented"] = [np.empty((0, 3)) if own is None else own for own in stems.points]
    if not any(len(own) for stems in sets.values() for own in stems):
        return None
    rows = [
        {
            "points": name,
            "stems with any": sum(len(own) > 0 for own in sets[name]),
            "of": len(sets[name]),
            "median of these": round(float(np.median([len(own) for own in sets[name] if len(own)] or [0]))),
            "in all": int(sum(len(own) for own in sets[name])),
        }
        for name in sets
    ]
    figure = pictures.draw_density(sets, pooled_reference(inputs.references))
    return [table_of(rows), write_chart(inputs.folder, "paper_density", figure)]


def _chart(name: str) -> Callable[[PaperInputs], list[Block] | None]:
    """A chart that the evaluation has drawn."""

    def make(inputs: PaperInputs) -> list[Block] | None:
        path = inputs.folder / f"{name}.svg"
        asked = {"visibility": "visibility"}.get(name, "methods")
        return [Picture(name, path.read_bytes())] if asked in inputs.metrics and path.exists() else None

    return make


def _visibility(inputs: PaperInputs) -> list[Block] | None:
    chart = _chart("visibility")(inputs)
    return None if chart is None else [table_of(inputs.metrics["visibility"]["correlations"]), *chart]


def _methods(inputs: PaperInputs) -> list[Block] | None:
    found = inputs.metrics.get("methods")
    if found is None:
        return None
    split = found["split"]
    said = Paragraph(f"{split['test']} stems tested, {len(split['held_out'])} held out for p.")
    rows = [{k: v for k, v in row.items() if k != "subset"} for row in found["rows"] if row["subset"] == "own"]
    return [said, table_of(rows)]


def _bands(inputs: PaperInputs) -> list[Block] | None:
    return inputs.first_drawn(
        inputs.workspaces, lambda plot: pictures.draw_bands(plot, inputs.reference_of(plot)), "paper_bands"
    )


def _ablation(inputs: PaperInputs) -> list[Block] | None:
    return [table_of(inputs.metrics["ablation"])] if "ablation" in inputs.metrics else None


def _labels(inputs: PaperInputs) -> list[Block] | None:
    rows = inputs.metrics.get("segmentation")
    if not rows:
        picture = _label_picture(inputs)
        said = Paragraph("No true labels, so nothing is scored. Whose labels are shown:")
        return [said, _whose(inputs), *picture] if picture else None
    return [Paragraph("Whose labels are scored:"), _whose(inputs), table_of(rows), *_label_picture(inputs)]


def _whose(inputs: PaperInputs) -> Sentences:
    """Whose labels each source's are, by plot."""
    return Sentences([f"{own.plot}, {own.source}: {_labeller(own, inputs.plots)}." for own in inputs.labelled])


def _labeller(cloud: LabelledPoints, plots: list[PlotFiles]) -> str:
    if cloud.source == "lidar":
        return "stems found in the cloud, or its own tree_id"
    plot = next(plot for plot in plots if plot.name == cloud.plot)
    asked = {} if plot.workspace_in is None else read_json(plot.workspace_in / "run.json").get("parameters", {})
    if asked.get("preset") == "paper":
        found = f"found in the surface points by --segmenter {asked.get('segmenter', 'own')}"
    else:
        found = (
            "tree_id of the file (of a run without --preset paper: stems found in the photos, nothing segmented anew)"
        )
    return found + (
        "" if cloud.whole else "; the file holds stem points only, so recall and what needs it are not known"
    )


def _label_picture(inputs: PaperInputs) -> list[Block]:
    found = draw_labels(inputs.labelled)
    return [] if found is None else [write_chart(inputs.folder, "paper_segmentation", found)]


def _oracle(inputs: PaperInputs) -> list[Block] | None:
    return [table_of(inputs.metrics["oracle"])] if inputs.metrics.get("oracle") else None


def _runtime(inputs: PaperInputs) -> list[Block] | None:
    return [table_of(inputs.metrics["runtime"])] if inputs.metrics.get("runtime") else None


def _gallery(inputs: PaperInputs) -> list[Block] | None:
    found = [gallery.sheets(plot, ref) for plot, ref in zip(inputs.plots, inputs.references, strict=True)]
    shown = [sheet for own in found for sheet in own]
    return [*_slices(inputs), *shown] or None


def _slices(inputs: PaperInputs) -> list[Block]:
    """Slices of stems that were and were not measured, one picture a source."""
    methods, reference = inputs.metrics.get("methods"), pooled_reference(inputs.references)
    if methods is None:
        return []
    path = inputs.folder / "visibility.csv"
    seen = pd.read_csv(path) if "visibility" in inputs.metrics and path.exists() else None
    parts: list[Block] = []
    for source, stems in inputs.gathered.items():
        fits = gallery.fitted_stems(stems, reference, methods["powers"][source], methods["split"]["seed"])
        picture = gallery.draw_fits(source, gallery.chosen(fits, reference), reference, seen)
        if picture is not None:
            words = f"{sum(np.isfinite(fit.dbh_cm) for fit in fits)} of {len(fits)} stems have a diameter"
            parts.append(Heading(f"Weighted circles, {source}: {words}", 3))
            parts.append(write_chart(inputs.folder, f"paper_gallery_{source}", picture))
    return parts


#: Why a picture of Gaussians may be missing.
NO_GAUSSIANS = (
    "no workspace of photos-to-dbh with Gaussians (--preset paper, --fit gaussians) is given, or none "
    "of them is near a reference stem"
)
#: Why a stem's photos may be missing.
NO_STEM = (
    "no workspace of photos-to-dbh is given, or none has a diameter at a reference stem that some photos show free at "
    "breast height"
)
#: In the order of the paper.
ITEMS = (
    Item("Figure 1", "Overview (errors: Figure 11)", _overview, NO_GAUSSIANS),
    Item("Figure 2", "A stem in distant photos", _pixels, NO_STEM),
    Item("Table 1", "Plots and their trees", _summary, ""),
    Item("Figure 3", "Plot layout", _layout, ""),
    Item("Figure 4", "Flight pattern", _flight, "no workspace of photos-to-dbh is given"),
    Item("Figure 5", "Field and measured stems, paired", _matching, "no stem was paired"),
    Item("Figure 6", "The pipeline: opacity, views, segmented stem", _pipeline, NO_GAUSSIANS),
    Item(
        "Figure 7",
        "Depth fusion beside surface samples",
        _beside_samples(point_sets.DEPTH, "paper_depth_fusion"),
        NO_GAUSSIANS,
    ),
    Item("Figure 8", "Intensity and opacity as reliability", _sources, "no cloud shows breast height of a stem"),
    Item("Figure 9", "Points of each source", _density, "neither a workspace nor a cloud is given"),
    Item("Figure 10", "Choice of the exponent p", _chart("power"), "no cloud is given"),
    Item("Tables 2 and 3", "Accuracy by plot and method", _methods, "no cloud is given"),
    Item("Figure 11", "Distribution of the errors", _chart("densities"), "no cloud is given"),
    Item("Figure 12", "Error over DBH", _chart("trend"), "no cloud is given"),
    Item("Figure 13", "Error over visibility", _visibility, "no workspace of photos-to-dbh is given"),
    Item("Figure 14", "Breast height called free and hidden", _bands, NO_STEM),
    Item(
        "Figure 15",
        "Means alone beside surface samples",
        _beside_samples(point_sets.MEANS, "paper_means_only"),
        NO_GAUSSIANS,
    ),
    Item("Table 4", "Ablation", _ablation, "no cloud is given"),
    Item(
        "Figure 16 and Table 5",
        "Segmentation",
        _labels,
        "no cloud is given",
    ),
    Item("Table 6", "With true labels instead", _oracle, "it needs a cloud and the true stems of a simulated plot"),
    Item("Table 7", "Runtime", _runtime, "no workspace of photos-to-dbh is given"),
    Item(
        "Figure 17",
        "Successes and failures",
        _gallery,
        "neither a cloud nor a workspace with evidence sheets is given",
    ),
)
