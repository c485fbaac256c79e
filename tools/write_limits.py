"""Write what the tree layer's pages say of the code: ``docs/analyst/quality-limits.md``, and the methods and reasons in
``docs/technician/tree-layer.md``.

Run with the engine's Python by ``make parameters`` after a limit, a reason or a method changed; a test compares.
"""

from __future__ import annotations

import sys

from written import ROOT, write_or_check

LIMITS_PAGE = ROOT / "docs" / "analyst" / "quality-limits.md"
LAYER_PAGE = ROOT / "docs" / "technician" / "tree-layer.md"

_HEAD = """# Quality limits

*Reference: from where on a tree is flagged or refused, and what set each limit.*

Every limit that flags a tree (`check`) or refuses it (`reject`, no DBH), as `treedgs_geo/stems/quality/limits.py`
holds them. A value on a limit passes. What the reasons mean and what to do about them:
[tree layer](../technician/tree-layer.md#reasons).
Settings are named `like_this`; `least_points` is {points},
and `least_at_bh` a quarter of it.
A fit that fails altogether is refused with the reason of the step that failed.

<!-- Written by tools/write_limits.py (make parameters): change the table there. -->
"""

_PREDICTORS = """
What decides nothing by itself adds up: the probability that a diameter is not the stem's. From {check:g} % on the stem
is flagged, its reasons are the predictors that make it so; above {reject:g} % it is refused. The interval is as wide as
that probability asks for. Log odds where nothing speaks against a stem: {nothing:g}.
[How it was set, and how it holds](../evidence/photos.md).
"""

_TITLES = {
    "photos": "Stems fitted in the photos",
    "points": "Stems measured in a point cloud",
    "survey": "The whole survey",
}


def limits_text() -> str:
    """``docs/analyst/quality-limits.md``: one table a route, in the order in which reasons are listed."""
    from treedgs_geo.stems.cloud.propose.sensors import SENSORS
    from treedgs_geo.stems.quality.findings import TOGETHER
    from treedgs_geo.stems.quality.limits import INTERCEPT, LIMITS, PREDICTORS, WRONG_CHECK, WRONG_REJECT

    points = ", ".join(f"{sensor.least_points} for `{name}`" for name, sensor in SENSORS.items())
    parts = [_HEAD.format(points=points)]
    for route, limits in LIMITS.items():
        parts.append(f"\n## {_TITLES[route]}\n")
        if route in TOGETHER:
            parts.append(f"{TOGETHER[route]} independent reasons for `check` refuse the tree together.\n")
        parts.append("| reason | measured | `check` | `reject` | set on |\n|---|---|---|---|---|")
        for limit in limits:
            bounds = (
                "" if bound is None else f"{limit.side} {bound.text(limit.unit)}"
                for bound in (limit.check, limit.reject)
            )
            parts.append(f"| `{limit.reason}` | {limit.measured} | {' | '.join(bounds)} | {limit.source} |")
        if route == "photos":
            parts.append(_PREDICTORS.format(check=100 * WRONG_CHECK, reject=100 * WRONG_REJECT, nothing=INTERCEPT))
            rows = (f"| `{reason}` | {measured} | {weight:g} |" for reason, measured, weight in PREDICTORS.values())
            parts.append("| reason | predictor | log odds a unit |\n|---|---|---|\n" + "\n".join(rows))
    return "\n".join(parts) + "\n"


def _rows(head: str, rows: list[str]) -> str:
    return "\n".join([head, "|" + "---|" * (head.count("|") - 1), *rows]) + "\n"


def layer_text(page: str) -> str:
    """``docs/technician/tree-layer.md`` with its tables of methods and reasons written anew between their marks."""
    from treedgs_geo.stems.quality.methods import METHODS
    from treedgs_geo.stems.quality.reasons import REASONS

    tables = {
        "methods": _rows("| method | what it is |", [f"| `{name}` | {text} |" for name, text in METHODS.items()]),
        "reasons": _rows(
            "| reason | meaning | what to do |",
            [f"| `{name}` | {meaning} | {action} |" for name, (meaning, action) in REASONS.items()],
        ),
    }
    for name, table in tables.items():
        start, end = f"<!-- {name}: written by tools/write_limits.py -->\n", f"<!-- end of {name} -->"
        before, rest = page.split(start)
        page = before + start + table + rest[rest.index(end) :]
    return page


def main() -> int:
    """Write both pages, or with ``--check`` only say whether they are up to date."""
    return write_or_check(
        ((LIMITS_PAGE, limits_text()), (LAYER_PAGE, layer_text(LAYER_PAGE.read_text(encoding="utf-8"))))
    )


if __name__ == "__main__":
    sys.exit(main())
