"""What the stability suite says: errors, refusals and interval coverage against severity, and who lied; and the verdict
factor by factor, with chance reckoned with."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binom, binomtest

from treedgs_geo.core.intervals import LEVEL
from treedgs_geo.report.blocks import Block, Column, Document, Heading, Paragraph, Picture, Sentences, Table, known
from treedgs_geo.report.charts import BLUE, VERMILION, new_chart

from .factors import FACTORS, Factor

#: An accepted tree farther off than this, or than so many of its stated errors, is a lie.
LIE_CM, LIE_SE = 2.0, 3.0
#: The claim to hold.
MAX_LIES, COVERAGE = 0.02, (0.85, 0.95)
#: With fewer accepted trees, 2 % and 90 % cannot be distinguished from chance.
ENOUGH = 50
LOOKS = {"photos": (BLUE, "o", "-"), "lidar": (VERMILION, "^", "-")}


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
            about = {"factor": factor.key, "level": level, "unit": factor.unit}
            rows += [{**about, "method": method, **figures(own)} for method, own in part.groupby("method", sort=False)]
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
        covered = found["coverage"]
        result[method] = {
            **found,
            "lie_share": None if share is None else round(share, 4),
            "holds": share is not None and share <= MAX_LIES,
            "coverage_holds": covered is not None and COVERAGE[0] <= covered <= COVERAGE[1],
        }
    return result


def lies(table: pd.DataFrame) -> pd.DataFrame:
    """Every lie, worst first."""
    found = table[table["lie"] & ~table["base"]]
    columns = ["method", "factor", "level", "seed", "tree_id", "kind", "clear"]
    columns += ["true_cm", "read_cm", "error_cm", "se_cm", "lo_cm", "hi_cm"]
    return found.sort_values("error_cm", key=lambda e: -e.abs().fillna(99))[columns].reset_index(drop=True)


def in_words(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows with title and unit in place of ``factor`` and ``level``."""
    known = {factor.key: factor for factor in FACTORS}
    return [
        {**row, "factor": known[row["factor"]].title, "level": known[row["factor"]].label_with_unit(row["level"])}
        for row in table.to_dict("records")
    ]


