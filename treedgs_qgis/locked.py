"""The engine's libraries, each in one version with its hashes, for this computer: with or without its GPU.

Standard library only. The list is ``requirements-locked.txt`` beside this file, written by ``make lock``.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

LOCKED = Path(__file__).with_name("requirements-locked.txt")
#: What ``make setup`` adds for the tests; not in the plugin's zip.
DEVELOPERS = Path(__file__).resolve().parents[1] / "tools" / "requirements-dev-locked.txt"
#: Only of use with a GPU.
GPU_ONLY = ("warp-lang",)
BUILDS = ("auto", "cpu", "cuda")


def lines(build: str = "cuda") -> list[str]:
    """The requirements of a build (``cpu`` or ``cuda``), each with its hashes."""
    listed = _read(LOCKED)
    return [line for line in listed if build == "cuda" or not line.startswith(GPU_ONLY)]


def lock_hash() -> str:
    """Names the managed environment: another list, another environment. The same with and without a GPU."""
    return hashlib.sha256("\n".join(lines()).encode()).hexdigest()[:10]


def write_list(build: str, target: Path, more: Path | None = None) -> list[str]:
    """Write the build's list to ``target``; returns what pip is given: that file, with hashes, wheels only.

    more: a further list (:data:`DEVELOPERS`).
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    listed = [*lines(build), *(_read(more) if more else [])]
    target.write_text("\n".join(listed) + "\n", encoding="utf-8")
    return ["--require-hashes", "--only-binary", ":all:", "-r", str(target)]


def _read(path: Path) -> list[str]:
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]
