"""The speed-accuracy chart of ``treedgs benchmark``: the configurations, what each cost and reached on plots."""

from __future__ import annotations

import hashlib
import shutil
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo import __version__
from treedgs_geo.core.errors import InputError, TreeDGSError
from treedgs_geo.core.files import ensure_writable, read_json, write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.report.charts import write_chart
from treedgs_geo.report.html import write_html

from ..plot import CLEAR_VIEWS, plots_of
from ..processes import run_job
from ..records import code_digest, machine, rows_of, write_markdown, write_table
from . import pictures

#: A configuration may be recommended when it measures at least this share of what the most successful one does.
ENOUGH_SUCCESS = 0.9


def run_configs(
    plots: list[Path], configs: list[Config], folder: Path, reporter: Reporter, budget_s: float = np.inf
) -> tuple[list[dict], list[str]]:
    """Every configuration on every plot; kept runs are not run again.

    Returns:
        one record a run (``config, plot, sfm_s, seconds, peak_memory_mb, rows …``) and what was left out for
        lack of time.
    """
    began = time.monotonic()
    records, left = [], []
    total = len(plots) * len(configs)
    number = 0
    # One untimed run: compiled code is loaded from disk then, and the first configuration does not pay for it.
    warm = folder / "warm.json"
    if any(config.sfm for config in configs) and not warm.exists():
        small = Config("warm", "", "", sfm="2000 features", params={"max_views": 6})
        _measure(small, plots[0], folder, warm)
    for config in configs:
        for plot in plots:
            number += 1
            reporter.progress(number / (total + 1), f"{config.title}, {plot.name}")
            kept = folder / "runs" / f"{config.key}--{_tag(plot)}.json"
            if not _is_good(kept):
                if time.monotonic() - began > budget_s:
                    left.append(f"{config.title} on {plot.name}")
                    continue
                _measure(config, plot, folder, kept)
            record = read_json(kept)
            if "error" in record:
                reporter.warn(f"{config.title} on {plot.name}: {record['error']}")
            records.append({**record, "config": config.key, "plot": plot.name})
    return records, left


def _tag(plot: Path) -> str:
    return f"{plot.name[:30]}-{hashlib.sha256(str(plot.resolve()).encode()).hexdigest()[:6]}"


def _is_good(kept: Path) -> bool:
    return kept.exists() and "error" not in read_json(kept)


def _reconstruction(name: str, plot: Path, folder: Path) -> dict[str, Any]:
    kept = folder / "sfm" / f"{name.replace(' ', '-')}--{_tag(plot)}.json"
    place = kept.with_suffix("")
    if not (_is_good(kept) and (place / "sfm" / "frame.json").exists()):
        shutil.rmtree(place, ignore_errors=True)
        kept.unlink(missing_ok=True)
        run_job({"kind": "sfm", "plot": str(plot), "sfm": str(place / "sfm"), "params": SFM[name]}, kept)
    return {**read_json(kept), "folder": str(place / "sfm")}


def _measure(config: Config, plot: Path, folder: Path, kept: Path) -> None:
    sfm: dict[str, Any] = {"wall_s": 0.0, "peak_memory_mb": 0, "folder": "", "stages": {}}
    if config.sfm:
        sfm = _reconstruction(config.sfm, plot, folder)
        if "error" in sfm:
            write_json(kept, {"error": f"reconstruction: {sfm['error']}", "seconds": None})
            return
    job = {
        "kind": config.kind,
        "plot": str(plot),
        "sfm": sfm["folder"],
        "params": config.params,
        "preset": config.preset,
        "points": str(kept.with_suffix(".laz")),
    }
    record = run_job(job, kept)
    if "error" in record:
        return
    stage_s = sum(record["stages"].values())
    write_json(
        kept,
        {
            **record,
            "version": __version__,
            "sfm_s": sfm["wall_s"],
            "stage_s": round(stage_s, 2),
            "seconds": round(sfm["wall_s"] + stage_s, 2),
            "sfm_stages": sfm["stages"],
            "peak_memory_mb": max(record["peak_memory_mb"], sfm["peak_memory_mb"]),
        },
    )


