"""TreeDGS: diameters at breast height from drone photos or LiDAR clouds.

The library computes; it never imports ``qgis``. ``import treedgs_geo as tg`` gives :func:`.api.measure_photos`,
:func:`.api.measure_cloud`, every other verb as a function (:func:`.api.verb_function`), and what they read and return;
the names load when they are first used. The rooms behind them, and the order in which they import one another, are in
``docs/developer/developing.md`` and ``.importlinter``.
"""

# Nothing is imported here: ``python -m treedgs_geo`` in a folder with a typing.py of its own would run that one before
# ``__main__`` can take the folder from the path (``core/children.py``). Type checkers know this name.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any

    from .api import Result, measure_cloud, measure_photos
    from .core.errors import TreeDGSError, TreeDGSWarning
    from .core.progress import Reporter
    from .geotags.reading import read_stations
    from .geotags.stations import Stations
    from .inventory.charts import draw_diameters, draw_heights, draw_intervals, draw_map, draw_scatter, draw_stem
    from .inventory.review.apply import review_trees
    from .inventory.reviewed import reviewed
    from .inventory.tree_layer import tree_table, write_trees
    from .inventory.tree_reading import read_trees
    from .pointcloud.cloud import PointCloud
    from .pointcloud.files import read_cloud, write_cloud
    from .run.finished import FinishedRun, open
    from .stems.geometry.circles import fit_circle
    from .stems.quality.reasons import explain
    from .stems.quality.tree import Tree
    from .terrain.dtm import Dtm, read_dtm

__version__ = "1.0.0"

#: Function -> verb, in the order of the work; a room has the plain name of two. ``photos-to-dbh`` and
#: ``pointcloud-to-dbh`` are measure_photos and measure_cloud.
_VERBS = {
    "plan_flight": "plan-flight",
    "measure_campaign": "campaign",
    "geotag": "geotag",
    "reconstruct": "reconstruct",
    "model_terrain": "terrain",
    "fit_gaussians": "fit-gaussians",
    "sample_surface": "sample-surface",
    "segment_stems": "segment-stems",
    "measure_dbh": "measure-dbh",
    "review": "review",
    "match_plots": "match-plots",
    "evaluate": "evaluate",
    "tape_sample": "tape-sample",
    "tape_check": "tape-check",
    "trial": "trial",
    "stand_table": "stand-table",
    "compare": "compare",
    "benchmark": "benchmark",
    "simulate_plot": "simulate-plot",
    "doctor": "doctor",
}
_CHARTS = ("draw_map", "draw_diameters", "draw_scatter", "draw_intervals", "draw_stem", "draw_heights")
#: Name -> module that has it.
_HOMES = {
    "Result": "api",
    "measure_photos": "api",
    "measure_cloud": "api",
    "read_stations": "geotags.reading",
    "Stations": "geotags.stations",
    "read_cloud": "pointcloud.files",
    "write_cloud": "pointcloud.files",
    "PointCloud": "pointcloud.cloud",
    "read_dtm": "terrain.dtm",
    "Dtm": "terrain.dtm",
    "fit_circle": "stems.geometry.circles",
    "FinishedRun": "run.finished",
    "open": "run.finished",
    "Tree": "stems.quality.tree",
    "explain": "stems.quality.reasons",
    "read_trees": "inventory.tree_reading",
    "write_trees": "inventory.tree_layer",
    "tree_table": "inventory.tree_layer",
    "reviewed": "inventory.reviewed",
    "review_trees": "inventory.review.apply",
    **dict.fromkeys(_CHARTS, "inventory.charts"),
    "Reporter": "core.progress",
    "TreeDGSError": "core.errors",
    "TreeDGSWarning": "core.errors",
}
__all__ = [
    "Dtm",
    "FinishedRun",
    "PointCloud",
    "Reporter",
    "Result",
    "Stations",
    "Tree",
    "TreeDGSError",
    "TreeDGSWarning",
    "draw_diameters",
    "draw_heights",
    "draw_intervals",
    "draw_map",
    "draw_scatter",
    "draw_stem",
    "explain",
    "fit_circle",
    "measure_cloud",
    "measure_photos",
    "open",
    "read_cloud",
    "read_dtm",
    "read_stations",
    "read_trees",
    "review_trees",
    "reviewed",
    "tree_table",
    "write_cloud",
    "write_trees",
]
__all__.extend(_VERBS)


def __getattr__(name: str) -> "Any":
    import importlib

    if name in _VERBS:
        found = importlib.import_module(".api", __name__).verb_function(_VERBS[name])
    elif name in _HOMES:
        found = getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(["__version__", *__all__])
