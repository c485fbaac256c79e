"""The list of trees that tapes are drawn from; from the settings of ``tape-sample`` to its files."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pyproj

from ...core.crs import project_crs
from ...core.errors import InputError
from ...core.files import atomic_path
from ...core.layer_files import write_layer
from ...core.progress import Reporter
from ...core.shown import count_of
from ...core.tables import write_csv
from ...report.pdf import ensure_pages, write_pages
from ...stems.quality.priors import BREAST_HEIGHT_M
from ..declination import parse_date
from ..double_sampling.designs import draw_trees
from ..double_sampling.tapes import LAYER, read_cells
from ..stand.sample import first_plot, read_sample
from ..stand.treelist import TreeList, measured_trees, on_the_map
from ..stand.values import BA
from .form import make_form, sheets, walk


def mark_of(trees: pd.DataFrame) -> str:
    """Short hash of numbers and diameters: whether a layer is still the one that was drawn from."""
    text = ";".join(f"{row.tree_id}:{row.dbh_cm:.1f}" for row in trees.sort_values("tree_id").itertuples(index=False))
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def read_frame(path: Path, crs: pyproj.CRS | None, plots: Path | None) -> TreeList:
    """Trees of a layer, without those that are dead, with their ``size`` (basal area, m2; of a stem without a DBH the
    median); of the plots only, where ``plots`` or the layer name any.

    Raises:
        InputError: not readable, no tree in any plot. CRSError: no CRS, or no projected one in metres.
    """
    path = Path(path)
    frame = on_the_map(measured_trees(path, crs), path, crs)
    trees = frame.trees
    if plots is not None:
        frame.plots = frame.plots_searched(read_sample(plots, frame.crs), path.name)
        names = np.array([*(plot.plot_id for plot in frame.plots), None], object)
        trees["plot_id"] = names[first_plot(frame.plots, trees[["x", "y"]].to_numpy(float))]
    inside = trees["plot_id"].notna()
    keep = ~trees["dead"].to_numpy(bool) & (inside | (not inside.any() and plots is None)).to_numpy(bool)
    if not keep.any():
        raise InputError(
            f"{path}: none of its {len(trees)} trees is alive and in a plot; check the plots and their epsg."
        )
    n_out, n_dead = int((~inside).sum()) if inside.any() else 0, int(trees["dead"].sum())
    for n, why in ((n_out, "Outside the plots"), (n_dead, "Dead by their status")):
        frame.notes += [f"{why}, and not drawn from: {count_of(n, 'tree')}."] if n else []
    trees = trees[keep].reset_index(drop=True)
    area = BA * trees["dbh_cm"].to_numpy(float) ** 2
    middle = float(np.nanmedian(area)) if np.isfinite(area).any() else 1.0
    frame.trees = trees.assign(size=np.where(np.isfinite(area), area, middle))
    return frame


def sample_tapes(settings: Any, reporter: Reporter) -> dict[str, Any]:
    """settings: ``TapeSampleSettings``. Draw, and write everything for the field.

    Raises:
        InputError: inputs that do not fit, or a folder whose tape table is filled in already.
    """
    folder = Path(settings.output)
    ensure_pages(folder, "tapes.csv", "tapes.gpkg", OWN_LAYERS)
    keep_tapes(folder)
    with reporter.stage("read", 0.0, 0.3):
        frame = read_frame(settings.trees, project_crs(settings.crs) if settings.crs else None, settings.plots)
    assert frame.crs is not None
    reporter.tell(frame.warnings, frame.notes)
    with reporter.stage("draw", 0.3, 0.4):
        draw = draw_trees(
            frame.trees["size"].to_numpy(float), frame.trees["qc_flag"].to_numpy(object), settings.n, settings.seed
        )
    if settings.n > len(frame.trees):
        reporter.warn(f"{settings.n} tapes asked for (--n), {len(frame.trees)} trees are there: all of them are drawn.")
    day = parse_date(settings.field_date, "--field-date").isoformat() if settings.field_date else ""
    trees = walk(frame, draw, settings, day, settings.trees)
    with reporter.stage("write", 0.4, 1.0):
        subtitle = (
            f"{len(trees)} of {len(frame.trees)} trees, stratified by flag and DBH, seed {settings.seed}; "
            f"{frame.crs.name}. Write what you read into tapes.csv or tapes.gpkg, then run tape-check."
        )
        table = tape_table(trees, len(frame.trees), mark_of(frame.trees))
        write_field_files(folder, frame, trees, table, subtitle, settings)
    counts = {str(name): int((draw.stratum == name).sum()) for name in sorted(set(draw.stratum))}
    n_plots = trees["plot_id"].nunique()
    reporter.info(
        f"{count_of(len(trees), 'tree')} of {len(frame.trees)} to tape"
        + (f", in {count_of(n_plots, 'plot')}" if n_plots else "")
        + f" ({', '.join(f'{name}: {count}' for name, count in counts.items())})."
    )
    return {
        "output": str(folder),
        "layer": str(folder / "tapes.gpkg"),
        "table": str(folder / "tapes.csv"),
        "form": str(folder / "tape_form.pdf"),
        "page": str(folder / "tape_form.html"),
        "gpx": str(folder / "tapes.gpx") if (folder / "tapes.gpx").exists() else None,
        "n": len(trees),
        "n_frame": len(frame.trees),
    }


def keep_tapes(folder: Path) -> None:
    """Refuse to write over anything that somebody typed in: a tape, a state, a note, a column or row of his own."""
    for name in ("tapes.gpkg", "tapes.csv"):
        path = folder / name
        if not path.exists() or not path.stat().st_size:
            continue
        table = read_cells(path)
        typed = table[[column for column in table if column not in COLUMNS or column in CREW]].notna().any(axis=1)
        n = int((typed | table["tree_id"].isna() if "tree_id" in table else typed).sum())
        if n:
            raise InputError(
                f"{path}: {count_of(n, 'tree')} of it {'is' if n == 1 else 'are'} filled in; give another folder."
            )


def write_field_files(
    folder: Path, frame: TreeList, trees: pd.DataFrame, table: pd.DataFrame, subtitle: str, settings: Any
) -> None:
    """``tapes.csv``, ``tapes.gpkg``, ``tapes.gpx``, ``tape_form.html`` and ``tape_form.pdf``.

    trees: of :func:`.form.walk`. table: of :func:`tape_table`. settings: with ``trees`` (path) and ``north``.
    """
    (folder / "tapes.gpx").unlink(missing_ok=True)
    write_csv(folder / "tapes.csv", table)
    layer = gpd.GeoDataFrame(table, geometry=gpd.points_from_xy(table["x"], table["y"]), crs=frame.crs)
    write_layer(folder / "tapes.gpkg", OWN_LAYERS, LAYER, layer, "Point")
    title = f"Trees to tape: {settings.trees.stem}"
    write_gpx(folder / "tapes.gpx", table, title)
    heights = frame.trees["bh_m"].dropna()
    breast = float(heights.median()) if len(heights) else BREAST_HEIGHT_M
    form = make_form(title, subtitle, frame, sheets(frame, trees), breast, settings.north)
    write_pages(folder / "tape_form", form)
    assert np.isfinite(table["prob"]).all()


#: Layers of tapes.gpkg, with the columns by which they are known as ours.
OWN_LAYERS = {LAYER: frozenset({"tree_id", "taped_cm", "prob", "stratum"})}
#: Columns, in order; those of the crew come first after the number.
COLUMNS = (
    "walk", "tree_id", "plot_id", "taped_cm", "second_taped_cm", "state", "tape_note", "near_id", "about_cm",
    "qc_flag", "azim_deg", "dist_m", "x", "y", "lon", "lat", "dbh_cm", "stratum", "prob", "n_frame", "design", "frame",
)  # fmt: skip
#: Those that a crew fills in.
CREW = ("taped_cm", "second_taped_cm", "state", "tape_note", "near_id")
_DECIMALS = {"azim_deg": 1, "dist_m": 2, "x": 3, "y": 3, "lon": 7, "lat": 7, "dbh_cm": 2}


def tape_table(trees: pd.DataFrame, n_frame: int, mark: str, design: str = "stratified") -> pd.DataFrame:
    """Columns :data:`COLUMNS`; probabilities keep every digit."""
    nothing = {"taped_cm": np.nan, "second_taped_cm": np.nan, "state": None, "tape_note": None}
    made = trees.assign(**nothing, near_id=pd.array([None] * len(trees), "Int64"))
    made = made.assign(n_frame=n_frame, design=design, frame=mark)[list(COLUMNS)]
    return made.round({name: places for name, places in _DECIMALS.items() if name in made})


def write_gpx(path: Path, table: pd.DataFrame, name: str) -> None:
    """Waypoints (GPX 1.1) in the order of the walk; nothing where the CRS is not tied to the earth.

    Sizes are shown where any is known.
    """
    if table["lon"].isna().any():
        return
    sizes = table["about_cm"].map(lambda size: ", no DBH" if pd.isna(size) else f", about {size:.0f} cm")
    plots = table["plot_id"].map(lambda plot: f", plot {plot}" if pd.notna(plot) else "")
    said = "Tree " + table["tree_id"].astype(str) + plots + (sizes if table["about_cm"].notna().any() else "")
    points = gpd.GeoDataFrame(
        {"name": "T" + table["tree_id"].astype(str), "desc": said},
        geometry=gpd.points_from_xy(table["lon"], table["lat"]),
        crs=4326,
    )
    options = {"CREATOR": "TreeDGS", "METADATA_NAME": name}
    with atomic_path(path) as temporary:
        pyogrio.write_dataframe(points, temporary, driver="GPX", layer="waypoints", dataset_options=options)
