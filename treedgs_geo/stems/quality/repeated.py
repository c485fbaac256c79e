"""Stems twice: the same diameters again at one common offset (scans not registered, tiles that overlap)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.special import chdtrc, gammainc

from .tree import Tree

#: Stems this far apart, m, may be one stem seen twice; their offsets agree within so much, m, and within half of it.
NEAREST_M, FARTHEST_M, AGREE_M = 0.08, 2.0, 0.25
#: Stems of one plot are at most so far from the next, m: each plot may be twice at an offset of its own.
_NEXT_M = 15.0
#: A stem's diameter is compared with those of so many others around it, not with the stand's: neighbours are alike.
_AROUND = 20
#: Chance of so many pairs at one offset, and of diameters that agree so well; at least half of the partners are nearer
#: in diameter than this share of the other stems around.
_CHANCE, _ALIKE, MIN_PAIRS = (1e-6, 1e-4), 0.25, 4
#: Stems that are the first of one pair and the second of another are fewer than this share of the pairs.
_IN_ROWS = 0.3


@dataclass(frozen=True)
class Repeated:
    """pairs: (P, 2) rows of stems that are one. offset_m: (2,) from the first to the second, of most pairs. offsets:
    how many there are, each in a plot of its own."""

    pairs: np.ndarray
    offset_m: np.ndarray
    offsets: int = 1

    def text(self, stems: int) -> str:
        """What was found among so many stems, for a message."""
        east, north = self.offset_m
        what = "every stem is" if len(np.unique(self.pairs)) >= 0.7 * stems else "these stems are"
        each = "one offset" if self.offsets == 1 else f"one offset in each of {self.offsets} places, here"
        return (
            f"{len(self.pairs)} pairs among {stems} stems have the same diameters at {each} of "
            f"{np.hypot(east, north):.2f} m ({east:+.2f} east, {north:+.2f} north): {what} there twice, from "
            "scans or tiles that are not registered to each other"
        )


def find_repeated(xy: np.ndarray, dbh_cm: np.ndarray) -> Repeated | None:
    """The pairs among (N, 2) stems with (N,) diameters, or ``None``: of all at one offset, or plot by plot."""
    known = np.flatnonzero(np.isfinite(dbh_cm) & np.isfinite(xy).all(axis=1))
    i, j = cKDTree(xy[known]).query_pairs(_NEXT_M, output_type="ndarray").T if len(known) else np.zeros((2, 0), int)
    count, plot = connected_components(coo_array((np.ones(len(i)), (i, j)), (len(known), len(known))), directed=False)
    apart = [found for k in range(count) if (found := _at_one_offset(known[plot == k], xy, dbh_cm))]
    together = _at_one_offset(known, xy, dbh_cm) if count > 1 else None
    if not apart or (together and len(together.pairs) >= sum(len(found.pairs) for found in apart)):
        return together
    most = max(apart, key=lambda found: len(found.pairs))
    return Repeated(np.vstack([found.pairs for found in apart]), most.offset_m, len(apart))


def _at_one_offset(rows: np.ndarray, xy: np.ndarray, dbh_cm: np.ndarray) -> Repeated | None:
    """The same of some rows, all at one offset: far more pairs than chance puts there, and their diameters agree far
    better than those of other neighbours do (in planted rows every stem has a partner, but of any diameter)."""
    if len(rows) < 2 * MIN_PAIRS:
        return None
    tree = cKDTree(xy[rows])
    near = tree.query_pairs(FARTHEST_M + AGREE_M, output_type="ndarray")
    offset = xy[rows[near[:, 1]]] - xy[rows[near[:, 0]]]
    near, offset = near[far := np.hypot(*offset.T) > NEAREST_M], offset[far]
    if len(near) < MIN_PAIRS:
        return None
    # Each pair both ways round: an offset is as good as its opposite.
    near, offset = np.vstack([near, near[:, ::-1]]), np.vstack([offset, -offset])
    unlike = _unlike(near, tree, dbh_cm[rows])
    places, reach = cKDTree(offset), np.hypot(*offset.T)
    groups = places.query_ball_point(offset, np.minimum(AGREE_M, reach / 2))
    best = int(np.argmax([np.sum(-np.log(unlike[group]) - 1) for group in groups]))
    middle = np.median(offset[groups[best]], axis=0)
    away = float(np.hypot(*middle))
    within = min(AGREE_M, away / 2)
    here = places.query_ball_point(middle, within)
    if len(here) < MIN_PAIRS:
        return None
    # Other pairs as far apart, in other directions.
    ring = np.abs(reach - away) < within
    for own in (middle, -middle):
        ring &= np.hypot(*(offset - own).T) > within
    rest = 4 * away / within - 2  # areas, in those of the offset's own
    # Stems of one stool make many pairs, but chance puts the stool there only once.
    each = max((ring.sum() + 2 * len(here)) / len(rows), 1.0)
    by_chance = gammainc(np.floor(len(here) / each), (ring.sum() + 1) / rest / each)  # Poisson: so many or more
    agree = chdtrc(2 * len(here), -2 * np.log(unlike[here]).sum())
    if by_chance > _CHANCE[0] or agree > _CHANCE[1] or np.median(unlike[here]) > _ALIKE:
        return None
    same = [k for k in here if unlike[k] < 2 * _ALIKE]
    # In rows of trees that are alike each one has partners ahead and behind.
    firsts, seconds = near[same].T
    if len(np.intersect1d(firsts, seconds)) > _IN_ROWS * len(same):
        return None
    return Repeated(rows[near[same]], np.median(offset[same], axis=0))


def _unlike(pairs: np.ndarray, tree: cKDTree, dbh_cm: np.ndarray) -> np.ndarray:
    """(P,) share of the stems around a pair whose diameters are nearer to one of the two than its partner's is."""
    around = tree.query(tree.data, min(_AROUND + 2, len(dbh_cm)))[1]
    found = np.zeros(len(pairs))
    for stem, partner in (pairs.T, pairs[:, ::-1].T):
        others = around[stem]
        counts = (others != stem[:, None]) & (others != partner[:, None])
        off = np.abs(dbh_cm[others] - dbh_cm[stem][:, None])
        own = np.abs(dbh_cm[partner] - dbh_cm[stem])[:, None]
        nearer = ((off < own) + 0.5 * (off == own)) * counts
        found += np.log((nearer.sum(axis=1) + 0.5) / (counts.sum(axis=1) + 1)) / 2
    return np.exp(found)


def mark_repeated(trees: list[Tree]) -> str:
    """Flag the stems that are there twice (``double``); what to say about them, empty where there are none."""
    xy = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    found = find_repeated(xy, np.array([tree.dbh_cm or np.nan for tree in trees], float))
    if found is None:
        return ""
    for row in np.unique(found.pairs):
        trees[row].add_reason("double")
    return f"{found.text(len(trees))}; register them, or cut the cloud to one, and measure again."
