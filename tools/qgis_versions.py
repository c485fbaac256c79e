"""Does the plugin work in each QGIS? The whole of ``tests/qgis`` with three versions, and a table of how it went.

    sudo .venv/bin/python -m tools.qgis_versions 3.22 3.40 3.44

Each is run by ``tools/qgis.sh VERSION`` (3.40 and 3.44 in a Debian of their own). Writes
``docs/results/qgis_versions.json`` (versions that were not asked for keep their row) and the table of
``docs/developer/dependencies.md``. Root, and the network the first time.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import time
from collections.abc import Iterable
from datetime import date
from pathlib import Path
from typing import Any

from treedgs_lab.benchmarks.records import RESULTS, ROOT, commit, fill_page, write_record

FIGURES = RESULTS / "qgis_versions.json"
PAGE = ROOT / "docs" / "developer" / "dependencies.md"
COUNTED = ("passed", "failed", "skipped", "error")


def outcome(printed: str) -> dict[str, Any]:
    """What QGIS and pytest said: the version, what each test that did not pass is called, and how many there were."""
    last = next((line for line in reversed(printed.splitlines()) if re.search(r"\d+ \w+.* in [\d.]+s", line)), "")
    found = re.search(r"^QGIS (\d\S+)", printed, re.M)
    counts = {word: re.search(rf"(\d+) {word}", last) for word in COUNTED}
    return {
        "qgis": found[1] if found else "?",
        **{word: int(count[1]) if count else 0 for word, count in counts.items()},
        "did_not_pass": re.findall(r"^(?:FAILED|ERROR) (\S+)", printed, re.M),
    }


def run(version: str, log: Path) -> dict[str, Any]:
    """All of ``tests/qgis`` with one version."""
    began, tested = time.perf_counter(), commit()
    command = ["sh", "tools/qgis.sh", version, "tests/qgis"]
    with open(log, "w", encoding="utf-8") as stream:
        done = subprocess.run(command, cwd=ROOT, stdout=stream, stderr=subprocess.STDOUT)
    row = {"asked": version, "date": date.today().isoformat(), "commit": tested}
    row["seconds"] = round(time.perf_counter() - began)
    return {**row, "exit_code": done.returncode, **outcome(log.read_text(encoding="utf-8", errors="replace"))}


def table(rows: Iterable[dict[str, Any]]) -> str:
    """The table of the page."""
    suites = {"3.22": "Debian 12", "3.40": "Debian 13", "3.44": "Debian sid"}
    lines = ["| QGIS | system | date | commit | passed | failed | skipped | seconds |", "|" + "---|" * 8]
    for row in rows:
        where, failed = suites.get(row["asked"], "?"), row["failed"] + row["error"]
        counts = f"{row['passed']} | {failed} | {row['skipped']} | {row['seconds']}"
        lines.append(f"| {row['qgis']} | {where} | {row['date']} | {row['commit']} | {counts} |")
    return "\n".join(lines)


def main() -> int:
    """Run, record, write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("versions", nargs="*")
    parser.add_argument("--logs", type=Path, default=Path("/var/tmp"), help="folder of what the tests print")
    chosen = parser.parse_args()
    kept = json.loads(FIGURES.read_text(encoding="utf-8")) if FIGURES.exists() else {}
    rows = {row["asked"]: row for row in kept.get("versions", [])}
    for version in chosen.versions:
        rows[version] = run(version, chosen.logs / f"treedgs-qgis-{version}.log")
        print(rows[version], flush=True)
        write_record(FIGURES, {"versions": [rows[name] for name in sorted(rows)]})
    fill_page(PAGE, "versions", table(rows[name] for name in sorted(rows)))
    return 0 if all(row["exit_code"] == 0 for row in rows.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
