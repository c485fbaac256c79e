"""The front door of the library: photos or a cloud in, a table of trees out; and every verb as a function.

Every name here is also an attribute of the package itself::

    import treedgs_geo as tg

    trees = tg.measure_cloud("plot.laz")
    stand = tg.stand_table(trees="trees.gpkg", plots="plots.csv")
    print(stand.ba_m2_ha, stand.ba_se_m2_ha)
"""

from __future__ import annotations

import functools
import inspect
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _VERBS
from .core.command import ordered_params
from .core.errors import InputError, TreeDGSError
from .core.outputs import checked_paths
from .core.progress import Reporter, WarningReporter
from .core.settings import Param, build, params_of
from .run.settings import PhotosToDbhSettings, PointcloudToDbhSettings
from .verbs import all_commands, get_command

if TYPE_CHECKING:
    import geopandas as gpd

    from .pointcloud.cloud import PointCloud


def measure_photos(
    photos: str | Path,
    workspace: str | Path,
    *,
    crs: str,
    geotags: str | Path | None = None,
    output: str | Path | None = None,
    reporter: Reporter | None = None,
    **settings: Any,
) -> gpd.GeoDataFrame | Result:
    """Measure the trees of a plot from drone photos: the verb ``photos-to-dbh``.

    Args:
        photos: folder with the original photos (JPEG) of one plot or block.
        workspace: folder for what the stages keep; a second call with the same inputs goes on from there.
        crs: projected CRS in metres, ``"EPSG:6344"``.
        geotags: folder or file with MRK and RTKLIB ``.pos`` files, or a CSV; ``None`` = the photos' EXIF/XMP.
        output: tree layer to write (.gpkg, .shp, .geojson, .csv); ``None`` = ``trees.gpkg`` in the workspace.
        reporter: where progress, warnings and results go; ``None`` = warnings only, as Python's.
        settings: further fields of :class:`~treedgs_geo.run.settings.PhotosToDbhSettings` by name (``plots``,
            ``gcp``, ``dtm``, ``preset``, ``at``, ``bh_m``).

    Returns:
        With ``dry_run=True`` what the run would meet and need, as the other verbs give it (:class:`Result`); else one
        row a stem found, in ``crs``: the columns of the tree layer (:class:`~treedgs_geo.stems.quality.tree.Tree`), DBH
        and its errors in cm, lengths in m. Stems without a DBH have their reason in ``qc_reason``.

    Raises:
        TreeDGSError: one sentence with the file, what was found, what was expected and what to do.

    Examples:
        >>> import treedgs_geo as tg
        >>> trees = tg.measure_photos(
        ...     plot / "images", work, geotags=plot, crs="EPSG:6344", plots=plot / "plots.csv"
        ... )
        >>> bool(trees["dbh_cm"].between(5, 90).any())
        True
        >>> sorted(set(trees["qc_flag"]) - {"ok", "check", "reject"})
        []
    """
    from .inventory.tree_reading import read_trees

    output = Path(workspace) / "trees.gpkg" if output is None else Path(output)
    given = {"photos": photos, "workspace": workspace, "crs": crs, "geotags": geotags, "output": output, **settings}
    with _in_python(reporter) as heard:
        chosen = build(PhotosToDbhSettings, given)
        with checked_paths(chosen):
            found = get_command("photos-to-dbh").run(chosen, heard)
        return Result(found) if chosen.dry_run else read_trees(output)


