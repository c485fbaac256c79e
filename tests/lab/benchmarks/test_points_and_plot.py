"""What counts as found, missed and invented."""

from __future__ import annotations

import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.stems.quality.tree import Tree
from treedgs_lab.benchmarks.plot import TruePlot, score_trees


def tree(number, x, dbh, flag="ok"):
    reason = "" if flag == "ok" else "few_views"
    return Tree(number, 600000 + x, 3700000.0, 40.0, dbh_cm=dbh, dbh_se_cm=0.5, qc_flag=flag, qc_reason=reason).finish()


def test_found_refused_missed_invented(plot):
    found = [
        tree(1, 0.1, 31.0),
        tree(2, 3.0, None, "reject"),
        tree(3, -3.1, 6.0),
        tree(4, 0.0 + 1.5, 22.0),
        tree(5, 12.0, 22.0),
    ]
    rows = {row["tree_id"]: row for row in score_trees(plot, found, plot.clear_views({"a", "b", "c"}))}
    assert rows["T1"]["read_cm"] == 31 and rows["T1"]["clear"] == 1  # one is out of frame, one too steep
    assert rows["T2"]["flag"] == "reject" and rows["T2"]["read_cm"] is None and rows["T2"]["clear"] == 0
    # The sapling is no invention, what stands outside the plot is not judged, T3 does not count.
    assert set(rows) == {"T1", "T2", "#4"} and rows["#4"]["false"] and rows["#4"]["true_cm"] is None


def test_a_measured_tree_takes_the_stem_before_a_refused_one(plot):
    rows = score_trees(plot, [tree(1, 0.02, None, "reject"), tree(2, 0.3, 29.0)])
    assert rows[0]["read_cm"] == 29.0 and rows[1]["flag"] == "absent" and len(rows) == 2


def test_a_folder_that_is_no_simulated_plot_is_refused(tmp_path):
    with pytest.raises(InputError, match="not the truth of a simulated plot"):
        TruePlot.load(tmp_path)
