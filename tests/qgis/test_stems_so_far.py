"""From the dialog to a second look: the first stems are on the map while the rest is still being measured, and a tree
is measured again where a person clicks."""

from __future__ import annotations

import json

import numpy as np

from treedgs_geo.inventory.tree_reading import read_trees


def test_first_stems_are_drawn_while_the_rest_is_measured(qgis, simulated_plot, tmp_path):
    values = {
        "PHOTOS": str(simulated_plot / "images"),
        "GEOTAGS": str(simulated_plot),
        "CRS": "EPSG:6344",
        "PLOTS": str(simulated_plot / "plots.csv"),
        "WORKSPACE": str(tmp_path / "work"),
        "OUTPUT": str(tmp_path / "trees.gpkg"),
        "PRESET": 0,
    }
    more = {"TREEDGS_MAP": tmp_path, "TREEDGS_VALUES": json.dumps(values)}
    seen = qgis.windows("so_far_inside.py", tmp_path / "seen.json", **more)
    assert len(seen["stems"]) >= 2 and seen["crs"] == "EPSG:6344"
    assert "Trees" not in seen["meanwhile"]
    assert "Trees" in seen["after"] and "Stems so far" not in seen["after"]
    assert seen["on_top"] == ["Open the report"]
    assert seen["tapes"] == values["PLOTS"], "a dialog opens with the run's plots"
    # In the end some have none: what all stems together tell is not known before.
    trees, kept = read_trees(tmp_path / "trees.gpkg"), 0
    for x, y, dbh_cm in seen["stems"]:
        away = np.hypot(trees.x - x, trees.y - y)
        measured = trees.dbh_cm[away.idxmin()]
        assert away.min() < 0.2 and (np.isnan(measured) or abs(measured - dbh_cm) < 2.0)
        kept += np.isfinite(measured)
    assert kept >= 2
    tree, cm, x = seen["before"]
    assert f"Tree {tree} is being measured" in seen["said"]
    assert seen["again"][0] == tree and abs(seen["again"][1] - cm) < 1.0 and seen["given"] == [1, 0]
    assert f"Before: {cm:.1f} cm" in seen["again"][3]
    assert seen["former"] == [tree, cm, x] and not seen["can_go_back"]
