"""What a verb may write over: never an input or another output, nothing of somebody else's; said before work."""

from __future__ import annotations

import json
import os
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

import pyogrio
import pytest
from small_campaign import make_cloud

from treedgs_geo.cli import main
from treedgs_geo.core.errors import InputError, OutputError
from treedgs_geo.core.files import ensure_writable
from treedgs_geo.core.outputs import checked_paths, is_foreign
from treedgs_geo.core.settings import param

posix = pytest.mark.skipif(sys.platform == "win32", reason="links and pipes need rights on Windows")


@pytest.fixture(scope="module")
def cloud(tmp_path_factory) -> Path:
    return make_cloud(tmp_path_factory.mktemp("cloud") / "cloud.laz", 1)


@pytest.fixture(scope="module")
def layer(tmp_path_factory, cloud) -> Path:
    made = tmp_path_factory.mktemp("layer") / "trees.gpkg"
    words = ["--input", str(cloud), "--output", str(made)]
    words += ["--report", str(made.with_name("page.html")), "--sheets", "none", "--log-format", "quiet"]
    assert main(["pointcloud-to-dbh", *words]) == 0
    return made


def heard_of(capsys, verb: str, *words: object) -> tuple[int, str]:
    code = main([verb, *map(str, words), "--log-format", "plain"])
    said = "".join(capsys.readouterr())
    assert "Traceback" not in said
    return code, said


@pytest.fixture
def own(tmp_path, cloud) -> Path:
    shutil.copy(cloud, tmp_path / "own.laz")
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,radius_m\np,425008,3718008,7\n")
    return tmp_path


@pytest.mark.parametrize("link", ["itself", "dots", pytest.param("symbolic", marks=posix), "hard"])
@pytest.mark.parametrize(
    ("verb", "source", "target"),
    [
        ("segment-stems", "--input", "--output"),
        ("terrain", "--input", "--ground-points"),
    ],
)
def test_an_output_is_never_an_input(own, capsys, link, verb, source, target):
    before, second = (own / "own.laz").read_bytes(), own / "second.laz"
    if link == "symbolic":
        second.symlink_to(own / "own.laz")
    elif link == "hard":
        os.link(own / "own.laz", second)
    else:
        second = own / "own.laz" if link == "itself" else own / ".." / own.name / "own.laz"
    other = ["--output", own / "t.tif"] if verb == "terrain" else []
    code, said = heard_of(capsys, verb, source, own / "own.laz", target, second, "--overwrite", *other)
    assert code == 2 and f"is what {source} names" in said and target in said
    assert (own / "own.laz").read_bytes() == before and not (own / "t.gpkg").exists()


def test_one_file_for_two_outputs(own, capsys):
    words = ["--input", own / "own.laz", "--plots", own / "plots.csv"]
    for more in (
        ["--output", own / "z.csv", "--report", own / "plots.csv"],
        ["--output", own / "plots.csv"],
        ["--output", own / "z.gpkg", "--report", own / "z.gpkg"],
    ):
        code, said = heard_of(capsys, "pointcloud-to-dbh", *words, *more)
        assert code == 2 and ("is what --plots names" in said or "expected .html" in said), said
    assert (own / "plots.csv").read_text().startswith("plot_id") and not list(own.glob("z.*"))


def test_outputs_that_are_each_other(tmp_path):
    @dataclass(frozen=True, kw_only=True)
    class Two:
        one: Path = param(kind="output_file", help="", suffixes=("csv",))
        two: Path = param(kind="output_file", help="", suffixes=("csv",))
        new: Path | None = param(None, kind="output_folder", help="")

    with (
        pytest.raises(InputError, match=r"--two: .*a\.csv is what --one names"),
        checked_paths(Two(one=tmp_path / "a.csv", two=tmp_path / "b" / ".." / "a.csv")),
    ):
        pass
    with (
        pytest.raises(InputError, match="--one: .* lies in the folder of --new"),
        checked_paths(Two(one=tmp_path / "n" / "a.csv", two=tmp_path / "b.csv", new=tmp_path / "n")),
    ):
        pass


@pytest.mark.parametrize("given", ["t.gpkg", "t.csv", "t.shp", "t.geojson", "page.html", "stems.laz"])
def test_a_file_of_somebody_else_stays(own, capsys, given):
    verb = "segment-stems" if given.endswith(".laz") else "pointcloud-to-dbh"
    option = "--report" if given.endswith(".html") else "--output"
    words = ["--input", own / "own.laz", option, own / given]
    words += [] if verb == "segment-stems" else ["--sheets", "none"]
    words += [] if option == "--output" else ["--output", own / "trees.gpkg"]
    for content in (b"mine", b"tree_no,dbh\n1,30\n"):
        (own / given).write_bytes(content)
        code, said = heard_of(capsys, verb, *words)
        assert code == 2 and "was not written by TreeDGS" in said and "--overwrite" in said
        assert (own / given).read_bytes() == content
    assert heard_of(capsys, verb, *words, "--overwrite")[0] == 0
    assert (own / given).read_bytes() != content
    # Our own result is replaced at once.
    assert heard_of(capsys, verb, *words)[0] == 0


def test_an_empty_file_is_nobodys(tmp_path):
    (tmp_path / "t.gpkg").touch()
    assert not is_foreign(tmp_path / "t.gpkg") and not is_foreign(tmp_path / "none.gpkg")


