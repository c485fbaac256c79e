"""The engine's libraries, each in one version with its hashes, for this computer: with or without its GPU and extras.

Standard library only. The list is ``requirements-locked.txt`` beside this file, written by ``make lock``: first what
every engine has, then, under headings like ``# [simulate reports]``, what only these extras need.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path

from . import extras as parts

LOCKED = Path(__file__).with_name("requirements-locked.txt")
#: What ``make setup`` adds for the tests; not in the plugin's zip.
DEVELOPERS = Path(__file__).resolve().parents[1] / "tools" / "requirements-dev-locked.txt"
BUILDS = ("auto", "cpu", "cuda")


def lines(build: str = "cuda", extras: Iterable[str] = tuple(parts.CHOICES)) -> list[str]:
    """The requirements of a build (``cpu`` or ``cuda``) with some extras (default: all), each with its hashes."""
    chosen = {*extras, *([parts.GPU] if build == "cuda" else [])}
    found: list[str] = []
    takes = True
    for line in LOCKED.read_text(encoding="utf-8").splitlines():
        if heading := re.fullmatch(r"# \[([\w ]+)\]", line):
            takes = bool(chosen & set(heading[1].split()))
        elif takes and line and line[0] != "#":
            found.append(line)
    return found


def lock_hash() -> str:
    """Names the managed environment: another list, another environment. The same with and without a GPU or extras."""
    return hashlib.sha256("\n".join(lines()).encode()).hexdigest()[:10]


def write_list(
    build: str, target: Path, more: Path | None = None, extras: Iterable[str] = tuple(parts.CHOICES)
) -> list[str]:
    """Write the build's list to ``target``; returns what pip is given: that file, with hashes, wheels only.

    The list is complete (a test holds that), so pip asks no library what it needs beside: quicker, and nothing else
    comes in. more: a further list (:data:`DEVELOPERS`). extras: see :func:`lines`.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    listed = [*lines(build, extras), *(_read(more) if more else [])]
    target.write_text("\n".join(listed) + "\n", encoding="utf-8")
    return ["--require-hashes", "--no-deps", "--only-binary", ":all:", "-r", str(target)]


def _read(path: Path) -> list[str]:
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]
