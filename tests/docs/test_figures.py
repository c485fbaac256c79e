"""No number on a page is typed: figures are those of their files, age and all."""

from __future__ import annotations

import json
import re
import subprocess

import pytest

from tools import install_matrix, qgis_versions, wheels
from treedgs_lab.benchmarks import figures

EVIDENCE = sorted((figures.ROOT / "docs" / "evidence").glob("*.md"))
LEADING = [figures.ROOT / "README.md", figures.ROOT / "docs" / "index.md", *EVIDENCE]
#: A measured quantity in a sentence: a decimal with a unit, a share, a count of a count, an RMSE.
TYPED = re.compile(
    r"\b\d+\.\d+ ?(?:cm|px|m|s|GB|%)\b|\b\d+ (?:of|to) \d+ (?:stems|trees|plots)\b|(?:RMSE|bias)[^|\n]{0,20}\d"
)
#: What a sentence may say by itself: how things are set up, not what came out.
SETTINGS = re.compile(
    r"\b90 %|\b95 %|\d+(\.\d+)? cm a pixel|at 1\.84 cm|from 1\.0 to 1\.8 m|\d(\.\d+)? square metre|by 0\.1 cm|"
    r"(?:0\.8|1\.2) px|1\.645 s\.e\.|off by 0\.5 to 4 m|4 cm more|0\.8 to 1\.5 m low|1\.5 to 4 %|starts at 1\.8 m|"
    r"of 0\.[1-6](?: to 0\.6)? cm|0\.4 cm \+ 1\.5 %|by 0\.[25] c?m|of 0\.9|3 cm thick"
)


#: A claim of accuracy, on whatever page.
CLAIM = re.compile(
    r"RMSE[^|\n]{0,20}\d|\d+\.\d+ cm (?:off|too|RMSE|mean)|\b\d+ of \d+ (?:stems|trees)|\b\d+(?:\.\d+)? % of \d+"
)
#: The table of systems (compared below) and the generated table of limits.
APART = {"dependencies", "quality-limits"}


def visible(text: str) -> str:
    """A page without code, links' targets and what the generator writes."""
    text = figures.INLINE.sub("", figures.BLOCK.sub("", text))
    text = re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)
    return re.sub(r"`[^`]*`|\]\([^)]*\)", "", text)


@pytest.mark.parametrize("page", figures.pages(), ids=lambda page: page.stem)
def test_figures_are_those_of_their_files(page):
    text = page.read_text(encoding="utf-8")
    assert figures.without_age(figures.filled(text)) == figures.without_age(text), (
        "run: python -m treedgs_lab.benchmarks.figures"
    )


@pytest.mark.parametrize("page", LEADING, ids=lambda page: page.stem)
def test_no_figure_is_typed(page):
    lines = SETTINGS.sub("", visible(page.read_text(encoding="utf-8"))).splitlines()
    assert [line for line in lines if TYPED.search(line)] == []


@pytest.mark.parametrize(
    "page", [page for page in figures.pages() if page.stem not in APART], ids=lambda page: page.stem
)
def test_no_claim_of_accuracy_is_typed(page):
    lines = SETTINGS.sub("", visible(page.read_text(encoding="utf-8"))).splitlines()
    assert [line for line in lines if CLAIM.search(line)] == []


@pytest.mark.parametrize("module", [install_matrix, qgis_versions, wheels], ids=lambda module: module.__name__)
def test_tables_of_systems_are_those_of_their_files(module):
    rows = next(rows for rows in json.loads(module.FIGURES.read_text()).values() if isinstance(rows, list))
    assert module.table(rows) in module.PAGE.read_text(encoding="utf-8")


def test_a_typed_figure_is_seen():
    assert TYPED.search("The stems are 0.46 cm off") and TYPED.search("it measures 14 of 20 stems")
    assert not TYPED.search(visible("The stems are <!--= a.json; b; .2f -->0.46<!--/--> cm off"))


