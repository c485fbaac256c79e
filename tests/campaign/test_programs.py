"""A table of somebody else runs nothing, not even in a check; a program of the command line is named before."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_campaign import make_cloud

from treedgs_geo.campaign.manifest import Checker
from treedgs_geo.cli import main
from treedgs_geo.core.settings import params_of
from treedgs_geo.verbs import all_commands


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    make_cloud(tmp_path / "c.laz", 1)
    (tmp_path / "photos").mkdir()
    return tmp_path


def test_every_setting_that_is_code_is_known_as_such():
    """By their names: a new one that runs something has to be declared."""
    names = ("segmenter_command",)
    for command in all_commands():
        for name, spec, _ in params_of(command.settings):
            runs = name in names or ".py" in spec.suffixes or "command" in name
            assert spec.code == runs, (command.name, name)


@pytest.mark.parametrize("route", ["photos", "cloud"])
def test_a_table_can_name_no_code(folder, route):
    """Of the verbs that a campaign's rows have settings of, none takes code."""
    checker = Checker(folder / "season.csv", None)
    assert not any(spec.code for spec in (*checker.verbs[route].values(), *checker.pairing.values()))


@pytest.mark.parametrize("predict", [[], ["--predict"]])
def test_a_column_that_names_a_program_is_refused(folder, capsys, predict):
    cells = "segmenter_command\na,photos,EPSG:6344,touch ran {input} {output}"
    (folder / "season.csv").write_text(f"plot_id,photos,crs,{cells}\n")
    words = ["campaign", "--manifest", str(folder / "season.csv"), "--workspace", str(folder / "ws"), *predict]
    assert main([*words, "--log-format", "plain"]) == 2
    assert "segmenter_command" in "".join(capsys.readouterr()) and not (folder / "ran").exists()


def test_what_is_run_is_said_before(folder, capsys):
    words = [
        "segment-stems",
        "--input",
        str(folder / "none.laz"),
        "--segmenter",
        "segmentanytree",
        "--segmenter-command",
        f"touch {folder / 'ran'} {{input}} {{output}}",
    ]
    words += ["--output", str(folder / "t.laz"), "--log-format", "plain"]
    assert main(words) == 2  # no cloud: refused before anything ran
    said = "".join(capsys.readouterr())
    assert "--segmenter-command: runs" in said and not (folder / "ran").exists()
