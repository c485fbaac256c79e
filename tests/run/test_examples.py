"""The example of a verb works on the sample: what ``treedgs VERB --example`` prints is run."""

from __future__ import annotations

import shlex
import shutil

import pytest

from treedgs_geo.cli import main
from treedgs_geo.verbs import MODULES

#: What a person writes first, or other data than the sample: decisions, tapes, a manifest, a second date.
WRITTEN_FIRST = {"review", "tape-check", "campaign", "compare"}
#: Minutes or hours, or torch: run elsewhere.
LONG = {"simulate-plot", "benchmark", "fit-gaussians", "sample-surface", "doctor"}
#: In the order in which one needs the files of another.
ORDER = (
    "photos-to-dbh", "pointcloud-to-dbh", "geotag", "reconstruct", "terrain", "segment-stems", "measure-dbh",
    "match-plots", "evaluate", "tape-sample", "trial", "stand-table", "plan-flight",
)  # fmt: skip


def example(verb: str, capsys: pytest.CaptureFixture) -> list[str]:
    capsys.readouterr()
    assert main([verb, "--example"]) == 0
    name, *words = shlex.split(capsys.readouterr().out)
    assert name == "treedgs" and words[0] == verb
    return words


def test_examples_run_one_after_the_other_on_the_sample(finished, simulated_plot, tmp_path, monkeypatch, capsys):
    assert set(ORDER) | WRITTEN_FIRST | LONG == set(MODULES)
    monkeypatch.chdir(tmp_path)
    shutil.copytree(simulated_plot, "flight")
    for cloud in (tmp_path / "flight" / "lidar").iterdir():
        cloud.rename(cloud.with_name("flight_uls.laz"))
    shutil.copytree(finished / "work", "work")
    for verb in ORDER:
        assert main([*example(verb, capsys), "--log-format", "plain"]) == 0, verb
    assert {"trees.gpkg", "lidar_trees.gpkg", "pairs.gpkg", "evaluation", "tapes", "trial", "stand", "plan"} <= {
        entry.name for entry in tmp_path.iterdir()
    }


@pytest.mark.parametrize("verb", sorted(WRITTEN_FIRST | LONG))
def test_every_other_verb_prints_one_too(verb, capsys):
    example(verb, capsys)
