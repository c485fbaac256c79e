"""Charts of trees, each a function of a table: reports show them, and ``import treedgs_geo as tg`` has them.

Every one returns a matplotlib figure, ``figure.savefig("map.png")`` writes it with 300 dots an inch. ax: axes to draw
into instead of a figure of its own. Marks differ in shape as well as in colour.
Where there are plots, trees outside them are pale on the map and left out of the diameters. An argument that cannot be
drawn is an ``InputError``.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ..core.errors import InputError
from ..core.intervals import HALF_WIDTH_SE
from ..report.charts import BLUE, FLAGS, GREY, MARKS, NOTEBOOK_DPI, VERMILION, chart_png, draw_outline, new_chart

if TYPE_CHECKING:
    import geopandas as gpd

#: A stem without a DBH is drawn as one of this many centimetres.
_UNKNOWN_CM = 12.0
#: How opaque trees outside the plots are, as on the map in QGIS.
_PALE = 0.65
#: A map of more trees, or of more ground in metres, has no room for their numbers.
_MAX_LABELS, _LABELLED_M = 60, 120.0
#: Columns that need not be numbers.
_TEXTS = {"tree_id", "qc_flag"}
#: Columns that a notebook shows.
_SHOWN = ("tree_id", "plot_id", "dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "height_m", "qc_flag", "qc_reason")


def draw_map(
    trees: gpd.GeoDataFrame, plots: gpd.GeoDataFrame | None = None, magnify: float = 2.5, ax: Any = None
) -> Any:
    """The map: a circle a tree, ``magnify`` times as wide as the stem, hollow where it has no DBH; north is up.

    Args:
        trees: with the columns ``x, y`` (m), ``dbh_cm``, ``qc_flag``, ``tree_id`` of a tree layer.
        plots: outlines (the layer ``searched`` of the same file), drawn as lines.
        magnify: 1 = true size; stems are small on a map of a plot.
        ax: see the module.

    Raises:
        InputError: a column is missing or holds no numbers.

    Examples:
        >>> import treedgs_geo as tg
        >>> trees = tg.tree_table([tg.Tree(1, 500000.0, 5.2e6, dbh_cm=31.0)], "EPSG:32632")
        >>> tg.draw_map(trees).axes[0].get_ylabel()
        'Northing − 5200000 m'
    """
    from matplotlib.collections import EllipseCollection

    _check_number("magnify", magnify, 0.01, 1000)
    axes = _axes(ax, trees, ("x", "y", "dbh_cm", "qc_flag", "tree_id"), 6.2, 5.6)
    xy = trees[["x", "y"]].to_numpy(float)
    origin = xy.mean(axis=0).round() if len(xy) else np.zeros(2)
    if plots is not None:
        if not hasattr(plots, "geometry"):
            raise InputError(f"plots: found {_said(plots)}, expected the outlines (the layer searched); read them.")
        outlines, crs = plots.geometry.dropna(), getattr(trees, "crs", None)
        for shape in outlines.to_crs(crs) if plots.crs and crs else outlines:
            draw_outline(axes, shape, origin, color=GREY, lw=1)
    known = trees["dbh_cm"].notna().to_numpy()
    across = magnify * trees["dbh_cm"].fillna(_UNKNOWN_CM).to_numpy(float) / 100
    flags, outside = _flags(trees), _outside(trees)
    for flag, (colour, words) in FLAGS.items():
        mine = (flags == flag).to_numpy()
        for part, face, alpha in (
            (mine & known & ~outside, colour, 0.9), (mine & ~known & ~outside, "none", 0.9),
            (mine & known & outside, "white", _PALE), (mine & ~known & outside, "none", _PALE),
        ):  # fmt: skip
            axes.add_collection(
                EllipseCollection(
                    across[part], across[part], np.zeros(part.sum()), units="xy", offsets=xy[part] - origin,
                    offset_transform=axes.transData, facecolor=face, edgecolor=colour, alpha=alpha, zorder=3,
                )
            )  # fmt: skip
        if (mine & ~outside).any():
            face = "none" if flag == "reject" else colour
            axes.scatter([], [], facecolor=face, edgecolor=colour, label=f"{words} ({(mine & ~outside).sum()})")
    if outside.any():
        pale = {"facecolor": "white", "edgecolor": FLAGS["ok"][0], "alpha": _PALE}
        axes.scatter([], [], **pale, label=f"pale: outside the plots ({outside.sum()})")
    if 0 < len(trees) <= _MAX_LABELS and np.ptp(xy, axis=0).max() < _LABELLED_M:
        for number, place, size in zip(trees["tree_id"], xy - origin, across, strict=True):
            axes.annotate(str(number), place + [0.5 * size, 0], (3, 0), textcoords="offset points", fontsize=7)
    axes.update_datalim(xy - origin)
    axes.autoscale_view()
    axes.margins(0.08)
    axes.set(aspect="equal", xlabel=f"Easting − {origin[0]:.0f} m", ylabel=f"Northing − {origin[1]:.0f} m")
    axes.set_title("Circles: the stems" + (f", {magnify:g} times as wide" if magnify != 1 else ""))
    if ax is not None:
        return _finished(axes, loc="best", fontsize=7)
    axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    return axes.figure


def draw_diameters(trees: pd.DataFrame, width_cm: float = 5.0, ax: Any = None) -> Any:
    """Number of stems by DBH class, stacked by flag; refused stems have no DBH and are counted beside it, as are those
    outside the plots.

    trees: with ``dbh_cm`` and ``qc_flag``. width_cm: of a class. ax: see the module.

    Raises:
        InputError: a column is missing or holds no numbers.

    Examples:
        >>> import treedgs_geo as tg
        >>> trees = tg.tree_table([tg.Tree(1, 500000.0, 5.2e6, dbh_cm=31.0)], "EPSG:32632")
        >>> tg.draw_diameters(trees).axes[0].get_title()
        '1 stems with a DBH, 0 without'
    """
    _check_number("width_cm", width_cm, 0.1, 100)
    axes = _axes(ax, trees, ("dbh_cm", "qc_flag"), 8, 3.2)
    outside = _outside(trees)
    trees = trees[~outside]
    measured = trees[trees["dbh_cm"].notna()]
    number = np.floor(measured["dbh_cm"].astype(float) / width_cm + 1e-9).astype(int)
    classes = range(int(number.min()), int(number.max()) + 1) if len(measured) else range(0)
    base = np.zeros(len(classes))
    for flag, (colour, words) in FLAGS.items():
        counts = np.array([int(((number == k) & (_flags(measured) == flag)).sum()) for k in classes])
        if counts.sum():
            lower = [k * width_cm for k in classes]
            axes.bar(lower, counts, width_cm * 0.9, base, align="edge", color=colour, label=words)
            base += counts
    axes.set(xlabel="DBH, cm", ylabel="Stems")
    left_out = f"; {outside.sum()} outside the plots left out" if outside.any() else ""
    axes.set_title(f"{len(measured)} stems with a DBH, {len(trees) - len(measured)} without{left_out}")
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.grid(visible=False, axis="x")
    return _finished(axes)


def draw_scatter(table: pd.DataFrame, field: str = "field_cm", ax: Any = None) -> Any:
    """Measured against field DBH with the 90 % intervals and the line of equality.

    Args:
        table: with ``dbh_cm``, ``qc_flag`` and the field DBH, cm; with ``dbh_lo_cm, dbh_hi_cm`` for the intervals:
            the layer ``pairs`` of ``match-plots``. Rows without either diameter are left out.
        field: column of the field DBH.
        ax: see the module.

    Raises:
        InputError: a column is missing or holds no numbers.

    Examples:
        >>> import pandas as pd
        >>> import treedgs_geo as tg
        >>> pairs = pd.DataFrame({"field_cm": [30.0, 25.0], "dbh_cm": [30.4, None], "qc_flag": ["ok", "reject"]})
        >>> tg.draw_scatter(pairs).axes[0].get_legend_handles_labels()[1]
        ['measured (1)']
    """
    axes = _axes(ax, table, (field, "dbh_cm", "qc_flag"), 5.4, 5.2)
    done = table[table[field].notna() & table["dbh_cm"].notna()]
    draw_by_flag(axes, done, field, "dbh_cm")
    if len(done):
        both = done[[field, "dbh_cm"]].to_numpy(float)
        low, high = max(both.min() - 3, 0), both.max() + 3
        axes.plot([low, high], [low, high], color="black", lw=1, zorder=0)
        axes.set(xlim=(low, high), ylim=(low, high))
    axes.set(aspect="equal", xlabel="Field DBH, cm", ylabel="Measured DBH, cm")
    axes.set_title("Bars: stated 90 % interval")
    return _finished(axes, loc="upper left")


def draw_intervals(trees: pd.DataFrame, field: str | None = None, ax: Any = None) -> Any:
    """Each measured tree's DBH with its 90 % interval, thinnest first; how many intervals hold the field DBH.

    trees: with ``tree_id, dbh_cm, dbh_lo_cm, dbh_hi_cm, qc_flag``. field: column of the field DBH, cm. ax: see the
    module.

    Raises:
        InputError: a column is missing or holds no numbers.

    Examples:
        >>> import treedgs_geo as tg
        >>> tree = tg.Tree(7, 500000.0, 5.2e6, dbh_cm=31.0, dbh_se_cm=0.5)
        >>> figure = tg.draw_intervals(tg.tree_table([tree], "EPSG:32632"))
        >>> [label.get_text() for label in figure.axes[0].get_xticklabels()]
        ['7']
    """
    wanted = ("tree_id", "dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "qc_flag", *([field] if field else []))
    axes = _axes(ax, trees, wanted, 8, 3.6)
    done = trees[trees["dbh_cm"].notna()].sort_values("dbh_cm", kind="stable")
    done = done.assign(place=np.arange(len(done)))
    draw_by_flag(axes, done, "place", "dbh_cm")
    if field is not None:
        known = done[done[field].notna()]
        inside = known[field].between(known["dbh_lo_cm"], known["dbh_hi_cm"]).sum()
        axes.plot(known["place"], known[field], "_", color="black", ms=9, mew=1.6, label=field, zorder=4)
        axes.set_title(f"{inside} of {len(known)} intervals hold {field}")
    step = len(done) // 40 + 1
    axes.set_xticks(done["place"][::step], done["tree_id"].astype(str)[::step], rotation=90 if len(done) > 20 else 0)
    axes.grid(visible=False, axis="x")
    axes.set(xlabel="Tree", ylabel="DBH, cm")
    return _finished(axes)


def draw_stem(sections: pd.DataFrame, tree_id: int, trees: pd.DataFrame | None = None, ax: Any = None) -> Any:
    """The stem curve: diameter over height with 90 % intervals, and the DBH where ``trees`` are given.

    Args:
        sections: the layer ``sections`` of a tree file: ``tree_id, height_m, d_cm, d_se_cm``.
        tree_id: of the stem.
        trees: tree layer of the same run.
        ax: see the module.

    Raises:
        InputError: a column is missing or holds no numbers, or the stem has no sections.

    Examples:
        >>> import pandas as pd
        >>> import treedgs_geo as tg
        >>> curve = pd.DataFrame({"tree_id": 4, "height_m": [1.0, 3.0], "d_cm": [31.0, 29.0], "d_se_cm": [0.4, 0.6]})
        >>> tg.draw_stem(curve, 4).axes[0].get_title()
        'Tree 4; bars: 90 % interval'
    """
    axes = _axes(ax, sections, ("tree_id", "height_m", "d_cm", "d_se_cm"), 4.2, 5.2)
    curve = sections[sections["tree_id"] == tree_id].sort_values("height_m")
    if not len(curve):
        raise InputError(f"Tree {tree_id} has no sections; give the number of one that has.")
    half = HALF_WIDTH_SE * curve["d_se_cm"]
    axes.errorbar(
        curve["d_cm"], curve["height_m"], xerr=half, fmt="o-", ms=4, lw=1, elinewidth=0.8, color=BLUE, label="sections"
    )
    if trees is not None:
        _check_table(trees, ("tree_id", "dbh_cm", "bh_m"))
        tree = trees[trees["tree_id"] == tree_id]
        axes.plot(tree["dbh_cm"], tree["bh_m"], "D", color=VERMILION, ms=7, zorder=4, label="DBH")
    axes.set(xlabel="Diameter, cm", ylabel="Height above the ground, m", title=f"Tree {tree_id}; bars: 90 % interval")
    axes.set_ylim(0, None)
    return _finished(axes)


def draw_heights(trees: pd.DataFrame, ax: Any = None) -> Any:
    """Heights over DBH with their standard errors, and Näslund's curve where there are enough of them.

    trees: with ``dbh_cm, height_m, height_se_m, qc_flag``. ax: see the module.

    Raises:
        InputError: a column is missing or holds no numbers.

    Examples:
        >>> import treedgs_geo as tg
        >>> tree = tg.Tree(7, 500000.0, 5.2e6, dbh_cm=31.0, height_m=24.0)
        >>> tg.draw_heights(tg.tree_table([tree], "EPSG:32632")).axes[0].get_title()
        'No curve: 1 trees with DBH and height, a curve needs 10'
    """
    from .stand.values import fit_curve

    axes = _axes(ax, trees, ("dbh_cm", "height_m", "height_se_m", "qc_flag"), 6.2, 4.2)
    done = trees[trees["dbh_cm"].notna() & trees["height_m"].notna()]
    se = done["height_se_m"].astype(float)
    done = done.assign(low=done["height_m"] - se, high=done["height_m"] + se)
    draw_by_flag(axes, done, "dbh_cm", "height_m", ("low", "high"))
    curve, why = fit_curve(done["dbh_cm"].to_numpy(float), done["height_m"].to_numpy(float))
    if curve is not None:
        across = np.linspace(curve.low_cm, curve.high_cm, 100)
        axes.plot(across, curve(across), color="black", lw=1.2, label=f"{curve.text}, RMSE {curve.rmse_m:.1f} m")
    axes.set_title(f"No curve: {why}" if curve is None else "Bars: standard error")
    axes.set(xlabel="DBH, cm", ylabel="Height, m")
    return _finished(axes, loc="lower right")


def trees_html(title: str, trees: gpd.GeoDataFrame, plots: gpd.GeoDataFrame | None = None) -> str:
    """What a notebook shows of a tree layer: counts, the map, the table."""
    picture = base64.b64encode(chart_png(draw_map(trees, plots), NOTEBOOK_DPI)).decode("ascii")
    found = _flags(trees).value_counts()
    counts = "; ".join(f"{found[flag]} {words}" for flag, (_, words) in FLAGS.items() if flag in found)
    shown = [name for name in _SHOWN if name in trees and trees[name].notna().any()]
    table = trees[shown].to_html(index=False, max_rows=20, na_rep="", float_format="{:.1f}".format, border=0)
    return (
        f"<p><b>{html.escape(title)}</b>: {len(trees)} stems: {counts}</p>"
        f'<img alt="map of the stems" src="data:image/png;base64,{picture}">{table}'
    )


def _axes(ax: Any, table: pd.DataFrame, columns: Sequence[str], width: float, height: float) -> Any:
    _check_table(table, columns)
    if not (ax is None or hasattr(ax, "add_collection")):
        raise InputError(f"ax: found {_said(ax)}, expected axes of matplotlib; give one of them, or leave it out.")
    return new_chart(width, height)[1] if ax is None else ax


def _check_table(table: pd.DataFrame, columns: Sequence[str]) -> None:
    if not isinstance(table, pd.DataFrame):
        raise InputError(f"A chart cannot be drawn of {_said(table)}, expected a table; read the layer by read_trees.")
    if missing := [str(name) for name in columns if not isinstance(name, str) or name not in table]:
        raise InputError(f"The table lacks {', '.join(missing)} for this chart; it has {', '.join(map(str, table))}.")
    for name in set(columns) - _TEXTS:
        values = table[name].dropna().infer_objects()
        if len(values) and not pd.api.types.is_numeric_dtype(values):
            raise InputError(f"Column {name}: holds {values.iloc[0]!r}, expected numbers for this chart; correct it.")


def _check_number(name: str, value: Any, low: float, high: float) -> None:
    if not (isinstance(value, int | float | np.number) and low <= value <= high):
        raise InputError(f"{name}: found {_said(value)}, expected a number from {low:g} to {high:g}; correct it.")


def _said(value: Any) -> str:
    """An argument that is not what it should be."""
    return repr(value) if isinstance(value, str | int | float) else f"a {type(value).__name__}"


def _outside(trees: pd.DataFrame) -> np.ndarray:
    """(N,) bool: in no plot, where there are plots."""
    inside = trees["plot_id"].fillna("").ne("").to_numpy() if "plot_id" in trees else np.zeros(len(trees), bool)
    return ~inside & inside.any()


def _flags(table: pd.DataFrame) -> pd.Series:
    """Another word than ours, or none (a table that a person wrote): to be checked."""
    return table["qc_flag"].where(table["qc_flag"].isin(FLAGS), "check")


def draw_by_flag(
    axes: Any, table: pd.DataFrame, x: str, y: str, ends: tuple[str, str] = ("dbh_lo_cm", "dbh_hi_cm")
) -> None:
    """Values with bars to their ends, where the table has these; marks and colours are those of the flags."""
    for flag, (colour, words) in FLAGS.items():
        mine = table[_flags(table) == flag]
        if not len(mine):
            continue
        bars = None
        if set(ends) <= set(table):
            _check_table(table, ends)
            bars = np.nan_to_num(np.abs(mine[list(ends)].to_numpy(float).T - mine[y].to_numpy(float)))
        axes.errorbar(
            mine[x].to_numpy(float), mine[y].to_numpy(float), yerr=bars, fmt=MARKS[flag], ms=5, color=colour,
            elinewidth=0.9, alpha=0.9, label=f"{words} ({len(mine)})", zorder=3,
        )  # fmt: skip


def _finished(axes: Any, **legend: Any) -> Any:
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False, **legend)
    return axes.figure
