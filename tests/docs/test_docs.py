"""The documented fields are the real ones."""

from __future__ import annotations

from pathlib import Path

from treedgs_geo.stems.quality.tree import TREE_FIELDS

PAGE = (Path(__file__).parents[2] / "docs" / "technician" / "tree-layer.md").read_text(encoding="utf-8")


def test_every_field_is_documented():
    assert [name for name in TREE_FIELDS if f"`{name}`" not in PAGE] == []


def test_help_report_and_pages_say_what_diameters_rest_on():
    from treedgs_geo.core.calibration import CALIBRATION, NETWORK, TAPE
    from treedgs_geo.verbs import photos_to_dbh, pointcloud_to_dbh

    assert all(words in photos_to_dbh.COMMAND.help for words in (CALIBRATION, NETWORK, TAPE))
    assert CALIBRATION in pointcloud_to_dbh.COMMAND.help and TAPE in pointcloud_to_dbh.COMMAND.help
    root = Path(__file__).parents[2]
    for page in ("README.md", "docs/technician/tree-layer.md", "docs/technician/known-limits.md"):
        text = " ".join((root / page).read_text(encoding="utf-8").split())
        assert "no photo of a tree that somebody taped has been measured" in text, page
        assert "network trained on our own simulator decide" in text and "ape some trees" in text, page
