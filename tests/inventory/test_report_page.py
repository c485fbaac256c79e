"""The report with many trees and hostile texts: escaped, linked, complete; in a real browser where there is one."""

from __future__ import annotations

import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.core.plots import Plot
from treedgs_geo.inventory.evidence.canvas import Canvas
from treedgs_geo.inventory.evidence.files import sheets_folder, trees_with_sheets, write_sheet, written_sheets
from treedgs_geo.inventory.evidence.parts import begin_sheet
from treedgs_geo.inventory.report import write_report
from treedgs_geo.inventory.tree_layer import tree_table
from treedgs_geo.stems.quality.tree import Tree

HOSTILE = "<script>document.title='broken'</script>\"'&amp;\n$name </td>"
RUN = "0123456789abcdef"


def forest(count: int, plot_id: str = "A") -> list[Tree]:
    rng = np.random.default_rng(5)
    trees = []
    for number in range(1, count + 1):
        flag = ("ok", "ok", "ok", "check", "reject")[number % 5]
        x, y = 500000 + rng.uniform(0, 60), 5200000 + rng.uniform(0, 60)
        dbh = None if flag == "reject" else round(float(rng.uniform(8, 60)), 1)
        trees.append(
            Tree(
                number, x, y, plot_id=plot_id if number % 2 else None, dbh_cm=dbh, dbh_se_cm=dbh and 0.4,
                method="photos", qc_flag=flag, qc_reason="" if flag == "ok" else "few_views", run_id=RUN,
            ).finish()
        )  # fmt: skip
    return trees


def page_of(folder: Path, trees: list[Tree], plot_id: str = "A") -> Path:
    """A report with a sheet for every second tree, in a folder whose name needs quoting."""
    sheets = {}
    if trees:
        with sheets_folder(folder / "sheets", RUN) as made:
            for tree in trees[::2]:
                write_sheet(made, tree, begin_sheet(tree, 80, 220, []))
        sheets = written_sheets(folder / "sheets", RUN)
    plots = [Plot(plot_id, 500030, 5200030, 25)]
    facts, stages = {"photos": plot_id}, {"geotag": {"seconds": 1.0, "peak_memory_mb": 90}}
    return write_report(
        folder / "report.html", tree_table(trees, "EPSG:32632"), plots, facts, [plot_id], stages, sheets
    )


