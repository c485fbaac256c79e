"""The brief's picture: a map of the flight, and photos against error and share measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..report.charts import BLUE, GREEN, VERMILION, chart_png, new_chart
from .choose import Choice, JudgedFlight
from .missions import Target
from .site import PlanSite

#: Colours and marks of the patterns (Okabe-Ito: apart in every kind of colour blindness).
STYLE = {"orbits": (BLUE, "o"), "crosshatch": (VERMILION, "s"), "nadir-oblique": (GREEN, "^")}


def draw_brief(choice: Choice, site: PlanSite, take_off: np.ndarray, error_cm: float, share: float) -> bytes:
    """PNG of the map and two charts; the wanted error and share are dotted lines."""
    figure, axes = new_chart(10.4, 4.6, mosaic=[["map", "share"], ["map", "error"]], width_ratios=(1.15, 1))
    _map(axes["map"], choice.plan, site.targets, take_off)
    _charts(axes["share"], axes["error"], choice, error_cm, share)
    return chart_png(figure)


def _map(axis: Any, plan: JudgedFlight, targets: list[Target], take_off: np.ndarray) -> None:
    flight = plan.flight
    for leg in np.unique(flight.leg):
        own = flight.xy[flight.leg == leg]
        axis.plot(*own.T, color="#8a958d", lw=0.9, zorder=1)
    way = np.column_stack([np.sin(np.radians(flight.yaw_deg)), np.cos(np.radians(flight.yaw_deg))])
    down = flight.pitch_deg < -85
    axis.quiver(
        *flight.xy[~down].T, *way[~down].T, angles="xy", color=BLUE, width=0.0035, scale=30, zorder=3, pivot="tail"
    )
    axis.plot(*flight.xy[down].T, "s", ms=4, mfc="none", mec=BLUE, zorder=3)
    for target in targets:
        rim = target.rim(5)
        axis.fill(*rim.T, facecolor="#17753c40", edgecolor="#17753c", lw=1.2)
        axis.annotate(target.plot_id, target.centre, ha="center", va="center", fontsize=7.5 if len(targets) < 25 else 5)
    axis.plot(*take_off[:2], "P", color=VERMILION, ms=11, mec="white", zorder=5)
    axis.annotate("take-off", take_off[:2], xytext=(7, 5), textcoords="offset points", color=VERMILION, fontsize=8)
    axis.set_aspect("equal")
    axis.margins(0.06)
    axis.annotate(
        "N", (0.035, 0.99), (0.035, 0.90), xycoords="axes fraction", ha="center", va="bottom", fontsize=10,
        arrowprops={"arrowstyle": "-|>", "color": "black"},
    )  # fmt: skip
    axis.set_xlabel("m east of the plots' middle; arrows: oblique photos, squares: straight down", fontsize=8)
    axis.set_ylabel("m north", fontsize=8)
    axis.tick_params(labelsize=7.5)


def _charts(upper: Any, lower: Any, choice: Choice, error_cm: float, share: float) -> None:
    for pattern, (colour, mark) in STYLE.items():
        own = sorted((row for row in choice.tried if row[0] == pattern), key=lambda row: row[2])
        if own:
            table = np.array([[row[2], 100 * row[3], row[4]] for row in own])
            for axis, column in ((upper, 1), (lower, 2)):
                axis.plot(table[:, 0], table[:, column], mark, ms=3.4, mfc="none", mec=colour, mew=0.8, label=pattern)
    found, more = choice.plan.outcome, choice.more
    photos = choice.plan.budget.photos
    for axis, here, there in ((upper, 100 * found.share, 100 * more.share), (lower, found.error_cm, more.error_cm)):
        axis.plot([photos], [here], "*", color="black", ms=13, zorder=5, label="this plan")
        axis.plot([photos, photos + 20], [here, there], "-", color="black", lw=1.2, zorder=4, label="20 photos more")
        axis.set_xscale("log")
        axis.tick_params(labelsize=7.5)
        low, high = axis.get_xlim()
        ticks = [n for n in (10, 20, 30, 50, 100, 200, 300, 500, 1000, 2000, 3000) if low <= n <= high]
        axis.set_xticks(ticks, [str(n) for n in ticks])
        axis.set_xticks([], minor=True)
    upper.axhline(100 * share, color="0.35", lw=0.9, ls=":")
    lower.axhline(error_cm, color="0.35", lw=0.9, ls=":")
    upper.set_ylabel("stems measured, %", fontsize=8)
    lower.set_ylabel("standard error of DBH, cm", fontsize=8)
    lower.set_xlabel("photos of the flight", fontsize=8)
    lower.set_ylim(0, None)
    upper.legend(fontsize=6.8, loc="lower right")
