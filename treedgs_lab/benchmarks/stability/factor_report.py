"""The verdict stratum by stratum (a factor is one): wrong diameters, and intervals, with chance reckoned with."""

from __future__ import annotations

import pandas as pd
from scipy.stats import binom, binomtest

from treedgs_geo.core.intervals import LEVEL
from treedgs_geo.report.blocks import Column, Table

from .factors import FACTORS
from .report import COVERAGE, LOOKS, distinct

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