def summarise(records: list[dict], seed: int = 0, resamples: int = 1000) -> pd.DataFrame:
    """One row a configuration: ``key, title, group, seconds`` (median over runs, a plot), ``seconds_lo, seconds_hi``
    (least, most), ``rmse_cm`` with its 90 % bootstrap interval over stems (a stem's runs stay together), ``me_cm,
    success, ok_share, worst_cm, false, coverage, peak_memory_mb, photos, megapixels, gaussians``; ``stems`` that are
    clearly visible, each counted once; ``of_all``: share of all stems with a DBH, hidden ones too; on the Pareto
    ``front``."""
    titles = {config.key: config for config in CONFIGS}
    rows = []
    for key in dict.fromkeys(record["config"] for record in records):
        runs = [record for record in records if record["config"] == key and "error" not in record]
        if not runs:
            continue
        config = titles[key]
        trees = [{**row, "plot": run["plot"]} for run in runs for row in run["rows"] if not row.get("false")]
        read = [row for row in trees if row["read_cm"] is not None]
        error = np.array([row["read_cm"] - row["true_cm"] for row in read])
        visible = [row for row in trees if (row["clear"] or 0) >= CLEAR_VIEWS]
        rng = np.random.default_rng(seed)
        low = high = rmse = np.nan
        if len(error):
            rmse = float(np.sqrt(np.mean(error**2)))
            low, high = _rmse_interval(error, [(row["plot"], row["tree_id"]) for row in read], resamples, rng)
        bounded = [row for row in read if row["lo_cm"] is not None]
        times = [run["seconds"] for run in runs]
        ok = [abs(row["read_cm"] - row["true_cm"]) for row in read if row["flag"] == "ok"]
        rows.append(
            {
                "key": key,
                "title": config.title,
                "group": config.group,
                "preset": config.preset,
                "runs": len(runs),
                "seconds": float(np.median(times)),
                "seconds_lo": min(times),
                "seconds_hi": max(times),
                "sfm_s": float(np.median([run["sfm_s"] for run in runs])),
                "stage_s": float(np.median([run["stage_s"] for run in runs])),
                "rmse_cm": rmse,
                "rmse_lo": float(low),
                "rmse_hi": float(high),
                "me_cm": float(error.mean()) if len(error) else np.nan,
                "worst_cm": float(np.abs(error).max()) if len(error) else np.nan,
                "stems": len({(row["plot"], row["tree_id"]) for row in visible}),
                "success": sum(row["read_cm"] is not None for row in visible) / max(len(visible), 1),
                "of_all": len(read) / max(len(trees), 1),
                "ok": len(ok),
                "ok_off_5cm": sum(value > 5 for value in ok),
                "coverage": (
                    sum(row["lo_cm"] <= row["true_cm"] <= row["hi_cm"] for row in bounded) / len(bounded)
                    if bounded
                    else np.nan
                ),
                "false": sum(bool(row.get("false")) for run in runs for row in run["rows"]) / len(runs),
                "peak_memory_mb": max(run["peak_memory_mb"] for run in runs),
                **{
                    name: next((run["modelled"].get(name) for run in runs if run["modelled"].get(name)), None)
                    for name in ("photos", "megapixels", "gaussians")
                },
            }
        )
    table = pd.DataFrame(rows)
    if len(table):
        table["front"] = pareto(table)
    return table


def _rmse_interval(error: np.ndarray, stems: list[tuple], resamples: int, rng: np.random.Generator) -> np.ndarray:
    """(2,) 5th and 95th percentile of the RMSE over drawn stems; a stem's repeated readings are drawn together."""
    _, owner = np.unique([f"{plot} {tree}" for plot, tree in stems], return_inverse=True)
    square, count = np.bincount(owner, error**2), np.bincount(owner)
    drawn = rng.integers(0, len(count), (resamples, len(count)))
    return np.percentile(np.sqrt(square[drawn].sum(axis=1) / count[drawn].sum(axis=1)), [5, 95])


