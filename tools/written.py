"""Files that are made from the code: write them, or say whether they are up to date."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def write_or_check(files: Iterable[tuple[Path, str]]) -> int:
    """Write each file's text where it differs, or with ``--check`` only name those that do.

    Returns:
        Exit status: 1 where ``--check`` found one.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("--check", action="store_true")
    check, stale = parser.parse_args().check, 0
    for path, text in files:
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        stale += 1
        print(f"{path.relative_to(ROOT)}: {'is not up to date, run make parameters' if check else 'written'}")
        if not check:
            path.write_text(text, encoding="utf-8")
    return 1 if check and stale else 0
