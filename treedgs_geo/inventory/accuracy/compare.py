"""Two methods on the same trees: a method that refuses the hard ones must not win by it."""

from __future__ import annotations

import numpy as np

from ...core.errors import InputError
from .tables import PairsEvidence, accuracy_of, resampled

#: Figures that are compared on the common trees.
COMPARED = ("rmse_cm", "rrmse_pct", "mae_cm", "me_cm", "max_abs_cm", "coverage_90")


def compare(
    first: PairsEvidence, second: PairsEvidence, seed: int = 0, repeats: int = 2000, level: float = 0.95
) -> dict:
    """Score two methods on the reference trees that both measured.

    Returns:
        ``n_common, n_only_this, n_only_other``; ``this`` and ``other``: figures on the common trees; ``other_all``: the
        other's figures on all its trees; ``rmse_gain_cm``: RMSE of this minus RMSE of the other on the common trees,
        with its bootstrap interval ``rmse_gain_interval_cm`` (plots resampled, or trees with one plot: ``by``).

    Raises:
        InputError: no common reference tree, or a tree's reference DBH differs.
    """
    keys = ["plot_id", "tree_id"]
    a, b = (e.trees.astype(dict.fromkeys(keys, str)) for e in (first, second))
    both = a.merge(b, on=keys, suffixes=("_this", "_other"))
    if not len(both):
        raise InputError("--against: shares no reference tree with --pairs; give pairs of the same field table.")
    differ = (both["reference_cm_this"] - both["reference_cm_other"]).abs() > 0.01
    if differ.any():
        row = both[differ].iloc[0]
        raise InputError(
            f"--against: field tree {row['plot_id']}/{row['tree_id']} has {row['reference_cm_other']:g} cm, in --pairs "
            f"it has {row['reference_cm_this']:g} cm; give pairs of the same field table."
        )
    done_a, done_b = both["error_cm_this"].notna(), both["error_cm_other"].notna()
    common = both[done_a & done_b]
    result = {
        "n_common": len(common),
        "n_only_this": int((done_a & ~done_b).sum()),
        "n_only_other": int((done_b & ~done_a).sum()),
        "other_all": accuracy_of(second.trees, sum(second.n_false.values())).figures(),
    }
    for side in ("this", "other"):
        names = {f"{name}_{side}": name for name in ("reference_cm", "error_cm", "inside_90")}
        scored = accuracy_of(common[list(names)].rename(columns=names)).figures()
        result[side] = {"n": scored["n"], **{name: scored[name] for name in COMPARED}}
    result.update(_gain(common, seed, repeats, level))
    return result


def _gain(common, seed: int, repeats: int, level: float) -> dict:
    """Difference of the RMSEs and its bootstrap interval; None without common trees."""
    if not len(common):
        return {"rmse_gain_cm": None, "rmse_gain_interval_cm": None, "by": None}
    square = common[["error_cm_this", "error_cm_other"]].to_numpy(float) ** 2
    by, _, total = resampled(common["plot_id"], (np.ones(len(square)), *square.T), seed, repeats)
    gains = np.sqrt(total[:, 1] / total[:, 0]) - np.sqrt(total[:, 2] / total[:, 0])
    exact = np.sqrt(square.mean(axis=0))
    low, high = np.percentile(gains, [50 * (1 - level), 50 * (1 + level)])
    return {
        "rmse_gain_cm": round(float(exact[0] - exact[1]), 4),
        "rmse_gain_interval_cm": [round(float(low), 4), round(float(high), 4)],
        "by": by,
    }
