"""Code blocks of the docs run: Python as it stands, commands of the shell up to the point where files are read."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyproj
import pytest

from tests.rendered_stems import Stem, oblique_views, render
from tests.synthetic_cloud import plot_cloud
from treedgs_geo.cli import _parser
from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.verbs import MODULES, get_command

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
CRS = pyproj.CRS.from_epsg(32615)


def python_blocks(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M)


def commands(page: Path) -> list[str]:
    """``treedgs VERB …`` of code blocks, continued lines joined."""
    text = re.sub(r"\\\n\s*", " ", page.read_text(encoding="utf-8"))
    blocks = re.findall(r"^```(?:\w*)\n(.*?)^```", text, re.S | re.M) + re.findall(r"(?<=\n\n)((?:    .*\n)+)", text)
    found = re.findall(r"^\s*(?:\$ )?(?:\.venv/bin/)?treedgs ([a-z][^\n#|;]*)", "\n".join(blocks), re.M)
    return [command.strip() for command in found]


def cloud() -> PointCloud:
    xyz = plot_cloud(np.random.default_rng(3), [(3, 3, 30.0), (8, 4, 22.0)], bark=900)
    xyz += (500000, 3700000, 0)
    return PointCloud(xyz, CRS, {"opacity": np.random.default_rng(4).uniform(0.3, 1, len(xyz)).astype(np.float32)})


def terrain(folder: Path) -> dict:
    write_cloud(folder / "plot.laz", cloud())
    xy = np.array([[500003.0, 3700003.0], [500004.0, 3700005.0]])
    frame = LocalFrame(CRS, np.array([500000.0, 3700000.0, 100.0]))
    return {"x": xy[:, 0], "y": xy[:, 1], "xy": xy, "frame": frame}


def measuring(_: Path) -> dict:
    from treedgs_geo.terrain.ground import dtm_from_cloud

    points = cloud()
    angle = np.linspace(0, 6, 60)
    ring = 0.15 * np.column_stack([np.cos(angle), np.sin(angle)])
    return {"cloud": points, "dtm": dtm_from_cloud(points.xyz), "points_xy": ring, "weights": np.ones(60)}


def stems_from_photos(folder: Path) -> dict:
    views = oblique_views(folder, 12)
    render(views, [Stem(0.6, 0.4, 0.15), Stem(-1.2, 0.9, 0.11)])
    frame = LocalFrame(CRS, np.array([500000.0, 3700000.0, 40.0]))
    return {"views": views, "ground": lambda x, y: 0 * x, "area": Area.circle(0, 0, 2.0), "frame": frame}


def gaussians(_: Path) -> dict:
    torch = pytest.importorskip("torch")
    from types import SimpleNamespace

    from tests.stems.splats.test_raster import camera, cloud

    view = camera(24, 22)
    shown = {"image": torch.zeros(view.height, view.width, 3), "measured": torch.full((view.height, view.width), 3.0)}
    return {"field": SimpleNamespace(packed=cloud(9, 3)), "camera": view, **shown}


INPUTS = {
    "terrain": terrain,
    "measuring": measuring,
    "stems-from-photos": stems_from_photos,
    "gaussians": gaussians,
}


@pytest.mark.parametrize("page", [page for page in PAGES if python_blocks(page)], ids=lambda page: page.stem)
def test_python_on_the_page_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = INPUTS[page.stem](tmp_path)
    for block in python_blocks(page):
        exec(compile(block, str(page), "exec"), names)
    if page.stem in ("measuring", "stems-from-photos"):
        assert len(names["trees"]) == 2


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.stem)
def test_commands_on_the_page_are_understood(page):
    for line in commands(page):
        verb, *words = shlex.split(line.replace("…", ""))
        if verb == "describe" or line.startswith("--"):
            continue
        assert verb in MODULES, line
        known, extra = _parser(get_command(verb)).parse_known_args(words)
        assert not [word for word in extra if word.startswith("--")], line


def test_an_experiment_on_a_page_says_how_it_is_called():
    used = {m for page in PAGES for m in re.findall(r"python -m (treedgs_lab[\w.]+)", page.read_text(encoding="utf-8"))}
    assert len(used) > 5
    for module in sorted(used):
        path = ROOT.joinpath(*module.split("."))
        assert path.with_suffix(".py").is_file() or (path / "__init__.py").is_file(), module


def test_the_readmes_first_command_prints_its_help():
    done = subprocess.run(
        [sys.executable, "-m", "treedgs_geo", "photos-to-dbh", "--help"], cwd=ROOT, capture_output=True
    )
    assert done.returncode == 0 and b"taped" in done.stdout
