"""What the stability suite says: errors, refusals and interval coverage against severity, and who lied."""

from __future__ import annotations

import html
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.inventory.accuracy.charts import BLUE, VERMILION

from .factor_type import Factor
from .factors import FACTORS

#: An accepted tree farther off than this, or than so many of its stated errors, is a lie.
LIE_CM, LIE_SE = 2.0, 3.0
#: The claim to hold.
MOST_LIES, COVERAGE = 0.02, (0.85, 0.95)
#: With fewer accepted trees, 2 % and 90 % cannot be distinguished from chance.
ENOUGH = 50
#: Our own methods: their levels and lies are listed one by one.
REPORTED = ("photos", "splats", "whole chain", "lidar")
GREEN, PURPLE, SKY = "#009E73", "#CC79A7", "#56B4E9"
ORANGE = "#E69F00"
LOOKS = {
    "photos": (BLUE, "o", "-"),
    "splats": (ORANGE, "X", "-"),
    "whole chain": ("black", "P", "-"),
    "lidar": (VERMILION, "^", "-"),
    "lidar cylinder": (GREEN, "s", "--"),
    "lidar circle": (PURPLE, "v", ":"),
    "lidar circle intensity": (SKY, "D", ":"),
}


def tree_rows(records: list[dict]) -> pd.DataFrame:
    """One row a stem and case; ``error_cm``; ``lie``: flagged ok and farther off than 2 cm or three
    stated errors, or where nothing stands.

    Factors of one stand share the measurement of its untroubled level: it is ``base`` in all but the first.
    """
    seen: set[tuple] = set()
    rows = []
    for record in records:
        factor = next(f for f in FACTORS if f.key == record["factor"])
        first = record["level"] == factor.levels[0]
        key = (record["stand"], record["method"])
        repeated = first and key in seen
        if first:
            seen.add(key)
        for row in record["rows"]:
            rows.append(
                {
                    **{name: record[name] for name in ("factor", "level", "seed", "stand", "method")},
                    **row,
                    "false": bool(row.get("false")),
                    "base": repeated,
                }
            )
    table = pd.DataFrame(rows)
    table["error_cm"] = pd.to_numeric(table["read_cm"]) - pd.to_numeric(table["true_cm"])
    table["inside"] = (table["lo_cm"].astype(float) <= table["true_cm"].astype(float)) & (
        table["true_cm"].astype(float) <= table["hi_cm"].astype(float)
    )
    ok = table["flag"] == "ok"
    off = table["error_cm"].abs()
    beyond = (off > LIE_CM) | (off > LIE_SE * table["se_cm"].astype(float))
    table["lie"] = ok & (table["false"] | beyond)
    return table


def distinct(rows: pd.DataFrame) -> int:
    """Different stems among rows: the same one stands in many levels and factors."""
    return len(rows[["seed", "stand", "tree_id"]].drop_duplicates())


def by_level(table: pd.DataFrame) -> pd.DataFrame:
    """Factor, level and method: stems, shares refused, checked and ok, RMSE, lies, coverage (of ok trees)."""
    rows = []
    for factor in FACTORS:
        for level in factor.levels:
            part = table[(table["factor"] == factor.key) & (table["level"] == level)]
            for method in dict.fromkeys(part["method"]):
                rows.append(
                    {
                        "factor": factor.key,
                        "level": level,
                        "unit": factor.unit,
                        "method": method,
                        **figures(part[part["method"] == method]),
                    }
                )
    return pd.DataFrame(rows)


def figures(part: pd.DataFrame) -> dict[str, Any]:
    """Counts and errors of some rows of one method."""
    stems = part[~part["false"]]
    read, ok = stems[stems["error_cm"].notna()], part[part["flag"] == "ok"]
    good = ok[~ok["false"]]
    bounded = good[good["lo_cm"].notna()]

    def rmse(rows: pd.DataFrame) -> float | None:
        return round(float(np.sqrt((rows["error_cm"] ** 2).mean())), 3) if len(rows) else None

    return {
        "seeds": part["seed"].nunique(),
        "stems": len(stems),
        "measured": len(read),
        "refused": round(1 - len(read) / len(stems), 3) if len(stems) else None,
        "ok": len(ok),
        "ok_stems": distinct(good),
        "rmse_cm": rmse(read),
        "rmse_ok_cm": rmse(good),
        "worst_ok_cm": round(float(good["error_cm"].abs().max()), 2) if len(good) else None,
        "lies": int(part["lie"].sum()),
        "bounded": len(bounded),
        "coverage": round(float(bounded["inside"].mean()), 3) if len(bounded) else None,
    }


