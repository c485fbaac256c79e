"""Does it install and run elsewhere? Fresh Debian systems in folders, each with its own Python and QGIS; other Pythons.

    sudo .venv/bin/python -m tools.install_matrix bookworm trixie sid [--systems FOLDER]
        [--mirror ADDRESS]
    .venv/bin/python -m tools.install_matrix --python PYTHON3.10 PYTHON3.12 --steps setup quick

For each suite: debootstrap, a clean clone of this repository, ``make setup``, ``make demo``, the quick tests, and
``treedgs:setupengine`` as a user of QGIS runs it (the engine without extras but the usual ones), with seconds and
megabytes; and the package: wheel and sdist, built and checked by twine, the wheel in a fresh environment with
``[reports]``, ``treedgs doctor`` there. For each other Python: the same on this system, with an environment made from
it. Writes ``docs/results/install_matrix.json`` (what was not asked for keeps its figures, with their commit and date)
and the table of ``docs/developer/dependencies.md``. Root, the network, 8 GB of disk and about 20 minutes a suite.
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
from collections.abc import Iterable
from datetime import date
from pathlib import Path
from typing import Any

from tools.qgis_versions import outcome
from treedgs_lab.benchmarks.records import RESULTS, ROOT, fill_page, write_record

FIGURES = RESULTS / "install_matrix.json"
PAGE = ROOT / "docs" / "developer" / "dependencies.md"
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
    """One suite in a folder; ``steps`` gets what each command took.

    Attributes:
        clone, home: the repository and the engine's data folder, as they are called inside.
        commit: what the clone holds.
    """

    def __init__(self, suite: str, folder: Path) -> None:
        self.root, self.suite, self.logs = folder / f"treedgs-fresh-{suite}", suite, folder
        self.clone, self.home, self.commit = "/home/treedgs", "/root/engine", ""
        self.steps: dict[str, dict[str, Any]] = {}

    def words(self, command: str) -> list[str]:
        """What runs a shell line inside."""
        return [
            "unshare",
            "--mount",
            "--propagation",
            "private",
            "sh",
            "-eu",
            "-c",
            INSIDE,
            "sh",
            str(self.root),
            command,
        ]

    def outside(self, path: str) -> Path:
        """A path of the inside, seen from here."""
        return Path(str(self.root) + path)

    def run(self, name: str, command: str, limit_s: float = 3600) -> str:
        """Run a shell line inside; returns what it printed, which is also kept in a log."""
        began, before = time.perf_counter(), self.size_mb()
        try:
            done = subprocess.run(
                self.words(command), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
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
            "commit": self.commit,
            "date": date.today().isoformat(),
        }
        print(self.suite, name, self.steps[name], flush=True)
        return printed

    def size_mb(self, below: str = "") -> float:
        """Megabytes (10^6 bytes) on disk of the system, or of a folder in it."""
        folder = self.outside(below) if below else self.root
        done = subprocess.run(["du", "-sxk", str(folder)], capture_output=True, text=True)
        return int(done.stdout.split()[0]) * 1024 / 1e6 if done.stdout else 0.0

    def make(self, mirror: str) -> None:
        """The bare system."""
        if not (self.root / "etc" / "debian_version").exists():
            command = ["debootstrap", "--variant=minbase", "--include=ca-certificates", self.suite, self.root, mirror]
            subprocess.run(list(map(str, command)), check=True, stdout=subprocess.DEVNULL)
        for path in ("/etc/resolv.conf", os.environ.get("SSL_CERT_FILE", ""), os.environ.get("PIP_CERT", "")):
            if path and Path(path).is_file():
                # A machine behind a proxy: its certificates have to be known inside too.
                target = self.outside(path)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(path, target)
        # A mirror may be weeks behind, as snapshots are; what it signed is checked all the same.
        (self.root / "etc/apt/apt.conf.d/50frozen").write_text('Acquire::Check-Valid-Until "false";\n')

    def take_clone(self, anew: bool) -> None:
        """The repository's commit in it. anew: nothing of a former set-up stays, as for who clones it first."""
        clone = self.outside(self.clone)
        if anew:
            shutil.rmtree(clone, ignore_errors=True)
        if not clone.exists():
            clone.parent.mkdir(parents=True, exist_ok=True)
            subprocess.run(["git", "clone", "-q", "--no-hardlinks", str(ROOT), str(clone)], check=True)
        subprocess.run(["git", "-C", str(clone), "fetch", "-q", str(ROOT), "HEAD"], check=True)
        subprocess.run(["git", "-C", str(clone), "reset", "-q", "--hard", "FETCH_HEAD"], check=True)
        asked = ["git", "-C", str(clone), "rev-parse", "--short=9", "HEAD"]
        self.commit = subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()


class OtherPython(System):
    """This system with another Python; a folder holds the clone, its environment and the engine."""

    def __init__(self, python: Path, folder: Path) -> None:
        asked = [str(python), "-c", "import sys; print('.'.join(map(str, sys.version_info[:2])))"]
        version = subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()
        super().__init__(f"python {version}", folder)
        self.root, self.python = folder / f"treedgs-python-{version}", python
        self.clone, self.home = str(self.root / "treedgs"), str(self.root / "engine")

    def words(self, command: str) -> list[str]:
        """The shell line, with that Python named for the set-up."""
        return ["env", "-u", "PYTHONPATH", f"TREEDGS_BASE_PYTHON={self.python}", "sh", "-c", command]

    def outside(self, path: str) -> Path:
        """The same."""
        return Path(path)

    def make(self, mirror: str) -> None:
        """Nothing is to be made."""
        self.root.mkdir(parents=True, exist_ok=True)


STEPS = ("packages", "setup", "engine", "quick", "demo", "wheel")


