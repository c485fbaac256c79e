"""Heights against diameters within one survey: a tree far shorter than the others of its diameter has another diameter,
or has lost its top; one far higher has been given the crown above it."""

from __future__ import annotations

import numpy as np

from .findings import TOGETHER
from .limits import judge
from .tree import Tree

#: Trees without a remark, with DBH and height, that a curve of the survey needs.
MIN_TREES = 10
#: A tree is too short below a share of the curve's height (:mod:`.limits`) that is this many spreads of the trees below
#: it too. Of 127 trees three were: DBHs of 11.0, 55.2 and 23.2 cm for 5.3, 15.1 and 17.0 cm; dead trees, leaning ones
#: and forks were not.
SPREADS = 4.0
#: No stand's heights lie closer to their curve than this share.
_MIN_SPREAD = 0.05


def check_heights(trees: list[Tree]) -> None:
    """Flag ``check`` and add ``too_short`` where a height is far below the survey's own height curve; with that as the
    third reason the tree is refused. A height as far above the curve is that of the crown over the tree: it is taken
    away, with ``height_why``. Without heights nothing happens."""
    known = [t for t in trees if t.dbh_cm is not None and t.height_m is not None and t.height_m > t.bh_m]
    sure = [t for t in known if t.qc_flag == "ok"]
    if len(sure) < MIN_TREES:
        return
    d, h = (np.array([getattr(t, name) for t in sure], float) for name in ("dbh_cm", "height_m"))
    curve = _naslund(d, h - sure[0].bh_m)
    if curve is None:
        return
    spread = max(1.4826 * float(np.median(np.abs(np.log((h - sure[0].bh_m) / curve(d))))), _MIN_SPREAD)
    lowest, highest = np.exp([-SPREADS * spread, SPREADS * spread])
    for tree in known:
        assert tree.dbh_cm is not None and tree.height_m is not None
        share = (tree.height_m - tree.bh_m) / float(curve(np.array([tree.dbh_cm]))[0])
        if share > highest:
            tree.height_m, tree.height_se_m, tree.height_why = None, None, "other_tree"
        for reason in judge("survey", {"height_share": share}).reasons if share < lowest else ():
            tree.add_reason(reason)
            if len(tree.reasons) >= TOGETHER["survey"]:
                tree.add_reason(reason, "reject")


def _naslund(d: np.ndarray, h: np.ndarray):
    """``h = (d / (a + b d))**2`` above breast height, as a function of d (cm); ``None`` where it does not rise.

    Fitted as the line d / sqrt(h) = a + b d by the medians of slopes and rests (Theil and Sen), which odd trees hardly
    move.
    """
    y = d / np.sqrt(h)
    i, j = np.triu_indices(len(d), 1)
    apart = np.abs(d[i] - d[j]) > 0.1
    if not apart.any():
        return None
    b = float(np.median((y[i] - y[j])[apart] / (d[i] - d[j])[apart]))
    a = float(np.median(y - b * d))
    if b <= 0 or a <= 0:
        return None
    return lambda x: (x / (a + b * x)) ** 2
