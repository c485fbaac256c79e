"""Bad input: one sentence that says what to do, exit code 2, nothing half-written."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import rasterio
from PIL import Image

from treedgs_geo.cli import main


def _run(capsys, tmp_path: Path, **given: object) -> str:
    words = ["photos-to-dbh", "--log-format", "plain"]
    given = {"crs": "EPSG:6344", "workspace": tmp_path / "work", "output": tmp_path / "out" / "trees.gpkg", **given}
    for name, value in given.items():
        words += [f"--{name.replace('_', '-')}", str(value)]
    assert main(words) == 2
    text = capsys.readouterr().err
    assert "Traceback" not in text
    assert not list(tmp_path.glob("out/*")) and not (tmp_path / "work").exists()
    line = [row for row in text.splitlines() if row.startswith("error: ")]
    assert len(line) == 1
    return line[0]


def test_empty_photo_folder(capsys, tmp_path):
    (tmp_path / "photos").mkdir()
    assert "photo" in _run(capsys, tmp_path, photos=tmp_path / "photos")


def test_missing_photo_folder(capsys, tmp_path):
    assert "nowhere" in _run(capsys, tmp_path, photos=tmp_path / "nowhere")


def test_photos_without_geotags(capsys, tmp_path):
    (tmp_path / "photos").mkdir()
    rng = np.random.default_rng(0)
    for number in range(4):
        Image.fromarray(rng.integers(0, 255, (120, 160, 3), dtype=np.uint8)).save(
            tmp_path / "photos" / f"p{number}.jpg"
        )
    assert "--geotags" in _run(capsys, tmp_path, photos=tmp_path / "photos")


def test_geotags_of_other_photos(capsys, tmp_path, simulated_plot):
    other = tmp_path / "other"
    other.mkdir()
    for source in [*simulated_plot.glob("*.MRK"), *simulated_plot.glob("*.pos")]:
        # The same flight a degree further north: plausible in itself, but not where these photos were taken.
        text = source.read_text()
        shutil.copy(source, other)
        (other / source.name).write_text(text.replace("33.", "34."))
    assert "other photos" in _run(capsys, tmp_path, photos=simulated_plot / "images", geotags=other)


def test_geographic_crs_suggests_the_utm_zone(capsys, tmp_path, simulated_plot):
    line = _run(capsys, tmp_path, photos=simulated_plot / "images", geotags=simulated_plot, crs="EPSG:4326")
    assert "UTM" in line and "EPSG:32615" in line


def test_crs_in_feet(capsys, tmp_path, simulated_plot):
    line = _run(capsys, tmp_path, photos=simulated_plot / "images", geotags=simulated_plot, crs="EPSG:3433")
    assert "foot" in line or "feet" in line


def test_dtm_that_does_not_cover_the_plot(capsys, tmp_path, simulated_plot):
    with rasterio.open(simulated_plot / "dtm.tif") as source:
        profile, band = source.profile, source.read()
    profile["transform"] = profile["transform"] * rasterio.Affine.translation(10_000, 0)
    with rasterio.open(tmp_path / "away.tif", "w", **profile) as target:
        target.write(band)
    line = _run(
        capsys,
        tmp_path,
        photos=simulated_plot / "images",
        geotags=simulated_plot,
        dtm=tmp_path / "away.tif",
        plots=simulated_plot / "plots.csv",
    )
    assert "away.tif" in line and "cover" in line


def test_plots_far_from_the_photos(capsys, tmp_path, simulated_plot):
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,radius_m\nfar,500000,3700000,10\n")
    line = _run(
        capsys, tmp_path, photos=simulated_plot / "images", geotags=simulated_plot, plots=tmp_path / "plots.csv"
    )
    assert "'far'" in line and "epsg" in line


def test_unwritable_output(capsys, tmp_path, simulated_plot):
    (tmp_path / "file").write_text("")
    line = _run(capsys, tmp_path, photos=simulated_plot / "images", output=tmp_path / "file" / "trees.gpkg")
    assert "choose another output" in line and not (tmp_path / "work").exists()


def test_unknown_output_format(capsys, tmp_path, simulated_plot):
    assert "rename" in _run(capsys, tmp_path, photos=simulated_plot / "images", output=tmp_path / "trees.docx")


@pytest.mark.parametrize("name", ["photo", "bh"])
def test_unknown_parameter(capsys, tmp_path, name):
    assert "unknown" in _run(capsys, tmp_path, **{name: "x"})
