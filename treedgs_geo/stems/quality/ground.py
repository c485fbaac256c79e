"""What the ground under a tree, known more or less well, means for its diameter: interval, flag and reason."""

from __future__ import annotations

from dataclasses import replace

from .findings import Route
from .limits import judge
from .tree import Tree, with_block_errors


def with_ground_error(tree: Tree, ground_m: float, route: Route) -> Tree:
    """The tree with the error of the ground's height under it, and so of breast height, added to its own.

    ground_m: standard error of that height, m; :mod:`.limits` says from where on a tree of the route (``points`` or
    ``photos``) is to be checked, or is refused: no ground, no breast height.
    """
    found = judge(route, {"ground_se_m": ground_m})
    if found.refused:
        return replace(tree).add_reason("no_ground", "reject")
    tree = replace(with_block_errors(tree, 0.0, ground_m))
    return tree.add_reason("no_ground") if found.flagged else tree
