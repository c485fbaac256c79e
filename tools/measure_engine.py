"""What the engine and each of its extras take: ``treedgs_qgis/extras.json`` and the table of the docs.

    .venv/bin/python tools/measure_engine.py [--python PYTHON] [--only sizes|compiling]

Each is set up for real, as ``treedgs:setupengine`` does it (:func:`treedgs_qgis.environment.build`: the environment,
pip over the network, compiling what it brought), the engine first, then one extra after the other; but from an index on
this computer that is held to a line of 50 Mbit/s (``slow_index.py``). Seconds of the whole; processor seconds of all
its processes, which are the same on a busy machine; megabytes (10^6 bytes) of the wheels and of what the environment
grows by. Network (the wheels are fetched first), 4 GB of disk, some minutes.
Then, in this very environment, the processor seconds of compiling ahead (``treedgs doctor --compile`` with nothing
compiled).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from datetime import date
from pathlib import Path

import psutil

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
PAGE = ROOT / "docs" / "developer" / "dependencies.md"
BEGIN, END = "<!-- sizes -->", "<!-- /sizes -->"
#: Seconds to an index and back, for each question.
WAY_S = 0.03


def size_mb(folder: Path) -> float:
    """Megabytes that its files hold."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink()) / 1e6


def fetch(python: str, listed: list[str], folder: Path) -> None:
    """Fetch the wheels of a list.

    Raises:
        RuntimeError: pip's last words.
    """
    command = [python, "-I", "-m", "pip", "download", "--disable-pip-version-check", "--no-input", "-q"]
    done = subprocess.run([*command, "-d", str(folder), *listed], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr[-800:])


def processors() -> str:
    """How many this process may use, and how many programs wanted one meanwhile, in words."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    here = "one processor" if count == 1 else f"{count} processors"
    wanted = f", {psutil.getloadavg()[2]:.0f} programs running on the machine's {os.cpu_count()}"
    return here + wanted


def spent_s() -> float:
    """Processor seconds of the programs that were run so far."""
    spent = os.times()
    return spent.children_user + spent.children_system


def compiling_s() -> float:
    """Processor seconds of compiling ahead, in all of its processes."""
    with tempfile.TemporaryDirectory() as cache:
        words = [sys.executable, "-m", "treedgs_geo", "doctor", "--compile", "--log-format", "quiet"]
        env = {**os.environ, "NUMBA_CACHE_DIR": cache, "PYTHONPATH": str(ROOT)}
        before = spent_s()
        subprocess.run(words, check=True, cwd=cache, env=env, stdout=subprocess.DEVNULL)
    return spent_s() - before


def table(parts: dict[str, dict[str, float]], where: str) -> str:
    """The table of the page."""
    from treedgs_qgis import extras

    lines = [BEGIN, f"Measured {date.today().isoformat()}, {where}:", ""]
    lines += [
        "| part | download, MB | on disk, MB | download at 50 Mbit/s | processor seconds | whole set-up, measured |",
        "|---|---|---|---|---|---|",
    ]
    for name, row in parts.items():
        download = f"{row['download_mb'] * 8 / extras.LINE_MBIT_S:.0f} s"
        label = "the engine alone" if name == "engine" else f"`{name}`"
        sizes = f"{row['download_mb']} | {row['disk_mb']}"
        lines.append(f"| {label} | {sizes} | {download} | {row['install_s']} s | {row['whole_s']} s |")
    return "\n".join([*lines, END])


def main() -> int:
    """Measure and write."""
    from treedgs_qgis import extras

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--only", choices=("sizes", "compiling"), help="keep the other figures")
    chosen = parser.parse_args()
    figures = json.loads(extras.SIZES.read_text(encoding="utf-8"))
    if chosen.only != "compiling":
        parts = installed(chosen.python)
        where = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}, {processors()}"
        figures.update(where=where, parts=parts)
        page = PAGE.read_text(encoding="utf-8")
        marked = re.compile(f"{re.escape(BEGIN)}.*?{re.escape(END)}", re.S)
        PAGE.write_text(marked.sub(lambda _: table(figures["parts"], where), page), encoding="utf-8")
    if chosen.only != "sizes":
        figures["compile_cpu_s"] = round(compiling_s())
    extras.SIZES.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return 0


def installed(python: str) -> dict[str, dict[str, float]]:
    """What each part takes."""
    from slow_index import serving

    from treedgs_qgis import environment, extras, locked

    parts: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        wheels, target = scratch / "wheels", scratch / "engine"
        everything = locked.write_list("cuda", scratch / "all.txt")
        fetch(python, everything, wheels)
        with serving(wheels, extras.LINE_MBIT_S, WAY_S) as (address, line):
            ours = {name: value for name, value in os.environ.items() if not name.startswith("PIP_")}
            ours.update(PIP_INDEX_URL=address, PIP_CONFIG_FILE=os.devnull)

            def run(command: list) -> int:
                return subprocess.run(list(map(str, command)), env=ours, stdout=subprocess.DEVNULL).returncode

            chosen: list[str] = []
            for name in ("engine", *extras.CHOICES, extras.GPU):
                chosen += [name] if name in extras.CHOICES else []
                listed = locked.write_list("cuda" if name == extras.GPU else "cpu", scratch / "l.txt", extras=chosen)
                disk, sent, spent, began = size_mb(target), line.sent_bytes, spent_s(), time.perf_counter()
                environment.build(
                    target, [listed], name, python, run=run, say=lambda _: None, cache=scratch / "pip-cache"
                )
                whole_s, fetched_mb = time.perf_counter() - began, (line.sent_bytes - sent) / 1e6
                parts[name] = {
                    "download_mb": round(fetched_mb),
                    "disk_mb": round(size_mb(target) - disk),
                    "whole_s": round(whole_s),
                    "install_s": max(1, round(spent_s() - spent)),
                }
                print(name, parts[name], flush=True)
    return parts


if __name__ == "__main__":
    sys.exit(main())