def test_the_terrain_is_known_as_ours(own, capsys):
    words = ["--input", own / "own.laz", "--output", own / "dtm.tif", "--ground-points", own / "g.laz"]
    for _ in range(2):
        assert heard_of(capsys, "terrain", *words)[0] == 0


def test_own_files_in_an_output_folder(tmp_path, layer, capsys):
    plots = tmp_path / "plots.csv"
    table = pyogrio.read_dataframe(layer, layer="trees")
    plots.write_text(f"plot_id,easting,northing,radius_m\np,{table.x.mean()},{table.y.mean()},6\n")
    folder = tmp_path / "stand"
    folder.mkdir()
    (folder / "thesis.docx").write_text("mine")
    words = ["--trees", layer, "--plots", plots, "--species", "PITA", "--output", folder]
    assert heard_of(capsys, "stand-table", *words)[0] == 0
    assert heard_of(capsys, "stand-table", *words)[0] == 0
    assert (folder / "thesis.docx").read_text() == "mine"
    other = tmp_path / "other"
    other.mkdir()
    (other / "report.html").write_text("mine")
    code, said = heard_of(capsys, "stand-table", *words[:-1], other)
    assert code == 2 and "report.html is there already and was not written by TreeDGS" in said
    assert (other / "report.html").read_text() == "mine" and len(list(other.iterdir())) == 1
    shutil.copy(plots, folder / "stand_plots.csv")
    before = (folder / "stand_plots.csv").read_bytes()
    code, said = heard_of(capsys, "stand-table", "--trees", layer, "--plots", folder / "stand_plots.csv", *words[4:])
    assert code == 2 and "is what --plots names" in said and (folder / "stand_plots.csv").read_bytes() == before


def test_a_folder_that_is_made_anew_holds_nothing_else(tmp_path, capsys):
    (tmp_path / "photos").mkdir()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "x").write_text("mine")
    words = ["--photos", tmp_path / "photos", "--crs", "EPSG:6344", "--output", tmp_path / "g.gpkg"]
    code, said = heard_of(capsys, "geotag", *words, "--tagged-photos", tmp_path / "full")
    assert code == 2 and "full: is there already, not empty" in said
    assert (tmp_path / "full" / "x").read_text() == "mine"


def test_pairs_do_not_go_into_the_trees(tmp_path, layer, capsys):
    trees = shutil.copy(layer, tmp_path / "t.gpkg")
    words = ["--trees", trees, "--field", layer, "--plots", layer, "--output", trees]
    code, said = heard_of(capsys, "match-plots", *words)
    assert code == 2 and "is what --trees names" in said


@posix
@pytest.mark.parametrize(("name", "option"), [("f.gpkg", "--output"), ("f.laz", "--input"), ("f.html", "--report")])
def test_a_pipe_does_not_hang(own, capsys, name, option):
    os.mkfifo(own / name)
    given = {"--input": own / "own.laz", "--output": own / "t.gpkg", option: own / name}
    code, said = heard_of(capsys, "pointcloud-to-dbh", *(word for pair in given.items() for word in pair))
    assert code == 2 and f"{name}: is a pipe or a device" in said


@pytest.mark.parametrize(
    ("verb", "option", "name"),
    [
        ("segment-stems", "--output", "s.txt"),
        ("pointcloud-to-dbh", "--report", "r.pdf"),
        ("terrain", "--ground-points", "g.csv"),
        ("terrain", "--output", "g.png"),
        ("segment-stems", "--output", "g"),
    ],
)
def test_a_wrong_ending_is_said_before_work(own, capsys, verb, option, name):
    given = {"--input": own / "missing.laz", "--output": own / ("t.tif" if verb == "terrain" else "t.gpkg")}
    given[option] = own / name
    code, said = heard_of(capsys, verb, *(word for pair in given.items() for word in pair))
    assert code == 2 and "expected ." in said and name in said


def test_inputs_are_kept_whatever_the_name_under_which_they_would_be_written(tmp_path):
    @dataclass(frozen=True, kw_only=True)
    class One:
        input: Path = param(kind="file", help="")
        output: Path = param(kind="output_file", help="")

    (tmp_path / "a.txt").write_text("mine")
    os.link(tmp_path / "a.txt", tmp_path / "a_sheets.txt")
    with checked_paths(One(input=tmp_path / "a.txt", output=tmp_path / "b.txt")):
        with pytest.raises(OutputError, match="is an input of this run"):
            ensure_writable(tmp_path / "a_sheets.txt")
        ensure_writable(tmp_path / "b.txt")
    ensure_writable(tmp_path / "a.txt")


def test_qgis_asks_itself_about_files_and_not_about_folders(own, layer, capsys):
    (own / "t.csv").write_text("mine")
    values = {"input": str(own / "own.laz"), "output": str(own / "t.csv"), "sheets": "none"}
    for overwrite, code in ((["report"], 2), (["output"], 0)):
        job = {"protocol": 1, "command": "pointcloud-to-dbh", "parameters": values, "overwrite": overwrite}
        (own / "job.json").write_text(json.dumps(job))
        done = os.spawnv(
            os.P_WAIT, sys.executable, [sys.executable, "-m", "treedgs_geo", "--job", str(own / "job.json")]
        )
        assert done == code
    assert (own / "t.csv").read_text().startswith("tree_id")