def measure_cloud(
    cloud: str | Path | PointCloud,
    *,
    dtm: str | Path | None = None,
    crs: str | None = None,
    reporter: Reporter | None = None,
    **settings: Any,
) -> gpd.GeoDataFrame | Result:
    """Find and measure every stem of a LiDAR cloud: the verb ``pointcloud-to-dbh`` without its files.

    Args:
        cloud: a LAS, LAZ, COPC, E57 or text file, or points in memory, coordinates in metres.
        dtm: terrain raster; ``None`` = the ground is found in the cloud.
        crs: CRS of a file that holds none, or ``"local"``.
        reporter: where progress, warnings and results go; ``None`` = warnings only, as Python's.
        settings: further fields of :class:`~treedgs_geo.run.settings.PointcloudToDbhSettings` by name (``plots``,
            ``bh_m``, ``min_dbh_cm``, ``max_dbh_cm``, ``method``, ``source`` ...).

    Returns:
        With ``dry_run=True`` (of a file) what the run would meet and need (:class:`Result`); else one row a stem found,
        in the cloud's CRS: the columns of the tree layer, DBH and its errors in cm.

    Raises:
        TreeDGSError: one sentence with the file, what was found, what was expected and what to do.

    Examples:
        Two stems of 30 and 20 cm, scanned from all sides, on level ground:

        >>> import numpy as np
        >>> import treedgs_geo as tg
        >>> rng = np.random.default_rng(0)
        >>> def stem(x, y, radius_m, n=4000):
        ...     angle, z = rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 6, n)
        ...     r = radius_m + rng.normal(0, 0.003, n)
        ...     return np.column_stack([x + r * np.cos(angle), y + r * np.sin(angle), z])
        >>> ground = np.column_stack([rng.uniform(-6, 6, (20000, 2)), rng.normal(0, 0.01, 20000)])
        >>> xyz = np.vstack([ground, stem(-2, 0, 0.15), stem(2, 1, 0.10)])
        >>> trees = tg.measure_cloud(tg.PointCloud(xyz))
        >>> trees.sort_values("x")["dbh_cm"].round(0).tolist()
        [30.0, 20.0]
    """
    from .inventory.tree_layer import tree_table
    from .pointcloud.cloud import PointCloud
    from .run.cloud import STAGES, CloudJob, take
    from .run.cloud_input import checked, read_checked
    from .run.stage import Steps, check, run_stages

    files = [name for name, spec, _ in params_of(PointcloudToDbhSettings) if spec.kind.startswith("output_")]
    if unused := [name for name in files if settings.get(name) is not None]:
        raise InputError(
            f"measure_cloud: writes no file, so that {', '.join(unused)} would not be; write what it returns by "
            "write_trees, or run the verb pointcloud-to-dbh."
        )
    path = Path("the cloud") if isinstance(cloud, PointCloud) else Path(cloud)
    with _in_python(reporter) as heard:
        given = build(PointcloudToDbhSettings, {"input": path, "output": path, "dtm": dtm, "crs": crs, **settings})
        if given.dry_run:
            return Result(get_command("pointcloud-to-dbh").run(given, heard))
        if isinstance(cloud, PointCloud):
            points, extent = checked(cloud, path, heard, dtm=given.dtm, crs=crs)
        else:
            points, extent = read_checked(path, crs, heard, dtm=given.dtm)
        job = CloudJob(given, heard)
        take(job, points, extent)
        _, ground, stems, *_ = STAGES
        check(ground, job)
        run_stages((ground, stems), job, Steps(None, heard, {ground.name: 0.3, stems.name: 0.7}))
        return tree_table(job.trees, job.crs)


class Result(dict[str, Any]):
    """What a verb gives: its figures, and the paths of its files, by name and as attributes.

    Files of an output that was not asked for lie in a temporary folder that goes when the result does.

    Examples:
        >>> import treedgs_geo as tg
        >>> found = tg.Result(n_trees=3, output=work / "trees.gpkg")
        >>> found.n_trees
        3
    """

    #: Holds what was not asked for.
    _temporary: tempfile.TemporaryDirectory | None = None

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        raise AttributeError(f"the result has no {name!r}, it has {', '.join(self)}")

    def read(self, name: str = "output", layer: str | None = None) -> gpd.GeoDataFrame:
        """A layer (or CSV) that the verb wrote. name: of the result. layer: of a GeoPackage with several.

        Raises:
            InputError: the result has no such file, or the file no such layer.
        """
        import geopandas as gpd
        import pyogrio

        path = self.get(name)
        if not isinstance(path, Path) or not path.is_file():
            files = [key for key, value in self.items() if isinstance(value, Path) and value.is_file()]
            raise InputError(f"{name}: is no file of this result; its files are {', '.join(files) or 'none'}.")
        layers = pyogrio.list_layers(path)[:, 0].tolist()
        if layer is not None and layer not in layers:
            raise InputError(f"{path}: has no layer {layer!r}, expected one of {', '.join(layers)}.")
        return gpd.read_file(path, layer=layer or layers[0])

    def _repr_html_(self) -> str:
        import pandas as pd

        from .core.layer_files import read_if_there
        from .inventory.charts import trees_html
        from .inventory.tree_layer import LAYER, OWN_LAYERS

        shown = pd.Series({name: value for name, value in self.items() if isinstance(value, str | int | float | Path)})
        html = shown.to_frame("").to_html(border=0, header=False)
        for path in self.values():
            table = read_if_there(path, LAYER, OWN_LAYERS[LAYER]) if isinstance(path, Path) and path.is_file() else None
            if table is not None:
                return html + trees_html(str(path), table)
        return html


