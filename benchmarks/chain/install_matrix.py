"""Does it install and run elsewhere? Fresh Debian systems in folders, each with its own Python and QGIS.

    sudo .venv/bin/python -m benchmarks.chain.install_matrix trixie sid [--systems FOLDER] [--mirror ADDRESS]

For each suite: debootstrap, a clean clone of this repository, ``make setup``, ``make demo``, the quick tests, and
``treedgs:setupengine`` as a user of QGIS runs it (the engine without extras but the usual ones), with seconds and
megabytes. Writes ``docs/results/install_matrix.json`` (suites that were not asked for keep their row) and the table of
``docs/developer/dependencies.md``. Root, the network, 8 GB of disk and about 20 minutes a suite.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from datetime import date
from pathlib import Path
from typing import Any

from benchmarks.records import RESULTS, ROOT, write_record

FIGURES = RESULTS / "install_matrix.json"
PAGE = ROOT / "docs" / "developer" / "dependencies.md"
BEGIN, END = "<!-- systems -->", "<!-- /systems -->"
PLACE = "/home/treedgs"
#: What a system needs before ``make`` can begin.
FIRST = "make git ca-certificates"
#: Inside a private mount namespace, so that nothing stays mounted.
INSIDE = """root=$1; shift
mount -t proc proc "$root/proc"; mount --rbind /dev "$root/dev"
exec chroot "$root" env -i HOME=/root PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin LANG=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive ${SSL_CERT_FILE:+SSL_CERT_FILE=$SSL_CERT_FILE} ${PIP_CERT:+PIP_CERT=$PIP_CERT} \
    sh -c "$1"
