"""Files that a public release needs agree with one another."""

from __future__ import annotations

import configparser
import re
import subprocess
from fnmatch import fnmatch
from pathlib import Path

import treedgs_geo

ROOT = Path(__file__).resolve().parents[2]


def test_version_and_licence_are_the_same_everywhere():
    metadata = configparser.ConfigParser(interpolation=None)
    metadata.read(ROOT / "metadata.txt", encoding="utf-8")
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert re.search(r"^version: (.+)$", citation, re.M)[1] == metadata["general"]["version"] == treedgs_geo.__version__
    assert re.search(r"^license: (.+)$", citation, re.M)[1] in project
    for needed in ("cff-version: 1.2.0", "message: ", "title: ", "authors:"):
        assert needed in citation
    assert (ROOT / "LICENSE").exists() and (ROOT / "SECURITY.md").exists()


def test_the_plugin_states_the_size_of_the_engine_that_was_measured():
    about = (ROOT / "metadata.txt").read_text(encoding="utf-8")
    measured = (ROOT / "docs" / "developer" / "dependencies.md").read_text(encoding="utf-8")
    on_disk_mb = float(re.search(r"\| the engine alone \| \d+ \| (\d+) \|", measured)[1])
    stated_gb = float(re.search(r"about ([\d.]+) GB", about)[1])
    assert abs(stated_gb * 1000 - on_disk_mb) < 150


def test_the_wheel_takes_every_file_of_the_library():
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    for package in ("treedgs_geo", "treedgs_lab"):
        patterns = re.findall(r'"([^"]+)"', re.search(rf'^"{package}" = \[(.+)\]', project, re.M)[1])
        listed = subprocess.run(["git", "ls-files", package], cwd=ROOT, capture_output=True, text=True).stdout.split()
        data = [name for name in listed if not name.endswith(".py") and "/training/" not in name]
        assert data
        left = [name for name in data if not any(fnmatch(name, p.replace("**", package + "*")) for p in patterns)]
        assert left in ([], [f"{package}/py.typed"])
