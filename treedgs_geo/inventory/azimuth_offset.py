"""Plots that fit best at the largest turn searched: what that means, and what to change."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import numpy as np
import pandas as pd
import pyproj

from ..core.crs import grid_convergence_deg
from ..core.errors import InputError
from ..core.plots import Plot
from ..core.shown import some
from .declination import declination_deg, parse_date
from .field_trees import FieldProtocol
from .pairing import PairingOptions, Registration, at_limit, register

#: How far a wider search looks, degrees, and in how many plots.
_WIDE_DEG, _WIDE_PLOTS = 45.0, 5


def is_stuck(plot: dict, options: PairingOptions) -> bool:
    """Whether a row of the layer ``plots`` is left to check and turned by the most that is searched."""
    return plot["status"] == "check" and at_limit(plot["rot_deg"], options.rotation_deg)


def turn_advice(
    plots: list[dict],
    survey: list[Plot],
    field_trees: pd.DataFrame,
    measured_xy: np.ndarray,
    options: PairingOptions,
    protocol: FieldProtocol,
    crs: pyproj.CRS,
) -> list[str]:
    """One sentence where plots are turned to the limit: how many, where a wider search finds them, what to change.

    plots: rows of the layer ``plots``. field_trees: with ``plot_id, x_field, y_field``. measured_xy: (M, 2).
    """
    stuck = [row["plot_id"] for row in plots if is_stuck(row, options)]
    if not stuck:
        return []
    known = {plot.plot_id: plot for plot in survey}
    tried = [known[name] for name in stuck[:_WIDE_PLOTS]]
    found = [_wider(plot, field_trees, measured_xy, options) for plot in tried]
    turns = [placed.rotation_deg for placed in found if placed is not None]
    text = (
        f"{len(stuck)} of {len(plots)} plots fit best at the largest turn searched, {options.rotation_deg:g} degrees "
        f"({some(stuck, 10)}), and are left to a hand check: their bearings may refer to another north or be "
        "in another unit."
    )
    if turns:
        span = f"{min(turns):+.1f}"
        if len(turns) > 1:
            span += f" to {max(turns):+.1f}, median {np.median(turns):+.1f}"
        text += f" Searched up to {_WIDE_DEG:g} degrees, {len(turns)} of {len(tried)} fit clearly, at {span}."
    return [f"{text} {_what_to_change(tried[0], protocol, crs)}"]


def _wider(
    plot: Plot, field_trees: pd.DataFrame, measured_xy: np.ndarray, options: PairingOptions
) -> Registration | None:
    """The plot placed with turns up to :data:`_WIDE_DEG`; ``None`` where that is unclear too."""
    centre = np.array([plot.x, plot.y])
    mine = field_trees.loc[field_trees["plot_id"] == plot.plot_id, ["x_field", "y_field"]].to_numpy(float) - centre
    reach = np.linalg.norm(mine, axis=1).max() + 3 * options.centre_error_m + 2.0
    there = measured_xy - centre
    there = there[np.linalg.norm(there, axis=1) <= reach]
    placed = register(mine, there, replace(options, rotation_deg=_WIDE_DEG))
    return placed if placed.status != "check" else None


def _what_to_change(plot: Plot, protocol: FieldProtocol, crs: pyproj.CRS) -> str:
    """The settings that turn a plot, with what the declination and the convergence are there."""
    ways = []
    if crs is not None and crs.geodetic_crs is not None:
        lon, lat = pyproj.Transformer.from_crs(crs, crs.geodetic_crs.to_2d(), always_xy=True).transform(plot.x, plot.y)
        day = protocol.field_date or date.today().isoformat()
        try:
            declination = declination_deg(lon, lat, 0.0, parse_date(day, "field date"), plot.plot_id)
            magnetic = f"magnetic with --field-date or --declination-deg (there {declination:+.1f} degrees on {day})"
        except InputError:
            magnetic = "magnetic with --declination-deg"
        convergence = grid_convergence_deg(crs, lon, lat)
        ways.append(
            f"--north (now {protocol.north}: {magnetic}, true, or grid, which lies {abs(convergence):.1f} degrees "
            f"{'east' if convergence > 0 else 'west'} of true)"
        )
    ways += ["--azimuth-unit (deg, gon, mil)", "--rotation-deg for a larger turn"]
    return f"Change {'; '.join(ways[:-1])}; or give {ways[-1]}."