def measure(system: System, steps: Iterable[str], before: dict[str, Any]) -> None:
    """Steps of one system, in this order; without packages or set-up nothing else is tried. Recorded after each.

    before: its row so far, whose other figures stay.
    """
    clone = system.clone
    engine = (
        f"cd {clone} && export TREEDGS_HOME={system.home} QT_QPA_PLATFORM=offscreen && "
        "/usr/bin/python3 tools/qgis_run.py run treedgs:setupengine "
        "${TREEDGS_BASE_PYTHON:+-- PYTHON=$TREEDGS_BASE_PYTHON}"
    )
    wanted = {
        "packages": f"apt-get update -q && apt-get install -y -q --no-install-recommends {FIRST}",
        "setup": f"cd {clone} && make setup",
        "demo": f"cd {clone} && make demo",
        "quick": f"cd {clone} && .venv/bin/python -m pytest -q -m 'not slow and not qgis'",
        "engine": engine,
        "wheel": f"cd {clone} && rm -rf dist {system.home}-wheel && "
        f"${{TREEDGS_BASE_PYTHON:-python3}} -m venv {system.home}-wheel && PATH={system.home}-wheel/bin:$PATH && "
        "pip install -q build twine && python -m build && "
        "twine check --strict dist/* && pip uninstall -q -y build twine && "
        'pip install "$(echo dist/*.whl)[reports]" && cd / && treedgs doctor --log-format plain',
    }
    row: dict[str, Any] = {**before, "suite": system.suite, "date": date.today().isoformat()}
    former = {name: {"date": before["date"], **step} for name, step in before.get("steps", {}).items()}
    for name in steps:
        printed = system.run(name, wanted[name])
        if not system.steps[name]["ok"]:
            print(printed[-3000:], flush=True)
        if name == "setup":
            row["python"] = system.run("python", f"{clone}/.venv/bin/python --version").split()[-1]
            found = re.search(
                r"QGIS (\d\S+)",
                system.run(
                    "qgis", f"cd {clone} && QT_QPA_PLATFORM=offscreen /usr/bin/python3 tools/qgis_run.py --version"
                ),
            )
            row["qgis"] = found[1] if found else "?"
        if name == "demo":
            found = re.search(r"\d+ of \d+ true stems measured.*RMSE [\d.]+ cm", printed)
            row["demo"] = found[0] if found else ""
        if name == "quick":
            said = outcome(printed)
            row["quick"] = {name: said[name] for name in ("passed", "failed", "skipped", "did_not_pass")}
        if name == "wheel" and system.steps[name]["ok"]:
            row["python"] = system.run("python", f"{system.home}-wheel/bin/python --version").split()[-1]
        if name == "engine":
            row["engine_mb"] = round(system.size_mb(system.home))
        if name in ("setup", "quick"):
            row["venv_mb"] = round(system.size_mb(f"{clone}/.venv"))
        done = {name: step for name, step in system.steps.items() if name in STEPS}
        keep({**row, "steps": {**former, **done}})
        if not system.steps[name]["ok"] and name in ("packages", "setup"):
            break


def known() -> dict[str, dict[str, Any]]:
    """The rows so far, by system: read each time, as two runs may go on side by side."""
    found = json.loads(FIGURES.read_text(encoding="utf-8")) if FIGURES.exists() else {}
    return {row["suite"]: row for row in found.get("systems", [])}


def keep(row: dict[str, Any]) -> None:
    """Record one row."""
    rows = {**known(), row["suite"]: row}
    write_record(FIGURES, {"systems": [rows[name] for name in sorted(rows)]})


def table(rows: Iterable[dict[str, Any]]) -> str:
    """The table of the page."""
    lines = [
        "| system | Python | QGIS | engine as QGIS sets it up | `make setup`, all extras | `make demo` | quick tests | "
        "wheel and `treedgs doctor` |",
        "|---|---|---|---|---|---|---|---|",
    ]

    def when(row: dict[str, Any], name: str) -> str:
        """Of which code; where that was not written down, of which day."""
        step = row["steps"].get(name)
        return f" ({step.get('commit') or step.get('date') or row['date']})" if step else ""

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
            row.get("qgis", "–"),
            took(row, "engine", f", {row.get('engine_mb', 0)} MB") + when(row, "engine"),
            took(row, "setup", f", {row['steps']['setup']['grew_mb']} MB" if "setup" in row["steps"] else "")
            + when(row, "setup"),
            took(row, "demo") + (f"; {row['demo']}" if row.get("demo") else "") + when(row, "demo"),
            (f"{counts}{row['steps']['quick']['seconds']} s" if "quick" in row["steps"] else "–") + when(row, "quick"),
            took(row, "wheel") + when(row, "wheel"),
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> int:
    """Measure, record, write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("suites", nargs="*")
    parser.add_argument("--python", type=Path, nargs="+", default=[], help="other Pythons, on this system")
    parser.add_argument("--steps", nargs="+", choices=STEPS, help="default: all")
    parser.add_argument("--systems", type=Path, default=Path("/var/tmp"))
    parser.add_argument("--mirror", default="http://deb.debian.org/debian")
    chosen = parser.parse_args()
    systems = [System(suite, chosen.systems) for suite in chosen.suites]
    for system in [*systems, *(OtherPython(python.absolute(), chosen.systems) for python in chosen.python)]:
        steps = chosen.steps or [name for name in STEPS if name != "packages" or system in systems]
        system.make(chosen.mirror)
        system.take_clone(anew="setup" in steps)

        measure(system, steps, known().get(system.suite, {}))
    rows = known()
    fill_page(PAGE, "systems", table(rows[name] for name in sorted(rows)))
    return 0 if all(step["ok"] for row in rows.values() for step in row["steps"].values()) else 1


if __name__ == "__main__":
    sys.exit(main())
