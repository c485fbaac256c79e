"""What work costs: seconds and peak memory of each stage against what it has to do, and what that means for a plot.

Each stage is measured in a process of its own at several sizes, one size at a time, and a power law ``a size^b`` is
fitted (``b`` within the limits that the algorithm allows). The prediction says what it was extrapolated from.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.matching_strategy import GUIDED_NEIGHBOURS
from treedgs_geo.report.blocks import Block, Column, Paragraph, Table
from treedgs_geo.report.charts import BLUE, VERMILION, new_chart, write_chart
from treedgs_geo.run.heights import MAX_COMPARED

from ..plot import plots_of
from ..processes import run_job
from ..records import machine, write_markdown, write_table

#: The paper's case (tab:runtime_breakdown): one plot of 365 photos of 20 MP, 45 stems, 83 minutes on 192 threads + GPU.
PAPER = {"photos": 365, "megapixels": 20.0, "stems": 45, "radius_m": 16.05, "minutes": 83.0}
#: Stage -> (what its seconds grow with, limits of the exponent).
GROWTH = {
    "features": ("photos x min(megapixels, 12)", (0.8, 1.2)),
    "reducing": ("photos x megapixels beyond 12", (0.8, 1.2)),
    "matching": ("pairs", (0.8, 1.2)),
    "mapping": ("photos", (0.8, 2.0)),
    "adjustment": ("photos", (0.8, 2.0)),
    "stems": ("area x photos used", (0.5, 1.2)),
    "heights": ("area x photos used", (0.5, 1.2)),
    "lidar": ("points", (0.8, 1.2)),
}
MAX_FEATURE_MP, MAX_VIEWS = 12.0, 96
#: Reading large photos counts from this share of what their features take.
_NOTICED = 0.02


def run_cost(output: Path, plots: Path | None, reporter: Reporter) -> dict[str, Any]:
    """Measure, fit, predict; writes ``cost.{json,csv,md,svg,png}``.

    Raises:
        InputError: the plot given is none.
    """
    plot, *more = plots_of(plots, output, True, reporter)
    points = _measure(plot, more, output, reporter)
    if len(points) < 4:
        raise InputError("Too few measurements for a cost model; see the files in cost-runs/ and run again.")
    table = split_reducing(pd.DataFrame(points))
    fits = {
        stage: fit_power(rows["size"].to_numpy(float), rows["seconds"].to_numpy(float), GROWTH[stage][1])
        for stage, rows in table.groupby("stage")
    }
    memory = fit_memory(table)
    prediction = predict(fits, memory, PAPER)
    facts = {
        "machine": machine(),
        "plot": plot.name,
        "reconstructed_too": [other.name for other in more],
        "points": [row.dropna().to_dict() for _, row in table.iterrows()],
        "fits": fits,
        "memory": memory,
        "paper_case": {**PAPER, **prediction},
    }
    write_json(output / "cost.json", facts)
    write_table(output / "cost.csv", table)
    write_chart(output, "cost", draw(table, fits))
    write_markdown(output / "cost.md", cost_blocks(facts))
    return {
        "output": str(output),
        "chart": str(output / "cost.svg"),
        "predicted_min": round(prediction["total_s"] / 60, 1),
    }


def _runs(plot: Path, more: list[Path]) -> dict[str, dict[str, Any]]:
    """Jobs of :mod:`.jobs` by name, small ones first: sizes of each kind of work on ``plot``, and the
    reconstruction of ``more`` plots."""
    runs: dict[str, dict[str, Any]] = {}
    for share, scale in ((0.35, 1.0), (0.6, 1.0), (1.0, 1.0), (0.5, 0.6)):
        runs[f"sfm-{share:g}-{scale:g}"] = {"kind": "subset_sfm", "share": share, "scale": scale}
    for other in more:
        runs[f"sfm-{other.name}"] = {"kind": "subset_sfm", "plot": str(other), "share": 1.0, "scale": 1.0}
    for radius in (0.5, 1.0, 1.4):
        for views in (12, 24, 60):
            runs[f"stems-{radius:g}-{views}"] = {"kind": "stems_cost", "radius": radius, "views": views}
    for photos, megapixels in ((6, 4.0), (6, 12.0), (4, 50.0)):
        job = {"kind": "features_cost", "photos": photos, "megapixels": megapixels}
        runs[f"features-{photos}-{megapixels:g}"] = job
    if (plot / "lidar").exists():
        for radius, views in ((0.5, 24), (1.0, 24), (1.0, 60)):
            runs[f"heights-{radius:g}-{views}"] = {"kind": "heights_cost", "radius": radius, "views": views}
        for share in (0.25, 0.5, 1.0):
            runs[f"lidar-{share:g}"] = {"kind": "lidar_cost", "share": share}
    return {name: {"plot": str(plot), **job} for name, job in runs.items()}


def _measure(plot: Path, more: list[Path], output: Path, reporter: Reporter) -> list[dict]:
    """A row a stage and run; kept runs are not run again."""
    points, runs = [], _runs(plot, more)
    for number, (name, job) in enumerate(runs.items()):
        reporter.progress(number / len(runs), name)
        kept = output / "cost-runs" / f"{name}.json"
        record: dict[str, Any] = read_json(kept) if kept.exists() else {"error": "not run"}
        if "error" in record:
            record = run_job({**job, "scratch": str(output / "cost-runs" / f"{name}-work")}, kept)
        if "error" in record:
            reporter.warn(f"{name}: {record['error']}")
            continue
        if (level := record["facts"].get("level", "guided")) != "guided":
            reporter.warn(f"{name}: reconstructed at the level {level}; only the guided one is fitted.")
            continue
        points += [
            {
                "run": name,
                "stage": stage,
                "size": record["sizes"][stage],
                "seconds": seconds,
                "peak_memory_mb": record["peak_memory_mb"],
                **record["facts"],
            }
            for stage, seconds in record["stages"].items()
        ]
    reporter.info(f"{len(points)} measurements on {plot.name}.")
    return points


def split_reducing(table: pd.DataFrame) -> pd.DataFrame:
    """Seconds of the features of photos beyond ``MAX_FEATURE_MP``, which are read whole and reduced: what they
    take longer than smaller ones of the same feature pixels becomes a stage of its own, ``reducing``; none where they
    take no longer."""
    features = table["stage"] == "features"
    large = features & (table["megapixels"] > 1.05 * MAX_FEATURE_MP)
    small = table[features & ~large]
    if not large.any() or not len(small):
        return table[~large].reset_index(drop=True)
    law = fit_power(small["size"].to_numpy(float), small["seconds"].to_numpy(float), GROWTH["features"][1])
    more = table[large].copy()
    own = law["a"] * (more["photos"] * MAX_FEATURE_MP) ** law["b"]
    more["seconds"] -= own
    more = more[more["seconds"] > _NOTICED * own].copy()
    more["size"] = more["photos"] * (more["megapixels"] - MAX_FEATURE_MP)
    more["stage"] = "reducing"
    return pd.concat([table[~large], more], ignore_index=True)


def fit_power(size: np.ndarray, seconds: np.ndarray, limits: tuple[float, float]) -> dict[str, Any]:
    """``seconds = a size^b`` by least squares in logarithms, b clipped to ``limits``; ``spread``: largest factor that a
    measurement lies off the fit."""
    x, y = np.log(size), np.log(np.maximum(seconds, 1e-3))
    b = float(np.clip(np.polyfit(x, y, 1)[0] if np.ptp(x) > 0.1 else 1.0, *limits))
    a = float(np.exp(np.mean(y - b * x)))
    off = float(np.exp(np.abs(y - np.log(a) - b * x).max()))
    return {
        "a": a,
        "b": round(b, 3),
        "from": float(size.min()),
        "to": float(size.max()),
        "n": len(size),
        "spread": round(off, 2),
    }


def fit_memory(table: pd.DataFrame) -> dict[str, Any]:
    """Peak memory: a base, plus what the crops of the photos used take (3 bytes a pixel) as measured; and that of the
    features by the photos' megapixels."""
    base, crops, least = 500.0, 3.0, 3.0
    rows = table[table["stage"] == "stems"]
    if "crop_megapixels" in rows and len(rows):
        x, y = rows["crop_megapixels"].to_numpy(float), rows["peak_memory_mb"].to_numpy(float)
        crops, base = np.polyfit(x, y, 1) if len(x) > 1 and np.ptp(x) > 1 else (least, float(y.max()))
    alone = table[table["run"].str.startswith("features-")].sort_values("megapixels")
    return {
        "base_mb": round(float(base)),
        "mb_per_crop_megapixel": round(max(float(crops), least), 2),
        "features_mb": [[round(mp, 2), mb] for mp, mb in alone[["megapixels", "peak_memory_mb"]].to_numpy().tolist()],
    }


