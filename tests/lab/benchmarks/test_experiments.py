"""The experiments: each can be imported, is in the index, and every result says where it is from."""

from __future__ import annotations

import ast
import importlib
import json
import re
import shutil
import subprocess
import sys
from fnmatch import fnmatch
from pathlib import Path

import pyproj
import pytest

from treedgs_geo import __version__
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_lab.benchmarks import evidence, figures, records
from treedgs_lab.benchmarks.chain.determinism import compare, environment

ROOT = Path(__file__).parents[3]
LAB = ROOT / "treedgs_lab" / "benchmarks"
SOURCES = sorted(LAB.rglob("*.py"))
SCRIPTS = [path for path in SOURCES if '__name__ == "__main__"' in path.read_text()]
RESULTS = sorted((ROOT / "docs" / "results").iterdir())


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_every_module_can_be_imported(path):
    importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))


def test_no_module_touches_the_search_path():
    assert not [path.name for path in SOURCES if "sys.path" in path.read_text()]


def test_the_index_lists_every_script_once_and_names_pages_that_exist():
    folder, listed, pages = "", [], set()
    for line in (LAB / "README.md").read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            named = re.findall(r"`treedgs_lab/benchmarks/(\w+)/`", line)
            folder = named[0] if len(named) == 1 else ""
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| `") and cells[0].endswith(".py`"):
            listed.append("/".join([*([folder] if folder else []), cells[0].strip("`")]))
            pages |= {page.strip() for page in cells[4].split(",") if page.strip()}
    assert sorted(listed) == sorted(str(path.relative_to(LAB)) for path in SCRIPTS)
    assert pages <= {path.stem for path in (ROOT / "docs").rglob("*.md")}


def test_results_quoted_by_the_docs_are_there():
    quoted = set()
    for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]:
        quoted |= set(re.findall(r"results/([\w.*-]+\.(?:json|csv|svg|html|tex))", page.read_text(encoding="utf-8")))
    names = [path.name for path in RESULTS]
    assert len(quoted) > 20
    assert [name for name in sorted(quoted) if not any(fnmatch(one, name) for one in names)] == []


@pytest.mark.parametrize("name", [path.name for path in RESULTS if path != figures.PUBLISHED])
def test_a_result_says_where_it_is_from(name):
    made = figures.record(name)
    assert made["command"].startswith(("python -m benchmarks.", "python -m treedgs_lab.", "python -m tools."))
    assert {"command", "date", "commit", "version"} <= made.keys()
    if made.get("packages") is not None:  # written since records carry them
        assert made["machine"].keys() == {"processor", "cores", "memory_gb", "load"}
    assert not re.search(r"(^|\s|=)/", made["command"])


def test_a_record_names_command_version_and_seeds(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["x.py", "/somewhere/else/plot_a", str(ROOT / "docs" / "results"), "--seed", "4"])
    records.write_record(tmp_path / "new" / "one.json", {"figure": 1.5}, seeds=[4])
    made = json.loads((tmp_path / "new" / "one.json").read_text())
    assert list(made) == ["made_by", "figure"] and made["figure"] == 1.5
    assert made["made_by"]["command"].endswith(" plot_a docs/results --seed 4")
    assert made["made_by"]["version"] == __version__ and made["made_by"]["seeds"] == [4]
    assert re.fullmatch(r"[0-9a-f]{7,}(-changed)?", made["made_by"]["commit"])
    assert made["made_by"]["packages"]["numpy"] and made["made_by"]["machine"]["cores"] > 0
    records.write_record(None, {"figure": 1.5})


def test_a_published_chart_is_noted(tmp_path, monkeypatch):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "cost.svg").write_text("<svg/>")
    monkeypatch.setattr(evidence, "RESULTS", tmp_path)
    monkeypatch.setattr(evidence, "PUBLISHED", tmp_path / "published.json")
    evidence.publish(tmp_path / "out" / "cost.svg", "cost.svg")
    noted = json.loads((tmp_path / "published.json").read_text())["cost.svg"]
    assert (tmp_path / "cost.svg").read_text() == "<svg/>"
    assert noted["output"] == "out/cost.svg" and noted["version"] == __version__


def layer(path: Path, *diameters: float) -> Path:
    trees = [
        Tree(
            tree_id=n,
            x=500000.0 + n,
            y=3700000.0,
            z_ground=40.0,
            dbh_cm=dbh,
            dbh_se_cm=0.5,
            bh_m=1.37,
            method="points-default-none",
            qc_flag="ok",
            qc_reason="",
        ).finish()
        for n, dbh in enumerate(diameters, 1)
    ]
    write_trees(path, trees, pyproj.CRS.from_epsg(6344))
    return path


def test_layers_are_compared_to_the_bit(tmp_path):
    one, same = layer(tmp_path / "one.gpkg", 30.0, 20.0), layer(tmp_path / "same.gpkg", 30.0, 20.0)
    assert compare(one, same)["same_to_the_bit"]
    near = compare(one, layer(tmp_path / "near.gpkg", 30.0, 20.01))
    assert not near["same_to_the_bit"] and near["most_dbh_mm"] == pytest.approx(0.1) and near["flags_differ"] == 0
    fewer = compare(one, layer(tmp_path / "fewer.gpkg", 30.0))
    assert not fewer["same_to_the_bit"] and fewer["trees"] == [2, 1]


def test_the_code_of_another_checkout_is_used_or_refused(tmp_path):
    with pytest.raises(SystemExit, match="no treedgs_geo"):
        environment(tmp_path)
    shutil.copytree(
        ROOT / "treedgs_geo", tmp_path / "treedgs_geo", ignore=lambda _, names: set(names) - {"__init__.py"}
    )
    words = [sys.executable, "-c", "import treedgs_geo; print(treedgs_geo.__file__)"]
    found = subprocess.run(words, cwd=tmp_path, env=environment(tmp_path), capture_output=True, text=True).stdout
    assert Path(found.strip()) == tmp_path / "treedgs_geo" / "__init__.py"


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_program_starts_after_all_that_it_defines(path):
    assert "__main__" in ast.unparse(ast.parse(path.read_text(encoding="utf-8")).body[-1])
