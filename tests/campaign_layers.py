"""For the tests of campaigns: layers compared."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from treedgs_geo.inventory.tree_reading import read_trees

#: Columns that name a run, not a tree.
_NAMES = {"tree_id", "plot_id", "run_id", "camp_plot", "plot_tree", "geometry"}


def trees_by_plot(layer: Path, plot_id: str | None = None) -> dict[str, list[tuple]]:
    """Every value of every tree, by plot; of a single plot's layer when ``plot_id`` is given."""
    table = read_trees(layer)
    table["_plot"] = plot_id if plot_id else table["camp_plot"]
    table["_tree"] = table["tree_id"] if plot_id else table["plot_tree"]
    table["_point"] = table.geometry.to_wkt(rounding_precision=6)
    columns = ["_tree", "_point", *sorted(set(table.columns) - _NAMES - {"_plot", "_tree", "_point"})]
    found: dict[str, list[tuple]] = {}
    for plot, part in table.groupby("_plot", sort=False):
        rows = part[columns].sort_values("_tree").itertuples(index=False, name=None)
        found[str(plot)] = [tuple(None if pd.isna(v) else v for v in row) for row in rows]
    return found


def differences(layer: Path, other: Path | dict[str, Path]) -> list[str]:
    """What differs between a campaign's layer and another one, or single plots' layers; empty = the same trees, each
    plot once, ids unique."""
    here = trees_by_plot(layer)
    there: dict[str, list[tuple]] = {}
    if isinstance(other, dict):
        for name, path in other.items():
            there.update(trees_by_plot(path, name))
    else:
        there = trees_by_plot(other)
    found = [f"{name}: only in one of them" for name in sorted(set(here) ^ set(there))]
    for name in sorted(set(here) & set(there)):
        if len(here[name]) != len(there[name]):
            found.append(f"{name}: {len(here[name])} trees against {len(there[name])}")
        elif here[name] != there[name]:
            pairs = zip(here[name], there[name], strict=True)
            found.append(f"{name}: {next((one, two) for one, two in pairs if one != two)}")
    ids = read_trees(layer)["tree_id"]
    if not ids.is_unique:
        found.append("tree ids are not unique")
    return found