def pareto(table: pd.DataFrame) -> np.ndarray:
    """(N,) bool: no other configuration that measures enough stems is both quicker and more accurate; photos and
    LiDAR apart, because who has one has not the other."""
    cloud = table["group"] == "LiDAR"
    if cloud.any() and not cloud.all():
        front = np.zeros(len(table), bool)
        for part in (cloud, ~cloud):
            front[part.to_numpy()] = pareto(table[part])
        return front
    enough = (table["success"] >= ENOUGH_SUCCESS * table["success"].max()) & table["rmse_cm"].notna()
    front = np.zeros(len(table), bool)
    best = np.inf
    for k in table.assign(_e=enough)[enough].sort_values(["seconds", "rmse_cm"]).index:
        if table.at[k, "rmse_cm"] < best - 1e-9:
            front[table.index.get_loc(k)] = True
            best = table.at[k, "rmse_cm"]
    return front


def knees(table: pd.DataFrame) -> dict[str, str]:
    """Configurations to recommend, from photos alone: ``best`` = least RMSE; ``balanced`` = quickest
    whose RMSE lies within the best's 90 % interval; ``fast`` = quickest with at most twice the best's."""
    photos = table[(table["group"] != "LiDAR") & table["rmse_cm"].notna()]
    photos = photos[photos["success"] >= ENOUGH_SUCCESS * photos["success"].max()] if len(photos) else photos
    if not len(photos):
        return {}
    best = photos.loc[photos["rmse_cm"].idxmin()]
    good = photos[photos["rmse_cm"] <= best["rmse_hi"]]
    fair = photos[photos["rmse_cm"] <= 2 * best["rmse_cm"]]
    return {
        "best": best["key"],
        "balanced": good.loc[good["seconds"].idxmin(), "key"],
        "fast": fair.loc[fair["seconds"].idxmin(), "key"],
    }


def write_records(folder: Path, records: list[dict], table: pd.DataFrame, facts: dict[str, Any]) -> None:
    """``benchmark.csv`` (a row a configuration), ``trees.csv`` (a row a tree and run), ``benchmark.json``."""
    trees = [
        {"config": record["config"], "plot": record["plot"], **row}
        for record in records
        for row in record.get("rows", [])
    ]
    write_table(folder / "benchmark.csv", table)
    write_table(folder / "trees.csv", pd.DataFrame(trees))
    write_json(folder / "benchmark.json", {**facts, "configurations": rows_of(table)})


def run_chart(
    output: Path, plots: Path | None, quick: bool, only: list[str], budget_min: float, reporter: Reporter
) -> dict[str, Any]:
    """The speed-accuracy chart. Files: ``speed-accuracy.{svg,png,html,md}``, ``benchmark.{csv,json}``, ``trees.csv``.

    Raises:
        InputError: no plot, or an unknown configuration.
    """
    began = time.monotonic()
    ensure_writable(output / "benchmark.json")
    known = {config.key for config in CONFIGS}
    if unknown := [key for key in only if key not in known]:
        raise InputError(f"--only: {unknown[0]!r} is no configuration; known: {', '.join(sorted(known))}.")
    configs = [c for c in CONFIGS if (c.key in only if only else c.quick or not quick)]
    with reporter.stage("plots", 0.0, 0.15):
        folders = plots_of(plots, output, quick, reporter)
    has_cloud = {folder: (folder / "lidar").exists() for folder in folders}
    if not all(has_cloud.values()):
        configs = [c for c in configs if c.kind != "cloud"]
        reporter.info("Not every plot has a LiDAR cloud: LiDAR methods are left out.")
    with reporter.stage("configurations", 0.15, 0.98):
        left_s = max(60 * budget_min - (time.monotonic() - began), 1.0)
        records, left = run_configs(folders, configs, output, reporter, left_s)
    table = summarise(records)
    if not len(table):
        raise TreeDGSError(f"{output}: no configuration finished, see the files in runs/ and run again.")
    if left:
        reporter.warn(f"Out of time; left out: {', '.join(left)}. Run again to add them.")
    stems = int(table["stems"].max())
    facts = {
        "command": f"treedgs benchmark{' --quick' if quick else ''}",
        "machine": machine(),
        "plots": [folder.name for folder in folders],
        "left_out": left,
        "code": code_digest(),
        "seconds": round(time.monotonic() - began),
        "plots_text": f"{', '.join(folder.name for folder in folders)}: {stems} visible stems",
    }
    recommended = knees(table)
    write_records(output, records, table, {**facts, "recommended": recommended})
    write_chart(output, "speed-accuracy", pictures.draw_chart(table, facts))
    write_html(output / "speed-accuracy.html", pictures.document(table, facts, recommended))
    each = {folder.name: summarise([r for r in records if r["plot"] == folder.name]) for folder in folders}
    write_markdown(output / "speed-accuracy.md", pictures.report_blocks(table, facts, recommended, each))
    for preset, key in recommended.items():
        row = table[table["key"] == key].iloc[0]
        reporter.info(f"{preset}: {row['title']}, {row['seconds']:.0f} s, RMSE {row['rmse_cm']:.2f} cm.")
    return {
        "output": str(output),
        "page": str(output / "speed-accuracy.html"),
        "chart": str(output / "speed-accuracy.svg"),
        "n_runs": len(records),
        "recommended": recommended,
        "left_out": left,
        "seconds": facts["seconds"],
    }


