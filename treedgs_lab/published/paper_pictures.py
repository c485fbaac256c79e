"""Pictures of the paper's kinds from our own data: crops, maps, slices, points of each source."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.scores import pair_by_position
from treedgs_geo.inventory.accuracy.tables import COUNTED
from treedgs_geo.inventory.pairs_layer import PAIRS, read_layer
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.images import load_image
from treedgs_geo.reconstruction.model import load_points, load_views
from treedgs_geo.report.charts import BLUE, GREY, VERMILION, new_chart
from treedgs_geo.stems.quality.priors import BREAST_HEIGHT_M
from treedgs_geo.terrain.dtm import Dtm, read_dtm

from .methods import StemPoints
from .reference import Reference
from .visibility import SeenStem, band_pixels, classify

#: Slice shown of each source, heights above the ground (m); stems shown; half width of crops, px.
SLICE_M, STEMS, HALF_PX = (BREAST_HEIGHT_M - 0.25, BREAST_HEIGHT_M + 0.25), 2, 40
#: Points count for a stem from here to there above the ground and this close to it, m.
STEM_M, NEAR_M = (0.3, 5.0), 0.5


def panels(count: int, columns: int, wide: float, high: float) -> tuple[Any, list[Any]]:
    """A figure with ``count`` axes in rows of ``columns``, each of so many inches."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure, grid = new_chart(wide * columns, high * rows, grid=False, nrows=rows, ncols=columns, squeeze=False)
    for axes in list(grid.flat)[count:]:
        axes.set_visible(False)
    return figure, list(grid.flat)[:count]


def dress(axes: Any, title: str, x: str = "", y: str = "", **more: Any) -> None:
    """A panel's words, small, and figures to match. more: of matplotlib's ``Axes.set``."""
    axes.set(**more)
    axes.set_title(title, fontsize=8)
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.tick_params(labelsize=7)


def scene(plot: PlotFiles) -> tuple[LocalFrame, list[View]]:
    """The registered photos of a plot's workspace."""
    assert plot.workspace_in is not None
    photos = Path(read_json(plot.workspace_in / "run.json")["parameters"]["photos"])
    return load_views(plot.workspace_in / "sfm", photos)


def _paired(plot: PlotFiles, frame: LocalFrame, reference: Reference) -> list[SeenStem]:
    """Trees of the workspace that have a DBH and stand where a reference stem does, in its local frame."""
    assert plot.workspace_in is not None
    trees = read_trees(plot.workspace_in / "trees.gpkg")
    trees = trees[trees["dbh_cm"].notna() & trees["z_ground"].notna()].reset_index(drop=True)
    local = frame.to_local(trees[["x", "y", "z_ground"]].to_numpy(float))
    pairs = pair_by_position(reference.xy, trees[["x", "y"]].to_numpy(float))
    return [SeenStem(*map(float, (*local[j], trees["dbh_cm"][j] / 100))) for _, j in pairs]


def draw_layout(references: list[Reference]) -> Any:
    """Reference stems of each plot from above, circles as wide as the DBH times ten."""
    plots = [(name, ref, ref.plot == name) for ref in references for name in dict.fromkeys(ref.plot)]
    figure, grid = panels(len(plots), 4, 3.0, 3.0)
    for axes, (name, ref, here) in zip(grid, plots, strict=True):
        xy = ref.xy[here] - ref.xy[here].mean(axis=0)
        for place, dbh in zip(xy, ref.dbh_cm[here], strict=True):
            axes.add_patch(ring(place, dbh / 20, color=BLUE, alpha=0.6))
        dress(axes, f"{name}: {int(here.sum())} stems", aspect="equal", **_about(xy))
    figure.supxlabel("metres east, of the stems' mean; diameters ten times", fontsize=8)
    return figure


def ring(middle: Any, radius: float, **look: Any) -> Any:
    """A circle to add to a panel."""
    from matplotlib.patches import Circle

    return Circle(middle, radius, **look)


def _about(xy: np.ndarray) -> dict[str, Any]:
    """Limits of a square about the origin that holds the points with a margin."""
    reach = float(np.abs(xy).max()) + 1.5
    return {"xlim": (-reach, reach), "ylim": (-reach, reach)}


