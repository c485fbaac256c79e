"""What ``treedgs benchmark --suite stability`` does: the suite, kept and resumed in one output folder."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from treedgs_geo.core.errors import InputError, TreeDGSError
from treedgs_geo.core.files import ensure_writable, write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.report.charts import write_chart
from treedgs_geo.report.html import write_html

from ..records import machine, rows_of, write_markdown, write_table
from . import report
from .cases import METHODS, Case, all_cases, run_cases
from .factors import FACTORS


@dataclass(frozen=True)
class StabilityChoice:
    """Which cases of the stability suite to run. only: keys of factors and methods; of a kind that has none, all."""

    seeds: list[int]
    only: list[str] = field(default_factory=list)

    def cases(self) -> list[Case]:
        """Those cases; :class:`.InputError` for a key that is none."""
        methods = [key for key in self.only if key in METHODS]
        factors = [key for key in self.only if key not in METHODS]
        known = [factor.key for factor in FACTORS]
        if unknown := [key for key in factors if key not in known]:
            said = ", ".join(sorted([*known, *METHODS]))
            raise InputError(f"--only: {unknown[0]!r} is no factor and no method; known: {said}.")
        cases = all_cases(self.seeds, factors, methods)
        if not cases:
            raise InputError("--only: the method does not read what the factors given trouble; choose others.")
        return cases


def run_stability(output: Path, chosen: StabilityChoice, budget_min: float, reporter: Reporter) -> dict[str, Any]:
    """The stability suite. Files: ``stability.{csv,json,md,html}``, ``stability-curves.{svg,png}``."""
    began = time.monotonic()
    ensure_writable(output / "stability.json")
    cases = chosen.cases()
    with reporter.stage("cases", 0.0, 0.97):
        records = list(run_cases(cases, output, reporter, 60 * budget_min))
    if len(records) < len(cases):
        reporter.warn(f"{len(records)} of {len(cases)} cases are done (out of time); run again to go on.")
    return {
        **write_stability(output, records, len(cases)),
        "n_cases": len(records),
        "n_wanted": len(cases),
        "seconds": round(time.monotonic() - began),
    }


def write_stability(output: Path, records: list[dict], wanted: int) -> dict[str, Any]:
    """Tables, pictures and page of the records; wanted: cases that there should be."""
    if not records:
        raise TreeDGSError("No case was run, so there is nothing to report; leave --quick out.")
    table = report.tree_rows(records)
    levels = report.by_level(table)
    claim = report.verdict(table)
    factors = report.by_factor(table)
    codes = sorted({record["code"] for record in records})
    facts = {
        "machine": machine(),
        "seeds": sorted({record["seed"] for record in records}),
        "cases": len(records),
        "wanted": wanted,
        "measuring_code": codes,
    }
    tables = {"stability.csv": levels, "stability-trees.csv": table, "stability-factors.csv": factors}
    for name, frame in tables.items():
        write_table(output / name, frame)
    wrong = report.lies(table)
    write_json(
        output / "stability.json",
        {**facts, "verdict": claim, "lies": rows_of(wrong), "levels": rows_of(levels)},
    )
    said = [*report.report_blocks(table, levels, facts), report.factor_table(factors)]
    write_markdown(output / "stability.md", said)
    curves = write_chart(output, "stability-curves", report.draw_curves(levels)).data
    write_html(output / "stability.html", report.document(said, curves))
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