class Parsed(HTMLParser):
    """Tags with their attributes, and the texts of the page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict]] = []
        self.texts: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.texts.append(data)


def test_hostile_text_is_text(tmp_path):
    page = page_of(tmp_path, forest(6, HOSTILE), HOSTILE).read_text(encoding="utf-8")
    parsed = Parsed(page)
    assert sum(tag == "script" for tag, _ in parsed.tags) == 1, "only the page's own script"
    rows = [attributes for tag, attributes in parsed.tags if tag == "tr" and attributes.get("data-tree")]
    assert {row["data-plot"] for row in rows} == {HOSTILE, ""}
    assert any(attributes.get("value") == HOSTILE for tag, attributes in parsed.tags if tag == "option")
    assert "document.title='broken'" in "".join(parsed.texts), "shown as it was written"
    assert not any(name.startswith("on") and name != "onsubmit" for _, at in parsed.tags for name in at)


def test_every_tree_is_in_table_and_map_with_its_sheet(tmp_path):
    folder = tmp_path / "a b#c é%20"
    folder.mkdir()
    trees = forest(500)
    page = page_of(folder, trees)
    parsed = Parsed(page.read_text(encoding="utf-8"))
    rows = {at["data-tree"]: at for tag, at in parsed.tags if tag == "tr" and at.get("data-tree")}
    stems = {at["data-tree"]: at for tag, at in parsed.tags if tag == "a" and "data-tree" in at}
    assert len(rows) == len(stems) == 500
    for tree in trees:
        row, name = rows[str(tree.tree_id)], str(tree.tree_id)
        assert row["id"] == f"tree-{name}" and stems[name]["href"] == f"#tree-{name}"
        assert row["data-flag"] == tree.qc_flag and row["data-dbh"] == (f"{tree.dbh_cm:.2f}" if tree.dbh_cm else "")
        assert row.get("data-sheet") == (f"sheets/{RUN}/{name}.jpg" if tree.tree_id % 2 else None)
    assert page.stat().st_size < 1_500_000
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", page.read_text(encoding="utf-8")), "no network"


def test_one_tree_and_none(tmp_path):
    for count in (1, 0):
        folder = tmp_path / str(count)
        folder.mkdir()
        page = page_of(folder, forest(count)).read_text(encoding="utf-8")
        assert ("viewBox" in page) == (count == 1) and "nan" not in page.lower().replace("isnan", "")


def test_which_trees_get_a_sheet():
    trees = forest(50)
    assert trees_with_sheets(trees, "none", True) == []
    assert trees_with_sheets(trees, "all", False) == trees
    assert {tree.qc_flag for tree in trees_with_sheets(trees, "check", False)} == {"check", "reject"}
    many = forest(1500)
    some = trees_with_sheets(many, "all", False)
    assert len(some) == 1000 and sum(t.qc_flag != "ok" for t in some) == sum(t.qc_flag != "ok" for t in many)
    assert [t.tree_id for t in some] == sorted(t.tree_id for t in some)
    assert len(trees_with_sheets(many, "all", True)) == 1500


def test_sheets_of_an_earlier_run_go_and_a_persons_files_stay(tmp_path):
    trees = forest(2)
    old, other, mixed = (tmp_path / "sheets" / name for name in ("f" * 16, "mine", "e" * 16))
    for folder, name in ((old, "1.jpg"), (other, "1.jpg"), (mixed, "notes.txt")):
        folder.mkdir(parents=True)
        (folder / name).write_bytes(b"x")
    with sheets_folder(tmp_path / "sheets", RUN) as made:
        write_sheet(made, trees[0], Canvas(40, 40))
    assert not old.exists() and other.exists() and mixed.exists()
    assert written_sheets(tmp_path / "sheets", RUN) == {1: tmp_path / "sheets" / RUN / "1.jpg"}


SCRIPT = """
(function () {
  function press(element) { element.click(); }
  var form = document.getElementById("filters"), say = [];
  function listed() { return document.querySelectorAll("#trees tbody tr:not([hidden])").length; }
  say.push(listed());
  form.querySelector("[value=ok]").checked = false;
  form.dispatchEvent(new Event("input"));
  say.push(listed());
  form.low.value = "20"; form.dispatchEvent(new Event("input"));
  say.push(listed());
  form.low.value = ""; form.querySelector("[value=ok]").checked = true; form.dispatchEvent(new Event("input"));
  var heads = document.querySelectorAll("#trees th span");
  press(heads[2]);
  say.push(document.querySelector("#trees tbody tr").dataset.tree);
  press(heads[2]);
  say.push(document.querySelector("#trees tbody tr").dataset.tree);
  document.querySelector("#map .stem[data-tree='7'] circle").dispatchEvent(new MouseEvent("click", {bubbles: true}));
  say.push(document.querySelector("tr.chosen").dataset.tree);
  say.push(document.querySelector("#picture img").getAttribute("src"));
  press(document.getElementById("gallery"));
  say.push(document.querySelectorAll("#all img").length, document.title);
  var out = document.createElement("pre");
  out.id = "said"; out.textContent = JSON.stringify(say);
  document.body.appendChild(out);
})();
"""


@pytest.mark.skipif(not shutil.which("chromium"), reason="needs a browser (chromium)")
def test_the_page_works_from_the_file_system(tmp_path):
    trees = forest(60, HOSTILE)
    page = page_of(tmp_path, trees, HOSTILE)
    text = page.read_text(encoding="utf-8").replace("</body>", f"<script>{SCRIPT}</script></body>")
    page.write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["chromium", "--headless=new", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
         "--virtual-time-budget=20000", "--dump-dom", page.as_uri()],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    import json
    from html import unescape

    said = json.loads(unescape(re.search(r"<pre id=\"said\">(.*?)</pre>", done.stdout, re.DOTALL)[1]))
    flagged = [tree for tree in trees if tree.qc_flag != "ok"]
    thick = [tree for tree in flagged if tree.dbh_cm is not None and tree.dbh_cm >= 20]
    measured = sorted((tree for tree in trees if tree.dbh_cm is not None), key=lambda tree: tree.dbh_cm)
    assert said[:3] == [60, len(flagged), len(thick)]
    assert said[3:5] == [str(measured[0].tree_id), str(measured[-1].tree_id)]
    assert said[5:7] == ["7", f"sheets/{RUN}/7.jpg"]
    assert said[7:] == [30, "Tree diameters"]


def test_the_page_says_what_it_rests_on(tmp_path):
    text = page_of(tmp_path, forest(3)).read_text(encoding="utf-8")
    assert "no photo of a tree that somebody taped has been measured" in text and "A network trained on" in text
    assert "Tape some trees" in text