def draw_flight(plots: list[PlotFiles]) -> Any:
    """Camera positions from above and from the side, a row a plot, a colour a flight."""
    figure, grid = panels(2 * len(plots), 2, 4.2, 3.6)
    for plot, above, beside in zip(plots, grid[::2], grid[1::2], strict=True):
        _, views = scene(plot)
        at = np.array([view.centre for view in views])
        flight = np.array([str(view.flight) for view in views])
        for name, colour in zip(sorted(set(flight)), (BLUE, VERMILION, GREY, "black") * 9, strict=False):
            own = flight == name
            above.plot(at[own, 0], at[own, 1], ".", color=colour, label=f"flight {name}: {int(own.sum())} photos")
            beside.plot(at[own, 0], at[own, 2], ".", color=colour)
        above.set_aspect("equal")
        above.legend(fontsize=7)
        dress(above, f"{plot.name}, from above", "east, m (local)", "north, m (local)")
        dress(beside, f"{plot.name}, from the south", "east, m (local)", "height, m (local)")
    return figure


def draw_pixels(plot: PlotFiles, reference: Reference) -> Any | None:
    """Breast height of the stem of middle width, pixel by pixel: the free photos that show it widest to narrowest."""
    frame, views = scene(plot)
    stems = _paired(plot, frame, reference)
    if not stems:
        return None
    stem = sorted(stems, key=lambda own: own.dbh_m)[len(stems) // 2]
    seen = classify(views, [stem])
    seen = seen[seen["free"].astype(bool)].sort_values("width_px", ascending=False)
    if not len(seen):
        return None
    rows = seen.iloc[np.unique(np.linspace(0, len(seen) - 1, 3).astype(int))]
    return _crops([*rows.itertuples()], 3, views, stem, lambda row: f"{row.image}\n{row.width_px:.1f} px across")


def _crops(rows: list[Any], columns: int, views: list[View], stem: SeenStem, title: Callable[[Any], str]) -> Any:
    """The stem's band in the photo of each row of :func:`classify`."""
    of_name = {view.name: view for view in views}
    figure, grid = panels(len(rows), columns, 2.8, 3.0)
    for axes, row in zip(grid, rows, strict=True):
        pixels, _ = band_pixels(of_name[row.image], stem)
        assert pixels is not None
        _crop(axes, of_name[row.image], pixels)
        dress(axes, title(row).rpartition("/")[2], xticks=[], yticks=[])
    return figure


def _crop(axes: Any, view: View, pixels: np.ndarray) -> None:
    """The photo round a band of pixels, with the band's box."""
    image = load_image(view)
    x, y = np.round(pixels.mean(axis=0)).astype(int)
    x0, y0 = max(x - HALF_PX, 0), max(y - HALF_PX, 0)
    crop = image[y0 : y + HALF_PX, x0 : x + HALF_PX]
    axes.imshow(crop, interpolation="nearest", extent=(x0, x0 + crop.shape[1], y0 + crop.shape[0], y0))
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    axes.plot(*np.array([low, (high[0], low[1]), high, (low[0], high[1]), low]).T, color="red", lw=0.9)


def matched(plot: PlotFiles, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
    """(K, 2) reference and (K, 2) measured stems that belong together, project coordinates."""
    if plot.pairs is not None:
        pairs = read_layer(plot.pairs, PAIRS)
        pairs = pairs[pairs["pair_status"].isin(COUNTED)]
        lines = [geometry if geometry.geom_type == "LineString" else geometry.geoms[0] for geometry in pairs.geometry]
        ends = np.array([[line.coords[0][:2], line.coords[-1][:2]] for line in lines], float).reshape(-1, 2, 2)
        return ends[:, 0], ends[:, 1]
    assert plot.trees is not None
    trees = read_trees(plot.trees)
    place = trees.loc[trees["dbh_cm"].notna(), ["x", "y"]].to_numpy(float)
    found = pair_by_position(reference.xy, place)
    return reference.xy[found[:, 0]], place[found[:, 1]]


def draw_matching(
    plots: list[PlotFiles], references: list[Reference], pairs: list[tuple[np.ndarray, np.ndarray]]
) -> Any:
    """All reference stems of each plot, and the measured ones with lines to theirs."""
    figure, grid = panels(len(plots), 3, 3.6, 3.8)
    for axes, plot, reference, (field, measured) in zip(grid, plots, references, pairs, strict=True):
        middle = reference.xy.mean(axis=0)
        for a, b in zip(field - middle, measured - middle, strict=True):
            axes.plot([a[0], b[0]], [a[1], b[1]], color=GREY, lw=0.8)
        axes.plot(*(reference.xy - middle).T, "o", ms=5, mfc="none", color=VERMILION, label="reference")
        axes.plot(*(measured - middle).T, ".", ms=4, color=BLUE, label="measured")
        title = f"{plot.name}: {len(measured)} of {len(reference)} paired"
        dress(axes, title, aspect="equal", **_about(reference.xy - middle))
    grid[0].legend(fontsize=7)
    figure.supxlabel("metres east, of the stems' mean", fontsize=8)
    return figure


def draw_reliability(gathered: dict[str, StemPoints], reference: Reference) -> Any | None:
    """Slices about breast height from above, a row a source, points coloured by their reliability."""
    slices = {name: [_slice(own) for own in stems] for name, stems in gathered.items()}
    fewest = [min((len(own[k][0]) for own in slices.values()), default=0) for k in range(len(reference))]
    stems = [k for k in np.argsort(fewest)[::-1][:STEMS] if fewest[k] >= 3]
    if not stems:
        return None
    figure, grid = panels(len(slices) * len(stems), len(stems), 3.6, 3.2)
    places = [(name, k) for name in slices for k in stems]
    for axes, (name, k) in zip(grid, places, strict=True):
        points, weight = slices[name][k]
        dots = axes.scatter(*(100 * (points - points.mean(axis=0))).T, c=weight, s=4, cmap="viridis", rasterized=True)
        what = "intensity" if name == "lidar" else "opacity"
        dress(axes, f"{_name(reference, k)}, {name}: {what}\n{len(points)} points", "east, cm", aspect="equal")
        figure.colorbar(dots, ax=axes).ax.tick_params(labelsize=7)
    return figure


def _name(reference: Reference, k: int) -> str:
    return f"{reference.plot[k]} {reference.tree[k]}"


def _slice(own: tuple[np.ndarray, np.ndarray] | None) -> tuple[np.ndarray, np.ndarray]:
    points, weight = own or (np.empty((0, 3)), np.empty(0))
    here = (points[:, 2] > SLICE_M[0]) & (points[:, 2] < SLICE_M[1])
    return points[here, :2], weight[here]


def sparse_near(plot: PlotFiles, reference: Reference) -> list[np.ndarray]:
    """SfM points, (N, 3), about each reference stem (:func:`near_stem`); none without workspace."""
    if plot.workspace_in is None:
        return [np.empty((0, 3))] * len(reference)
    frame, _ = scene(plot)
    xyz = frame.to_project(load_points(plot.workspace_in / "sfm"))
    dtm = read_dtm(plot.workspace_in / "dtm.tif", frame.crs)
    return [near_stem(xyz, dtm, xy)[1] for xy in reference.xy]


def near_stem(xyz: np.ndarray, dtm: Dtm, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points (N, 3) within ``NEAR_M`` of a stem and ``STEM_M`` above the ground, and the same as east and north of
    the stem and height above the ground."""
    near = xyz[np.hypot(*(xyz[:, :2] - xy).T) < NEAR_M]
    height = near[:, 2] - dtm.height(near[:, 0], near[:, 1])
    here = (height > STEM_M[0]) & (height < STEM_M[1])
    return near[here], np.column_stack([near[here, :2] - xy, height[here]])


def draw_density(sets: dict[str, list[np.ndarray]], reference: Reference) -> Any:
    """One stem of all sets from the side: the one that most sets have points of, and of these with most in the set that
    has fewest."""
    counts = np.array([[len(own) for own in stems] for stems in sets.values()])
    k = max(range(len(reference)), key=lambda stem: sorted(counts[:, stem] > 0) + sorted(counts[:, stem]))
    figure, grid = panels(len(sets), 4, 2.6, 4.2)
    for axes, (name, stems) in zip(grid, sets.items(), strict=True):
        points = stems[k]
        if len(points):
            axes.plot(points[:, 0] - np.median(points[:, 0]), points[:, 2], ".", ms=1.5, color=BLUE, rasterized=True)
        dress(axes, f"{name}\n{len(points)} points", "east, m", xlim=(-0.8, 0.8), ylim=(0, 8))
    grid[0].set_ylabel(f"height above the ground at {_name(reference, k)}, m", fontsize=8)
    return figure


def draw_bands(plot: PlotFiles, reference: Reference) -> Any | None:
    """Photos of one stem whose breast height is called free (above) and hidden (below)."""
    frame, views = scene(plot)
    stems = _paired(plot, frame, reference)
    best: tuple[int, SeenStem, Any] | None = None
    for stem in stems[:: max(len(stems) // 6, 1)]:
        seen = classify(views, [stem])
        both = min(int(seen["free"].sum()), int((~seen["free"].astype(bool)).sum())) if len(seen) else 0
        if best is None or both > best[0]:
            best = both, stem, seen
    if best is None or best[0] == 0:
        return None
    each, (_, stem, seen) = min(best[0], 4), best
    rows = [row for wanted in (True, False) for row in seen[seen["free"] == wanted].head(each).itertuples()]
    return _crops(rows, each, views, stem, lambda row: f"{'free' if row.free else 'hidden'} ({100 * row.share:.0f} %)")
