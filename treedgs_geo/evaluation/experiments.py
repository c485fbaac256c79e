"""The rest of an Experiments section: methods, ablation, segmentation, visibility, runtime."""

from __future__ import annotations

import html
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..core.errors import InputError
from ..core.files import atomic_path, read_json
from ..core.progress import Reporter
from ..core.tables import safe_frame
from ..inventory.tree_reading import read_trees
from ..pointcloud.cloud import PointCloud
from ..pointcloud.files import read_cloud
from ..terrain.dtm import Dtm, read_dtm
from ..terrain.ground import dtm_from_cloud
from ..trees.priors import BREAST_HEIGHT_M
from . import charts, experiment_charts
from .methods import (
    WEIGHTS,
    Reference,
    StemPoints,
    ablate,
    choose_power,
    compare_methods,
    measure,
    stem_points,
)
from .segmentation import score_segmentation, true_labels
from .visibility import Stem, agreement, classify, per_stem


@dataclass(frozen=True)
class ExperimentInputs:
    """lidar, splats: clouds (with ``tree_id`` they count as segmented). dtm: terrain. workspace: of photos-to-dbh, for
    visibility and runtime. truth: ``truth/trees.csv`` of a simulated plot. share, seed: of the held-out stems."""

    lidar: Path | None = None
    splats: Path | None = None
    dtm: Path | None = None
    workspace: Path | None = None
    truth: Path | None = None
    share: float = 0.1
    seed: int = 0
    bh_m: float = BREAST_HEIGHT_M


def run_experiments(
    inputs: ExperimentInputs, reference: Reference, folder: Path, reporter: Reporter
) -> tuple[dict[str, Any], str]:
    """Write tables (CSV, LaTeX) and charts (SVG, PNG) into ``folder``; returns what belongs in ``metrics.json`` and the
    sections for the page.

    Raises:
        InputError: a cloud without the attribute that its weights need, or no workspace where one is named.
    """
    found: dict[str, Any] = {}
    parts: list[str] = []
    clouds = {name: path for name, path in (("lidar", inputs.lidar), ("splats", inputs.splats)) if path is not None}
    if clouds:
        with reporter.stage("methods", 0.0, 0.6):
            found |= _methods(clouds, inputs, reference, folder, parts)
    if inputs.workspace is not None:
        with reporter.stage("visibility and runtime", 0.6, 1.0):
            found |= _workspace(inputs, reference, folder, parts)
    return found, "".join(parts)


