"""Does every locked library have a wheel? Each Python and system, for the engine alone and with all extras.

    .venv/bin/python -m tools.wheels

uv resolves the locked list for that Python and system from wheels only, its own tags deciding what fits; nothing is
installed. Where it cannot, its reason names the first library that has none. Writes ``docs/results/wheels.json`` and
the table of ``docs/developer/dependencies.md``. Network, 5 minutes.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tools.write_lock import uv_program
from treedgs_lab.benchmarks.records import RESULTS, ROOT, fill_page, write_record
from treedgs_qgis import extras, locked

FIGURES = RESULTS / "wheels.json"
PAGE = ROOT / "docs" / "developer" / "dependencies.md"
PYTHONS = ("3.10", "3.11", "3.12", "3.13", "3.14")
#: What uv calls it, the oldest macOS where that counts, and what we call it.
SYSTEMS = (
    ("x86_64-manylinux_2_28", "", "Linux x86-64, glibc 2.28 (2018)"),
    ("x86_64-manylinux_2_35", "", "Linux x86-64, glibc 2.35 (2022)"),
    ("x86_64-pc-windows-msvc", "", "Windows x64"),
    ("aarch64-apple-darwin", "15.0", "macOS 15, Apple processor"),
    ("aarch64-apple-darwin", "14.0", "macOS 14, Apple processor"),
    ("x86_64-apple-darwin", "15.0", "macOS 15, Intel processor"),
    ("aarch64-manylinux_2_35", "", "Linux ARM"),
)


def resolved(uv: Path, python: str, system: str, macos: str, listed: Path) -> dict[str, Any]:
    """``libraries``: how many the list has there; ``lacks``: the first without a wheel, if any."""
    command = [uv, "pip", "compile", "-q", "--no-deps", "--no-header", "--no-annotate", "--only-binary", ":all:"]
    command += ["--python-version", python, "--python-platform", system, listed]
    variables = {**os.environ, **({"MACOSX_DEPLOYMENT_TARGET": macos} if macos else {})}
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, env=variables)
    if done.returncode == 0:
        return {"libraries": sum("==" in line for line in done.stdout.splitlines()), "lacks": ""}
    named = re.search(r"Because (\S+)==(\S+) has no (?:usable )?wheels", done.stderr)
    if named is None:
        raise RuntimeError(done.stderr.strip()[-800:])
    return {"libraries": 0, "lacks": f"{named[1]} {named[2]}"}


def table(rows: Iterable[dict[str, Any]]) -> str:
    """The table of the page: a line each system and part, a column each Python."""
    lines = [f"| system | part | {' | '.join(PYTHONS)} |", f"|---|---|{'---|' * len(PYTHONS)}"]
    for row in rows:
        cells = [f"no {one['lacks']}" if one["lacks"] else f"all {one['libraries']}" for one in row["pythons"].values()]
        lines.append(f"| {row['system']} | {row['part']} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> int:
    """Ask, record, write the table."""
    uv = uv_program()
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for system, macos, name in SYSTEMS:
            for part, build, chosen in (("engine alone", "cpu", ()), ("all extras", "cuda", tuple(extras.CHOICES))):
                listed = Path(folder) / "listed.txt"
                locked.write_list(build, listed, extras=chosen)
                found = {python: resolved(uv, python, system, macos, listed) for python in PYTHONS}
                rows.append({"system": name, "uv": system, "macos": macos, "part": part, "pythons": found})
                print(name, part, found, flush=True)
    write_record(FIGURES, {"systems": rows})
    fill_page(PAGE, "wheels", table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
