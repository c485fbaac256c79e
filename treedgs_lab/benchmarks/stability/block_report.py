"""What the stability suite says of blocks: refused, how true, and whether what was accepted has a wrong scale."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.report.blocks import Block, Column, Sentences, Table
from treedgs_geo.report.charts import BLUE, VERMILION

from ..blocks import WRONG_SCALE_SD, WRONG_SCALE_SHARE, wrong_scale
from .factor_type import Factor
from .factors import FACTORS
from .report import factor_panels, in_words

#: Scale errors beyond this are drawn at the edge, %.
_MAX_PCT = 3.0


def block_rows(records: list[dict]) -> pd.DataFrame:
    """One row a case that ran the whole chain (records with ``block``).

    Columns: ``factor, level, seed, method, refused`` (the message), ``registered`` (share of the photos),
    ``turned_photos`` (of them, looking elsewhere),
    ``centre_rms_cm`` (3-D), ``focal_error_pct`` (of the worst flight), ``scale_sd_pct`` (stated), ``scale_error_pct``
    (of widths at breast height), ``ok_error_pct`` (median error of the ok trees, of their diameter), ``ok_trees``,
    ``wrong_scale`` and ``wrong_ok_scale``: ok trees although ``scale_error_pct``, or their own median error, is beyond
    what is stated. ``by_plot``: stems measured in each plot, where there are several. ``base``: the untroubled flight,
    which is every factor's first level, in all but the first. NaN or None where nothing was reconstructed or no tree is
    ok.
    """
    firsts = {factor.key: factor.levels[0] for factor in FACTORS}
    seen: set[tuple] = set()
    rows = []
    for record in (record for record in records if "block" in record):
        first = record["level"] == firsts[record["factor"]]
        key = (record["seed"], record["method"])
        rows.append({**_block_row(record), "base": first and key in seen})
        if first:
            seen.add(key)
    return pd.DataFrame(rows)


def _block_row(record: dict) -> dict[str, Any]:
    block = record["block"]
    good = [row for row in record["rows"] if row["flag"] == "ok" and row["true_cm"] is not None]
    median = float(np.median([row["read_cm"] / row["true_cm"] - 1 for row in good])) if good else None
    stated, scale = block.get("scale_sd"), block.get("scale_error")
    return {
        **{name: record[name] for name in ("factor", "level", "seed", "method", "refused")},
        "registered": block["registered"] / block["photos"] if block else None,
        "turned_photos": block.get("turned_photos"),
        "centre_rms_cm": block.get("centre_rms_3d_cm"),
        "focal_error_pct": max(block["focal_error_pct"], key=abs) if block else None,
        "scale_sd_pct": _pct(stated),
        "scale_error_pct": _pct(scale),
        "ok_trees": len(good),
        "ok_error_pct": _pct(median),
        "wrong_scale": wrong_scale(scale, stated) if good else None,
        "wrong_ok_scale": wrong_scale(median, stated),
        "by_plot": _by_plot(record["rows"]),
    }


def _pct(share: float | None) -> float | None:
    return None if share is None else round(100 * share, 4)


def _by_plot(rows: list[dict]) -> str:
    """Stems measured of those that stand in each plot of a flight over several; empty for one plot."""
    counts: dict[str, list[int]] = {}
    for row in rows:
        if row.get("plot_id"):
            one = counts.setdefault(str(row["plot_id"]), [0, 0])
            one[0] += row["read_cm"] is not None
            one[1] += 1
    return ", ".join(f"{plot}: {measured} of {stems}" for plot, (measured, stems) in sorted(counts.items()))


def with_blocks(levels: pd.DataFrame, blocks: pd.DataFrame) -> pd.DataFrame:
    """The table by level with the figures of its blocks (:func:`by_block_level`) where there are any."""
    keys = ["factor", "level", "method"]
    found = by_block_level(blocks)
    return levels.merge(found, on=keys, how="left") if len(found) else levels


def by_block_level(blocks: pd.DataFrame) -> pd.DataFrame:
    """Factor and level: cases, how many were refused, the worst of each figure of the others, and how many have ok
    trees and a wrong scale."""
    rows = []
    for keys, part in blocks.groupby(["factor", "level", "method"], sort=False) if len(blocks) else ():
        rows.append(
            {
                **dict(zip(("factor", "level", "method"), keys, strict=True)),
                "cases": len(part),
                "cases_refused": int((part["refused"] != "").sum()),
                "least_registered": part["registered"].astype(float).min(),
                **{
                    name: _worst(part[name])
                    for name in ("centre_rms_cm", "focal_error_pct", "scale_sd_pct", "scale_error_pct", "ok_error_pct")
                },
                "turned_photos": _worst(part["turned_photos"]),
                **{name: _count(part[name]) for name in ("wrong_scale", "wrong_ok_scale")},
                "by_plot": "; ".join(text for text in part["by_plot"] if text),
            }
        )
    return pd.DataFrame(rows)


def _count(answers: pd.Series) -> int:
    """How many of True, False and None are True."""
    return sum(answer is True or answer is np.True_ for answer in answers)


def _worst(values: pd.Series) -> float:
    """The value farthest from zero; NaN where there is none."""
    numbers = values.astype(float).dropna()
    return float(numbers.loc[numbers.abs().idxmax()]) if len(numbers) else float("nan")


def block_report(blocks: pd.DataFrame) -> list[Block]:
    """Level by level what the reconstruction made of the flights, every wrong scale, and the refusals in their words;
    nothing without cases."""
    if not len(blocks):
        return []
    once = blocks[~blocks["base"]]
    columns = [
        Column("factor", "factor"),
        Column("level", "level"),
        Column("cases", "cases", 0),
        Column("cases_refused", "refused", 0),
        Column("least_registered", "registered, %", 0, 100),
        Column("turned_photos", "turned", 0),
        Column("centre_rms_cm", "centres, cm", 1),
        Column("focal_error_pct", "focal length, %", 2, signed=True),
        Column("scale_sd_pct", "stated scale error, %", 2),
        Column("scale_error_pct", "scale error, %", 2, signed=True),
        Column("ok_error_pct", "median ok tree, %", 2, signed=True),
        Column("wrong_scale", "wrong scale: block", 0),
        Column("wrong_ok_scale", "ok trees", 0),
    ]
    note = (
        f"Nothing true: {len(once)} cases, {(once['refused'] != '').sum()} refused, {_count(once['wrong_scale'])} "
        f"with ok trees in a block whose scale is off by more than {WRONG_SCALE_SD:g} stated standard errors and "
        f"{100 * WRONG_SCALE_SHARE:g} % ({_count(once['wrong_ok_scale'])} by the median of the ok trees). By level, "
        "the worst of the seeds."
    )
    table = Table("blocks", "Through the reconstruction", columns, in_words(by_block_level(blocks)), note)
    return [table, Sentences(_named(blocks))]


def _named(blocks: pd.DataFrame) -> list[str]:
    """Refusals in their own words, and plots of flights over several, case by case."""
    listed = []
    for row in in_words(blocks):
        where = f"{row['factor']}, {row['level']}, seed {row['seed']}"
        if row["refused"]:
            listed.append(f"{where}: refused: {row['refused']}")
        if row["by_plot"]:
            listed.append(f"{where}: measured in {row['by_plot']}.")
    return listed


def draw_blocks(blocks: pd.DataFrame) -> Any:
    """A panel a factor: error of the scale, case by case, on the band that is stated; below it the camera centres."""
    figure, panels = factor_panels(blocks, 4, 3.1, 3.0, [2, 1])
    for factor, (above, below) in panels:
        _block_panel(above, below, blocks[blocks["factor"] == factor.key], factor)
        if above.get_subplotspec().is_first_col():
            above.set_ylabel("scale error, %", fontsize=7)
            below.set_ylabel("centres, cm", fontsize=7)
    figure.suptitle(
        f"Through the reconstruction: error of the block's scale on what it states (grey: {WRONG_SCALE_SD:g} standard "
        f"errors and {100 * WRONG_SCALE_SHARE:g} %).\nFilled: has ok trees; red: beyond it; cross: refused. "
        "Below: camera centres, RMS",
        fontsize=9,
    )
    return figure


def _block_panel(above: Any, below: Any, part: pd.DataFrame, factor: Factor) -> None:
    above.axhline(0, color="black", lw=0.7)
    for place, level in enumerate(factor.levels):
        cases = part[part["level"] == level].to_dict("records")
        for x, row in zip(place + np.linspace(-0.25, 0.25, max(len(cases), 2)), cases, strict=False):
            if row["refused"]:
                above.scatter([x], [0], marker="x", s=26, color="black", zorder=4)
                continue
            if pd.isna(row["scale_error_pct"]):
                continue
            half = WRONG_SCALE_SD * np.nan_to_num(float(row["scale_sd_pct"] or 0.0)) + 100 * WRONG_SCALE_SHARE
            above.bar(x, 2 * half, width=0.16, bottom=-half, color="0.85", zorder=1)
            error = float(row["scale_error_pct"])
            colour = VERMILION if abs(error) > half else BLUE
            face = colour if row["ok_trees"] else "none"
            above.scatter(
                [x], [np.clip(error, -_MAX_PCT, _MAX_PCT)], s=16, facecolors=face, edgecolors=colour, zorder=3
            )
            below.scatter([x], [max(float(row["centre_rms_cm"]), 0.1)], s=10, color=BLUE)
    above.set_ylim(-1.07 * _MAX_PCT, 1.07 * _MAX_PCT)
    below.set_yscale("log")
    below.set_ylim(0.1, 1000)
    below.set_yticks([1, 100], ["1", "100"])