@pytest.mark.parametrize("page", EVIDENCE, ids=lambda page: page.stem)
def test_an_evidence_page_can_be_read(page):
    text = page.read_text(encoding="utf-8")
    shown = re.sub(r"<!-- table -->\n<!--.*?-->", "", text, flags=re.S)
    shown = figures.BLOCK.sub("", shown) if page.stem == "sources" else shown
    assert shown.count("\n") <= 120
    assert text.split("\n")[2].startswith("*Evidence. ") and "?*" in text.split("\n\n")[1]
    if page.stem != "sources":
        assert "\n## How it was measured\n" in text and "\n## What it does not show\n" in text
        assert "<!-- made -->" in text
    # A line that begins with a marker would be no sentence to the site's builder.
    assert not re.search(r"^<!--= ", text, re.M)


def test_keys_choose_rows_names_and_all():
    data = {
        "runs": [{"plot": "a", "e cm": 1.234}, {"plot": "b/c", "e cm": None}],
        "lidar/x.laz": {"n": 3.0},
        "none": [],
    }
    assert figures.figure(data, "runs/plot=a/e cm", ".2f") == "1.23"
    assert figures.figure(data, "runs/1/e cm", ".2f") == "–" and figures.figure(data, "lidar/x.laz/n", "d") == "3"
    assert figures.figure(data, "runs/*/plot", "len d") == "2" and figures.figure(data, "none/-1/x", "d") == "–"
    assert figures.figure([{"v": 0.031}, {"v": 0.5}], "*/v", "range .0%") == "3 % to 50 %"
    with pytest.raises(KeyError):
        figures.figure(data, "runs/plot=z/e cm", ".2f")


def test_a_changed_file_changes_the_page_and_a_wrong_page_is_seen(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "RESULTS", tmp_path)
    monkeypatch.setattr(figures, "age", lambda _: 0.0)
    figures.content.cache_clear()
    (tmp_path / "x.json").write_text(json.dumps({"rows": {"one": {"e": 0.46}, "two": {"e": 0.5}}}))
    table = "<!-- table -->\n<!--\nfrom x.json; rows/*\nplot = @\nRMSE = e; .1f\n-->\n<!-- /table -->"
    page = f"RMSE <!--= x.json; rows/one/e; .2f -->9.99<!--/-->\n{table}"
    new = figures.filled(page)
    assert "-->0.46<!--/-->" in new and "| two | 0.5 |" in new and new != page
    assert figures.filled(new) == new
    figures.content.cache_clear()


def test_age_follows_the_imports_of_the_command():
    own = figures.sources("speed-accuracy.svg")
    assert any(path.startswith("treedgs_geo/report/") for path in own)
    assert not any(path.startswith("treedgs_geo/stems/") for path in own)
    # A command that runs verbs as processes depends on all of the library.
    whole = figures.sources("photos_to_dbh.json")
    assert any(path.startswith("treedgs_geo/stems/splats/") for path in whole)


def test_a_settled_figure_ages_with_the_rooms_of_its_record():
    own = figures.sources("pairing.json")
    assert "treedgs_geo/inventory/pairing.py" in own and all(path.startswith("treedgs_geo/inventory/") for path in own)
    made = [figures.record(path.name) for path in figures.RESULTS.iterdir() if path != figures.PUBLISHED]
    rooms = {room for one in made for room in one.get("rooms", [])}
    assert "treedgs_geo/inventory" in rooms and all((figures.ROOT / room).is_dir() for room in rooms)


def test_a_release_refuses_old_figures(monkeypatch):
    monkeypatch.setattr(figures, "age", lambda name: 0.9 if name in ("blind.json", "refusals.json") else 0.0)
    assert figures.too_old() == ["blind.json: 90 % of its code changed"]  # the other is settled


def test_the_history_of_blind_tests_is_never_edited():
    rows = json.loads((figures.RESULTS / "blind.json").read_text())["rows"]
    git = ["git", "-c", f"safe.directory={figures.ROOT}", "-C", str(figures.ROOT)]
    log = subprocess.run([*git, "log", "--format=%h", "--", "docs/results/blind.json"], capture_output=True, text=True)
    for commit in log.stdout.split():
        shown = subprocess.run([*git, "show", f"{commit}:docs/results/blind.json"], capture_output=True, text=True)
        if shown.returncode == 0:
            former = json.loads(shown.stdout)["rows"]
            assert rows[: len(former)] == former, f"rows of {commit} were changed"
    assert len({row["commit"] for row in rows}) == len(rows)