def draw_curves(levels: pd.DataFrame) -> Any:
    """A panel a factor, every method against severity: RMSE of what it measured, the share it refused, and how many of
    the accepted lie inside their 90 % interval."""
    factors = [factor for factor in FACTORS if (levels["factor"] == factor.key).any()]
    columns = max(min(5, len(factors)), 2)
    rows = -(-len(factors) // columns)
    shape = {"nrows": 3 * rows, "ncols": columns, "squeeze": False, "height_ratios": [2, 1, 1] * rows}
    figure, grid = new_chart(2.6 * columns, 3.3 * rows, False, **shape)
    panels = grid.reshape(rows, 3, columns).transpose(0, 2, 1).reshape(-1, 3)
    for axes in panels[len(factors) :].flat:
        axes.set_visible(False)
    shown: dict[str, Any] = {}
    for factor, parts in zip(factors, panels, strict=False):
        _curves(parts, levels[levels["factor"] == factor.key], factor)
        handles, labels = parts[0].get_legend_handles_labels()
        shown |= dict(zip(labels, handles, strict=True))
        if parts[0].get_subplotspec().is_first_col():
            for axes, label in zip(parts, ("RMSE, cm", "% refused", "% in 90 %"), strict=True):
                axes.set_ylabel(label, fontsize=7)
    methods = [method for method in LOOKS if method in shown]
    figure.legend([shown[method] for method in methods], methods, ncols=5, fontsize=8, loc="outside upper center")
    return figure


def _curves(parts: np.ndarray, levels: pd.DataFrame, factor: Factor) -> None:
    above, middle, below = parts
    above.set_title(factor.title, fontsize=8, pad=3)
    for axes in parts:
        axes.set_xticks(range(len(factor.levels)), [])
        axes.set_xlim(-0.5, len(factor.levels) - 0.5)
        axes.tick_params(labelsize=7)
    below.set_xticks(range(len(factor.levels)), [factor.label(level) for level in factor.levels], fontsize=7)
    below.set_xlabel(factor.unit, fontsize=7, labelpad=1)
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
    for axes in (middle, below):
        axes.set_ylim(-5, 105)
        axes.set_yticks([0, 100], ["0", "100"], fontsize=7)


def report_blocks(table: pd.DataFrame, levels: pd.DataFrame, facts: dict[str, Any]) -> list[Block]:
    """The claim, what misses it, and the methods level by level."""
    seeds = ", ".join(str(seed) for seed in facts["seeds"])
    done = "all" if facts["cases"] == facts["wanted"] else f"only {facts['cases']} of"
    wrong = lies(table)
    return [
        Paragraph(f"Seeds {seeds}; {done} {facts['wanted']} cases; TreeDGS {facts['machine']['version']}."),
        _verdict_table(table),
        Paragraph(f"Accepted and wrong: {len(wrong)}."),
        *([_lies_table(wrong.head(40))] if len(wrong) else ()),
        _levels_table(levels),
    ]


def _verdict_table(table: pd.DataFrame) -> Table:
    rows = []
    for method, found in verdict(table).items():
        claimed = "holds" if found["holds"] else "missed" if found["ok"] else "accepts none"
        covers = "holds" if found["coverage_holds"] else "missed" if found["bounded"] else "–"
        if 0 < found["ok"] < ENOUGH and not found["lies"]:
            claimed = "too few to say"
        if 0 < found["bounded"] < ENOUGH:
            covers = "too few to say"
        rows.append({**found, "method": method, "claimed": claimed, "covers": covers})
    columns = [
        Column("method", "method"),
        Column("stems", "stems", 0),
        Column("measured", "measured", 0),
        Column("ok", "ok", 0),
        Column("ok_stems", "of so many stems", 0),
        Column("lies", f"ok, off by > {LIE_CM:g} cm or {LIE_SE:g} stated errors", 0),
        Column("lie_share", "share, %", 1, 100),
        Column("claimed", "claim (at most 2 %)"),
        Column("coverage", "ok inside 90 % interval, %", 0, 100),
        Column("bounded", "of", 0),
        Column("covers", "claim (85-95 %)"),
    ]
    return Table("verdict", "", columns, rows)


def _lies_table(wrong: pd.DataFrame) -> Table:
    rows = [
        {
            **row,
            "stem": f"{row['tree_id']} ({row['kind']})",
            "true_cm": known(row["true_cm"]) or "nothing stands there",
            "clear": known(row["clear"]),
        }
        for row in in_words(wrong)
    ]
    columns = [
        Column("method", "method"),
        Column("factor", "factor"),
        Column("level", "level"),
        Column("seed", "seed"),
        Column("stem", "stem"),
        Column("true_cm", "true cm", 1),
        Column("read_cm", "read cm", 1),
        Column("clear", "clear views", 0),
    ]
    return Table("wrong", "", columns, rows)


def _levels_table(levels: pd.DataFrame) -> Table:
    columns = [
        Column("factor", "factor"),
        Column("level", "level"),
        Column("method", "method"),
        Column("stems", "stems", 0),
        Column("refused", "refused, %", 0, 100),
        Column("ok", "ok", 0),
        Column("rmse_ok_cm", "RMSE of ok, cm", 2),
        Column("worst_ok_cm", "worst ok, cm", 2),
        Column("lies", "wrong", 0),
        Column("coverage", "in 90 %, %", 0, 100),
    ]
    return Table("levels", "", columns, in_words(levels))


def document(blocks: list[Block], curves: bytes) -> Document:
    """The page. curves: :func:`draw_curves` as SVG."""
    about = Sentences([f"{factor.title} ({factor.unit}): {factor.about}" for factor in FACTORS])
    subtitle = "Does a method refuse or widen its interval as a case gets hopeless?"
    blocks = [*blocks, Heading("Curves"), Picture("curves", curves), Heading("Factors"), about]
    return Document("Stability where methods fail", subtitle, blocks, wide=True)


#: A share is taken for missed where fewer than this of such samples would come out so, were it inside the range.
CHANCE = 0.05


#: Strata beside the factors: the first level of all of them, each stand once, and everything together.
UNTROUBLED, ALL = "untroubled", "all"


def by_factor(table: pd.DataFrame) -> pd.DataFrame:
    """One row a method and stratum: every factor's troubled levels, the untroubled ones, and all of them, which are the
    figures of :func:`.report.verdict`.

    table: :func:`.report.tree_rows`. Columns: ``factor``, ``title`` (in words), ``method``; ``ok`` and
    ``ok_inside``, accepted trees that give an interval and those whose interval holds the truth; ``stems``, how many
    different stems these are; ``wrong``, accepted ones that are wrong, false trees too; ``worst_cm`` of the accepted;
    ``measured`` and ``inside``, the same with the flagged ones; ``holds``: "holds", "missed", or "by chance" where the
    share of accepted trees is outside the 85 to 95 % asked, but no farther than chance takes so few.
    """
    firsts = {factor.key: factor.levels[0] for factor in FACTORS}
    first = table["level"] == table["factor"].map(firsts)
    once = ~table["base"].astype(bool)
    strata = {factor.key: (factor.title, ~first & (table["factor"] == factor.key)) for factor in FACTORS}
    strata |= {UNTROUBLED: ("nothing: the stands as they are", first & once), ALL: ("all together", once)}
    rows = []
    for key, (title, chosen) in strata.items():
        own = table[chosen]
        part = own[~own["false"].astype(bool)]
        for method in (name for name in LOOKS if (part["method"] == name).any()):
            read = part[(part["method"] == method) & part["lo_cm"].notna() & part["error_cm"].notna()]
            ok = read[read["flag"] == "ok"]
            rows.append(
                {
                    "factor": key,
                    "title": title,
                    "method": method,
                    "stems": distinct(ok),
                    "ok": len(ok),
                    "wrong": int(own.loc[own["method"] == method, "lie"].sum()),
                    "worst_cm": round(float(ok["error_cm"].abs().max()), 2) if len(ok) else None,
                    "ok_inside": int(ok["inside"].sum()),
                    "measured": len(read),
                    "inside": int(read["inside"].sum()),
                    "holds": holds(int(ok["inside"].sum()), len(ok)),
                }
            )
    return pd.DataFrame(rows)


def holds(inside: int, of: int) -> str:
    """Whether ``inside`` of ``of`` intervals is 85 to 95 %; empty where there are none."""
    if not of:
        return ""
    low, high = COVERAGE
    share = inside / of
    if low <= share <= high:
        return "holds"
    near, side = (low, "less") if share < low else (high, "greater")
    return "missed" if binomtest(inside, of, near, side).pvalue < CHANCE else "by chance"


def by_chance(of: int) -> tuple[int, int]:
    """Fewest and most of ``of`` right intervals of 90 % that hold the truth, nine times in ten.

    Were the trees strangers to each other: the levels of a factor share their stand, and what one stem has of its own
    counts at each of them.
    """
    low, high = binom.interval(LEVEL, of, LEVEL)
    return int(low), int(high)


def factor_table(factors: pd.DataFrame) -> Table:
    """The same as a table of the page."""
    rows = [
        {
            **row,
            "factor": row["title"],
            "chance": " to ".join(map(str, by_chance(row["ok"]))) if row["ok"] else None,
            "share": row["ok_inside"] / row["ok"] if row["ok"] else None,
            "holds": row["holds"] or None,
            "all": row["inside"] / row["measured"],
        }
        for row in factors[factors["measured"] > 0].to_dict("records")
    ]
    columns = [
        Column("factor", "factor"),
        Column("method", "method"),
        Column("stems", "stems", 0),
        Column("wrong", "wrong", 0),
        Column("ok_inside", "ok inside 90 % interval", 0),
        Column("ok", "of ok", 0),
        Column("chance", "chance"),
        Column("share", "share, %", 0, 100),
        Column("holds", "claim (85-95 %)"),
        Column("all", "all measured: inside, %", 0, 100),
        Column("measured", "of", 0),
    ]
    return Table(
        "factors",
        "Intervals factor by factor",
        columns,
        rows,
        "Each factor over the levels that trouble, the untroubled ones apart. By chance: outside 85 to 95 %, but no "
        "farther than chance takes so few; right "
        "intervals give the number under chance nine times in ten.",
    )
