"""The documented fields and reasons are the real ones."""

from __future__ import annotations

from pathlib import Path

from treedgs_geo.trees.reasons import REASONS, explain
from treedgs_geo.trees.tree import TREE_FIELDS

PAGE = (Path(__file__).parents[2] / "docs" / "technician" / "tree-layer.md").read_text(encoding="utf-8")


def test_every_field_is_documented():
    assert [name for name in TREE_FIELDS if f"`{name}`" not in PAGE] == []


def test_every_reason_is_documented_with_what_to_do():
    for reason, (meaning, action) in REASONS.items():
        assert f"| `{reason}` | {meaning} | {action} |" in PAGE
        assert explain(reason) == f"{meaning}: {action}"
