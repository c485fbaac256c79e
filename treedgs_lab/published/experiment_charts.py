"""Charts of the method comparison: densities, trend over DBH, the choice of p, visibility."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import gaussian_kde

from treedgs_geo.report.charts import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, new_chart

#: One look a method: Okabe-Ito colours, and lines that differ in grey.
LOOKS = {
    "lidar, cylinder": (ORANGE, "-"),
    "lidar, circle": (PURPLE, ":"),
    "lidar, weighted circle": (SKY, "--"),
    "splats, cylinder": (GREEN, "-."),
    "splats, circle": (VERMILION, ":"),
    "splats, weighted circle": (BLUE, "-"),
}


#: Width of the bins of DBH, and the least stems of one.
STEP_CM, MIN_STEMS = 5.0, 2


def _finished(figure: Any, axes: Any, title: str, x: str, y: str) -> Any:
    """The chart with its words and, where there is anything to tell apart, a legend."""
    axes.set(title=title, xlabel=x, ylabel=y)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8)
    return figure


def _reach(errors: dict[str, np.ndarray], percentile: float, factor: float) -> float:
    """Largest error shown, cm: so many times a percentile of all."""
    every = np.concatenate([np.zeros(0), *(error[np.isfinite(error)] for error in errors.values())])
    return float(np.clip(np.percentile(np.abs(every), percentile) * factor, 2, 40)) if len(every) else 2.0


def draw_densities(errors: dict[str, np.ndarray]) -> Any:
    """Kernel density of the signed errors of each method (Silverman's width); a tick a stem where there are few."""
    figure, axes = new_chart(6.6, 4.2)
    reach = _reach(errors, 97, 1.4)
    x = np.linspace(-reach, reach, 400)
    for name, error in errors.items():
        error = error[np.isfinite(error)]
        colour, line = LOOKS.get(name, (GREY, "-"))
        if 0 < len(error) < 3:
            axes.plot(error, np.zeros(len(error)), "|", color=colour, ms=16, mew=2, label=f"{name} ({len(error)})")
        if len(error) < 3:
            continue
        curve = gaussian_kde(error, "silverman")(x) if error.std() > 0 else np.zeros(len(x))
        axes.plot(x, curve, color=colour, ls=line, lw=1.8, label=f"{name} ({len(error)})")
    axes.axvline(0, color="0.4", ls="--", lw=1)
    return _finished(figure, axes, "Signed errors", "estimate − reference, cm", "density")


def robust_trend(dbh_cm: np.ndarray, error_cm: np.ndarray) -> np.ndarray:
    """(B, 3): bin centre, median error, number of stems; bins with fewer than :data:`MIN_STEMS` are left out."""
    good = np.isfinite(error_cm)
    errors = pd.Series(error_cm[good]).groupby(np.floor(dbh_cm[good] / STEP_CM))
    rows = [(STEP_CM * (bin_ + 0.5), own.median(), len(own)) for bin_, own in errors if len(own) >= MIN_STEMS]
    return np.array(rows, float).reshape(-1, 3)


def draw_trend(reference_cm: np.ndarray, errors: dict[str, np.ndarray]) -> Any:
    """Signed error against DBH: dots a stem, lines through the bins' medians, dashed across empty bins."""
    figure, axes = new_chart(6.6, 4.4)
    reach = _reach(errors, 95, 1.5)
    for name, error in errors.items():
        colour, _ = LOOKS.get(name, (BLUE, "-"))
        trend = robust_trend(reference_cm, error)
        alone = name if np.isfinite(error).any() and not len(trend) else None
        axes.scatter(
            reference_cm, np.clip(error, -reach, reach), s=12, color=colour, alpha=0.35, linewidths=0, label=alone
        )
        for a, b in zip(trend[:-1], trend[1:], strict=True):
            axes.plot([a[0], b[0]], [a[1], b[1]], color=colour, lw=2, ls="-" if b[0] - a[0] < 5.1 else "--")
        if len(trend):
            axes.plot(trend[:, 0], trend[:, 1], "o", ms=3.5, color=colour, label=name)
    axes.axhline(0, color="black", lw=1)
    axes.set_ylim(-reach * 1.05, reach * 1.05)
    title = f"Error over DBH: medians of {STEP_CM:g} cm bins"
    return _finished(figure, axes, title, "reference DBH, cm", "estimate − reference, cm")


def draw_power(sweep: list[dict]) -> Any:
    """RMSE (line) and MAE (dashed) on the held-out stems over the exponent p."""
    figure, axes = new_chart(6.0, 3.8)
    table = pd.DataFrame(sweep)
    for source, colour, mark in (("lidar", VERMILION, "^"), ("splats", BLUE, "o")):
        rows = table[(table["source"] == source) & table["rmse_cm"].notna()]
        if len(rows):
            axes.plot(rows["p"], rows["rmse_cm"], color=colour, marker=mark, label=f"{source}, RMSE")
            axes.plot(rows["p"], rows["mae_cm"], color=colour, marker=mark, ls="--", alpha=0.6, label=f"{source}, MAE")
    return _finished(figure, axes, f"Choice of p on {int(table['held_out'].max())} held-out stems", "exponent p", "cm")


def draw_visibility(table: pd.DataFrame, against: dict[str, str]) -> Any:
    """Absolute error over some columns of a table, each with its words; least-squares line and Pearson's r."""
    figure, grid = new_chart(3.4 * len(against), 3.4, ncols=len(against), sharey=True)
    known = table[table["error_cm"].notna() & (table["free_views"] > 0)]
    for axes, (name, label) in zip(grid, against.items(), strict=True):
        x, y = known[name].to_numpy(float), known["error_cm"].abs().to_numpy(float)
        axes.scatter(x, y, s=16, color=BLUE, alpha=0.8)
        if len(x) > 2 and x.std() > 0 and y.std() > 0:
            ends, r = np.array([x.min(), x.max()]), np.corrcoef(x, y)[0, 1]
            line = np.polyval(np.polyfit(x, y, 1), ends)
            axes.plot(ends, line, color=VERMILION, lw=1.6, label=f"r = {r:+.2f}, n = {len(x)}")
            axes.legend(fontsize=8)
        axes.set_xlabel(label)
    grid[0].set_ylabel("|error|, cm")
    return figure
