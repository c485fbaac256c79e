"""Charts of trees: what stands in them, their size on paper, and tables that lack a column."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest
from PIL import Image

import treedgs_geo as tg


@pytest.fixture
def trees():
    rng = np.random.default_rng(1)
    rows = [
        tg.Tree(
            k, 500000 + 3.0 * k, 5.2e6 + k, dbh_cm=20 + 1.5 * k, dbh_se_cm=0.5, height_m=15 + k + rng.normal(0, 0.3)
        )
        for k in range(1, 13)
    ]
    refused = tg.Tree(13, 500010.0, 5200020.0, qc_flag="reject", qc_reason="few_views")
    return tg.tree_table([*rows, refused], "EPSG:32632")


def test_circles_of_the_map_have_the_stems_sizes(trees):
    figure = tg.draw_map(trees, magnify=1)
    widths = np.concatenate([c._widths * 2 for c in figure.axes[0].collections if hasattr(c, "_widths")])
    assert sorted(widths.round(4)) == sorted((trees["dbh_cm"].fillna(12.0) / 100).round(4))
    assert figure.axes[0].get_legend_handles_labels()[1] == ["measured (12)", "seen, no DBH (1)"]


def test_a_chart_is_written_with_300_dots_an_inch_and_shown_in_a_notebook(trees, tmp_path):
    figure = tg.draw_diameters(trees)
    figure.savefig(tmp_path / "d.png")
    with Image.open(tmp_path / "d.png") as image:
        assert image.size == (2400, 960) and round(image.info["dpi"][0]) == 300
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_intervals_are_counted_and_rows_without_a_diameter_left_out(trees):
    field = trees["dbh_cm"] + np.r_[np.zeros(10), 5.0, 5.0, 0]
    figure = tg.draw_intervals(trees.assign(field_cm=field), "field_cm")
    assert figure.axes[0].get_title() == "10 of 12 intervals hold field_cm"
    figure = tg.draw_scatter(trees.assign(field_cm=field.where(trees["tree_id"] > 2)))
    assert figure.axes[0].get_legend_handles_labels()[1] == ["measured (10)"]


def test_a_height_curve_needs_heights(trees):
    (label,) = [text for text in tg.draw_heights(trees).axes[0].get_legend_handles_labels()[1] if "RMSE" in text]
    assert label.startswith("h = 1.37 + (d / (")
    assert tg.draw_heights(trees.head(4)).axes[0].get_title().startswith("No curve: 4 trees")


def test_drawn_into_axes_of_the_user(trees):
    from matplotlib.figure import Figure

    left, right = Figure().subplots(ncols=2)
    assert tg.draw_map(trees, ax=left) is left.figure and tg.draw_heights(trees, ax=right) is left.figure


def test_words_of_a_person_in_place_of_a_flag_are_to_be_checked(trees):
    edited = trees.assign(qc_flag=["fine", None, *trees["qc_flag"][2:]])
    assert tg.draw_map(edited).axes[0].get_legend_handles_labels()[1][1] == "measured, to be checked (2)"


def test_a_table_that_lacks_a_column_is_named(trees):
    with pytest.raises(tg.TreeDGSError, match="lacks height_se_m for this chart"):
        tg.draw_heights(trees.drop(columns="height_se_m"))
    with pytest.raises(tg.TreeDGSError, match="Tree 9 has no sections"):
        tg.draw_stem(pd.DataFrame({"tree_id": [1], "height_m": 1.0, "d_cm": 30.0, "d_se_cm": 0.5}), 9)


def test_trees_outside_the_plots_are_pale_on_the_map_and_not_in_the_distribution(trees):
    some = trees.assign(plot_id=["A"] * 8 + [None] * 5)
    axes = tg.draw_map(some).axes[0]
    assert axes.get_legend_handles_labels()[1] == ["measured (8)", "pale: outside the plots (5)"]
    white = [c for c in axes.collections if hasattr(c, "_widths") and (c.get_facecolor()[:, :3] == 1).all()]
    assert sum(len(c.get_offsets()) for c in white if len(c.get_facecolor())) == 4
    axes = tg.draw_diameters(some).axes[0]
    assert axes.get_title() == "8 stems with a DBH, 0 without; 5 outside the plots left out"
    assert sum(bar.get_height() for bar in axes.patches) == 8
    assert "outside" not in tg.draw_diameters(trees).axes[0].get_title()


@pytest.mark.parametrize(
    ("draw", "arguments", "said"),
    [
        (tg.draw_diameters, {"width_cm": 0}, "width_cm: found 0, expected a number from 0.1 to 100"),
        (tg.draw_diameters, {"trees": "trees.gpkg"}, "drawn of 'trees.gpkg', expected a table"),
        (tg.draw_map, {"magnify": "big"}, "magnify: found 'big', expected a number"),
        (tg.draw_map, {"plots": pd.DataFrame({"x": [1]})}, "plots: found a DataFrame, expected the outlines"),
        (tg.draw_heights, {"ax": 3}, "ax: found 3, expected axes"),
        (tg.draw_intervals, {"field": "qc_reason"}, "Column qc_reason: holds '', expected numbers"),
        (tg.draw_intervals, {"field": 7}, "lacks 7 for this chart"),
    ],
)
def test_wrong_arguments_are_named(trees, draw, arguments, said):
    with pytest.raises(tg.TreeDGSError, match=re.escape(said)):
        draw(**{"trees": trees, **arguments})


def test_a_layer_without_trees_is_drawn(trees):
    none = trees.iloc[:0]
    for draw in (tg.draw_map, tg.draw_diameters, tg.draw_intervals, tg.draw_heights):
        assert draw(none)._repr_png_().startswith(b"\x89PNG")