def _methods(
    clouds: dict[str, Path], inputs: ExperimentInputs, reference: Reference, folder: Path, parts: list[str]
) -> dict[str, Any]:
    sources: dict[str, StemPoints] = {}
    oracle: dict[str, StemPoints] = {}
    scores: dict[str, dict] = {}
    for name, path in clouds.items():
        cloud, dtm, label = _segmented(path, inputs.dtm, name)
        sources[name] = stem_points(cloud, label, dtm, reference, WEIGHTS[name])
        if inputs.truth is not None and inputs.truth.with_name("stems.json").exists():
            true, _ = true_labels(cloud.xyz, inputs.truth.with_name("stems.json"))
            height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
            band = _near(cloud, reference) & (height > 0.3) & (height < 5.0)
            scores[name] = score_segmentation(label[band], true[band])
            oracle[name] = stem_points(cloud, true, dtm, reference, WEIGHTS[name])
    found = compare_methods(sources, reference, inputs.share, inputs.seed, inputs.bh_m)
    held = np.isin(
        [f"{p}/{t}" for p, t in zip(reference.plot, reference.tree, strict=True)], found["split"]["held_out"]
    )
    errors = {name: np.where(held, np.nan, read - reference.dbh_cm) for name, read in found["estimates"].items()}
    _table(folder / "methods.csv", found["rows"])
    _table(folder / "power.csv", found["sweep"])
    _table(
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
    _text(folder / "methods.tex", methods_latex(found["rows"]))
    main = "splats" if "splats" in sources else "lidar"
    ablation = ablate(sources[main], reference, held, found["powers"][main], inputs.bh_m, inputs.seed)
    _table(folder / "ablation.csv", ablation)
    _text(folder / "ablation.tex", plain_latex(ablation, ("setting", "value", "n", "mae_cm", "rmse_cm", "me_cm")))
    drawn = [
        _draw(folder, "densities", experiment_charts.draw_densities(errors)),
        _draw(folder, "trend", experiment_charts.draw_trend(reference.dbh_cm, errors)),
        _draw(folder, "power", experiment_charts.draw_power(found["sweep"])),
    ]
    split = found["split"]
    parts.append(
        "<h2>Methods</h2><p>p chosen on "
        f"{len(split['held_out'])} held-out stems (seed {split['seed']}): "
        + ", ".join(f"{source} {p:g}" for source, p in found["powers"].items())
        + f"; figures on the other {split['test']}. The paper's figures are of other plots: context, not a "
        "comparison.</p>" + _html(found["rows"]) + "".join(drawn)
    )
    parts.append(f"<h2>Ablation ({main}, weighted circle)</h2>" + _html(ablation))
    result = {"methods": {key: found[key] for key in ("split", "powers", "sweep", "rows")}, "ablation": ablation}
    if scores:
        runs = _oracle(sources, oracle, reference, held, inputs)
        _table(folder / "segmentation.csv", [{"source": name, **row} for name, row in scores.items()])
        _table(folder / "oracle.csv", runs)
        result |= {"segmentation": scores, "oracle": runs}
        parts.append(
            "<h2>Segmentation</h2>"
            + _html([{"source": name, **row} for name, row in scores.items()])
            + "<h2>With true labels instead</h2>"
            + _html(runs)
        )
    return result


def _segmented(path: Path, dtm_file: Path | None, name: str) -> tuple[PointCloud, Dtm, np.ndarray]:
    cloud = read_cloud(path)
    dtm = read_dtm(dtm_file, cloud.horizontal_crs) if dtm_file else dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs)
    if "tree_id" in cloud.attributes:
        return cloud, dtm, np.asarray(cloud.attributes["tree_id"]).astype(int)
    if name == "splats":
        raise InputError(f"{path}: has no tree_id; give the stems.laz of a workspace (photos-to-dbh --fit gaussians).")
    from ..from_points.segmentation.segment import find_stems, label_points

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
    inputs: ExperimentInputs,
) -> list[dict]:
    """The same fits with our labels and with the true ones, on the stems that both gave a figure."""
    from ..from_points.measuring.published import PublishedOptions
    from ..shapes.circles import SolidCircle

    rows = []
    for source in sources:
        power, _ = choose_power(sources[source], reference, held, "weighted circle", inputs.bh_m, inputs.seed)
        options = PublishedOptions(circle=SolidCircle(power=power))
        for fit in ("cylinder", "weighted circle"):
            reads = {
                name: measure(points[source], fit, options, inputs.bh_m, inputs.seed)
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


def _workspace(inputs: ExperimentInputs, reference: Reference, folder: Path, parts: list[str]) -> dict[str, Any]:
    from ..reconstruction.model import load_views
    from .accuracy import pair_by_position

    assert inputs.workspace is not None
    record = read_json(inputs.workspace / "run.json")
    runtime = [
        {"stage": name, "seconds": entry.get("seconds"), "peak_memory_mb": entry.get("peak_memory_mb")}
        for name, entry in record.get("stages", {}).items()
    ]
    _table(folder / "runtime.csv", runtime)
    _text(folder / "runtime.tex", plain_latex(runtime, ("stage", "seconds", "peak_memory_mb")))
    frame, views = load_views(inputs.workspace / "sfm", Path(record["parameters"]["photos"]))
    trees = read_trees(inputs.workspace / "trees.gpkg")
    trees = trees[trees["z_ground"].notna()].reset_index(drop=True)
    place = trees[["x", "y"]].to_numpy(float)
    local = frame.to_local(np.column_stack([place, trees["z_ground"].to_numpy(float)]))
    usual = float(np.nanmedian(trees["dbh_cm"])) if trees["dbh_cm"].notna().any() else 25.0
    width = trees["dbh_cm"].fillna(usual).to_numpy(float) / 100
    partner = {int(j): int(i) for i, j in pair_by_position(reference.xy, place)}
    stems = [Stem(float(x), float(y), float(z), float(w)) for (x, y, z), w in zip(local, width, strict=True)]
    seen = classify(views, stems)
    table = per_stem(seen, len(stems))
    error = [trees["dbh_cm"][k] - reference.dbh_cm[partner[k]] if k in partner else np.nan for k in range(len(trees))]
    table = table.assign(
        tree_id=trees["tree_id"],
        reference=[reference.tree[partner[k]] if k in partner else None for k in range(len(trees))],
        error_cm=error,
    )
    _table(folder / "visibility.csv", table.to_dict("records"))
    result: dict[str, Any] = {
        "runtime": runtime,
        "visibility": {
            "stems": len(table),
            "mean_free_views": round(float(table["free_views"].mean()), 2) if len(table) else None,
            "mean_width_px": round(float(table["width_px"].mean()), 2) if table["width_px"].notna().any() else None,
        },
    }
    check = ""
    if inputs.truth is not None and inputs.truth.with_name("visibility.csv").exists():
        names = [reference.tree[partner[k]] if k in partner else "" for k in range(len(trees))]
        agreed = agreement(seen, names, pd.read_csv(inputs.truth.with_name("visibility.csv")))
        result["visibility"]["against_truth"] = agreed
        check = (
            f"<p>Against the simulator: of {agreed['views']} views {agreed['clear']} are clear; "
            f"{agreed['called_free']} are called free, precision {agreed['precision']:.2f}, recall "
            f"{agreed['recall']:.2f}; counts of the stems correlate with r = {agreed['stem_count_r']}.</p>"
        )
    drawn = _draw(folder, "visibility", experiment_charts.draw_visibility(table))
    parts.append(
        "<h2>Visibility of breast height</h2><p>Bands called free from the photos' own colours.</p>"
        + check
        + drawn
        + "<h2>Runtime by stage</h2>"
        + _html(runtime)
    )
    return result


LABELS = {
    ("lidar", "cylinder"): "L-Cyl",
    ("lidar", "circle"): "L-CN",
    ("lidar", "weighted circle"): "L-CW",
    ("splats", "cylinder"): "T-Cyl",
    ("splats", "circle"): "T-CN",
    ("splats", "weighted circle"): "T-CW",
}


def methods_latex(rows: list[dict]) -> str:
    """The table in the paper's shape: plot, method, RMSE, RRMSE, MAE, ME, SR."""
    lines = [r"\begin{tabular}{llrrrrr}", r"\toprule", r"Plot & Method & RMSE & RRMSE & MAE & ME & SR \\"]
    last = None
    for row in sorted((r for r in rows if r["subset"] == "own"), key=lambda r: (r["plot"] != "All", r["plot"])):
        if row["plot"] != last:
            lines.append(r"\midrule")
            last = row["plot"]
        figures = " & ".join(
            "--" if row[k] is None else f"{row[k]:.2f}" for k in ("rmse_cm", "rrmse_pct", "mae_cm", "me_cm")
        )
        plot = str(row["plot"]).replace("_", r"\_")
        lines.append(rf"{plot} & {LABELS[row['source'], row['fit']]} & {figures} & {row['n']}/{row['of']} \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def plain_latex(rows: list[dict], columns: tuple[str, ...]) -> str:
    """A booktabs table of some columns."""
    lines = [
        rf"\begin{{tabular}}{{l{'r' * (len(columns) - 1)}}}",
        r"\toprule",
        " & ".join(name.replace("_", r"\_") for name in columns) + r" \\",
        r"\midrule",
    ]
    for row in rows:
        cells = [
            "--" if row[c] is None else f"{row[c]:.2f}" if isinstance(row[c], float) else str(row[c]) for c in columns
        ]
        lines.append(" & ".join(cell.replace("_", r"\_") for cell in cells) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def _html(rows: list[dict]) -> str:
    if not rows:
        return "<p>Nothing.</p>"
    heads = "".join(f"<th>{html.escape(name)}</th>" for name in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(_cell(value))}</td>" for value in row.values()) + "</tr>" for row in rows
    )
    return f"<table><tr>{heads}</tr>{body}</table>"


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return "–"
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def _table(path: Path, rows: list[dict]) -> None:
    _text(path, safe_frame(pd.DataFrame(rows)).to_csv(index=False, lineterminator="\n", float_format="%.4f"))


def _draw(folder: Path, name: str, figure: Any) -> str:
    svg = charts.render(figure, "svg").decode("utf-8")
    _text(folder / f"{name}.svg", svg)
    with atomic_path(folder / f"{name}.png") as temporary:
        temporary.write_bytes(charts.render(figure, "png"))
    charts.close(figure)
    return svg[svg.index("<svg") :]


def _text(path: Path, text: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
