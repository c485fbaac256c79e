"""Run the configurations of the ladder on plots, and say what each cost and reached."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo import __version__
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.core.machine import cores
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.tables import safe_frame

from .jobs import run_job
from .ladder import CONFIGS, SFM, Config
from .plot import TruePlot

#: A stem counts as visible with this many clear photos of its breast height; success counts these.
CLEAR_VIEWS = 3
#: A configuration may be recommended when it measures at least this share of what the most successful one does.
ENOUGH_SUCCESS = 0.9


def machine() -> dict[str, Any]:
    """What the seconds were measured on."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30 if hasattr(os, "sysconf") else None
    name = platform.processor() or platform.machine()
    try:
        found = [
            line.split(":", 1)[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if line.startswith("model name")
        ]
        name = found[0] if found else name
    except OSError:
        pass
    return {
        "processor": name,
        "cores": cores(),
        "memory_gb": None if memory is None else round(memory, 1),
        "python": platform.python_version(),
        "version": __version__,
    }


def run_configs(
    plots: list[Path], configs: list[Config], repeats: int, folder: Path, reporter: Reporter, budget_s: float = np.inf
) -> tuple[list[dict], list[str]]:
    """Every configuration on every plot, ``repeats`` times; kept runs are not run again.

    Returns:
        one record a run (``config, plot, repeat, sfm_s, seconds, peak_memory_mb, rows …``) and what was left out for
        lack of time.
    """
    began = time.monotonic()
    records, left = [], []
    total = len(plots) * len(configs) * repeats
    number = 0
    # One untimed run: compiled code is loaded from disk then, and the first configuration does not pay for it.
    if any(config.sfm for config in configs):
        _warm_up(plots[0], folder, began, budget_s)
    for repeat in range(repeats):
        for config in configs:
            for plot in plots:
                number += 1
                reporter.progress(number / (total + 1), f"{config.title}, {plot.name}, run {repeat + 1}")
                kept = folder / "runs" / f"{config.key}--{_tag(plot)}--{repeat}.json"
                if not _is_good(kept):
                    if time.monotonic() - began > budget_s:
                        left.append(f"{config.title} on {plot.name}")
                        continue
                    _measure(config, plot, repeat, folder, kept)
                record = read_json(kept)
                if "error" in record:
                    reporter.warn(f"{config.title} on {plot.name}: {record['error']}")
                records.append({**record, "config": config.key, "plot": plot.name, "repeat": repeat})
    return records, left


def _tag(plot: Path) -> str:
    return f"{plot.name[:30]}-{hashlib.sha256(str(plot.resolve()).encode()).hexdigest()[:6]}"


def _is_good(kept: Path) -> bool:
    return kept.exists() and "error" not in read_json(kept)


def _warm_up(plot: Path, folder: Path, began: float, budget_s: float) -> None:
    done = folder / "warm.json"
    if done.exists() or time.monotonic() - began > budget_s:
        return
    sfm = _reconstruction("2000 features", plot, 0, folder)
    if "error" not in sfm:
        run_job(
            {
                "kind": "photos",
                "plot": str(plot),
                "sfm": sfm["folder"],
                "scale": 1.0,
                "params": {"max_views": 6},
                "scratch": str(folder / "scratch"),
            },
            done,
        )


def _reconstruction(name: str, plot: Path, repeat: int, folder: Path) -> dict[str, Any]:
    kept = folder / "sfm" / f"{name.replace(' ', '-')}--{_tag(plot)}--{repeat}.json"
    place = kept.with_suffix("")
    if not (_is_good(kept) and (place / "sfm" / "frame.json").exists()):
        shutil.rmtree(place, ignore_errors=True)
        kept.unlink(missing_ok=True)
        run_job({"kind": "sfm", "plot": str(plot), "sfm": str(place / "sfm"), "params": SFM[name]}, kept)
    return {**read_json(kept), "folder": str(place / "sfm")}


def _measure(config: Config, plot: Path, repeat: int, folder: Path, kept: Path) -> None:
    sfm: dict[str, Any] = {"wall_s": 0.0, "peak_memory_mb": 0, "folder": "", "stages": {}}
    if config.sfm:
        sfm = _reconstruction(config.sfm, plot, repeat, folder)
        if "error" in sfm:
            write_json(kept, {"error": f"reconstruction: {sfm['error']}", "seconds": None})
            return
    scratch = folder / "scratch"
    job = {
        "kind": config.kind,
        "plot": str(plot),
        "sfm": sfm["folder"],
        "params": config.params,
        "scale": config.scale,
        "preset": config.preset,
        "scratch": str(scratch),
        "points": str(kept.with_suffix(".laz")),
    }
    record = run_job(job, kept)
    shutil.rmtree(scratch, ignore_errors=True)
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
    (least, most), ``rmse_cm`` with its 90 % bootstrap interval over stems (a stem's repeats stay together), ``me_cm,
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
    """Recommended configuration for each preset, from photos alone: ``best`` = least RMSE; ``balanced`` = quickest
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


def plots_of(given: Path | None, folder: Path, quick: bool, reporter: Reporter) -> list[Path]:
    """The plots to run on: those given (a plot, or a folder of plots), or simulated ones.

    Raises:
        InputError: the folder holds no simulated plot.
    """
    from ..simulate.settings import SimulateSettings
    from ..simulate.simulate import simulate_plot

    if given is not None:
        found = [given] if (given / "truth").exists() else sorted(p.parent for p in given.glob("*/truth"))
        if not found:
            raise InputError(f"{given}: holds no simulated plot (a folder with truth/); make one with simulate-plot.")
        for plot in found:
            TruePlot.load(plot)
        return [plot.resolve() for plot in found]
    wanted = [41] if quick else [41, 42, 43]
    plots = []
    for seed in wanted:
        plot = folder / "plots" / f"sim{seed}"
        if not (plot / "truth" / "config.json").exists():
            with reporter.stage(f"simulate plot {seed}", 0.0, 1.0):
                size = {"preset": "plot", "radius_m": 9.0, "photos": 50, "samples": 3} if quick else {"preset": "plot"}
                simulate_plot(
                    SimulateSettings(
                        output=plot, seed=seed, touching_saplings=1, strong_leans=1, lean_max_deg=8.0, **size
                    ),
                    reporter,
                )  # type: ignore[arg-type]
        plots.append(plot.resolve())
    return plots


def write_records(folder: Path, records: list[dict], table: pd.DataFrame, facts: dict[str, Any]) -> None:
    """``benchmark.csv`` (a row a configuration), ``trees.csv`` (a row a tree and run), ``benchmark.json``."""
    from treedgs_geo.core.files import atomic_path

    trees = pd.DataFrame(
        [
            {"config": record["config"], "plot": record["plot"], "repeat": record["repeat"], **row}
            for record in records
            for row in record.get("rows", [])
        ]
    )
    for name, frame in (("benchmark.csv", table), ("trees.csv", trees)):
        with atomic_path(folder / name) as path:
            safe_frame(frame).to_csv(path, index=False, float_format="%.4g")
    clean = json.loads(table.to_json(orient="records")) if len(table) else []
    write_json(folder / "benchmark.json", {**facts, "configurations": clean})
