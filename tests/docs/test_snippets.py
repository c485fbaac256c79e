"""Code of the docs runs: Python as it stands, commands of the shell up to the point where files are read."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest

from tests.rendered_stems import Stem, oblique_views, render
from tests.synthetic_cloud import plot_cloud
from treedgs_geo.cli import _parser
from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.settings import build, params_of
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.verbs import MODULES, get_command

ROOT = Path(__file__).parents[2]
#: Every page but the changelog, which tells of what was.
PAGES = sorted(
    page
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "treedgs_lab").rglob("*.md"))
    if page.name != "CHANGELOG.md" and "build" not in page.parts
)
CRS = pyproj.CRS.from_epsg(32615)
PARAMETERS = json.loads((ROOT / "treedgs_qgis" / "parameters.json").read_text(encoding="utf-8"))


def python_blocks(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M)


def blocks(page: Path) -> str:
    """The lines of all blocks of code, fenced or indented, continued ones joined."""
    text = re.sub(r"\\\n\s*", " ", page.read_text(encoding="utf-8"))
    found = re.findall(r"^```[^\n{]*\n(.*?)^```", text, re.S | re.M)
    return "\n".join([*found, *re.findall(r"(?<=\n\n)((?:    .*\n)+)", text)])


def inline(page: Path) -> str:
    """The spans of code, a line each."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    return "\n".join(" ".join(span.split()) for span in re.findall(r"`([^`]+)`", text))


def called(text: str, program: str) -> list[str]:
    """What follows a program's name at the beginning of a line, without comments and what comes after a bar."""
    found = re.findall(rf"^\s*(?:\$ )?(?:\.venv/bin/)?{program} ([^\n#|;]*)", text, re.M)
    return [words.replace("…", "").strip() for words in found]


def verbs_called(text: str) -> list[list[str]]:
    """Verb and words of every ``treedgs VERB …``."""
    lines = [line for line in called(text, "treedgs") if re.match(r"(?!describe|completion)[a-z]", line)]
    return [shlex.split(line) for line in lines]


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


def scripting(folder: Path) -> dict:
    stems = [(3.0, 3.0, 30.0), (8.0, 4.0, 22.0), (5.5, 8.5, 26.0), (10.5, 9.0, 35.0), (6.0, 1.0, 18.0)]
    xyz = plot_cloud(np.random.default_rng(3), stems, bark=900) + (500000, 3700000, 0)
    write_cloud(folder / "plot.laz", PointCloud(xyz, CRS))
    (folder / "plots.csv").write_text("plot_id,easting,northing,radius_m\nA,500006,3700005,9\n")
    rows = []
    for number, (x, y, d) in enumerate(stems, start=1):
        azimuth = np.degrees(np.arctan2(x - 6, y - 5)) % 360
        rows.append(f"{number},{np.hypot(x - 6, y - 5):.2f},{azimuth:.1f},{d},live,A\n")
    (folder / "field_trees.csv").write_text("tree_no,distance_m,azimuth_deg,dbh_cm,status,plot_id\n" + "".join(rows))
    return {}


INPUTS = {
    "scripting": scripting,
    "README": scripting,
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


def of_pages(has) -> Any:
    return pytest.mark.parametrize("page", [page for page in PAGES if has(page)], ids=lambda page: page.stem)


@of_pages(lambda page: verbs_called(blocks(page)))
def test_commands_in_blocks_are_complete(page):
    """The settings are built of them: no required option is missing, no value impossible."""
    for verb, *words in verbs_called(blocks(page)):
        assert verb in MODULES, verb
        command = get_command(verb)
        known, extra = _parser(command).parse_known_args(words)
        assert not extra, (verb, extra)
        values = {name: value for name, value in vars(known).items() if value is not None}
        build(command.settings, {name: values[name] for name in values if name not in ("log_format", "overwrite")})


@of_pages(lambda page: verbs_called(inline(page)))
def test_commands_in_sentences_name_real_options(page):
    for verb, *words in verbs_called(inline(page)):
        assert verb in MODULES, verb
        known = {f"--{spec.replace('_', '-')}" for spec, _, _ in params_of(get_command(verb).settings)}
        options = {word.strip("[]") for word in words if word.strip("[").startswith("--")}
        assert options <= known | {"--help", "--overwrite", "--example"}, (verb, options - known)


@of_pages(lambda page: "treedgs:" in page.read_text(encoding="utf-8"))
def test_algorithms_of_qgis_exist_and_have_the_parameters(page):
    text = page.read_text(encoding="utf-8")
    models = {path.stem for path in (ROOT / "treedgs_qgis" / "models").iterdir()}
    assert set(re.findall(r"treedgs:(\w+)", text)) <= models | {
        path.stem for path in (ROOT / "processing").glob("*.py")
    }
    for line in called(blocks(page), r"(?:qgis_process|python3 tools/qgis_run\.py) run"):
        name, *words = shlex.split(line)
        given = {word.partition("=")[0] for word in words if "=" in word}
        for command in PARAMETERS["commands"]:
            if command["id"] == name.removeprefix("treedgs:"):
                assert given <= {parameter["name"].upper() for parameter in command["parameters"]}, line


def test_what_make_is_asked_for_is_in_the_makefile():
    targets = set(re.findall(r"^([a-z][\w-]*):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    for page in PAGES:
        for line in called(blocks(page) + "\n" + inline(page), "make"):
            assert set(re.findall(r"^[a-z][\w-]*", line)) <= targets, (page, line)


def test_a_job_on_a_page_is_one_that_the_engine_takes():
    jobs = [job for page in PAGES for job in re.findall(r"^    (\{.*\})$", page.read_text(encoding="utf-8"), re.M)]
    assert jobs
    for job in map(json.loads, jobs):
        build(get_command(job["command"]).settings, job["parameters"])


def test_an_experiment_on_a_page_says_how_it_is_called():
    # The command of a settled question is as it was: its commit has the script.
    today = re.compile(r"python -m (treedgs_lab[\w.]+)(?![^`]*` \(script: commit)")
    used = {module for page in PAGES for module in today.findall(page.read_text(encoding="utf-8"))}
    assert len(used) > 5
    for module in sorted(used):
        path = ROOT.joinpath(*module.split("."))
        assert path.with_suffix(".py").is_file() or (path / "__init__.py").is_file(), module


def test_the_readmes_first_command_prints_its_help():
    done = subprocess.run(
        [sys.executable, "-m", "treedgs_geo", "photos-to-dbh", "--help"], cwd=ROOT, capture_output=True
    )
    assert done.returncode == 0 and b"taped" in done.stdout
