"""Files that are not what they should be end with one sentence, a non-zero exit code and nothing written."""

from __future__ import annotations

import json
import os
import struct
import zlib
from pathlib import Path

import pyproj
import pytest
from small_campaign import make_cloud

from treedgs_geo.cli import main
from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import CRSError, GeotagError, InputError, OutputError
from treedgs_geo.core.files import write_json
from treedgs_geo.core.plots import read_plots
from treedgs_geo.core.workspace import Workspace
from treedgs_geo.geotags.photos import read_photo
from treedgs_geo.geotags.tables import is_position_table, read_position_table
from treedgs_geo.run.measure_stage import read_kept_trees

UTM = pyproj.CRS("EPSG:6344")
HEAD = "plot_id,easting,northing,radius_m,epsg\n"


@pytest.fixture(scope="module")
def cloud(tmp_path_factory) -> Path:
    return make_cloud(tmp_path_factory.mktemp("cloud") / "cloud.laz", 1)


@pytest.mark.parametrize(
    ("row", "words", "kind"),
    [
        ("a,500000,3700000,8,inf", "epsg 'inf' is unknown", CRSError),
        ("a,500000,3700000,8,1e400", "epsg '1e400' is unknown", CRSError),
        ("a,nan,3700000,8,", "only one of easting and northing", InputError),
        ("a,inf,3700000,8,", "easting is 'inf', expected a number", InputError),
        ("a,500000,3700000,inf,", "radius_m is 'inf', expected a number", InputError),
        ("a,9e99,3700000,8,32615", "has no place in", InputError),
        ("a,500000,3700000,8," + "6" * 140_000, "field larger than field limit", InputError),
    ],
)
def test_a_plots_table_with_odd_values(tmp_path, row, words, kind):
    (tmp_path / "plots.csv").write_text(HEAD + row + "\n")
    with pytest.raises(kind, match=words) as heard:
        read_plots(tmp_path / "plots.csv", UTM)
    assert "plots.csv" in str(heard.value)


def test_a_position_table_with_an_endless_cell(tmp_path):
    endless = tmp_path / "positions.csv"
    endless.write_text("name,lat,lon,h\nDJI_0001.JPG,33,-91," + "1" * 140_000 + "\n")
    with pytest.raises(GeotagError, match=r"positions\.csv, line 2: is not CSV .*save the table again"):
        read_position_table(endless, UTM)
    (tmp_path / "notes.txt").write_text("a," + "b" * 140_000)
    assert not is_position_table(tmp_path / "notes.txt")


