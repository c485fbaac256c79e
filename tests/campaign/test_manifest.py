"""Manifests as they come: from Excel, with wrong rows, with doubled plots. Nothing starts before all are checked."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_campaign import make_cloud, write_manifest

from treedgs_geo.campaign.manifest import Checker, table_rows
from treedgs_geo.campaign.places import folder_name
from treedgs_geo.campaign.state import Plan, layer_crs, make_plan
from treedgs_geo.core.costs import CostModel
from treedgs_geo.core.errors import CRSError, InputError, TreeDGSError
from treedgs_geo.core.progress import Reporter


def plan(manifest: Path, folder: Path, crs: str | None = None):
    folder.mkdir(exist_ok=True)
    return make_plan(manifest, crs, folder, CostModel.load(), Reporter())


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_spreadsheet_tables_are_read(tmp_path, clouds, encoding, mark):
    place = tmp_path / "Höhenrücken süd"
    place.mkdir()
    shutil.copy(clouds / "cloud_0.laz", place / "Wölke 1.laz")
    head = mark.join(["Plot_ID", "Cloud", "BH m", "", ""])
    number = "1,3" if mark == ";" else "1.3"
    row = mark.join(["Fläche Ä/1", "Wölke 1.laz", number, "", ""])
    manifest = tmp_path / "Höhenrücken süd" / "plots.csv"
    manifest.write_bytes(f"{head}\r\n{row}\r\n{mark * 4}\r\n\r\n".encode(encoding))
    found = plan(manifest, tmp_path / "w").entries[0]["row"]
    assert found["plot_id"] == "Fläche Ä/1" and found["line"] == 2
    assert Path(found["values"]["input"]) == place / "Wölke 1.laz" and float(found["values"]["bh_m"]) == 1.3


def test_excels_first_line_with_the_separator(tmp_path, clouds):
    manifest = tmp_path / "plots.csv"
    manifest.write_text(f"sep=;\r\nplot_id;cloud\r\na;{clouds / 'cloud_0.laz'}\r\n", newline="")
    assert plan(manifest, tmp_path / "w").entries[0]["row"]["line"] == 3


def test_every_wrong_row_is_reported_and_no_folder_is_made(tmp_path, clouds, campaign):
    good = clouds / "cloud_0.laz"
    (tmp_path / "few").mkdir()
    manifest = write_manifest(
        tmp_path / "plots.csv",
        [
            {"plot_id": "a", "cloud": good},
            {"plot_id": "A", "cloud": clouds / "cloud_1.laz"},
            {"plot_id": "", "cloud": good},
            {"plot_id": "c", "cloud": "gone.laz"},
            {"plot_id": "d"},
            {"plot_id": "e", "cloud": good, "photos": clouds},
            {"plot_id": "f", "photos": tmp_path / "few", "crs": "EPSG:6344"},
            {"plot_id": "g", "cloud": clouds / "cloud_2.laz", "bh_m": "9"},
            {"plot_id": "h", "cloud": good},
        ],
    )
    ended = campaign(manifest, tmp_path / "w")
    assert ended.code == 2 and not (tmp_path / "w" / "plots").exists()
    sentence = ended.said("error")[0]
    for part in (
        "8 rows",
        "line 3 (A): plot_id 'A' appears twice (also in line 2)",
        "line 4: has no plot_id",
        "gone.laz does not exist",
        "neither photos nor cloud",
        "both photos and cloud",
        "holds 0 photos",
        "line 9 (g): --bh-m: found 9",
        "line 10 (h): names the same cloud as line 2",
    ):
        assert part in sentence, part


def test_columns_are_settings_of_the_verb(tmp_path, clouds):
    rows = [{"plot_id": "a", "cloud": clouds / "cloud_0.laz", "bh_n": "1.3"}]
    with pytest.raises(InputError, match="did you mean 'bh_m'"):
        plan(write_manifest(tmp_path / "p.csv", rows), tmp_path / "w")
    rows = [{"plot_id": "a", "cloud": clouds / "cloud_0.laz", "output": "x.gpkg"}]
    with pytest.raises(InputError, match="column 'output' is unknown"):
        plan(write_manifest(tmp_path / "p.csv", rows), tmp_path / "w")
    rows = [{"plot_id": "a", "cloud": clouds / "cloud_0.laz", "preset": "fast"}]
    with pytest.raises(InputError, match="preset is not a setting of pointcloud-to-dbh"):
        plan(write_manifest(tmp_path / "p.csv", rows), tmp_path / "w")


def test_mixed_crs_are_explained_and_can_be_brought_together(tmp_path, clouds):
    make_cloud(tmp_path / "west.laz", 9, epsg=26915)
    manifest = write_manifest(
        tmp_path / "p.csv", [{"plot_id": "a", "cloud": clouds / "cloud_0.laz"}, {"plot_id": "b", "cloud": "west.laz"}]
    )
    with pytest.raises(TreeDGSError, match=r"EPSG:6344 \(line 2\), EPSG:26915 \(line 3\).*--crs"):
        plan(manifest, tmp_path / "w")
    assert layer_crs(plan(manifest, tmp_path / "w", "EPSG:6344"), "EPSG:6344") == "EPSG:6344"


def test_a_cloud_without_crs_needs_one(tmp_path):
    make_cloud(tmp_path / "bare.laz", 1, epsg=None)
    manifest = write_manifest(tmp_path / "p.csv", [{"plot_id": "a", "cloud": "bare.laz"}])
    with pytest.raises((InputError, CRSError), match="holds no CRS"):
        plan(manifest, tmp_path / "w")
    assert plan(manifest, tmp_path / "w", "EPSG:32615").entries[0]["row"]["values"]["crs"] == "EPSG:32615"


def test_two_rows_may_not_share_inner_plots(tmp_path, clouds):
    (tmp_path / "c.csv").write_text("plot_id,easting,northing,radius_m\nP1,500004,3700004,4\nP2,500005,3700004,4\n")
    rows = [{"plot_id": f"block{n}", "cloud": clouds / f"cloud_{n}.laz", "plots": "c.csv"} for n in (0, 1)]
    with pytest.raises(InputError, match="its trees would be counted twice"):
        plan(write_manifest(tmp_path / "p.csv", rows), tmp_path / "w")
    rows = [{"plot_id": f"P{n + 1}", "cloud": clouds / f"cloud_{n}.laz", "plots": "c.csv"} for n in (0, 1)]
    assert len(plan(write_manifest(tmp_path / "p.csv", rows), tmp_path / "w")) == 2


@pytest.mark.parametrize(
    "content, words",
    [
        (b"", "is empty"),
        (b"PK\x03\x04rest", "a spreadsheet or an archive"),
        (b"plot_id,plot_id\na,b\n", "appears twice"),
        (b"plot_id,cloud\n", "holds no plot"),
        (b"plot_id,cloud\na,b,c\n", "more cells"),
        (b"\x00\x01\x02\x00", "not text"),
    ],
)
def test_what_is_no_manifest(tmp_path, content, words):
    (tmp_path / "p.csv").write_bytes(content)
    with pytest.raises(InputError, match=words):
        plan(tmp_path / "p.csv", tmp_path / "w")


@given(st.lists(st.text(min_size=1, max_size=60), min_size=2, max_size=2, unique=True))
def test_folder_names_are_safe_and_their_own(ids):
    one, other = (folder_name(text) for text in ids)
    assert one != other
    for name in (one, other):
        assert name.isascii() and len(name) <= 60 and not set(name) & set('/\\:*?"<>| .') and name[0] not in "-"


def test_a_plan_is_read_back(tmp_path, clouds):
    rows = [{"plot_id": f"p{n}", "cloud": clouds / f"cloud_{n}.laz"} for n in range(6)]
    found = plan(write_manifest(tmp_path / "p.csv", rows), tmp_path / "w")
    assert [entry["row"]["line"] for entry in found.entries] == [2, 3, 4, 5, 6, 7]
    assert Plan.load(tmp_path / "w") == found


def test_lines_count_as_in_an_editor(tmp_path):
    (tmp_path / "p.csv").write_text('plot_id,cloud\n\n"a\nb",c\nd,e\n')
    assert [line for line, _ in table_rows(tmp_path / "p.csv")] == [4, 5]
    checker = Checker(tmp_path / "p.csv", None)
    assert list(checker.rows()) == [] and "is no short line of text" in checker.problems[0]
