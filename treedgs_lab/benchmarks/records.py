"""What every result file says of itself: command, date, commit, version, machine, Python, packages, seeds; blocks of a
page as Markdown, without pictures and fragments."""

from __future__ import annotations

import contextlib
import datetime
import hashlib
import json
import platform
import re
import shlex
import subprocess
import sys
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

import pandas as pd
import psutil

from treedgs_geo import __version__
from treedgs_geo.core.files import atomic_path, write_json
from treedgs_geo.core.machine import cores
from treedgs_geo.core.tables import safe_frame
from treedgs_geo.report.blocks import Block, Cards, Heading, Paragraph, Sentences, Table

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "docs" / "results"
#: Measured by these rooms: their source is part of what a kept result says about itself.
ROOMS = ("core", "pointcloud", "geotags", "terrain", "reconstruction", "stems", "run")
#: Whose versions a record names, where they are installed: what figures may depend on.
PACKAGES = ("numpy", "scipy", "numba", "opencv-python-headless", "pycolmap", "rasterio", "laspy", "torch", "open3d")


def portable(word: str) -> str:
    """A word of a command without this machine's folders: relative to the repository, or the last name of a path."""
    path = Path(word)
    if not path.is_absolute():
        return word
    return str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else path.name


def command() -> str:
    """The command that runs now, as one would type it in the repository's root."""
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    program = f"python -m {spec.name}" if spec else f"python {Path(sys.argv[0]).name}"
    return f"{program} {shlex.join(map(portable, sys.argv[1:]))}".strip()


def commit() -> str:
    """The commit of this checkout; ``-changed`` after it where a file of code differs; empty where there is no git."""
    git = ["git", "-c", f"safe.directory={ROOT}"]
    try:
        here = subprocess.run(
            [*git, "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
        )
        changed = subprocess.run(
            [*git, "status", "--porcelain", "--", "*.py"], cwd=ROOT, capture_output=True, text=True
        )
    except (OSError, subprocess.CalledProcessError):
        return ""
    return here.stdout.strip() + ("-changed" if changed.stdout.strip() else "")


def packages() -> dict[str, str]:
    """Versions of :data:`PACKAGES`."""
    found = {}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def code_digest() -> str:
    """Hash of the measuring code, to tell results of another state apart."""
    root = ROOT / "treedgs_geo"
    digest = hashlib.sha256()
    for room in ROOMS:
        for path in sorted((root / room).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def machine() -> dict[str, Any]:
    """What seconds were measured on, and with which code: ``processor, cores, memory_gb, python, version``."""
    name = platform.processor() or platform.machine()
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    return {
        "processor": name,
        "cores": cores(),
        "memory_gb": round(psutil.virtual_memory().total / 2**30, 1),
        "python": platform.python_version(),
        "version": __version__,
    }


def made_by(seeds: Iterable[int] = ()) -> dict[str, Any]:
    """Where figures come from. seeds: all that the figures depend on, none for what draws nothing.

    Returns:
        ``command, date`` (ISO), ``commit``, ``version`` of TreeDGS, ``python``, ``packages``, ``machine`` (processor,
        cores, memory_gb, load: processes that wanted a core, mean of the last minute), ``seeds``.
    """
    here = machine()
    return {
        "command": command(),
        "date": datetime.date.today().isoformat(),
        "commit": commit(),
        "version": here.pop("version"),
        "python": here.pop("python"),
        "packages": packages(),
        "machine": {**here, "load": round(psutil.getloadavg()[0], 1)},
        "seeds": list(seeds),
    }


def write_record(target: Path | None, figures: dict[str, Any], seeds: Iterable[int] = ()) -> None:
    """Write figures as JSON with :func:`made_by` before them; nothing where ``target`` is None."""
    if target is not None:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_json(target, {"made_by": made_by(seeds), **figures})


def write_table(target: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV, four digits."""
    with atomic_path(target) as path:
        safe_frame(table).to_csv(path, index=False, float_format="%.4g")


def write_markdown(target: Path, blocks: list[Block]) -> None:
    """Write the tables and sentences of a page."""
    with atomic_path(target) as path:
        path.write_text(markdown(blocks), encoding="utf-8")


def rows_of(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows as JSON has them: None where there is no number."""
    return json.loads(table.to_json(orient="records"))


def fill_page(page: Path, marker: str, text: str) -> None:
    """Put ``text`` between ``<!-- marker -->`` and ``<!-- /marker -->`` of a page of the docs."""
    begin, end = f"<!-- {marker} -->", f"<!-- /{marker} -->"
    marked = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.S)
    whole = page.read_text(encoding="utf-8")
    page.write_text(marked.sub(lambda _: f"{begin}\n{text}\n{end}", whole), encoding="utf-8")


def markdown(blocks: Iterable[Block]) -> str:
    """The text, parts apart by an empty line."""
    return "\n\n".join(filter(None, map(_part, blocks))) + "\n"


def _part(block: Block) -> str:
    if isinstance(block, Heading):
        return f"{'#' * block.level} {block.text}"
    if isinstance(block, Paragraph):
        return f"**{block.text}**" if block.strong else block.text
    if isinstance(block, Cards):
        return "\n".join(f"- {label}: {value}{f' ({more})' if more else ''}" for label, value, more in block.items)
    if isinstance(block, Sentences):
        return "\n".join(
            [*([block.title, ""] if block.title and block.items else []), *(f"- {s}" for s in block.items)]
        )
    return _table(block) if isinstance(block, Table) else ""


def _table(table: Table) -> str:
    columns = table.shown
    lines = [[column.heading for column in columns], ["---"] * len(columns)]
    lines += [[table.text(row, column) for column in columns] for row in table.rows]
    text = "\n".join(f"| {' | '.join(_cell(cell) for cell in line)} |" for line in lines)
    return "\n\n".join(filter(None, (table.title, text.replace("| --- ", "|---").replace("--- |", "---|"), table.note)))


def _cell(text: str) -> str:
    """One line of a table's cell; a bar would end it."""
    return " ".join(text.split()).replace("|", "\\|")
