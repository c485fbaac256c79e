"""Where the shared development data is, when it is there at all."""

from __future__ import annotations

from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


def needs_shared(name: str) -> Path:
    """Folder ``name`` of the shared data; skips the test with a message where it is absent."""
    folder = SHARED / name
    if not folder.exists():
        pytest.skip(f"shared data {name!r} is not beside this repository")
    return folder
