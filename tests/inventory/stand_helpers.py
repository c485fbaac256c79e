"""A small survey on disk for the stand table's tests, and readers of the files it writes."""

from __future__ import annotations

import json
import os
import subprocess
from html.parser import HTMLParser

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
import pytest
from shapely.geometry import box

from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.stand.run import make_report as run
from treedgs_geo.inventory.stand.run import read_stand
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs.stand_table import StandTableSettings

CRS = pyproj.CRS.from_epsg(6344)
EAST, NORTH = 611300.0, 3718400.0


class Ears(Reporter):
    """Remembers what was said."""

    def __init__(self):
        super().__init__()
        self.warnings: list[str] = []
        self.infos: list[str] = []

    def warn(self, message):
        self.warnings.append(message)

    def info(self, message):
        self.infos.append(message)


def make_survey(folder, seed=1):
    """600 stems a hectare on one hectare, four plots, one of them over the western edge; some stems without a DBH."""
    rng = np.random.default_rng(seed)
    trees = []
    for k in range(600):
        x, y = rng.uniform(0, 100, 2)
        d = float(np.clip(rng.normal(24, 7), 7, 50))
        more = {"dbh_cm": d, "dbh_se_cm": 0.8}
        if k % 15 == 0:
            more = {"qc_flag": "reject", "qc_reason": "too_small" if k % 60 == 0 else "few_views"}
        height = 1.37 + (d / (1.5 + 0.19 * d)) ** 2 if k % 3 else None
        trees.append(Tree(k, EAST + x, NORTH + y, z_ground=38.0, height_m=height, method="photos", **more))
    write_trees(folder / "trees.gpkg", trees, CRS)
    centres = {"A": (5, 50), "B": (40, 30), "C": (75, 30), "D & é": (60, 75)}
    rows = [
        {"plot_id": name, "easting": EAST + x, "northing": NORTH + y, "epsg": 6344, "radius_m": 11.28}
        for name, (x, y) in centres.items()
    ]
    pd.DataFrame(rows).to_csv(folder / "plots.csv", index=False)
    outline = gpd.GeoDataFrame(geometry=[box(EAST, NORTH, EAST + 100, NORTH + 100)], crs=CRS)
    outline.to_file(folder / "stand.gpkg")
    return folder


def edit_in_qgis(script, path, edits):
    """Run a PyQGIS script that edits the layer in ``path``; it prints SAVED when done."""
    python = "/usr/bin/python3"
    if subprocess.run([python, "-c", "import qgis.core"], capture_output=True).returncode:
        pytest.skip("QGIS is not installed here; make setup installs it")
    done = subprocess.run(
        [python, "-c", script, str(path), json.dumps(edits)],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "PYTHONPATH": "", "XDG_CONFIG_HOME": str(path.parent / "q")},
    )
    assert "SAVED" in done.stdout, done.stdout + done.stderr
    return done.stdout


def _settings(folder, out, more):
    values = {
        "trees": folder / "trees.gpkg",
        "plots": folder / "plots.csv",
        "boundary": folder / "stand.gpkg",
        "species": "PITA",
        "output": folder / out,
        **more,
    }
    return StandTableSettings(**values)


def report(folder, out="out", **more):
    """Run the verb; returns result, reporter, output folder."""
    ears = Ears()
    return run(_settings(folder, out, more), ears), ears, folder / out


def figures(folder, **more):
    """The same without writing files; returns the stand and the reporter."""
    ears = Ears()
    return read_stand(_settings(folder, "out", more), ears), ears


class _Tables(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found: dict[str, list[list[str]]] = {}
        self._rows: list[list[str]] = []
        self._cell: list[str] | None = None
        self.outside: list[str] = []

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.outside += [v for k, v in values.items() if k in ("src", "href") and not str(v).startswith("data:")]
        if tag == "table":
            self._rows = self.found.setdefault(values["id"], [])
        elif tag == "tr":
            self._rows.append([])
        elif tag in ("td", "th"):
            self._cell = []

    def handle_data(self, data):
        if self._cell is not None:
            self._cell.append(data)

    def handle_endtag(self, tag):
        if tag in ("td", "th") and self._cell is not None:
            self._rows[-1].append("".join(self._cell))
            self._cell = None


def html_tables(path):
    """``id -> rows of cells`` of every table, and what the page would load from elsewhere."""
    parser = _Tables()
    parser.feed(path.read_text(encoding="utf-8"))
    return parser.found, parser.outside


def number(text):
    """A shown number; NaN for a dash."""
    text = text.replace("\u202f", "").replace(" ", "")
    return float("nan") if text == "–" else float(text)