"""


class System:
    """One suite in a folder; ``steps`` gets what each command took."""

    def __init__(self, suite: str, folder: Path, logs: Path) -> None:
        self.root, self.suite, self.logs = folder / f"treedgs-fresh-{suite}", suite, logs
        self.steps: dict[str, dict[str, Any]] = {}

    def run(self, name: str, command: str, limit_s: float = 3600) -> str:
        """Run a shell line inside; returns what it printed, which is also kept in a log."""
        began, before = time.perf_counter(), self.size_mb()
        words = ["unshare", "--mount", "--propagation", "private", "sh", "-eu", "-c", INSIDE, "sh", str(self.root)]
        try:
            done = subprocess.run(
                [*words, command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                timeout=limit_s,
            )  # fmt: skip
            printed, code = done.stdout, done.returncode
        except subprocess.TimeoutExpired as problem:
            printed, code = (problem.stdout or b"").decode("utf-8", "replace"), 124
        (self.logs / f"{self.suite}-{name}.log").write_text(printed, encoding="utf-8")
        self.steps[name] = {
            "ok": code == 0,
            "seconds": round(time.perf_counter() - began),
            "grew_mb": round(self.size_mb() - before),
        }
        print(self.suite, name, self.steps[name], flush=True)
        return printed

    def size_mb(self, below: str = "") -> float:
        """Megabytes (10^6 bytes) on disk of the system, or of a folder in it."""
        done = subprocess.run(["du", "-sxk", str(self.root) + below], capture_output=True, text=True)
        return int(done.stdout.split()[0]) * 1024 / 1e6 if done.stdout else 0.0

    def make(self, mirror: str) -> None:
        """The bare system, and the repository cloned into it."""
        if not (self.root / "etc" / "debian_version").exists():
            command = ["debootstrap", "--variant=minbase", "--include=ca-certificates", self.suite, self.root, mirror]
            subprocess.run(list(map(str, command)), check=True, stdout=subprocess.DEVNULL)
        for path in ("/etc/resolv.conf", os.environ.get("SSL_CERT_FILE", ""), os.environ.get("PIP_CERT", "")):
            if path and Path(path).is_file():
                # A machine behind a proxy: its certificates have to be known inside too.
                target = Path(str(self.root) + path)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(path, target)
        # A mirror may be weeks behind, as snapshots are; what it signed is checked all the same.
        (self.root / "etc/apt/apt.conf.d/50frozen").write_text('Acquire::Check-Valid-Until "false";\n')
        shutil.rmtree(str(self.root) + PLACE, ignore_errors=True)
        subprocess.run(["git", "clone", "-q", "--no-hardlinks", ROOT, str(self.root) + PLACE], check=True)


STEPS = ("packages", "setup", "engine", "quick", "demo")


def measure(system: System, steps: Iterable[str], keep: Callable[[dict[str, Any]], None]) -> None:
    """Steps of one system, in this order; without packages or set-up nothing else is tried. keep: after each step."""
    engine = (
        f"cd {PLACE} && export TREEDGS_HOME=/root/engine QT_QPA_PLATFORM=offscreen && "
        "/usr/bin/python3 tools/qgis_run.py run treedgs:setupengine"
    )
    wanted = {
        "packages": f"apt-get update -q && apt-get install -y -q --no-install-recommends {FIRST}",
        "setup": f"cd {PLACE} && make setup",
        "demo": f"cd {PLACE} && make demo",
        "quick": f"cd {PLACE} && .venv/bin/python -m pytest -q -m 'not slow and not qgis'",
        "engine": engine,
    }
    row: dict[str, Any] = {"suite": system.suite, "date": date.today().isoformat()}
    for name in steps:
        printed = system.run(name, wanted[name])
        if not system.steps[name]["ok"]:
            print(printed[-3000:], flush=True)
        if name == "setup":
            row["python"] = system.run("python", f"{PLACE}/.venv/bin/python --version").split()[-1]
            found = re.search(r"QGIS (\d\S+)", system.run("qgis", "QT_QPA_PLATFORM=offscreen qgis_process --version"))
            row["qgis"] = found[1] if found else "?"
        if name == "demo":
            found = re.search(r"\d+ of \d+ true stems measured.*RMSE [\d.]+ cm", printed)
            row["demo"] = found[0] if found else ""
        if name == "quick":
            found = re.search(r"(?:(\d+) failed, )?(\d+) passed", printed)
            row["quick"] = {"failed": int(found[1] or 0), "passed": int(found[2])} if found else {}
        if name == "engine":
            row["engine_mb"] = round(system.size_mb("/root/engine"))
        if name in ("setup", "quick"):
            row["venv_mb"] = round(system.size_mb(f"{PLACE}/.venv"))
        keep({**row, "steps": {name: step for name, step in system.steps.items() if name in STEPS}})
        if not system.steps[name]["ok"] and name in ("packages", "setup"):
            break


def table(rows: Iterable[dict[str, Any]]) -> str:
    """The table of the page."""
    lines = [
        BEGIN,
        "| system | Python | QGIS | engine as QGIS sets it up | `make setup`, all extras | `make demo` | quick tests |",
        "|---|---|---|---|---|---|---|",
    ]

    def took(row: dict[str, Any], name: str, size: str = "") -> str:
        step = row["steps"].get(name)
        if step is None:
            return "–"
        return f"{step['seconds']} s{size}" if step["ok"] else f"**failed** after {step['seconds']} s"

    for row in rows:
        quick = row.get("quick") or {}
        counts = f"{quick['passed']} passed, {quick['failed']} failed, " if quick else ""
        cells = [
            row["suite"],
            row.get("python", "?"),
            row.get("qgis", "?"),
            took(row, "engine", f", {row.get('engine_mb', 0)} MB"),
            took(row, "setup", f", {row['steps']['setup']['grew_mb']} MB" if "setup" in row["steps"] else ""),
            took(row, "demo") + (f"; {row['demo']}" if row.get("demo") else ""),
            f"{counts}{row['steps']['quick']['seconds']} s" if "quick" in row["steps"] else "–",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, END])


def main() -> int:
    """Measure, record, write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("suites", nargs="*")
    parser.add_argument("--steps", nargs="+", choices=STEPS, help="default: all")
    parser.add_argument("--systems", type=Path, default=Path("/var/tmp"))
    parser.add_argument("--mirror", default="http://deb.debian.org/debian")
    chosen = parser.parse_args()
    kept = json.loads(FIGURES.read_text(encoding="utf-8")) if FIGURES.exists() else {}
    rows = {row["suite"]: row for row in kept.get("systems", [])}
    for suite in chosen.suites:
        system = System(suite, chosen.systems, chosen.systems)
        system.make(chosen.mirror)

        def keep(row: dict[str, Any]) -> None:
            rows[row["suite"]] = row
            write_record(FIGURES, {"systems": [rows[name] for name in sorted(rows)]})

        measure(system, chosen.steps or STEPS, keep)
    page = PAGE.read_text(encoding="utf-8")
    marked = re.compile(f"{re.escape(BEGIN)}.*?{re.escape(END)}", re.S)
    PAGE.write_text(marked.sub(lambda _: table(rows[name] for name in sorted(rows)), page), encoding="utf-8")
    return 0 if all(step["ok"] for row in rows.values() for step in row["steps"].values()) else 1


if __name__ == "__main__":
    sys.exit(main())
