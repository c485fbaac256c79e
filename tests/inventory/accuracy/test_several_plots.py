"""``evaluate --plots``: several plots in one call, pooled and one by one, with the methods on all their clouds."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.accuracy.plot_files import read_plot_files
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs.evaluate import EvaluateSettings, run
from treedgs_lab.published.paper_document import ITEMS
from treedgs_lab.published.photo_experiments import correlations


@pytest.fixture
def table(simulated_plot, tmp_path):
    """Two plots (the same one twice): measured 0.5 cm too thick, and 0.1 cm too thin; LiDAR of both."""
    truth = simulated_plot / "truth" / "trees.csv"
    rows = pd.read_csv(truth)
    lidar = next((simulated_plot / "lidar").glob("*.laz"))
    lines = ["plot_id,trees,truth,lidar"]
    for name, off in (("north", 0.5), ("south", -0.1)):
        trees = [
            Tree(k, r.E_bh, r.N_bh, dbh_cm=r.dbh_cm + off, dbh_se_cm=0.5, method="photos") for k, r in rows.iterrows()
        ]
        write_trees(tmp_path / f"{name}.gpkg", trees, pyproj.CRS.from_epsg(6344))
        lines.append(f"{name},{name}.gpkg,{truth},{lidar}")
    (tmp_path / "plots.csv").write_text("\n".join(lines))
    return tmp_path / "plots.csv"


def test_plots_are_pooled_and_judged_one_by_one(table, tmp_path):
    out = tmp_path / "out"
    result = run(EvaluateSettings(plots=table, output=out, paper=True), Reporter())
    found = json.loads((out / "metrics.json").read_text())
    one = found["per_plot"]["north"]
    assert list(found["per_plot"]) == ["north", "south"] and found["n_reference"] == 2 * one["n_reference"]
    assert one["me_cm"] == pytest.approx(0.5, abs=0.01) and found["me_cm"] == pytest.approx(0.2, abs=0.01)
    spread = found["over_plots"]["me_cm"]
    assert spread["sd"] == pytest.approx(0.6 / np.sqrt(2), abs=0.01) and spread["plots"] == 2
    assert (spread["low"], spread["high"]) == pytest.approx((-0.1, 0.5), abs=0.01)
    page, tex = (out / "evaluation.html").read_text(), (out / "table.tex").read_text()
    assert "0.20 ± 0.42 (-0.10–0.50)" in page and r"0.20 $\pm$ 0.42 (-0.10--0.50)" in tex
    rows = pd.read_csv(out / "methods.csv")
    own = rows[(rows["subset"] == "own") & (rows["fit"] == "cylinder")].set_index("plot")
    assert set(own.index) == {"All", "north", "south"} and own.loc["All", "of"] == found["methods"]["split"]["test"]
    assert own.loc["All", "n"] == own.loc["north", "n"] + own.loc["south", "n"] > 0
    check_paper(Path(result["paper"]).read_text(), (out / "paper_tables.tex").read_text())
    segmented = pd.read_csv(out / "segmentation.csv")
    assert segmented["plot"].tolist() == ["north", "south"] and (segmented["f1"] > 0.8).all()


def check_paper(page: str, tables: str) -> None:
    """Every table and figure in the paper's order, with data or a reason."""
    places = [item.place for item in ITEMS]
    at = [page.index(f"<h2>{place}. ") for place in places]
    assert at == sorted(at) and len(places) == 22
    parts = dict(zip(places, re.split(r"<h2>", page)[1:], strict=True))
    missing = {place for place, part in parts.items() if "Not applicable" in part}
    asked = {"Figure 2", "Figure 4", "Figure 13", "Figure 14", "Table 7"}
    gaussians = {"Figure 1", "Figure 6", "Figure 7", "Figure 15"}
    assert missing == gaussians | asked
    assert all("no workspace" in parts[place] for place in missing)
    assert all("no workspace of photos-to-dbh with Gaussians" in parts[place] for place in gaussians)
    assert "stem, rightly" in parts["Figure 16 and Table 5"] and "smallest error" in parts["Figure 17"]
    assert all("<svg" in parts[place] or "<td" in parts[place] for place in set(places) - missing)
    assert "true stems" not in page and "mean planimetric offset 0.000 m" in parts["Figure 5"]
    assert tables.count(r"\begin{tabular}") == 5 and "L-Cyl" in tables


def test_tables_that_cannot_be_used_are_refused(table, tmp_path):
    good = table.read_text().splitlines()
    for lines, match in (
        ([good[0]], "holds no row"),
        ([good[0].replace("lidar", "laser"), good[1]], "columns laser found"),
        ([*good[:2], good[1]], "'north' is in two rows"),
        ([good[0], good[1].replace("north.gpkg", "gone.gpkg")], "line 2: trees gone.gpkg is not there"),
        ([good[0], "north,north.gpkg,,"], "line 2: give either pairs"),
    ):
        table.write_text("\n".join(lines))
        with pytest.raises(InputError, match=match):
            read_plot_files(table)
    with pytest.raises(InputError, match="so --truth cannot be given beside it"):
        run(EvaluateSettings(plots=table, truth=table, output=tmp_path / "out"), Reporter())
    assert not (tmp_path / "out" / "metrics.json").exists()


def test_correlations_have_a_p_value():
    rng = np.random.default_rng(2)
    views = np.arange(1, 31)
    related = pd.DataFrame({"free_views": views, "width_px": 9.0, "score": rng.normal(size=30)})
    related["error_cm"] = 3.0 - 0.08 * views + rng.normal(0, 0.3, 30)
    found = {row["against"]: row for row in correlations(related)}
    assert found["photos that show breast height"]["r"] < -0.8 and found["photos that show breast height"]["p"] < 1e-6
    assert found["mean width there, px"]["r"] is None and found["photos × width, px"]["p"] > 0.01
    assert all(row["r"] is None for row in correlations(related[:2]))
