"""What a plot costs: seconds, memory and disk from its photos, megapixels or points, fitted to finished runs.

Linear with coefficients that cannot be negative, fitted to relative errors, so that small plots count as much as large
ones. The shipped figures are those of ``docs/results/campaign_costs.json``; a campaign refits them from its own
runs.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from .errors import InputError
from .files import read_json, write_json

#: Per route: what the cost depends on besides a constant. All known before a plot is run.
FEATURES = {"photos": ("photos", "megapixels"), "cloud": ("points_m",)}
MEASURES = ("seconds", "memory_gb", "disk_gb")
#: A route is refitted from a campaign's own runs when there are this many plots of it.
FEWEST_RUNS = 8
#: Memory is declared this much above the prediction, and never below :data:`MIN_GB`.
HEADROOM, MIN_GB = 1.3, 0.35


@dataclass(frozen=True)
class Need:
    """What one plot is expected to take. seconds: on one thread of the machine of the runs. memory_gb: declared to the
    workers, with headroom. outside: larger than every plot the figures rest on."""

    seconds: float
    memory_gb: float
    disk_gb: float
    outside: bool


class CostModel:
    """Per route: ``seconds``, ``memory_gb``, ``disk_gb`` (each: constant, per feature…), ``n, largest, spread``."""

    def __init__(self, routes: dict[str, dict[str, Any]]) -> None:
        self.routes = routes

    @classmethod
    def load(cls, path: Path | None = None) -> CostModel:
        """The shipped model, with the routes of ``path`` in place of its own.

        Raises:
            InputError: ``path`` is no cost model.
        """
        shipped = read_json(files(__package__) / "costs.json")  # type: ignore[arg-type]
        if path is None:
            return cls(shipped["routes"])
        found = read_json(path)
        try:
            own = {route: found["routes"][route] for route in FEATURES if route in found["routes"]}
            for route, entry in own.items():
                for name in MEASURES:
                    values = np.asarray(entry[name], float)
                    if values.shape != (len(FEATURES[route]) + 1,) or not np.isfinite(values).all():
                        raise ValueError(name)
        except (KeyError, TypeError, ValueError):
            raise InputError(f"{path}: is no cost model, expected costs.json of a campaign; delete the file.") from None
        return cls({**shipped["routes"], **own})

    def save(self, path: Path) -> None:
        """Write as JSON."""
        write_json(path, {"features": FEATURES, "routes": self.routes})

    def predict(self, route: str, sizes: dict[str, Any]) -> Need:
        """Cost of a plot with these inputs (``PlotInputs`` of a campaign as JSON)."""
        entry = self.routes[route]
        x = np.array([1.0, *(float(sizes[name]) for name in FEATURES[route])])
        values = {name: float(np.dot(entry[name], x)) for name in MEASURES}
        outside = any(value > 1.5 * most for value, most in zip(x[1:], entry["largest"], strict=True))
        memory = max(values["memory_gb"] * HEADROOM, MIN_GB)
        return Need(max(values["seconds"], 0.5), memory, max(values["disk_gb"], 0.002), outside)

    def refit(self, runs: Iterable[dict[str, Any]]) -> CostModel:
        """A model from finished plots: ``route``, the features, and ``seconds, memory_gb, disk_gb`` of each."""
        runs = list(runs)
        routes = dict(self.routes)
        for route, features in FEATURES.items():
            mine = [run for run in runs if run["route"] == route]
            if len(mine) >= FEWEST_RUNS:
                routes[route] = fit(mine, features)
        return CostModel(routes)


def fit(runs: list[dict[str, Any]], features: tuple[str, ...]) -> dict[str, Any]:
    """Coefficients of one route. spread: 90th percentile of the factor between prediction and run, per measure."""
    from scipy.optimize import nnls

    x = np.array([[1.0, *(float(run[name]) for name in features)] for run in runs])
    scale = np.maximum(x.max(axis=0), 1e-9)
    largest = [round(float(value), 4) for value in x[:, 1:].max(axis=0)]
    entry: dict[str, Any] = {"n": len(runs), "largest": largest, "spread": {}}
    for name in MEASURES:
        y = np.maximum(np.array([float(run[name]) for run in runs]), 1e-6)
        solution, _ = nnls(x / scale / y[:, None], np.ones(len(y)))
        entry[name] = [float(f"{value:.6g}") for value in solution / scale]
        predicted = np.maximum(x @ np.array(entry[name]), 1e-6)
        entry["spread"][name] = round(float(np.percentile(np.exp(np.abs(np.log(predicted / y))), 90)), 2)
    return entry


def time_text(seconds: float) -> str:
    """``8 s``, ``12 min``, ``3.4 h``, ``5.2 days``."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    if seconds < 2 * 86400:
        return f"{seconds / 3600:.1f} h"
    return f"{seconds / 86400:.1f} days"


def makespan(seconds: np.ndarray, slots: int) -> float:
    """Seconds until all are done on ``slots`` workers, the longest first: what a list scheduler reaches."""
    import heapq

    if len(seconds) > 200_000:
        return float(seconds.sum() / slots + seconds.max())
    ends = [0.0] * max(1, min(slots, len(seconds)))
    for value in np.sort(seconds)[::-1]:
        heapq.heapreplace(ends, ends[0] + float(value))
    return max(ends)
