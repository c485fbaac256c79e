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


def again(rng, xy, dbh, offset):
    """The same stems at an offset, as a second scan reads them."""
    return xy + offset + rng.normal(0, 0.06, xy.shape), dbh + rng.normal(0, 0.8, len(dbh))


def four_plots(rng):
    places = [np.array([80.0 * (k % 2), 80.0 * (k // 2)]) for k in range(4)]
    xy = [place + rng.uniform(-10, 10, (16, 2)) for place in places]
    return xy, [rng.normal(26, 7, 16).clip(8) for _ in places]


@pytest.mark.parametrize("which", ["all", "own offsets", "one plot"])
def test_plots_that_are_there_twice_are_found_in_all_noise(which):
    rng = np.random.default_rng(4)
    xy, dbh = four_plots(rng)
    offsets = [(0.8, 0.5), (-0.6, 0.9), (0.5, 0.0), (0.0, -1.3)] if which == "own offsets" else [(0.8, 0.5)] * 4
    more = [again(rng, *plot) for plot in list(zip(xy, dbh, offsets, strict=True))[: 1 if which == "one plot" else 4]]
    stems = np.vstack([*xy, *(place for place, _ in more)]), np.concatenate([*dbh, *(d for _, d in more)])
    found = find_repeated(*stems)
    assert find_repeated(np.vstack(xy), np.concatenate(dbh)) is None
    assert found is not None and len(found.pairs) >= 13 * len(more)
    assert ("every stem is" in found.text(len(stems[1]))) == (which != "one plot")
    assert found.offsets == (4 if which == "own offsets" else 1)


@pytest.mark.parametrize("seed", range(12))
def test_plantations_and_stools_are_no_pairs(seed):
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(4, 14, 2)
    place = np.array([(i, j) for i in range(rows) for j in range(columns)], float)
    xy = place * rng.uniform(1, 3, 2) + rng.normal(0, 0.05, place.shape)
    left = rng.uniform(size=len(xy)) < rng.uniform(0.6, 1.0)
    assert find_repeated(xy[left], rng.normal(20, rng.uniform(1, 6), left.sum())) is None
    stools, shoots = rng.uniform(0, 20, (60, 2)), rng.integers(1, 8, 60)
    xy = np.repeat(stools, shoots, axis=0) + rng.normal(0, 0.3, (shoots.sum(), 2))
    assert find_repeated(xy, np.repeat(rng.uniform(4, 12, 60), shoots) + rng.normal(0, 0.8, len(xy))) is None
