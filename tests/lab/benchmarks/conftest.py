"""A plot of which everything is known."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
import rasterio

from treedgs_lab.benchmarks.plot import TruePlot


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
