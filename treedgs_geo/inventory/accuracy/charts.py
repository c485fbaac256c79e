"""Charts of accuracy: signed errors, measured against reference, plot by plot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from ...report.charts import BLUE, VERMILION, new_chart


def draw_errors(trees: pd.DataFrame, metrics: dict[str, Any]) -> Any:
    """Histogram of the signed errors (measured - reference, cm) with its mean."""
    figure, axes = new_chart()
    error = trees["error_cm"].dropna().to_numpy(float)
    if len(error):
        # Round steps with an edge at zero: the sign stays readable.
        reach = max(np.abs(error).max(), 0.5)
        most = max(2 * np.sqrt(len(error)), 8)
        step = next((s for s in (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0) if 2 * reach / s <= most), 25.0)
        edge = np.ceil(reach / step) * step
        axes.hist(
            error, bins=np.arange(-edge, edge + step / 2, step), color=BLUE, alpha=0.75, edgecolor="white", lw=0.5
        )
        axes.axvline(
            metrics["me_cm"],
            color=VERMILION,
            ls="--",
            lw=1.8,
            label=f"mean {metrics['me_cm']:+.2f} cm (RMSE {metrics['rmse_cm']:.2f} cm)",
        )
        axes.set_ylim(0, axes.get_ylim()[1] * 1.2)
        axes.yaxis.get_major_locator().set_params(integer=True)
        axes.legend(loc="upper left")
    else:
        axes.text(0.5, 0.5, "no tree was measured", transform=axes.transAxes, ha="center")
    axes.axvline(0, color="black", lw=1)
    axes.set_xlabel("measured − reference DBH, cm")
    axes.set_ylabel("trees")
    axes.set_title(f"Signed error of {len(error)} of {len(trees)} trees")
    return figure


def draw_scatter(trees: pd.DataFrame, reference: str) -> Any:
    """Measured against reference DBH with the 90 % intervals and the line of equality."""
    figure, axes = new_chart(5.4, 5.2)
    done = trees[trees["error_cm"].notna()]
    looks = {"ok": (done["qc_flag"] == "ok", BLUE, "o"), "to check": (done["qc_flag"] != "ok", VERMILION, "^")}
    for name, (rows, colour, mark) in looks.items():
        part = done[rows]
        if not len(part):
            continue
        span = np.abs(part[["dbh_lo_cm", "dbh_hi_cm"]].to_numpy(float).T - part["dbh_cm"].to_numpy(float))
        axes.errorbar(
            part["reference_cm"], part["dbh_cm"], yerr=span if np.isfinite(span).any() else None, fmt=mark, ms=5,
            color=colour, elinewidth=0.8, alpha=0.85, label=f"{name} ({len(part)})",
        )  # fmt: skip
    if len(done):
        both = done[["reference_cm", "dbh_cm"]].to_numpy(float)
        low, high = max(both.min() - 3, 0), both.max() + 3
        axes.plot([low, high], [low, high], color="black", lw=1, zorder=0)
        axes.set_xlim(low, high)
        axes.set_ylim(low, high)
        axes.legend(loc="upper left")
    axes.set_aspect("equal")
    axes.set_xlabel(f"{reference}, cm")
    axes.set_ylabel("measured DBH, cm")
    axes.set_title("Bars: stated 90 % interval")
    return figure


def draw_plots(metrics: dict[str, Any]) -> Any:
    """Mean error and RMSE of each plot."""
    plots = [(name, row) for name, row in metrics["per_plot"].items() if row["n"]]
    figure, axes = new_chart(6.2, max(1.6 + 0.32 * len(plots), 2.2))
    for k, (_, row) in enumerate(reversed(plots)):
        axes.plot(
            [0, row["rmse_cm"]], [k, k], color=BLUE, lw=3, solid_capstyle="butt", label="RMSE" if k == 0 else None
        )
        axes.plot(row["me_cm"], k, "D", color=VERMILION, ms=6, label="mean error" if k == 0 else None)
    axes.set_yticks(range(len(plots)), [f"{name} ({row['n']}/{row['n_reference']})" for name, row in reversed(plots)])
    axes.axvline(0, color="black", lw=1)
    axes.set_ylim(-0.7, max(len(plots) - 0.3, 0.5))
    axes.set_xlabel("cm")
    axes.set_title("By plot (trees measured / reference trees)")
    if plots:
        axes.legend()
    return figure
