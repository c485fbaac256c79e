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

    from .api import Result as Result
    from .api import measure_cloud as measure_cloud
    from .api import measure_photos as measure_photos
    from .core.errors import TreeDGSError as TreeDGSError
    from .core.errors import TreeDGSWarning as TreeDGSWarning
    from .core.progress import Reporter as Reporter
    from .geotags.reading import read_stations as read_stations
    from .geotags.stations import Stations as Stations
    from .inventory.charts import draw_diameters as draw_diameters
    from .inventory.charts import draw_heights as draw_heights
    from .inventory.charts import draw_intervals as draw_intervals
    from .inventory.charts import draw_map as draw_map
    from .inventory.charts import draw_scatter as draw_scatter
    from .inventory.charts import draw_stem as draw_stem
    from .inventory.review.apply import review_trees as review_trees
    from .inventory.reviewed import reviewed as reviewed
    from .inventory.tree_layer import tree_table as tree_table
    from .inventory.tree_layer import write_trees as write_trees
    from .inventory.tree_reading import read_trees as read_trees
    from .pointcloud.cloud import PointCloud as PointCloud
    from .pointcloud.files import read_cloud as read_cloud
    from .pointcloud.files import write_cloud as write_cloud
    from .run.finished import FinishedRun as FinishedRun
    from .run.finished import open as open
    from .stems.geometry.circles import fit_circle as fit_circle
    from .stems.quality.reasons import explain as explain
    from .stems.quality.tree import Tree as Tree
    from .terrain.dtm import Dtm as Dtm
    from .terrain.dtm import read_dtm as read_dtm

__version__ = "1.0.0"

#: Function -> verb, in the order of the work; a room has the plain name of two. ``photos-to-dbh`` and
#: ``pointcloud-to-dbh`` are measure_photos and measure_cloud.
_VERBS = {
    name: name.replace("_", "-")
    for name in (
        "plan_flight", "measure_campaign", "geotag", "reconstruct", "model_terrain", "fit_gaussians", "sample_surface",
        "segment_stems", "measure_dbh", "review", "match_plots", "evaluate", "tape_sample", "tape_check", "trial",
        "stand_table", "compare", "benchmark", "simulate_plot", "doctor",
    )
} | {"measure_campaign": "campaign", "model_terrain": "terrain"}  # fmt: skip
#: Name -> module that has it.
_HOMES = {
    name: module
    for module, names in {
        "api": ("Result", "measure_photos", "measure_cloud"),
        "geotags.reading": ("read_stations",),
        "geotags.stations": ("Stations",),
        "pointcloud.files": ("read_cloud", "write_cloud"),
        "pointcloud.cloud": ("PointCloud",),
        "terrain.dtm": ("read_dtm", "Dtm"),
        "stems.geometry.circles": ("fit_circle",),
        "run.finished": ("FinishedRun", "open"),
        "stems.quality.tree": ("Tree",),
        "stems.quality.reasons": ("explain",),
        "inventory.tree_reading": ("read_trees",),
        "inventory.tree_layer": ("write_trees", "tree_table"),
        "inventory.reviewed": ("reviewed",),
        "inventory.review.apply": ("review_trees",),
        "inventory.charts": (
            "draw_map",
            "draw_diameters",
            "draw_scatter",
            "draw_intervals",
            "draw_stem",
            "draw_heights",
        ),
        "core.progress": ("Reporter",),
        "core.errors": ("TreeDGSError", "TreeDGSWarning"),
    }.items()
    for name in names
}
__all__ = [*_HOMES, *_VERBS]


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
