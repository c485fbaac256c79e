"""Coordinates on a lattice: rounded in storing, or gone through 32-bit floats (25 cm steps in a large northing).

A step moves the bark's points by up to half of it, and the circle with them: errors are of the step's order, not of
the points' spread. Each axis has its own step.
"""

from __future__ import annotations

import numpy as np

from ....core.progress import Reporter
from ...quality.limits import judge
from ...quality.tree import Tree, with_block_errors

#: Points looked at, and how many of them have to share a value on average for the values to be a lattice's.
_SAMPLE, _SHARED = 400_000, 8
#: Standard error of a diameter over the step across the stem, from steps of the second on; below, the step's points
#: average out, and it falls with the step. Nine stems of 12 to 44 cm each, rounded: steps of 5 to 6 cm gave errors of
#: 0.2 to 1.1 cm, 10 cm up to 4.3, 25 cm up to 15.
STEP_SE, COARSE_M = 0.2, 0.10
#: From here on the step is said, m.
_SAID_M = 0.025


def lattice_steps(xyz: np.ndarray) -> np.ndarray:
    """(3,) metres between the values that coordinates of (N, 3) ``xyz`` take in each axis; 0 where they take any."""
    some = xyz[:: max(len(xyz) // _SAMPLE, 1)]
    steps = np.zeros(3)
    for axis in range(3):
        values = np.unique(np.round(some[:, axis], 4))
        if len(values) > 2 and len(some) >= _SHARED * len(values):
            steps[axis] = float(np.median(np.diff(values)))
    return steps


def with_rounding(trees: list[Tree], xyz: np.ndarray, reporter: Reporter) -> list[Tree]:
    """Trees measured in (N, 3) points, whose errors allow for the lattice that the coordinates lie on."""
    x_m, y_m, z_m = (float(step) for step in lattice_steps(xyz))
    across = max(x_m, y_m)
    if max(across, z_m) > _SAID_M:
        reporter.warn(
            f"The coordinates lie on a lattice of {100 * x_m:.1f} cm in x, {100 * y_m:.1f} cm in y and {100 * z_m:.1f} "
            "cm in z (rounded, or stored as 32-bit floats without a shift): intervals are widened by it, and stems "
            "that it hides refused (wide_error); export the cloud in double precision, or with a global shift."
        )
    more_cm = 100 * STEP_SE * across * min(1.0, across / COARSE_M)
    return [_widened(tree, more_cm, z_m) for tree in trees]


def _widened(tree: Tree, more_cm: float, ground_m: float) -> Tree:
    if tree.dbh_cm is None or tree.dbh_se_cm is None or more_cm + ground_m == 0:
        return tree
    wider = with_block_errors(tree, more_cm / tree.dbh_cm, ground_m)
    assert wider.dbh_se_cm is not None
    found = judge("points", {"se_cm": wider.dbh_se_cm}, tree.dbh_cm)
    if max(more_cm, ground_m) > 0.5 * tree.dbh_se_cm and found.reasons:
        return wider.add_reason(found.reasons[0], "reject" if found.refused else "check")
    return wider
