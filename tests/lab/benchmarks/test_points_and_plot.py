"""What counts as found, missed and invented."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
import rasterio

from treedgs_geo.core.errors import InputError
from treedgs_geo.stems.quality.tree import Tree
from treedgs_lab.benchmarks.plot import TruePlot, score_trees


@pytest.fixture
def plot(tmp_path) -> TruePlot:
    """Two stems in a plot of 5 m, one 8 m out, a sapling."""
    folder = tmp_path / "truth"
    folder.mkdir()
    (folder / "config.json").write_text(
        json.dumps({"epsg": 6344, "origin_E_N_h": [600000, 3700000, 40], "config": {"radius_m": 5.0}})
    )
    rows = [("T1", 0.0, 0.0, 30.0, True), ("T2", 3.0, 0.0, 20.0, True), ("T3", 8.0, 0.0, 25.0, False)]
    with open(folder / "trees.csv", "w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["tree_id", "kind", "in_plot", "E_bh", "N_bh", "E_base", "N_base", "h_base", "dbh_cm"])
        for name, x, y, dbh, inside in rows:
            writer.writerow([name, "normal", inside, 600000 + x, 3700000 + y, 600000 + x, 3700000 + y, 40, dbh])
    (folder / "stems.json").write_text(json.dumps({"stems": {}, "saplings_xy_dbhcm": [[-3.0, 0.0, 5.0]]}))
    (folder / "visibility.csv").write_text(
        "tree_id,image,visible_fraction,width_px,in_frame,foreshortening\n"
        "T1,a,0.9,10,1,0.6\nT1,b,0.9,10,0,0.6\nT1,c,0.9,10,1,0.2\nT2,a,0.69,10,1,0.6\n"
    )
    with rasterio.open(
        tmp_path / "dtm.tif",
        "w",
        driver="GTiff",
        width=2,
        height=2,
        count=1,
        dtype="float32",
        crs="EPSG:6344",
        transform=rasterio.transform.from_origin(599980, 3700020, 20, 20),
    ) as target:
        target.write(np.full((2, 2), 40, np.float32), 1)
    return TruePlot.load(tmp_path)


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
