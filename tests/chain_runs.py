"""The command line of a run of the chain on a simulated plot."""

from __future__ import annotations

from pathlib import Path


def chain_arguments(plot: Path, folder: Path, **more: str) -> list[str]:
    given = {
        "photos": plot / "images",
        "geotags": plot,
        "crs": "EPSG:6344",
        "plots": plot / "plots.csv",
        "workspace": folder / "work",
        "output": folder / "trees.gpkg",
        **more,
    }
    words = ["photos-to-dbh", "--log-format", "plain"]
    for name, value in given.items():
        words += [f"--{name.replace('_', '-')}", str(value)]
    return words
