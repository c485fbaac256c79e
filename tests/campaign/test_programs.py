"""A table of somebody else runs nothing, not even in a check; the command line may say that it does."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_campaign import make_cloud

from treedgs_geo.campaign.command import CampaignSettings
from treedgs_geo.campaign.manifest import Checker
from treedgs_geo.cli import main
from treedgs_geo.core.settings import params_of
from treedgs_geo.verbs import all_commands


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    make_cloud(tmp_path / "c.laz", 1)
    (tmp_path / "photos").mkdir()
    (tmp_path / "w.onnx").write_text("w")
    return tmp_path


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("Segmenter_Command", "touch ran {input} {output}"),
        ("segmenter_command", "touch ran {input} {output}"),
        ("segmenter_model", "w.onnx"),
    ],
)
@pytest.mark.parametrize("predict", [[], ["--predict"]])
def test_a_manifest_names_no_program(folder, capsys, column, cell, predict):
    (folder / "season.csv").write_text(f"plot_id,photos,crs,{column}\na,photos,EPSG:6344,{cell}\n")
    words = ["campaign", "--manifest", str(folder / "season.csv"), "--workspace", str(folder / "ws"), *predict]
    assert main([*words, "--log-format", "plain"]) == 2
    said = "".join(capsys.readouterr())
    assert f"line 2 (a): {column.lower()} names code to run" in said and "--run-programs" in said
    assert not (folder / "ran").exists()
    checker = Checker(folder / "season.csv", None, run_programs=True)
    list(checker.rows())
    assert "names code" not in " ".join(checker.problems)


def test_every_setting_that_is_code_is_known_as_such():
    """By their names: a new one that runs something has to be declared."""
    names = ("segmenter_command", "segmenter_model")
    for command in all_commands():
        for name, spec, _ in params_of(command.settings):
            runs = name in names or ".py" in spec.suffixes or "command" in name
            assert spec.code == runs, (command.name, name)
    assert dict((name, default) for name, _, default in params_of(CampaignSettings))["run_programs"] is False


def test_what_is_run_is_said_before(folder, capsys):
    words = [
        "photos-to-dbh",
        "--photos",
        str(folder / "photos"),
        "--crs",
        "EPSG:6344",
        "--segmenter",
        "segmentanytree",
        "--segmenter-command",
        f"touch {folder / 'ran'} {{input}} {{output}}",
    ]
    words += ["--workspace", str(folder / "w"), "--output", str(folder / "t.gpkg"), "--log-format", "plain"]
    assert main(words) == 2  # no photo: refused before anything ran
    said = "".join(capsys.readouterr())
    assert "--segmenter-command: runs" in said and not (folder / "ran").exists()
