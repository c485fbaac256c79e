"""A second draw into a folder in which a crew has written anything is refused; nothing of it is lost."""

from __future__ import annotations

import geopandas as gpd
import pandas as pd
import pytest
from inventory.stand_helpers import CRS, EAST, NORTH

from treedgs_geo.cli import main
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree


@pytest.fixture
def draw(tmp_path):
    trees = [Tree(k, EAST + 3 * k, NORTH, dbh_cm=20.0 + k, dbh_se_cm=0.5, qc_flag="ok") for k in range(1, 13)]
    layer, folder = write_trees(tmp_path / "trees.gpkg", trees, CRS), tmp_path / "tapes"

    def again(n: int) -> int:
        return main(["tape-sample", "--trees", str(layer), "--n", str(n), "--output", str(folder), "--seed", "1"])

    assert again(5) == 0 and again(6) == 0  # nothing typed yet
    return folder, again


@pytest.mark.parametrize(
    ("column", "value"),
    [("taped_cm", 23.4), ("taped_cm", "twenty"), ("state", "not reached"), ("state", "dead"), ("state", "felled?"),
     ("tape_note", "ivy"), ("near_id", 4), ("girth_cm", 70), ("crew", "Ana"), (None, None)],
)  # fmt: skip
@pytest.mark.parametrize("name", ["tapes.csv", "tapes.gpkg"])
def test_whatever_was_typed_stays(draw, capsys, name, column, value):
    folder, again = draw
    path = folder / name
    table = pd.read_csv(path) if name.endswith("csv") else gpd.read_file(path)
    if column is None:  # a tree that the map lacks, no more written yet than where it stands
        table = pd.concat([table, table.iloc[[0]].assign(tree_id=None)], ignore_index=True)
    else:
        table[column] = pd.Series([value, *[None] * (len(table) - 1)], dtype=object)
    table.to_csv(path, index=False) if name.endswith("csv") else table.to_file(path, layer="tapes")
    before = path.read_bytes()
    assert again(8) == 2
    said = "".join(capsys.readouterr())
    assert f"{name}: 1 tree of it is filled in; give another folder" in said
    assert path.read_bytes() == before
