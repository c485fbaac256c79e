"""What the engine and each of its extras take: ``treedgs_qgis/extras.json`` and the table of the docs.

    .venv/bin/python tools/measure_engine.py [--python PYTHON] [--only-compiling]

The locked list of the engine alone is installed as ``treedgs:setupengine`` does, and then each extra's own libraries:
what pip downloads, what the folder grows by (megabytes of 10^6 bytes), the seconds here, and what the download takes at
50 Mbit/s. Network, 3 GB of disk, some minutes. Then, in this very environment, the processor seconds of compiling ahead
(``treedgs doctor --compile`` with nothing compiled): they say the same on a busy machine.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
PAGE = ROOT / "docs" / "developer" / "dependencies.md"
BEGIN, END = "<!-- sizes -->", "<!-- /sizes -->"


def size_mb(folder: Path) -> float:
    """Megabytes that its files hold."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink()) / 1e6


def pip(python: Path, *words: object) -> float:
    """Run pip; returns its seconds.

    Raises:
        RuntimeError: pip's last words.
    """
    command = [python, "-I", "-m", "pip", "--disable-pip-version-check", "--no-input", *map(str, words)]
    began = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr[-800:])
    return time.perf_counter() - began


def compiling_s() -> float:
    """Processor seconds of compiling ahead, in all of its processes."""
    with tempfile.TemporaryDirectory() as cache:
        words = [sys.executable, "-m", "treedgs_geo", "doctor", "--compile", "--log-format", "quiet"]
        env = {**os.environ, "NUMBA_CACHE_DIR": cache, "PYTHONPATH": str(ROOT)}
        before = os.times()
        subprocess.run(words, check=True, cwd=cache, env=env, stdout=subprocess.DEVNULL)
        after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def table(parts: dict[str, dict[str, float]], where: str) -> str:
    """The table of the page."""
    from treedgs_qgis import extras

    lines = [BEGIN, f"Measured {date.today().isoformat()}, {where}:", ""]
    lines += [
        "| part | download, MB | on disk, MB | download at 50 Mbit/s | installing here |",
        "|---|---|---|---|---|",
    ]
    for name, row in parts.items():
        minutes = f"{row['download_mb'] * 8 / extras.LINE_MBIT_S:.0f} s"
        label = "the engine alone" if name == "engine" else f"`{name}`"
        lines.append(f"| {label} | {row['download_mb']} | {row['disk_mb']} | {minutes} | {row['install_s']} s |")
    return "\n".join([*lines, END])


def main() -> int:
    """Measure and write."""
    from treedgs_qgis import extras

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--only-compiling", action="store_true", help="keep the other figures")
    chosen = parser.parse_args()
    figures = json.loads(extras.SIZES.read_text(encoding="utf-8"))
    if not chosen.only_compiling:
        where = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
        figures.update(where=where, parts=installed(chosen.python))
        page = PAGE.read_text(encoding="utf-8")
        marked = re.compile(f"{re.escape(BEGIN)}.*?{re.escape(END)}", re.S)
        PAGE.write_text(marked.sub(lambda _: table(figures["parts"], where), page), encoding="utf-8")
    figures["compile_cpu_s"] = round(compiling_s())
    extras.SIZES.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return 0


def installed(python: str) -> dict[str, dict[str, float]]:
    """What each part takes."""
    from treedgs_qgis import environment, extras, locked

    parts: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        subprocess.run([python, "-I", "-m", "venv", scratch / "env"], check=True)
        inside = scratch / "env" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
        base = locked.lines("cpu", ())
        for name in ("engine", *extras.CHOICES, extras.GPU):
            build, chosen = ("cuda", ()) if name == extras.GPU else ("cpu", () if name == "engine" else (name,))
            listed = [line for line in locked.lines(build, chosen) if name == "engine" or line not in base]
            file, wheels, into = scratch / f"{name}.txt", scratch / f"{name}-wheels", scratch / name
            file.write_text("\n".join(listed) + "\n", encoding="utf-8")
            words = ["--no-deps", "--require-hashes", "--only-binary", ":all:", "-r", file]
            pip(inside, "download", "-q", "-d", wheels, *words)
            # An extra goes into a folder of its own: what it adds to the environment.
            target = [] if name == "engine" else ["--target", into]
            begin = ["install", "-q", "--no-compile", "--no-index", "--find-links", wheels]
            seconds = pip(inside, *begin, *target, *words)
            began = time.perf_counter()
            site = environment.packages_of(scratch / "env") if name == "engine" else into
            subprocess.run([inside, "-I", "-c", environment.COMPILE, str(site)], check=True, stdout=subprocess.DEVNULL)
            seconds += time.perf_counter() - began
            disk = size_mb(scratch / "env" if name == "engine" else into)
            parts[name] = {"download_mb": round(size_mb(wheels)), "disk_mb": round(disk), "install_s": round(seconds)}
            print(name, parts[name], flush=True)
            shutil.rmtree(wheels)
    return parts


if __name__ == "__main__":
    sys.exit(main())
