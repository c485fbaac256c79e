"""Which plugin uses which engine: QGIS profiles, and versions of QGIS, may hold plugins of different versions.

They share one data folder. Each plugin folder keeps a note there, named after itself, with the name of its engine; an
engine that the note of another plugin names is not removed. Standard library only.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from pathlib import Path

#: Folder of the notes, in the data folder.
NOTES = "users"


def _note(base: Path, plugin: Path) -> Path:
    return base / NOTES / f"{hashlib.sha256(str(plugin).encode()).hexdigest()[:10]}.json"


def _read(note: Path) -> tuple[str, str]:
    """The plugin folder and its engine; two empty words where the note says neither."""
    try:
        found = json.loads(note.read_text(encoding="utf-8"))
        return str(found["plugin"]), str(found["engine"])
    except (OSError, ValueError, KeyError, TypeError):
        return "", ""


def uses(base: Path, plugin: Path, engine: str) -> None:
    """Note that ``plugin`` uses ``engine`` (a folder's name in ``base``). Where nothing can be written, nothing is."""
    note = _note(base, plugin)
    if _read(note) == (str(plugin), engine):
        return
    fresh = note.with_name(f"{note.name}-{os.getpid()}")
    try:
        note.parent.mkdir(parents=True, exist_ok=True)
        fresh.write_text(json.dumps({"plugin": str(plugin), "engine": engine}) + "\n", encoding="utf-8")
        os.replace(fresh, note)
    except OSError:
        with contextlib.suppress(OSError):
            fresh.unlink()


def leaves(base: Path, plugin: Path) -> None:
    """``plugin`` uses no engine any more."""
    _note(base, plugin).unlink(missing_ok=True)
    _drop_if_empty(base / NOTES)


def of_others(base: Path, plugin: Path) -> dict[str, str]:
    """Engines that other plugins use: the engine's name and a plugin's folder. Notes of plugins that are gone go."""
    found: dict[str, str] = {}
    own = _note(base, plugin)
    notes = base / NOTES
    for note in sorted(notes.glob("*.json")):
        other, engine = _read(note)
        if note == own or not engine:
            continue
        if (Path(other) / "metadata.txt").is_file():
            found[engine] = other
        else:
            note.unlink(missing_ok=True)
    _drop_if_empty(notes)
    return found


def _drop_if_empty(notes: Path) -> None:
    if notes.is_dir() and not any(notes.iterdir()):
        notes.rmdir()
