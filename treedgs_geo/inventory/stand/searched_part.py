"""Plots as far as stems were searched for in them: nothing is divided by ground that nobody looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from shapely.geometry.base import BaseGeometry

from ...core.errors import InputError
from ..searched import ALMOST, WHOLE
from .sample import SamplePlot

#: Less searched ground than this is none, m2: no tree has room on it.
_MIN_M2 = 1.0
#: Plots that share more than this of what was searched of them are one plot in other words.
_SAME_GROUND = 0.5
#: Chance below which an empty rim of the plots is none.
_CHANCE = 1e-4


def as_searched(
    plots: Sequence[SamplePlot], searched: BaseGeometry | None, xy: np.ndarray, name: str
) -> tuple[list[SamplePlot], list[str], list[str]]:
    """``(plots, warnings, notes)``: each plot as its part in which stems were searched for, those without any left out.

    searched: all ground that was (:func:`.searched.searched_area`), ``None`` where the tree layer does not say: its
    plots are then taken as searched all over, and a note says so. xy: (N, 2) its trees. name: of the layer, for the
    sentences.

    Raises:
        InputError: no plot was searched, or the same searched ground is asked for twice.
    """
    if searched is None:
        said = (
            f"{name} does not say where stems were searched for (another format, an older version, or edited): every "
            "plot is taken as searched all over"
        )
        empty = _empty_rim(plots, xy)
        return list(plots), [f"{said}, {empty}"] if empty else [], [] if empty else [f"{said}."]
    kept: list[SamplePlot] = []
    missing, part_of = [], []
    for plot in plots:
        if plot.outline is None:
            kept.append(plot)
            continue
        part = plot.outline.intersection(searched)
        share = part.area / plot.outline.area
        if part.area < _MIN_M2:
            missing.append(plot.plot_id)
        elif share >= WHOLE:
            kept.append(plot)
        else:
            area = plot.area_ha * share
            made = replace(plot, shape="polygon", outline=part, area_ha=area, weight_area_ha=area, searched=share)
            kept.append(made)
            part_of.append((plot, made))
    if not kept:
        raise InputError(
            f"{name}: stems were searched for in none of the {len(plots)} plots ({_some(missing)}); check their "
            "coordinates and epsg, or measure them."
        )
    _refuse_same_ground(part_of, name)
    warnings = []
    if missing:
        warnings.append(
            f"{name}: {len(missing)} of {len(plots)} plots {'was' if len(missing) == 1 else 'were'} not searched for "
            f"stems and {'is' if len(missing) == 1 else 'are'} left out: {_some(missing)}."
        )
    larger = [
        f"{made.plot_id} ({1e4 * made.area_ha:,.0f} of {1e4 * plot.area_ha:,.0f} m²{_like_feet(plot, made)})"
        for plot, made in part_of
    ]
    notes: list[str] = []
    if larger:
        sentence = (
            f"{name}: {len(larger)} of {len(plots)} plots {'asks' if len(larger) == 1 else 'ask'} for more ground than "
            f"stems were searched for on: {_some(larger)}. Only the searched part counts, and the trees in it."
        )
        least = min(made.searched for _, made in part_of)
        (warnings if least < ALMOST else notes).append(sentence)
    return kept, warnings, notes


def _empty_rim(plots: Sequence[SamplePlot], xy: np.ndarray) -> str:
    """What is odd where no tree stands in the outer part of any round plot; '' where chance can leave it empty."""
    shares = [
        np.hypot(*(xy[plot.contains(xy[:, 0], xy[:, 1])] - [plot.x, plot.y]).T) ** 2 / plot.radius_m**2
        for plot in plots
        if plot.shape == "circle"
    ]
    inner = np.concatenate(shares) if shares else np.zeros(0)
    if not len(inner) or inner.max() >= ALMOST or inner.max() ** len(inner) > _CHANCE:
        return ""
    return (
        f"but of {len(inner)} trees none stands in their outer {100 * (1 - inner.max()):.0f} %: if only the inner "
        f"{100 * np.sqrt(inner.max()):.0f} % of the radius was searched, every figure per hectare is too low by that "
        "share; give the plots as they were measured, or measure again."
    )


def _refuse_same_ground(part_of: list[tuple[SamplePlot, SamplePlot]], name: str) -> None:
    """Plots so large that what was searched of them is the same ground are no plots of their own."""
    for (plot, one), (_, other) in combinations(part_of, 2):
        assert one.outline is not None and other.outline is not None
        if one.outline.distance(other.outline) > 0:
            continue
        both = one.outline.intersection(other.outline).area
        if both > _SAME_GROUND * min(one.outline.area, other.outline.area):
            raise InputError(
                f"{name}: plots {one.plot_id} and {other.plot_id} ask for the same searched ground ({both:,.0f} m²; "
                f"{one.plot_id} is to have {1e4 * plot.area_ha:,.0f} m²); correct the plots' sizes and their unit."
            )


def _like_feet(plot: SamplePlot, made: SamplePlot) -> str:
    """A hint where the radius is that of the searched circle in feet."""
    circle = np.sqrt(1e4 * made.area_ha / np.pi)
    return ": a radius in feet?" if abs(np.log(plot.radius_m / circle * 0.3048)) < 0.03 else ""


def _some(names: list[str]) -> str:
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