#: Reconstruction settings by name; several configurations share one reconstruction, whose seconds count for each.
SFM: dict[str, dict[str, Any]] = {
    "2000 features": {"max_features": 2000, "neighbours": 8},
    "4000 features": {"max_features": 4000, "neighbours": 12},
    "8000 features": {},
    "16000 features": {"max_features": 16000, "neighbours": 30},
    "half-size photos": {"max_image_size": 640},
}


@dataclass(frozen=True)
class Config:
    """One point of the chart.

    key: file name. title: on the chart. group: level of modelling (``docs/evidence/speed-accuracy.md``). kind:
    ``photos`` (stems fitted in the photos), ``published`` (the published method over the whole plot) or ``cloud``.
    sfm: key of :data:`SFM`. params: settings of the stage. preset: this is that preset of ``photos-to-dbh``, with all
    of its settings. quick: part of ``--quick``.
    """

    key: str
    title: str
    group: str
    kind: str = "photos"
    sfm: str = "8000 features"
    params: dict[str, Any] = field(default_factory=dict)
    preset: str = ""
    quick: bool = False


PRESET_GROUP = "presets"
CONFIGS: tuple[Config, ...] = (
    Config("balanced", "balanced", PRESET_GROUP, preset="balanced", quick=True),
    Config("fast", "fast", PRESET_GROUP, sfm="4000 features", preset="fast", quick=True),
    Config("lidar", "LiDAR, our circles", "LiDAR", "cloud", sfm="", quick=True),
    Config(
        "lidar-cylinder",
        "LiDAR, cylinder (published)",
        "LiDAR",
        "cloud",
        sfm="",
        params={"method": "paper", "fit": "cylinder"},
        quick=True,
    ),
    Config("views-12", "12 photos", "photos used", params={"max_views": 12}, quick=True),
    Config("views-24", "24 photos", "photos used", params={"max_views": 24}, quick=True),
    Config("pixels-5", "pixels of 5 cm", "pixels used", params={"max_views": 96, "finest_gsd_m": 0.055}, quick=True),
    Config("sfm-2000", "2000 features", "reconstruction", sfm="2000 features", params={"max_views": 96}, quick=True),
    Config("best", "best", PRESET_GROUP, sfm="16000 features", preset="best", quick=True),
    Config("upright", "upright stems only", "stem model", params={"max_views": 96, "max_lean_deg": 0.0}),
    Config("views-6", "6 photos", "photos used", params={"max_views": 6}),
    Config("views-48", "48 photos", "photos used", params={"max_views": 48}),
    Config("pixels-10", "pixels of 10 cm", "pixels used", params={"max_views": 96, "finest_gsd_m": 0.11}),
    Config("sfm-half", "half-size photos", "reconstruction", sfm="half-size photos", params={"max_views": 96}),
    Config("sfm-4000", "4000 features", "reconstruction", sfm="4000 features", params={"max_views": 96}),
    Config("sfm-16000", "16000 features", "reconstruction", sfm="16000 features", params={"max_views": 96}),
    Config(
        "paper",
        "paper (whole plot, 60 CPU minutes)",
        PRESET_GROUP,
        "published",
        params={"time_limit_min": 60.0},
        preset="paper",
    ),
)