def predict(fits: dict[str, dict], memory: dict[str, Any], case: dict[str, float]) -> dict[str, Any]:
    """Seconds a stage and in all, and peak memory, for a case: photos, megapixels each, stems, radius_m of the plot;
    1.84 cm on the ground, and the guided level of reconstruction is enough."""
    gsd_m = 0.0184
    used = min(case["photos"], MAX_VIEWS)
    crop = min(case["megapixels"], (2 * case["radius_m"] + 6) ** 2 / gsd_m**2 / 1e6)
    sizes = {
        "features": case["photos"] * min(case["megapixels"], MAX_FEATURE_MP),
        "matching": case["photos"] * GUIDED_NEIGHBOURS / 2,
        "mapping": case["photos"],
        "adjustment": case["photos"],
        "reducing": case["photos"] * max(case["megapixels"] - MAX_FEATURE_MP, 0.0),
        "stems": np.pi * case["radius_m"] ** 2 * used,
        "heights": np.pi * case["radius_m"] ** 2 * min(case["photos"], MAX_COMPARED),
    }
    known = {name: size for name, size in sizes.items() if name in fits and size > 0}
    stages = {name: round(fits[name]["a"] * size ** fits[name]["b"], 1) for name, size in known.items()}
    beyond = {name: round(size / fits[name]["to"], 1) for name, size in known.items()}
    megapixels, features_mb = np.array(memory.get("features_mb") or [[0.0, 0.0]]).T
    peaks = (
        float(np.interp(case["megapixels"], megapixels, features_mb)),
        memory["base_mb"] + memory["mb_per_crop_megapixel"] * crop * used,
    )
    return {
        "stages_s": stages,
        "total_s": round(sum(stages.values()), 1),
        "times_beyond_measured": beyond,
        "peak_memory_mb": round(max(peaks)),
    }


