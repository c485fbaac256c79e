"""What ``treedgs benchmark`` does: chart or stability suite, kept and resumed in one output folder."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from treedgs_geo.core.errors import InputError, TreeDGSError
from treedgs_geo.core.files import atomic_path, ensure_writable, write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.tables import safe_frame
from treedgs_geo.report.blocks import Block
from treedgs_geo.report.charts import write_chart
from treedgs_geo.report.html import write_html

from . import chart, chart_pictures, stability_blocks, stability_factors, stability_report
from .factors import FACTORS
from .ladder import CONFIGS
from .markdown import markdown
from .stability import METHODS, Case, all_cases, code_digest, run_cases


def run_chart(
    output: Path, plots: Path | None, quick: bool, repeats: int, only: list[str], budget_min: float, reporter: Reporter
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
        folders = chart.plots_of(plots, output, quick, reporter)
    has_cloud = {folder: (folder / "lidar").exists() for folder in folders}
    if not all(has_cloud.values()):
        configs = [c for c in configs if c.kind != "cloud"]
        reporter.info("Not every plot has a LiDAR cloud: LiDAR methods are left out.")
    with reporter.stage("configurations", 0.15, 0.98):
        budget = max(60 * budget_min - (time.monotonic() - began), 1.0) if budget_min else float("inf")
        records, left = chart.run_configs(folders, configs, repeats, output, reporter, budget)
    table = chart.summarise(records)
    if not len(table):
        raise TreeDGSError(f"{output}: no configuration finished, see the files in runs/ and run again.")
    if left:
        reporter.warn(f"Out of time; left out: {', '.join(left)}. Run again to add them.")
    stems = int(table["stems"].max())
    facts = {
        "command": f"treedgs benchmark{' --quick' if quick else ''} --repeats {repeats}",
        "machine": chart.machine(),
        "plots": [folder.name for folder in folders],
        "repeats": repeats,
        "left_out": left,
        "code": code_digest(),
        "seconds": round(time.monotonic() - began),
        "plots_text": f"{', '.join(folder.name for folder in folders)}: {stems} visible stems",
    }
    knees = chart.knees(table)
    chart.write_records(output, records, table, {**facts, "recommended": knees})
    write_chart(output, "speed-accuracy", chart_pictures.draw_chart(table, facts))
    write_html(output / "speed-accuracy.html", chart_pictures.document(table, facts, knees))
    each = {folder.name: chart.summarise([r for r in records if r["plot"] == folder.name]) for folder in folders}
    _write(output / "speed-accuracy.md", chart_pictures.report_blocks(table, facts, knees, each))
    for preset, key in knees.items():
        row = table[table["key"] == key].iloc[0]
        reporter.info(f"{preset}: {row['title']}, {row['seconds']:.0f} s, RMSE {row['rmse_cm']:.2f} cm.")
    return {
        "output": str(output),
        "page": str(output / "speed-accuracy.html"),
        "chart": str(output / "speed-accuracy.svg"),
        "n_runs": len(records),
        "recommended": knees,
        "left_out": left,
        "seconds": facts["seconds"],
    }


@dataclass(frozen=True)
class StabilityChoice:
    """Which cases of the stability suite to run. factors, methods: their keys; empty: all."""

    seeds: list[int]
    factors: list[str] = field(default_factory=list)
    methods: list[str] = field(default_factory=list)

    def cases(self) -> list[Case]:
        """Those cases; :class:`.InputError` for a key that is none."""
        known = {"factor": {factor.key for factor in FACTORS}, "method": set(METHODS)}
        for what, keys in (("factor", self.factors), ("method", self.methods)):
            if unknown := [key for key in keys if key not in known[what]]:
                raise InputError(f"--{what}s: {unknown[0]!r} is no {what}; known: {', '.join(sorted(known[what]))}.")
        cases = all_cases(self.seeds, self.factors, self.methods)
        if not cases:
            raise InputError("--methods: none of them reads what the factors given trouble; choose others.")
        return cases


def run_stability(
    output: Path, chosen: StabilityChoice, fresh: bool, budget_min: float, reporter: Reporter
) -> dict[str, Any]:
    """The stability suite. Files: ``stability.{csv,json,md,html}``, ``stability-<method>.{svg,png}``, curves;
    with factors that run the whole chain ``stability-blocks.csv`` and ``stability-reconstruction.{svg,png}``."""
    began = time.monotonic()
    ensure_writable(output / "stability.json")
    cases = chosen.cases()
    with reporter.stage("cases", 0.0, 0.97):
        budget = 60 * budget_min if budget_min else float("inf")
        records = list(run_cases(cases, output, reporter, fresh, budget))
    if len(records) < len(cases):
        reporter.warn(f"{len(records)} of {len(cases)} cases are done (out of time, or crashed); run again to go on.")
    return {
        **write_stability(output, records, len(cases)),
        "n_cases": len(records),
        "n_wanted": len(cases),
        "seconds": round(time.monotonic() - began),
    }


def write_stability(output: Path, records: list[dict], wanted: int) -> dict[str, Any]:
    """Tables, pictures and page of the records; wanted: cases that there should be."""
    if not records:
        raise TreeDGSError("No case was run, so there is nothing to report; give more time with --budget-min.")
    table = stability_report.tree_rows(records)
    blocks = stability_blocks.block_rows(records)
    levels = stability_blocks.with_blocks(stability_report.by_level(table), blocks)
    claim = stability_report.verdict(table)
    factors = stability_factors.by_factor(table)
    codes = sorted({record["code"] for record in records})
    facts = {
        "machine": chart.machine(),
        "seeds": sorted({record["seed"] for record in records}),
        "cases": len(records),
        "wanted": wanted,
        "measuring_code": codes,
    }
    tables = {"stability.csv": levels, "stability-trees.csv": table, "stability-factors.csv": factors}
    if len(blocks):
        tables["stability-blocks.csv"] = blocks
    for name, frame in tables.items():
        with atomic_path(output / name) as path:
            safe_frame(frame).to_csv(path, index=False, float_format="%.4g")
    wrong = stability_report.lies(table)
    write_json(
        output / "stability.json",
        {**facts, "verdict": claim, "lies": _plain(wrong), "levels": _plain(levels), "blocks": _plain(blocks)},
    )
    said = [
        *stability_report.report_blocks(table, levels, facts),
        stability_factors.factor_table(factors),
        *stability_blocks.block_report(blocks),
    ]
    _write(output / "stability.md", said)
    figures = {
        method: (method.replace(" ", "-"), stability_report.draw_errors(table, method))
        for method in METHODS
        if (table["method"] == method).any()
    }
    if len(blocks):
        figures["reconstruction"] = "reconstruction", stability_blocks.draw_blocks(blocks)
    figures["every method"] = "curves", stability_report.draw_curves(levels)
    pictures = {
        words: write_chart(output, f"stability-{name}", figure).data for words, (name, figure) in figures.items()
    }
    write_html(output / "stability.html", stability_report.document(said, pictures))
    own = claim.get("photos") or next(iter(claim.values()))
    return {
        "output": str(output),
        "page": str(output / "stability.html"),
        "chart": str(output / "stability-curves.svg"),
        "n_ok": own["ok"],
        "n_lies": own["lies"],
        "coverage_90": own["coverage"],
        "claim_holds": bool(own["holds"]),
    }


def _plain(frame: pd.DataFrame) -> list[dict]:
    import json

    return json.loads(frame.to_json(orient="records"))


def _write(target: Path, blocks: list[Block]) -> None:
    with atomic_path(target) as temporary:
        temporary.write_text(markdown(blocks), encoding="utf-8")
