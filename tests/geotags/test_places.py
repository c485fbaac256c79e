"""Project CRS and geotags against the place where the photos were taken: both routes, before anything is computed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest

from treedgs_geo.cli import main
from treedgs_geo.core.errors import CRSError, GeotagError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations


class Ears(Reporter):
    def __init__(self) -> None:
        super().__init__()
        self.heard: list[str] = []

    def warn(self, message: str) -> None:
        self.heard.append(message)


@pytest.fixture(scope="module")
def placed(simulated_plot):
    return read_stations(simulated_plot / "images", simulated_plot, "EPSG:6344", check_photos=False)


def _table(path: Path, stations, xyz: np.ndarray) -> Path:
    rows = [
        f"{Path(name).name},{x!r},{y!r},{z!r}" for name, (x, y, z) in zip(stations.names, xyz.tolist(), strict=True)
    ]
    path.write_text("\n".join(["name,x,y,z", *rows]) + "\n")
    return path


@pytest.mark.parametrize("crs", ["EPSG:3857", "EPSG:32662", "EPSG:3035", "EPSG:5070", "EPSG:32613", "EPSG:3857+5703"])
def test_a_stretching_project_crs_is_refused_by_every_verb(crs, simulated_plot, tmp_path, capsys):
    """Before: EPSG:3857 gave trees 22 % too thick, ``ok``."""
    photos = ["--photos", str(simulated_plot / "images"), "--geotags", str(simulated_plot), "--crs", crs]
    work, out = str(tmp_path / "out_work"), str(tmp_path / "out.gpkg")
    for words in (
        ["photos-to-dbh", "--workspace", work, "--output", out, "--dry-run", "true"],
        ["photos-to-dbh", "--workspace", work, "--output", out],
        ["reconstruct", "--workspace", work],
        ["geotag", "--output", out],
    ):
        assert main([words[0], *photos, *words[1:], "--log-format", "plain"]) == 2
        reported = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
        assert len(reported) == 1 and reported[0].startswith("error: --crs: ")
        assert "EPSG:32615 (WGS 84 / UTM zone 15N)" in reported[0]
        assert not list(tmp_path.glob("out*.gpkg")) and not list(tmp_path.glob("out*/sfm"))


def test_a_neighbouring_zone_is_reported_and_measured_in(placed, simulated_plot):
    """An own zone 4 degrees away: the place is outside of no area, but the scale is reported."""
    ears = Ears()
    far = "+proj=tmerc +lon_0=-96.9 +k=0.9996 +x_0=500000 +datum=NAD83 +units=m +type=crs"
    stations = read_stations(simulated_plot / "images", None, far, check_photos=False, reporter=ears)
    assert any("m on the map" in sentence for sentence in ears.heard) and stations.is_placed.all()
    quiet = Ears()
    read_stations(simulated_plot / "images", simulated_plot, "EPSG:6344", check_photos=False, reporter=quiet)
    assert not any("map" in sentence or "area" in sentence for sentence in quiet.heard)


def test_the_area_of_a_compound_crs_counts(simulated_plot):
    """Before, only a CRS without a height datum was compared with the photos' place."""
    with pytest.raises(CRSError, match=r"made for longitudes .*give --crs EPSG:32615"):
        read_stations(simulated_plot / "images", None, "EPSG:32633+3855", check_photos=False)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda xyz: xyz - np.floor(xyz.mean(axis=0)) + (-190, 30, 60), "local metres by their size"),
        (lambda xyz: np.column_stack([xyz[:, 1], xyz[:, 0], xyz[:, 2]]), "exchanged"),
        (lambda xyz: xyz * (1e3, 1e3, 1), "cannot lie"),
        (lambda xyz: np.column_stack([np.full(len(xyz), -91.8), np.full(len(xyz), 33.6), xyz[:, 2]]), "degrees"),
        (lambda xyz: xyz - (611_527, 0, 0), "easting from 0"),
    ],
)
def test_a_table_whose_positions_cannot_lie_in_the_project_crs(make, words, placed, simulated_plot, tmp_path):
    table = _table(tmp_path / "positions.csv", placed, make(placed.xyz))
    with pytest.raises(CRSError, match=words) as found:
        read_stations(simulated_plot / "images", table, "EPSG:6344", check_photos=False)
    assert str(found.value).startswith(str(table))


def test_a_table_in_the_zone_beside_is_named(placed, simulated_plot, tmp_path):
    other = pyproj.Transformer.from_crs("EPSG:6344", "EPSG:32616", always_xy=True)
    moved = np.column_stack([*other.transform(placed.xyz[:, 0], placed.xyz[:, 1]), placed.xyz[:, 2]])
    table = _table(tmp_path / "positions.csv", placed, moved)
    with pytest.raises(GeotagError, match=r"\(in EPSG:32616, WGS 84 / UTM zone 16N, they would fit\)"):
        read_stations(simulated_plot / "images", table, "EPSG:6344", check_photos=False)


def test_geo_txt_whose_positions_cannot_lie_in_its_own_crs(placed, simulated_plot, tmp_path):
    geo = tmp_path / "geo.txt"
    lines = [
        f"{Path(name).name} {x - 611_000:.3f} {y - 3_718_000:.3f} {z:.3f}"
        for name, (x, y, z) in zip(placed.names, placed.xyz.tolist(), strict=True)
    ]
    geo.write_text("\n".join(["EPSG:32615", *lines]) + "\n")
    with pytest.raises(CRSError, match=r"geo\.txt, line 2: .*local metres"):
        read_stations(simulated_plot / "images", geo, "EPSG:6344", check_photos=False)
    to_web = pyproj.Transformer.from_crs("EPSG:6344", "EPSG:3857", always_xy=True)
    lines = [
        f"{Path(name).name} {to_web.transform(x, y)[0]:.4f} {to_web.transform(x, y)[1]:.4f} {z:.3f}"
        for name, (x, y, z) in zip(placed.names, placed.xyz.tolist(), strict=True)
    ]
    geo.write_text("\n".join(["EPSG:3857", *lines]) + "\n")
    found = read_stations(simulated_plot / "images", geo, "EPSG:32615", check_photos=False)
    assert np.abs(found.xyz - placed.xyz)[:, :2].max() < 3, "positions may come on any map: they are turned into --crs"


def test_the_frame_of_the_geotags_has_a_place_too(placed, simulated_plot, tmp_path):
    with pytest.raises(CRSError, match=r"^--geotags-crs: GDA2020 is made for longitudes"):
        read_stations(simulated_plot / "images", simulated_plot, "EPSG:6344", check_photos=False, frame="EPSG:7843")


def test_one_photo_without_a_fix_does_not_decide_on_the_place():
    from treedgs_geo.geotags.reading import _middle

    class Photo:
        has_position = True

        def __init__(self, lon: float, lat: float) -> None:
            self.lon_deg, self.lat_deg = lon, lat

    assert _middle([Photo(0.0, 0.0), Photo(-91.8, 33.6), Photo(-91.81, 33.61)]) == (-91.8, 33.6)
    assert _middle([]) is None
