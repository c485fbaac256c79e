"""The recipe for conda-forge asks for what the package asks for."""

from __future__ import annotations

import re
from pathlib import Path

from treedgs_geo import __version__
from treedgs_geo.cli import main

ROOT = Path(__file__).parents[2]
#: Names there -> names in pyproject.toml.
OTHER_NAMES = {"py-opencv": "opencv-python-headless", "matplotlib-base": "matplotlib"}


def test_ranges_and_version_are_those_of_the_package():
    recipe = (ROOT / "packaging" / "recipe.yaml").read_text(encoding="utf-8")
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    wanted = re.search(r"^dependencies = \[(.*?)^\]", project, re.S | re.M)[1]
    ours = dict(re.findall(r'"([\w-]+)(?:\[\w+\])?(>=[^"]+)"', wanted))
    run = recipe.split("  run:\n")[1].split("\ntests:")[0]
    theirs = {OTHER_NAMES.get(name, name): ends for name, ends in re.findall(r"- ([\w-]+) (>=\d\S*)", run)}
    assert theirs == ours and f"version: {__version__}\n" in recipe
    assert "treedgs = treedgs_geo.cli:main" in recipe and callable(main)