def verb_function(verb: str) -> Callable[..., Result]:
    """The function of a verb: keyword arguments by the names that the command line has, ``reporter`` beside them.

    What it asks for as output may be left out: see :class:`Result`.
    """
    command = get_command(verb)

    def call(*, reporter: Reporter | None = None, **settings: Any) -> Result:
        result = Result()
        given = {name: value for name, value in settings.items() if value is not None}
        for name, spec, default in params_of(command.settings):
            if default is MISSING and spec.kind.startswith("output_") and name not in given:
                result._temporary = result._temporary or tempfile.TemporaryDirectory(prefix="treedgs-")
                ending = f".{spec.suffixes[0].lstrip('.')}" if spec.kind == "output_file" else ""
                given[name] = Path(result._temporary.name) / f"{name}{ending}"
        with _in_python(reporter) as heard:
            chosen = build(command.settings, given)
            with checked_paths(chosen):
                found = command.run(chosen, heard)
        result.update((key, _as_path(value)) for key, value in found.items())
        return result

    call.__name__ = call.__qualname__ = verb.replace("-", "_")
    call.__module__ = __name__
    call.__doc__ = _doc(command.summary, command.help, ordered_params(command), command.outputs)
    call.__signature__ = _signature(ordered_params(command))  # type: ignore[attr-defined]
    return call


@contextmanager
def _in_python(reporter: Reporter | None) -> Iterator[Reporter]:
    """What hears a verb: where no reporter is given, Python's warnings. These and errors name Python's parameters."""
    heard = reporter or WarningReporter()
    if reporter is None:
        heard.words = _python_words
    try:
        yield heard
    except TreeDGSError as problem:
        problem.args = (_python_words(str(problem)), *problem.args[1:])
        raise


@functools.lru_cache(maxsize=1)
def _functions() -> tuple[dict[str, Param], dict[str, str]]:
    """Every parameter by its name, and the function of every verb."""
    named = {name: spec for each in all_commands() for name, spec, _ in params_of(each.settings)}
    own = {"photos-to-dbh": "measure_photos", "pointcloud-to-dbh": "measure_cloud"}
    return named, own | {verb: function for function, verb in _VERBS.items()}


def _python_words(text: str, mark: str = "'") -> str:
    """The engine's sentence with options of the command line and verbs under their names here."""
    params, functions = _functions()

    def named(found: re.Match[str]) -> str:
        name, value = found[1].replace("-", "_"), found[2] or ""
        if name not in params:
            return found[0]
        is_value = value.startswith("EPSG:") or value == "local" or value in params[name].choices
        return f'{mark}{name}="{value}"{mark}' if is_value else f"{mark}{name}{mark}" + (f" {value}" if value else "")

    text = re.sub(r"(?<![\w-])--([a-z](?:[a-z0-9-]*[a-z0-9])?)(?: (\w[\w:.-]*))?", named, text)
    # Verbs of one word are words of sentences, too; a command line and a file's name stay.
    verbs = "|".join(verb for verb in functions if "-" in verb)
    found = rf"(?<![\w/.-])(?<!treedgs )(?:{verbs})(?![\w/-]|\.\w)"
    return re.sub(found, lambda found: f"{mark}{functions[found[0]]}{mark}", text)


def _as_path(value: Any) -> Any:
    """Text that names a file or folder that is there, as a path."""
    named = isinstance(value, str) and (Path(value).suffix or len(Path(value).parts) > 1)
    return Path(value) if named and os.path.exists(value) else value


#: Kind of a parameter -> the type of its argument; what is not here is a path.
_TYPES = {
    "integer": "int", "number": "float", "flag": "bool", "text": "str", "crs": "str", "choice": "str",
    "record": "str | dict",
}  # fmt: skip


def _signature(params: list[tuple[str, Param, Any]]) -> inspect.Signature:
    arguments = []
    for name, spec, default in params:
        left_out = default if default is not MISSING or not spec.kind.startswith("output_") else None
        kind = _TYPES.get(spec.kind, "str | Path") + (" | None" if left_out is None else "")
        default = inspect.Parameter.empty if left_out is MISSING else left_out
        arguments.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind))
    reporter = inspect.Parameter("reporter", inspect.Parameter.KEYWORD_ONLY, default=None, annotation="Reporter | None")
    return inspect.Signature([*arguments, reporter], return_annotation="Result")


def _doc(summary: str, text: str, params: list[tuple[str, Param, Any]], outputs: dict[str, str]) -> str:
    """A docstring in the form of the others, of what is declared once for all faces."""

    def line(name: str, spec: Param) -> str:
        choices = f" One of {', '.join(spec.choices)}." if spec.choices else ""
        if spec.record:
            choices = f" Keys: {', '.join(key for key, _, _ in params_of(spec.record))}."
        return f"    {name}: {spec.help.rstrip('.')}{f', {spec.unit}' if spec.unit else ''}.{choices}"

    lines = [summary, "", text, "", "Args:", *(line(name, spec) for name, spec, _ in params)]
    lines += [
        "    reporter: where progress, warnings and results go; ``None`` = warnings only, as Python's.",
        "",
        "Returns:",
    ]
    lines += [f"    {key}: {meaning}." for key, meaning in outputs.items()]
    lines += [
        "",
        "Raises:",
        "    TreeDGSError: one sentence with the file, what was found, what was expected, what to do.",
    ]
    return _python_words("\n".join(lines), "``")
