"""What the ground under a tree, known more or less well, means for its diameter: interval, flag and reason."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from .tree import Tree, with_block_errors

#: A ground whose height is less sure than this makes a tree one to check; one this unsure is no ground at all, m.
UNSURE_GROUND_M, NO_GROUND_M = 0.25, 5.0


def with_ground_error(tree: Tree, ground_m: float, unsure_m: float = UNSURE_GROUND_M) -> Tree:
    """The tree with the error of the ground's height under it, and so of breast height, added to its own.

    ground_m: standard error of that height. Above ``unsure_m`` the tree is to be checked, from :data:`NO_GROUND_M` on
    it is refused: no ground, no breast height.
    """
    if ground_m >= NO_GROUND_M:
        reasons = _with_reason(tree.qc_reason, "no_ground")
        return replace(tree, qc_flag="reject", qc_reason=reasons).finish()
    tree = with_block_errors(tree, 0.0, ground_m)
    if ground_m <= unsure_m:
        return tree
    flag: Literal["ok", "check", "reject"] = "check" if tree.qc_flag == "ok" else tree.qc_flag
    return replace(tree, qc_flag=flag, qc_reason=_with_reason(tree.qc_reason, "no_ground"))


def _with_reason(reasons: str, reason: str) -> str:
    return ",".join(dict.fromkeys([*filter(None, reasons.split(",")), reason]))
