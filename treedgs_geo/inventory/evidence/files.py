"""Where sheets lie, and which trees get one."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...core.files import atomic_folder
from ...stems.quality.tree import Tree
from .canvas import Canvas

#: Name of the folder of a run that gave its trees no ``run_id``.
NO_RUN = "sheets"
#: Sheets written without being asked for all of them; those to check and not measured come first.
MAX_UNASKED = 1000
_RUN = re.compile(r"[0-9a-f]{16}")
_SHEET = re.compile(r"[0-9]+\.jpg")


def sheet_file(folder: Path, tree: Tree) -> Path:
    """``FOLDER/RUN_ID/TREE_ID.jpg``: a layer's columns name its sheets, and never those of another run."""
    return folder / (tree.run_id or NO_RUN) / f"{tree.tree_id}.jpg"


def trees_with_sheets(trees: list[Tree], wanted: str, asked: bool) -> list[Tree]:
    """Those of ``trees`` that get a sheet, in their order. wanted: ``all``, ``check`` (to check and not measured) or
    ``none``. asked: by a person, so there is no limit."""
    if wanted == "none":
        return []
    chosen = [tree for tree in trees if wanted == "all" or tree.qc_flag != "ok"]
    if asked or len(chosen) <= MAX_UNASKED:
        return chosen
    first = sorted(range(len(chosen)), key=lambda k: ("check", "reject", "ok").index(chosen[k].qc_flag))
    return [chosen[k] for k in sorted(first[:MAX_UNASKED])]


@contextmanager
def sheets_folder(folder: Path, run_id: str) -> Iterator[Path]:
    """Yield a folder that becomes ``FOLDER/RUN_ID`` if the block succeeds; sheets of earlier runs go then.

    Raises:
        OutputError: it cannot be written, or the disk is full.
    """
    with atomic_folder(folder / (run_id or NO_RUN)) as made:
        yield made
    for old in folder.iterdir():
        # Only what a run wrote: whatever a person keeps there stays.
        ours = old.is_dir() and old.name != run_id and _RUN.fullmatch(old.name)
        if ours and all(_SHEET.fullmatch(file.name) for file in old.iterdir()):
            shutil.rmtree(old, ignore_errors=True)


def write_sheet(folder: Path, tree: Tree, canvas: Canvas) -> None:
    """One sheet into the folder of its run."""
    (folder / f"{tree.tree_id}.jpg").write_bytes(canvas.jpeg())


def written_sheets(folder: Path, run_id: str) -> dict[int, Path]:
    """``tree_id`` -> sheet of a run, of those that lie there."""
    return {int(path.stem): path for path in (folder / (run_id or NO_RUN)).glob("*.jpg") if _SHEET.fullmatch(path.name)}
