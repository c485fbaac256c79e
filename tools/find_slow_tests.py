"""Write ``tests/slow_tests.txt`` from the times of a run: tests whose slowest case, with what it sets up, took longer.

.venv/bin/python -m pytest --junitxml build/tests.xml
python tools/find_slow_tests.py build/tests.xml [MORE.xml ...] [--seconds 0.5]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
SLOW_TESTS = ROOT / "tests" / "slow_tests.txt"


def slow_names(reports: list[Path], seconds: float) -> dict[str, float]:
    """Names (``tests/room/test_x.py::test_y``) -> seconds of all cases together, above the limit, slowest first."""
    taken: dict[str, float] = {}
    for case in (case for report in reports for case in ElementTree.parse(report).iter("testcase")):
        place, _, rest = case.get("classname", "").rpartition(".test_")
        module, _, group = f"test_{rest}".partition(".")
        parts = [f"{place.replace('.', '/')}/{module}.py", *filter(None, group.split("."))]
        name = "::".join([*parts, case.get("name", "").partition("[")[0]])
        taken[name] = taken.get(name, 0.0) + float(case.get("time", 0))
    return dict(sorted(((name, s) for name, s in taken.items() if s > seconds), key=lambda pair: -pair[1]))


def main() -> int:
    """Read, write, say how much is left."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reports", type=Path, nargs="+")
    parser.add_argument("--seconds", type=float, default=0.5)
    options = parser.parse_args()
    slow = slow_names(options.reports, options.seconds)
    head = f"# Tests that took more than {options.seconds:g} s, written by tools/find_slow_tests.py.\n"
    head += "# make quick leaves them out.\n"
    SLOW_TESTS.write_text(head + "".join(f"{name}\n" for name in sorted(slow)), encoding="utf-8")
    print(f"{len(slow)} slow tests, {sum(slow.values()):.0f} s", file=sys.stderr)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
