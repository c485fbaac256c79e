"""Treetops and stems: one crown, one stem."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.stems.quality.tops import HEIGHT_REASONS, heights_sentence, join_tops
from treedgs_geo.stems.quality.tree import Tree


def stand(seed: int = 3, count: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Places, slopes, diameters and tops (above the leaning axes) of a stand in rows."""
    rng = np.random.default_rng(seed)
    places = np.array([[4.0 * (k % 4), 4.0 * (k // 4)] for k in range(count)])
    slopes = rng.normal(0, 0.03, (count, 2))
    dbh = rng.uniform(18, 45, count)
    height = 3.6 * np.sqrt(dbh) * np.exp(rng.normal(0, 0.04, count))
    tops = np.column_stack([places + slopes * (height - 1.37)[:, None] + rng.normal(0, 0.2, (count, 2)), height])
    return places, slopes, dbh, tops


def join(places, slopes, dbh, tops):
    return join_tops(places[:, None] + slopes[:, None] * (tops[None, :, 2:] - 1.37), tops, dbh)


def test_leaning_stems_get_their_own_tops_in_any_order():
    places, slopes, dbh, tops = stand()
    order = np.random.default_rng(0).permutation(len(tops))
    joined = join(places, slopes, dbh, tops[order])
    np.testing.assert_array_equal(order[joined.top], np.arange(len(dbh)))
    assert joined.scatter < 0.1 and not any(joined.reason)


def test_a_sapling_does_not_get_the_crown_above_it():
    places, slopes, dbh, tops = stand()
    # 0.4 m beside tree 5's axis, nearer to its top than the tree itself.
    beside = tops[5, :2] - slopes[5] * (tops[5, 2] - 1.37)
    joined = join(np.vstack([places, beside]), np.vstack([slopes, slopes[5]]), np.append(dbh, 5.0), tops)
    assert joined.top[-1] == -1 and joined.reason[-1] == "other_tree"
    assert joined.top[5] == 5


def test_a_stem_without_a_top_says_so_and_takes_no_neighbours():
    places, slopes, dbh, tops = stand()
    joined = join(places, slopes, dbh, np.delete(tops, 7, axis=0))
    assert joined.top[7] == -1 and joined.reason[7] == "no_top" and joined.reason[7] in HEIGHT_REASONS


def test_of_two_tops_that_suit_alike_the_higher_counts_and_says_how_far_apart_they_are():
    places, slopes, dbh, tops = stand()
    other = tops[4].copy()
    other[2] *= 0.94  # a branch of the same crown
    joined = join(places, slopes, dbh, np.vstack([tops, other]))
    assert joined.top[4] == 4
    axis = places[4] + slopes[4] * (tops[4, 2] - 1.37)
    tops[4, :2], other[:2], other[2] = axis, axis + 0.3, 1.06 * tops[4, 2]
    joined = join(places, slopes, dbh, np.vstack([tops, other]))
    assert joined.top[4] == len(tops) and joined.reason[4] == ""
    assert joined.apart_m[4] == pytest.approx(other[2] - tops[4, 2]) and not np.delete(joined.apart_m, 4).any()
    # Without a diameter nothing tells which.
    joined = join(places, slopes, np.where(np.arange(len(dbh)) == 4, np.nan, dbh), np.vstack([tops, other]))
    assert joined.reason[4] == "two_tops" and joined.top[4] == -1


@pytest.mark.parametrize("tops", [np.empty((0, 3))])
def test_no_tops_or_no_stems(tops):
    places, slopes, dbh, _ = stand()
    assert set(join(places, slopes, dbh, tops).reason) == {"no_top"}
    assert len(join(places[:0], slopes[:0], dbh[:0], stand()[3]).top) == 0


def test_the_sentence_counts_heights_and_says_why_others_have_none():
    trees = [
        Tree(1, 0, 0, dbh_cm=30.0, height_m=21.0),
        Tree(2, 3, 0, dbh_cm=28.0, height_why="unclear"),
        Tree(3, 6, 0, dbh_cm=22.0, height_why="other_tree"),
        Tree(4, 9, 0, dbh_cm=26.0, height_why="unclear"),
        Tree(5, 9, 3, qc_flag="reject", height_why="no_top"),
    ]
    said = heights_sentence(trees)
    assert said.startswith("Heights of 1 of 4 trees with a DBH (without: 2: where this crown ends")
    assert f"; 1: {HEIGHT_REASONS['other_tree']})" in said
    # Heights were not asked for: nothing is said.
    assert heights_sentence([Tree(1, 0, 0, dbh_cm=30.0)]) == "" == heights_sentence([])
