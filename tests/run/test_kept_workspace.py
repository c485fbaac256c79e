"""A workspace that is not given lies beside the photos, is named, and is never taken for photos."""

from __future__ import annotations

import json
from pathlib import Path

from small_flight import CRS, Flight, lines, write_photos

from treedgs_geo.cli import main
from treedgs_geo.core.workspace import beside_photos
from treedgs_geo.geotags.photos import list_photos


def test_it_lies_beside_the_photos_and_is_named(tmp_path: Path, capsys, monkeypatch) -> None:
    write_photos(Flight(lines(12, 8.0)), tmp_path / "flight")
    monkeypatch.chdir(tmp_path / "flight")
    words = ["photos-to-dbh", "--photos", ".", "--crs", CRS, "--output", str(tmp_path / "t.gpkg"), "--preset", "fast"]
    place = tmp_path / "flight_treedgs"
    assert main([*words, "--dry-run", "--log-format", "plain"]) == 0
    assert f"Workspace: {place}" in "".join(capsys.readouterr()) and not place.exists()
    assert main([*words, "--log-format", "plain"]) == 2  # pictures of noise match nothing
    assert f"Workspace: {place}" in "".join(capsys.readouterr())
    assert "geotag" in json.loads((place / "run.json").read_text())["stages"]
    assert beside_photos(Path(".")) == place


def test_pictures_of_a_workspace_are_no_photos(tmp_path: Path) -> None:
    write_photos(Flight(lines(4, 8.0)), tmp_path / "flight")
    before = list_photos(tmp_path / "flight")
    sheets = tmp_path / "flight" / "work" / "sheets" / "id"
    sheets.mkdir(parents=True)
    (sheets / "1.jpg").write_bytes(before[0].read_bytes())
    (tmp_path / "flight" / "work" / "run.json").write_text("{}")
    assert list_photos(tmp_path / "flight") == before
