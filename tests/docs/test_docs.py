"""The documented fields are the real ones."""

from __future__ import annotations

from pathlib import Path

from treedgs_geo.stems.quality.tree import TREE_FIELDS

PAGE = (Path(__file__).parents[2] / "docs" / "technician" / "tree-layer.md").read_text(encoding="utf-8")


def test_every_field_is_documented():
    assert [name for name in TREE_FIELDS if f"`{name}`" not in PAGE] == []
