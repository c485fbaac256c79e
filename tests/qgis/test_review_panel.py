"""The panel **Review trees** in the graphical QGIS: buttons, keys and map clicks of a person (``review_inside.py``)."""

from __future__ import annotations

import json
import subprocess

import pytest
from qgis_driver import ROOT
from qgis_helpers import HOSTILE, review_trees_layer

from treedgs_geo.inventory.reviewed import reviewed
from treedgs_geo.inventory.tree_reading import read_trees


@pytest.fixture(scope="module")
def sitting(qgis, tmp_path_factory):
    """What a person saw at the panel, and the layer afterwards."""
    folder = tmp_path_factory.mktemp("séance 1")
    path = review_trees_layer(folder / "trees.gpkg")
    job = {"trees": str(path), "report": str(folder / "seen.json")}
    seen = qgis.windows("review_inside.py", folder / "seen.json", TREEDGS_REVIEW=json.dumps(job))
    return seen, read_trees(path).set_index("tree_id", drop=False)


def test_it_walks_through_the_trees_that_want_a_look(sitting):
    seen, _ = sitting
    assert seen["button"] and seen["height"] == [True, True], "the toolbox opens the panel, in front of itself"
    assert "add trees.gpkg" in seen["empty"]["headline"]
    first = seen["first"]
    assert first["list"] == [2, 3, 4, 6] and first["tree"] == 2 and first["place"] == "1 of 4"
    assert "too few photos see the stem" in first["reasons"] and "fly more oblique photos" in first["reasons"]
    assert first["decision"] == "Not decided yet." and first["progress"].startswith("Decided: 0 of 4")
    assert seen["next"]["tree"] == 3 and seen["round"]["tree"] == 6 and seen["scale"] <= 121
    assert [seen[f"list {which}"] for which in ("check", "reject", "ok", "decided", "all")] == [
        [2, 4], [3, 6, 7], [1, 5], [2, 3, 6, 7], [1, 2, 3, 4, 5, 6, 7],
    ]  # fmt: skip


def test_keys_and_buttons_decide_and_go_on(sitting):
    seen, table = sitting
    decided, after = seen["accepted"]
    assert decided["rev_flag"] == "accept" and after["tree"] == 3 and after["progress"].startswith("Decided: 1 of 4")
    assert seen["rejected"][0]["rev_flag"] == "reject" and seen["rejected"][1]["tree"] == 4
    assert seen["undone"][0]["rev_flag"] is None and seen["undone"][1]["tree"] == 3
    assert seen["typed"] == ["<i>Nana & X</i>", {"rev_flag": None, "rev_dbh_cm": None, "rev_note": None}, 3]
    assert seen["focus"], "D without a number goes to where it is typed"
    assert seen["taped"][0] == {"rev_flag": "dbh", "rev_dbh_cm": 31.5, "rev_note": "<i>Nana & X</i>"}
    rows, before, kept = seen["asked"]
    assert rows["rev_flag"] is None and before["tree"] == 4 and kept and "Is it this tree" in before["message"]
    assert seen["sure"][0]["rev_flag"] == "dbh"
    row, said = seen["replaced"]
    assert row["rev_flag"] == "accept" and "Before: taped (" in said and "(U) brings it back" in said
    assert seen["too thick"][0]["rev_flag"] is None and "expected 0.5 to 500 cm" in seen["too thick"][1]["message"]
    assert table["rev_flag"][2] == "accept" and table["rev_dbh_cm"][3] == 31.5


def test_map_clicks_name_the_other_tree_and_set_a_stem(sitting):
    """The map is in another CRS than the layer."""
    seen, table = sitting
    assert seen["missed"][0]["rev_flag"] is None and "No other tree stands where you clicked" in seen["missed"][1]
    assert seen["merged"][0] == {"rev_flag": "merge", "rev_dbh_cm": None, "rev_note": "same tree as 5"}
    assert seen["merged"][2] is False and seen["tool"] is True
    assert seen["stem"][0]["rev_flag"] == "stem" and seen["stem"][1]["tree"] == 7 and seen["stem"][2] is False
    assert seen["stem at"] == pytest.approx([1.0, 1.2], abs=0.1)
    assert seen["beside"][0] == 7 and "decide about that tree" in seen["beside"][1]
    assert table["qc_reason"][7] == "not_found" and abs(table.geometry[7].x - table["x"][7]) < 0.001


def test_what_was_decided_is_what_the_next_verb_counts(sitting):
    _, table = sitting
    _, review = reviewed(table)
    assert review.counts() == {"accepted": 1, "rejected": 0, "taped": 1, "merged": 1, "stems": 1}


def test_the_stem_list_follows_the_map(sitting):
    seen, _ = sitting
    assert seen["list all"] == [1, 2, 3, 4, 5, 6, 7] and len(seen["list near"]) < 7 and 2 in seen["list near"]
    assert seen["list click"] == [seen["list near"][0], 7]


def test_text_is_text(sitting):
    """Plot ids, notes and layer names with markup stand there as they are."""
    seen, _ = sitting
    assert seen["formats"] == [seen["plain"]] and HOSTILE in seen["first"]["headline"]
    assert seen["title"] == "<b>Trees</b>" and "<i>Nana & X</i>" in seen["taped"][1]["message"] + str(seen["taped"][0])


def test_it_comes_and_goes_with_its_layer_and_its_plugin(sitting):
    seen, _ = sitting
    assert "workspace was not found" in seen["no workspace"]
    assert seen["gone"]["tree"] is None and seen["closed"] is False and seen["unloaded"] == [True, True]


def test_no_size_of_the_panel_makes_the_sheet_resize_without_end(qgis, tmp_path):
    """A scroll bar that comes and goes with the picture's height recursed until QGIS died (signal 11)."""
    code = """
import sys
from qgis.PyQt.QtGui import QPixmap
from qgis.PyQt.QtWidgets import QApplication
application = QApplication([])
from treedgs_qgis.review.widgets import Form
form, sheet, path = Form(), QPixmap(1600, 1200), sys.argv[1]
sheet.fill()
sheet.save(path)
form.sheet.show_sheet(path)
form.show()
for width in (400, 500, 560):
    for height in range(500, 1300):
        form.resize(width, height)
        application.processEvents()
print("whole", form.sheet.pixmap().width())
"""
    done = subprocess.run(
        ["/usr/bin/python3", "-c", code, str(tmp_path / "sheet.png")],
        env=qgis.environment(PYTHONPATH=ROOT), cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0 and "whole 5" in done.stdout, done.stdout + done.stderr