def png(path: Path, side: int) -> Path:
    """A PNG whose header claims a square of this side; no pixel is needed to be fooled."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    parts = chunk(b"IHDR", head), chunk(b"IDAT", zlib.compress(b"")), chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    return path


def test_a_picture_of_3600_megapixels(tmp_path, capsys):
    with pytest.raises(InputError, match=r"huge\.png: claims more than \d+ megapixels"):
        read_photo(png(tmp_path / "huge.png", 60_000))
    code = main(
        [
            "geotag",
            "--photos",
            str(tmp_path),
            "--crs",
            "EPSG:6344",
            "--log-format",
            "plain",
            "--output",
            str(tmp_path / "out" / "g.gpkg"),
        ]
    )
    heard = "".join(capsys.readouterr())
    assert code == 2 and "megapixels" in heard and "Traceback" not in heard and not (tmp_path / "out").exists(), heard


@pytest.mark.parametrize(
    "content",
    [
        "{}",
        "[]",
        "null",
        '{"crs_wkt": "x", "origin": [0, 0, 0]}',
        json.dumps({"crs_wkt": UTM.to_wkt(), "origin": [1, 2]}),
        json.dumps({"crs_wkt": UTM.to_wkt(), "origin": "here"}),
        "",
    ],
)
def test_a_frame_that_says_nothing(tmp_path, content):
    (tmp_path / "frame.json").write_text(content)
    with pytest.raises(InputError, match=r"frame\.json"):
        LocalFrame.load(tmp_path / "frame.json")


@pytest.mark.parametrize("stages", [["geotag"], {"geotag": "done"}, None, 3])
@pytest.mark.parametrize("dry", [[], ["--dry-run"]])
def test_a_record_with_other_stages(tmp_path, capsys, stages, dry):
    photos, work = tmp_path / "photos", tmp_path / "work"
    photos.mkdir()
    png(photos / "a.png", 10)
    write_json(work / "run.json", {"version": "0", "stages": stages})
    before = (work / "run.json").read_bytes()
    code = main(
        [
            "photos-to-dbh",
            "--photos",
            str(photos),
            "--crs",
            "EPSG:6344",
            "--workspace",
            str(work),
            "--output",
            str(tmp_path / "t.gpkg"),
            "--log-format",
            "plain",
            *dry,
        ]
    )
    heard = "".join(capsys.readouterr())
    assert code == 2 and "Traceback" not in heard
    if not dry:  # the dry run looks at the photos first, and they are none
        assert "run.json: its 'stages' are no table of stages" in heard
    assert (work / "run.json").read_bytes() == before and sorted(os.listdir(work)) == ["run.json"] or not dry


@pytest.mark.parametrize("content", [[{"height": 3}], ["tree"], {"a": 1}, 7, [{"tree_id": 1, "qc_reason": "luck"}]])
def test_trees_of_another_program(tmp_path, content):
    write_json(tmp_path / "trees.json", content)
    with pytest.raises(InputError, match=r"trees\.json: holds no trees of this version .*delete it"):
        read_kept_trees(tmp_path / "trees.json")


NAMES = {
    "a line break": ("tre\nes", "holds a line break"),
    "a tab": ("tre\tes", "expected a plain path"),
    "too long": ("x" * 250, "expected at most 240"),
    "too long in bytes": ("ß" * 125, "expected at most 240"),
    "no text": (os.fsdecode(b"tr\xff"), "expected a plain path"),
}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("verb", "suffix"),
    [
        ("pointcloud-to-dbh", ".gpkg"),
        ("pointcloud-to-dbh", ".csv"),
        ("terrain", ".tif"),
        ("segment-stems", ".laz"),
        ("simulate-plot", ""),
    ],
)
def test_names_that_no_output_should_have(tmp_path, cloud, capsys, name, verb, suffix):
    stem, words = NAMES[name]
    for target in (tmp_path / (stem + suffix), tmp_path / stem / f"out{suffix}"):
        given = [] if verb == "simulate-plot" else ["--input", str(cloud)]
        for dry in ([], ["--dry-run"]) if verb == "pointcloud-to-dbh" else ([],):
            code = main([verb, *given, "--output", str(target), "--log-format", "plain", *dry])
            heard = "".join(capsys.readouterr())
            assert code == 2 and words in heard and "Traceback" not in heard, heard
            assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("suffix", [".gpkg", ".csv", ".shp", ".geojson"])
def test_an_output_that_is_a_folder(tmp_path, cloud, capsys, suffix):
    (tmp_path / f"out{suffix}").mkdir()
    code = main(
        [
            "pointcloud-to-dbh",
            "--input",
            str(cloud),
            "--output",
            str(tmp_path / f"out{suffix}"),
            "--log-format",
            "plain",
        ]
    )
    assert code == 2 and "is a folder" in "".join(capsys.readouterr())


def test_a_geopackage_at_the_end_of_a_path_that_is_too_long_for_sqlite(tmp_path, cloud, capsys):
    deep = tmp_path.joinpath(*["d" * 100] * 5)
    for dry in (["--dry-run"], []):
        code = main(
            [
                "pointcloud-to-dbh",
                "--input",
                str(cloud),
                "--output",
                str(deep / "t.gpkg"),
                "--log-format",
                "plain",
                *dry,
            ]
        )
        assert code == 2 and "for a GeoPackage; choose a shorter one" in "".join(capsys.readouterr())
        assert os.listdir(tmp_path) == []


def test_an_unusable_record_does_not_hide_what_went_wrong(tmp_path):
    """The record cannot be written when the disk is full: the stage's own problem is what counts."""
    space = Workspace(tmp_path / "w")
    with pytest.raises(OutputError, match="the stage's own"), space.running("fit", "k", {}):
        space._file = tmp_path / "w" / "run.json" / "is no folder"
        raise OutputError("the stage's own")
    assert json.loads((tmp_path / "w" / "run.json").read_text())["stages"]["fit"]["status"] == "running"
