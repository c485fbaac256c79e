"""The same trees on one core as on all of them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
from chain_runs import chain_arguments

from treedgs_geo.core.files import read_json

#: Columns that say when and in which run a tree was measured.
MADE = ["run_id", "made", "created", "date"]


def _values(layer: Path) -> gpd.GeoDataFrame:
    trees = gpd.read_file(layer, layer="trees").drop(columns=MADE, errors="ignore")
    return trees.sort_values("tree_id").reset_index(drop=True)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="a process cannot be held to one core here")
@pytest.mark.skipif(len(getattr(os, "sched_getaffinity", lambda _: {0})(0)) < 2, reason="this machine has one core")
def test_one_core_gives_the_same_trees_to_the_bit(simulated_plot, finished, tmp_path):
    core = {min(os.sched_getaffinity(0))}
    subprocess.run(
        [sys.executable, "-m", "treedgs_geo", *chain_arguments(simulated_plot, tmp_path / "one")],
        check=True,
        env={name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")},
        preexec_fn=lambda: os.sched_setaffinity(0, core),
    )
    every, one = _values(finished / "trees.gpkg"), _values(tmp_path / "one" / "trees.gpkg")
    assert len(every) > 3 and every["dbh_cm"].notna().sum() > 3
    assert every.drop(columns="geometry").equals(one.drop(columns="geometry"))
    assert (every.geometry.to_wkb() == one.geometry.to_wkb()).all()
    kept = [read_json(folder / "work" / "fits.json")["fits"] for folder in (finished, tmp_path / "one")]
    np.testing.assert_equal(kept[0], kept[1])
