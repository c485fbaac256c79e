"""What is known before any photo is matched is said then: nadir photos, and how large a search will be."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyogrio
import pytest
from shared_data import needs_shared
from small_flight import CRS, Flight, lines, write_photos
from synthetic_block import ring

from treedgs_geo.cli import main
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.workspace import Workspace
from treedgs_geo.reconstruction.area import Area, area_seen
from treedgs_geo.run.forecast import search_of
from treedgs_geo.run.photos import GIVEN, SHEETS, TREES, WRITE
from treedgs_geo.run.stage import Stage, Steps
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.tiles import split


def _words(folder: Path, **more: object) -> list[str]:
    given = {
        "photos": folder / "photos",
        "crs": CRS,
        "workspace": folder / "work",
        "output": folder / "out.gpkg",
        **more,
    }
    words = ["photos-to-dbh", "--json"]
    for name, value in given.items():
        words += [f"--{name.replace('_', '-')}"] + ([] if value is True else [str(value)])
    return words


def _events(capsys) -> list[dict]:
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def _texts(events: list[dict], kind: str) -> list[str]:
    return [event["message"] for event in events if event["t"] == kind]


def _block(folder: Path, count: int, spacing_m: float) -> None:
    write_photos(Flight(lines(count, spacing_m / 2)), folder / "photos")


def test_the_dry_run_counts_tiles_and_time_grows_with_them(tmp_path: Path, capsys) -> None:
    results = []
    for count, spacing in ((40, 8.0), (160, 16.0)):
        folder = tmp_path / str(count)
        _block(folder, count, spacing)
        assert main(_words(folder, dry_run=True)) == 0
        events = _events(capsys)
        results.append((events[-1]["result"], _texts(events, "warn") + _texts(events, "info")))
        assert not (folder / "work").exists()
    (small, _), (large, said) = results
    assert large["n_tiles"] > 2 * small["n_tiles"] > 40  # on 2.8 times the ground
    assert large["predicted_s"] > 2 * small["predicted_s"]
    line = next(text for text in said if "tiles of about" in text)
    assert f" in {large['n_tiles']} tiles" in line and "--plots" in line
    plots = tmp_path / "plots.csv"
    plots.write_text("plot_id,easting,northing,radius_m\na,425070,3718070,10\n")
    assert main(_words(tmp_path / "160", dry_run=True, plots=plots)) == 0
    events = _events(capsys)
    assert events[-1]["result"]["n_tiles"] == 1
    assert not any("--plots" in text for text in _texts(events, "warn"))


def test_a_large_block_that_says_no_angles_is_no_matter_of_minutes(tmp_path: Path, capsys) -> None:
    seconds = []
    for name, xmp in (("known", {}), ("unknown", {"GimbalPitchDegree": None})):
        write_photos(Flight(lines(160, 8.0), xmp=xmp), tmp_path / name / "photos")
        assert main(_words(tmp_path / name, dry_run=True)) == 0
        events = _events(capsys)
        seconds.append(events[-1]["result"]["predicted_s"])
        assert any("--plots" in text for text in _texts(events, "warn"))
    assert 0.3 < seconds[1] / seconds[0] < 3


def test_the_dry_run_counts_the_tiles_that_are_searched() -> None:
    views = ring(24, 60.0, -55.0)
    area = area_seen(views, 0.0)
    search = search_of(area, views, PhotoStemOptions())
    assert search.tiles == len(split(area, PhotoStemOptions().margin_m)) > 4
    one = search_of(Area.circle(0.0, 0.0, 12.0), views, PhotoStemOptions())
    assert one.tiles == 1 and one.hectares == pytest.approx(np.pi * 0.0144, rel=0.02)
    assert search.core_seconds > 3 * one.core_seconds > 0


def test_the_run_itself_says_it_first(tmp_path: Path, capsys) -> None:
    _block(tmp_path, 30, 12.0)
    assert main(_words(tmp_path, preset="fast")) == 2  # pictures of noise match nothing
    events = _events(capsys)
    warned = next(k for k, event in enumerate(events) if "tiles of about" in event.get("message", ""))
    begun = next(k for k, event in enumerate(events) if event["t"] == "stage" and event["name"] == "reconstruct")
    assert warned < begun and "--plots" in events[warned]["message"]


def test_a_long_search_fills_the_progress_bar(tmp_path: Path) -> None:
    ends, shares = {}, {stage.name: stage.share for stage in (*TREES, GIVEN, SHEETS, WRITE)}
    for factor in (1.0, 20.0):
        steps = Steps(Workspace(tmp_path / str(factor)), Reporter(), shares)
        stages = [Stage(name, share, lambda job, reporter: {}) for name, share in shares.items()]
        steps.run(stages[0], None)
        steps.weigh("measure", factor)
        steps.run(stages[1], None)
        ends[factor] = steps._at
        for stage in stages[2:]:
            steps.run(stage, None)
        assert steps._at == pytest.approx(1.0)
    assert ends[1.0] == pytest.approx(shares["geotag"] + shares["reconstruct"]) and ends[20.0] < 0.1


def test_nadir_photos_end_early_with_the_reason(tmp_path: Path, capsys) -> None:
    write_photos(Flight(lines(24), pitch_deg=-89.5), tmp_path / "photos")
    assert main(_words(tmp_path, dry_run=True)) == 2
    errors = _texts(_events(capsys), "error")
    assert len(errors) == 1 and "no DBH" in errors[0] and "straight down" in errors[0] and "oblique" in errors[0]
    assert main(_words(tmp_path)) == 0
    events = _events(capsys)
    assert not any(event["t"] == "stage" and event["name"] == "reconstruct" for event in events)
    result = events[-1]["result"]
    assert result["n_trees"] == 0 and "all 24 photos look almost straight down" in result["status"]
    assert pyogrio.read_info(tmp_path / "out.gpkg", layer="trees")["features"] == 0
    report = (tmp_path / "work" / "report.html").read_text()
    assert "straight down" in report and "not matched" in report


@pytest.mark.parametrize("case", ["no angles", "three oblique", "almost"])
def test_nadir_is_only_said_where_it_is_known(tmp_path: Path, capsys, case: str) -> None:
    pitch = np.full(24, -89.5)
    xmp: dict[str, str | None] = {}
    if case == "no angles":
        xmp = {"GimbalPitchDegree": None, "GimbalYawDegree": None}
    elif case == "three oblique":
        pitch[[3, 9, 15]] = -60
    else:
        pitch[:] = -76  # 14 degrees: mounting and gimbal errors may make it enough
    write_photos(Flight(lines(24), pitch_deg=pitch, xmp=xmp), tmp_path / "photos")
    assert main(_words(tmp_path, dry_run=True)) == 0
    events = _events(capsys)
    assert events[-1]["result"]["n_tiles"] > 10
    if case == "no angles":
        assert any("roughly" in text for text in _texts(events, "warn") + _texts(events, "info"))


def test_real_nadir_photos(tmp_path: Path, capsys) -> None:
    photos = needs_shared("drone_brighton_beach") / "images"
    assert main(_words(tmp_path, photos=photos, crs="EPSG:32615", dry_run=True)) == 2
    assert "all 18 photos look almost straight down" in _texts(_events(capsys), "error")[0]
    assert main(_words(tmp_path, photos=photos, crs="EPSG:32615")) == 0
    assert "straight down" in _events(capsys)[-1]["result"]["status"]