def verdict(table: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """The claim, method by method, over the whole suite (the untroubled level counted once)."""
    result = {}
    once = table[~table["base"]]
    for method in dict.fromkeys(table["method"]):
        found = figures(once[once["method"] == method])
        share = found["lies"] / found["ok"] if found["ok"] else None
        holds = share is not None and share <= MOST_LIES
        covered = found["coverage"] is not None and COVERAGE[0] <= found["coverage"] <= COVERAGE[1]
        result[method] = {
            **found,
            "lie_share": None if share is None else round(share, 4),
            "holds": holds,
            "coverage_holds": covered,
        }
    return result


def lies(table: pd.DataFrame) -> pd.DataFrame:
    """Every lie, worst first."""
    found = table[table["lie"] & ~table["base"]]
    columns = [
        "method",
        "factor",
        "level",
        "seed",
        "tree_id",
        "kind",
        "clear",
        "true_cm",
        "read_cm",
        "error_cm",
        "se_cm",
        "lo_cm",
        "hi_cm",
    ]
    return found.sort_values("error_cm", key=lambda e: -e.abs().fillna(99))[columns].reset_index(drop=True)


def draw_errors(table: pd.DataFrame, method: str) -> Any:
    """A panel a factor: signed errors against severity; under it the share refused and the interval's coverage."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    own = table[table["method"] == method]
    factors = [f for f in FACTORS if (own["factor"] == f.key).any()]
    columns = max(min(4, len(factors)), 2)
    figure, grid = plt.subplots(
        -(-len(factors) // columns),
        columns,
        squeeze=False,
        dpi=110,
        figsize=(3.1 * columns, 2.25 * -(-len(factors) // columns)),
    )
    for axes in grid.flat[len(factors) :]:
        axes.set_visible(False)
    for axes, factor in zip(grid.flat, factors, strict=False):
        _panel(axes, own[own["factor"] == factor.key], factor)
    figure.suptitle(
        f"{method}: DBH error, cm, from harmless (left) to hopeless. Filled: ok; hollow: to check; "
        "crosses: beyond 8 cm.\nBelow each level: share refused; ok trees inside their 90 % interval",
        fontsize=9,
    )
    figure.tight_layout(rect=(0, 0, 1, 0.985))
    return figure


def _panel(axes: Any, part: pd.DataFrame, factor: Factor) -> None:
    axes.axhspan(-LIE_CM, LIE_CM, color="0.95", zorder=0)
    axes.axhline(0, color="black", lw=0.7)
    names = []
    for place, level in enumerate(factor.levels):
        rows = part[part["level"] == level]
        read = rows[rows["error_cm"].notna()]
        for flag, face in (("ok", BLUE), ("check", "none")):
            chosen = read[read["flag"] == flag]
            error = chosen["error_cm"].to_numpy(float)
            x = place + np.linspace(-0.22, 0.22, len(error)) if len(error) > 1 else np.full(len(error), place)
            near = np.abs(error) <= 8
            edge = BLUE if flag == "ok" else VERMILION
            axes.scatter(
                x[near],
                error[near],
                s=14,
                marker="o" if flag == "ok" else "^",
                facecolors=face,
                edgecolors=edge,
                linewidths=0.9,
                zorder=3,
            )
            axes.scatter(x[~near], np.sign(error[~near]) * 7.6, s=26, marker="x", color=edge, zorder=4)
        found = figures(rows)
        cover = "–" if found["coverage"] is None else f"{100 * found['coverage']:.0f}"
        gone = "–" if found["refused"] is None else f"{100 * found['refused']:.0f}"
        names.append(f"{factor.label(level)}\n{gone} %\n{cover} %")
    axes.set_xticks(range(len(factor.levels)), names, fontsize=7)
    axes.set_ylim(-8.4, 8.4)
    axes.set_yticks([-5, 0, 5])
    axes.tick_params(labelsize=7)
    axes.set_xlim(-0.5, len(factor.levels) - 0.5)
    axes.set_title(factor.title if factor.unit in factor.title else f"{factor.title}, {factor.unit}", fontsize=8, pad=3)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw_curves(levels: pd.DataFrame) -> Any:
    """Every method against severity: RMSE of what it measured, the share it refused, and how many of the accepted lie
    inside their 90 % interval (methods that give one)."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    factors = [f for f in FACTORS if (levels["factor"] == f.key).any()]
    columns = max(min(5, len(factors)), 2)
    rows = -(-len(factors) // columns)
    figure, grid = plt.subplots(
        3 * rows,
        columns,
        squeeze=False,
        dpi=110,
        figsize=(2.6 * columns, 3.3 * rows),
        gridspec_kw={"height_ratios": [2, 1, 1] * rows},
    )
    for number in range(rows * columns):
        parts = [grid[3 * (number // columns) + k, number % columns] for k in range(3)]
        if number < len(factors):
            _curves(parts, levels[levels["factor"] == factors[number].key], factors[number])
        else:
            for axes in parts:
                axes.set_visible(False)
        if number % columns == 0:
            for axes, label in zip(parts, ("RMSE, cm", "% refused", "% in 90 %"), strict=True):
                axes.set_ylabel(label, fontsize=7)
    handles, labels = [], []
    for axes in grid.flat:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            if label not in labels:
                handles.append(handle)
                labels.append(label)
    figure.legend(handles, labels, ncols=5, fontsize=8, loc="upper center", frameon=False)
    figure.tight_layout(rect=(0, 0, 1, 0.97))
    return figure


def _curves(parts: list[Any], levels: pd.DataFrame, factor: Factor) -> None:
    above, middle, below = parts
    place = {level: k for k, level in enumerate(factor.levels)}
    below.axhspan(100 * COVERAGE[0], 100 * COVERAGE[1], color="0.9", zorder=0)
    for method, (colour, mark, line) in LOOKS.items():
        part = levels[levels["method"] == method]
        if not len(part):
            continue
        x = [place[level] for level in part["level"]]
        look = {"color": colour, "marker": mark, "ls": line}
        above.plot(x, np.clip(part["rmse_cm"].astype(float), 0.1, 30), ms=4, lw=1.3, label=method, **look)
        middle.plot(x, 100 * part["refused"].astype(float), ms=3, lw=1, **look)
        below.plot(x, 100 * part["coverage"].astype(float), ms=3, lw=1, **look)
    above.set_yscale("log")
    above.set_ylim(0.1, 40)
    above.set_yticks([0.1, 1, 10], ["0.1", "1", "10"], fontsize=7)
    above.set_title(factor.title, fontsize=8, pad=3)
    for axes in (middle, below):
        axes.set_ylim(-5, 105)
        axes.set_yticks([0, 100], ["0", "100"], fontsize=7)
    for axes in (above, middle):
        axes.set_xticks(range(len(factor.levels)), [])
    below.set_xticks(range(len(factor.levels)), [factor.label(level) for level in factor.levels], fontsize=7)
    below.set_xlabel(factor.unit, fontsize=7, labelpad=1)


def markdown(table: pd.DataFrame, levels: pd.DataFrame, facts: dict[str, Any]) -> str:
    """The claim, what misses it, and photos and LiDAR level by level, for the docs."""
    seeds = ", ".join(str(seed) for seed in facts["seeds"])
    done = "all" if facts["cases"] == facts["wanted"] else f"**only {facts['cases']} of**"
    lines = [
        f"Seeds {seeds}; {done} {facts['wanted']} cases; TreeDGS {facts['machine']['version']}.",
        "",
        f"| method | stems | measured | ok | of so many stems | "
        f"ok, off by > {LIE_CM:g} cm or {LIE_SE:g} stated errors | "
        "share | claim (at most 2 %) | "
        "ok inside 90 % interval | claim (85-95 %) |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for method, found in verdict(table).items():
        share = "–" if found["lie_share"] is None else f"{100 * found['lie_share']:.1f} %"
        cover = "–" if found["coverage"] is None else f"{100 * found['coverage']:.0f} % of {found['bounded']}"
        claimed = "holds" if found["holds"] else "missed" if found["ok"] else "accepts none"
        covers = "holds" if found["coverage_holds"] else "missed" if found["bounded"] else "–"
        if 0 < found["ok"] < ENOUGH and not found["lies"]:
            claimed = "too few to say"
        if 0 < found["bounded"] < ENOUGH:
            covers = "too few to say"
        lines.append(
            f"| {method} | {found['stems']} | {found['measured']} | {found['ok']} | {found['ok_stems']} | "
            f"{found['lies']} | "
            f"{share} | {claimed} | {cover} | {covers} |"
        )
    wrong = lies(table)
    wrong = wrong[wrong["method"].isin(REPORTED)]
    lines += ["", f"Accepted and wrong ({', '.join(f'`{name}`' for name in REPORTED)}): {len(wrong)}.", ""]
    if len(wrong):
        lines += [
            "| method | factor | level | seed | stem | true cm | read cm | clear views |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for _, row in wrong.head(40).iterrows():
            true = "nothing stands there" if pd.isna(row["true_cm"]) else f"{row['true_cm']:.1f}"
            clear = "–" if pd.isna(row["clear"]) else f"{row['clear']:.0f}"
            lines.append(
                f"| {row['method']} | {row['factor']} | {row['level']:g} | {row['seed']} | {row['tree_id']} "
                f"({row['kind']}) | {true} | {row['read_cm']:.1f} | {clear} |"
            )
    lines += [
        "",
        "| factor | level | method | stems | refused | ok | RMSE of ok, cm | worst ok, cm | wrong | in 90 % |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    known = {one.key: one for one in FACTORS}
    for _, row in levels[levels["method"].isin(REPORTED)].iterrows():
        cells = ["–" if pd.isna(row[name]) else f"{row[name]:.2f}" for name in ("rmse_ok_cm", "worst_ok_cm")]
        place = known[row["factor"]].label_with_unit(row["level"])
        gone = "–" if pd.isna(row["refused"]) else f"{100 * row['refused']:.0f} %"
        cover = "–" if pd.isna(row["coverage"]) else f"{100 * row['coverage']:.0f} %"
        lines.append(
            f"| {row['factor']} | {place} | {row['method']} | {row['stems']} | "
            f"{gone} | {row['ok']} | {cells[0]} | {cells[1]} | {row['lies']} | {cover} |"
        )
    return "\n".join(lines) + "\n"


def page(text: str, pictures: dict[str, bytes]) -> str:
    """A self-contained page of the markdown tables and the pictures (SVG)."""
    parts = []
    for block in text.split("\n\n"):
        rows = [line for line in block.strip().splitlines() if line.startswith("|")]
        if not rows:
            parts.append(f"<p>{html.escape(block)}</p>")
            continue
        cells = [[html.escape(cell.strip()) for cell in row.strip("|").split("|")] for row in rows if "|---" not in row]
        body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in cells[1:])
        parts.append("<table><tr>" + "".join(f"<th>{cell}</th>" for cell in cells[0]) + f"</tr>{body}</table>")
    drawn = "".join(
        f"<h2>{html.escape(name)}</h2>{svg[svg.index(b'<svg') :].decode()}" for name, svg in pictures.items()
    )
    about = "".join(
        f"<li><b>{html.escape(f.title)}</b> ({html.escape(f.unit)}): {html.escape(f.about)}</li>" for f in FACTORS
    )
    return f"""<!doctype html><html lang="en"><meta charset="utf-8"><title>TreeDGS: stability</title><style>
body{{font:14px system-ui,sans-serif;margin:20px auto;max-width:1300px}}table{{border-collapse:collapse;font-size:12px}}
td,th{{padding:2px 7px;border-bottom:1px solid #ddd}}svg{{max-width:100%;height:auto}}</style>
<h1>Stability where methods fail</h1>{"".join(parts)}{drawn}<h2>Factors</h2><ul>{about}</ul></html>
"""