def draw(table: pd.DataFrame, fits: dict[str, dict]) -> Any:
    """A panel a stage: measured seconds and the fitted law."""
    from matplotlib.ticker import NullFormatter

    stages = list(fits)
    rows_needed = -(-len(stages) // 3)
    figure, grid = new_chart(10, 2.5 * rows_needed, nrows=rows_needed, ncols=3, squeeze=False)
    for axes in grid.flat[len(stages) :]:
        axes.set_visible(False)
    for axes, stage in zip(grid.flat, stages, strict=False):
        rows, fit = table[table["stage"] == stage], fits[stage]
        axes.scatter(rows["size"], rows["seconds"], color=BLUE, zorder=3)
        x = np.geomspace(fit["from"], fit["to"], 30)
        axes.plot(x, fit["a"] * x ** fit["b"], color=VERMILION)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_minor_formatter(NullFormatter())
        marks = sorted({fit["from"], fit["to"]})
        axes.set_xticks(marks, [f"{mark:,.0f}" for mark in marks])
        ends = sorted({float(rows["seconds"].min()), float(rows["seconds"].max())})
        axes.set_yticks(ends, [f"{end:.3g}" for end in ends])
        axes.set_title(f"{stage}: exponent {fit['b']:.2f}", fontsize=9)
        axes.set_xlabel(GROWTH[stage][0], fontsize=8)
        axes.set_ylabel("s", fontsize=8)
    return figure


def cost_blocks(facts: dict[str, Any]) -> list[Block]:
    """The laws and the prediction, for the docs."""
    rows = [
        {
            "stage": stage,
            "grows": GROWTH[stage][0],
            "law": f"{fit['a']:.3g} size^{fit['b']:.2f}",
            "from": f"{fit['from']:.0f} - {fit['to']:.0f}",
            "misfit": f"x{fit['spread']:.2f}",
        }
        for stage, fit in facts["fits"].items()
    ]
    columns = [
        Column("stage", "stage"),
        Column("grows", "grows with"),
        Column("law", "seconds"),
        Column("from", "measured from - to"),
        Column("misfit", "worst misfit"),
    ]
    case = facts["paper_case"]
    stages = ", ".join(f"{name} {seconds / 60:.1f}" for name, seconds in case["stages_s"].items())
    beyond = max(case["times_beyond_measured"].values(), default=1)
    others = ", ".join(f"`{name}`" for name in facts["reconstructed_too"])
    measured = f"`{facts['plot']}`" + (f" (reconstruction on {others}, too)" if others else "")
    said = (
        f"Measured on {measured}, {facts['machine']['cores']} cores. The paper's case ({case['photos']} photos of "
        f"{case['megapixels']:.0f} MP, radius {case['radius_m']} m): predicted {case['total_s'] / 60:.0f} minutes "
        f"({stages}) and {case['peak_memory_mb'] / 1024:.1f} GB, extrapolated up to {beyond:g} times beyond what was "
        f"measured. The paper took {case['minutes']:.0f} minutes on 192 threads and a GPU (another scene: context)."
    )
    return [Table("cost", "", columns, rows), Paragraph(said)]
