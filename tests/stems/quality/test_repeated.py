"""Every stem twice: the same diameters again at one common offset."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest

from treedgs_geo.cli import main
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.repeated import find_repeated, mark_repeated
from treedgs_geo.stems.quality.tree import Tree


def twice(rng, offset, stems=9, seen_again=1.0):
    xy, dbh = rng.uniform(0, 20, (stems, 2)), rng.uniform(12, 44, stems)
    again = rng.uniform(size=stems) < seen_again
    xy = np.vstack([xy, xy[again] + offset + rng.normal(0, 0.01, (again.sum(), 2))])
    return xy, np.r_[dbh, dbh[again]] + rng.normal(0, 0.2, len(xy))


@pytest.mark.parametrize("offset", [(0.3, 0.0), (0.6, 0.1), (-0.7, 0.7), (0.0, 1.5)])
def test_stems_that_are_there_twice_are_found_with_their_offset(offset):
    xy, dbh = twice(np.random.default_rng(1), offset, 20, 0.9)
    found = find_repeated(xy, dbh)
    assert found is not None and len(found.pairs) >= 15
    np.testing.assert_allclose(np.abs(found.offset_m), np.abs(offset), atol=0.03)


@pytest.mark.parametrize("spacing_m", [1.5, 2.0, 3.0])
def test_rows_of_a_plantation_are_no_pairs(spacing_m):
    rng = np.random.default_rng(2)
    place = np.array([(i, j) for i in range(6) for j in range(6)], float)
    for sd in (2.0, 5.0):
        xy = spacing_m * place + rng.normal(0, 0.05, place.shape)
        assert find_repeated(xy, rng.normal(25, sd, len(xy))) is None


def test_the_layer_says_it_and_the_stand_table_is_refused(tmp_path, capsys):
    xy, dbh = twice(np.random.default_rng(3), (0.6, 0.0))
    at = np.array([500000.0, 4000000.0])
    trees = [
        Tree(n + 1, *(at + place), dbh_cm=float(d), dbh_se_cm=0.5, method="points-default-none").finish()
        for n, (place, d) in enumerate(zip(xy, dbh, strict=True))
    ]
    assert "9 pairs among 18 stems" in mark_repeated(trees) and all(tree.reasons == ("double",) for tree in trees)
    layer, plots = tmp_path / "trees.gpkg", tmp_path / "plots.csv"
    write_trees(layer, trees, pyproj.CRS.from_epsg(32615))
    plots.write_text(f"plot_id,easting,northing,radius_m\np,{at[0] + 10},{at[1] + 10},12\n")
    out = tmp_path / "stand"
    assert main(["stand-table", "--trees", str(layer), "--plots", str(plots), "--output", str(out)]) != 0
    assert "every stem is there twice" in "".join(capsys.readouterr()) and not out.exists()
