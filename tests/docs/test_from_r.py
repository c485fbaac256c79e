"""R reads what TreeDGS writes: the code of the page, and its totals beside those of ``stand-table``."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pandas as pd
import pytest

import treedgs_geo as tg

PAGE = Path(__file__).parents[2] / "docs" / "analyst" / "from-r.md"


def has_sf() -> bool:
    words = ["Rscript", "-e", "library(sf)"]
    return shutil.which("Rscript") is not None and subprocess.run(words, capture_output=True).returncode == 0


@pytest.mark.skipif(not has_sf(), reason="R with the package sf (Debian: r-base-core, r-cran-sf) is not here")
def test_totals_of_r_are_those_of_the_stand_table_to_the_last_digit(tmp_path):
    trees = [
        tg.Tree(k, 500000.0 + 3 * k, 5.2e6 + k % 3, dbh_cm=17.3 + 1.7 * k, dbh_se_cm=0.4, height_m=14.0 + 0.8 * k)
        for k in range(1, 15)
    ]
    tg.write_trees(tmp_path / "trees.gpkg", trees, "EPSG:32632")
    circles = "plot_id,easting,northing,radius_m\nA,500010,5200001,9\nB,500033,5200001,11\n"
    (tmp_path / "plots.csv").write_text(circles)
    files = {"trees": tmp_path / "trees.gpkg", "plots": tmp_path / "plots.csv", "output": tmp_path / "stand"}
    tg.stand_table(**files, species="PIAB")
    code = "\n".join(re.findall(r"^```r\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.S | re.M))
    code += 'write.csv(data.frame(key = names(totals), mean = format(totals, digits = 15)), "r.csv")\n'
    done = subprocess.run(["Rscript", "-e", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    ours = pd.read_csv(tmp_path / "stand" / "stand_summary.csv").set_index("key")["mean"]
    for key, mean in pd.read_csv(tmp_path / "r.csv").set_index("key")["mean"].items():
        assert mean == pytest.approx(ours[key], rel=1e-13) and ours[key] > 0, key
