"""Expansion and estimates against arithmetic by hand, a plain second computation, and many simulated surveys."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pyproj
import pytest
from scipy import stats
from shapely.geometry import Polygon, box

from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.stand.equations import read_equations
from treedgs_geo.inventory.stand.estimate import ratio
from treedgs_geo.inventory.stand.expansion import expand
from treedgs_geo.inventory.stand.sample import at_the_edge, census, read_sample, weights
from treedgs_geo.inventory.stand.survey import make_stand
from treedgs_geo.inventory.stand.treelist import COLUMNS, TreeList
from treedgs_geo.inventory.stand.units import ACRE_HA, UNITS, make_classes
from treedgs_geo.inventory.stand.unmeasured import NOTHING_KNOWN
from treedgs_geo.inventory.stand.values import ValueOptions

UTM = pyproj.CRS.from_epsg(26917)
BOOK = read_equations()


def tree_list(rows, from_field=False):
    table = pd.DataFrame([{**dict.fromkeys(COLUMNS), "tree_id": k, **row} for k, row in enumerate(rows)])
    for name in ("x", "y", "dbh_cm", "dbh_se_cm", "height_m", "height_se_m", "bh_m"):
        table[name] = pd.to_numeric(table[name]).astype(float)
    table["dead"] = table["dead"].eq(True)
    table["qc_flag"] = np.where(table["dbh_cm"].notna(), "ok", "reject")
    return TreeList(table, UTM, from_field)


def test_the_error_of_a_height_counts_in_volume_and_not_in_basal_area(tmp_path):
    plots = plots_file(tmp_path, "plot_id,easting,northing,radius_m\np,500000,3600000,10\n")
    found = {}
    for se in (None, 0.0, 2.0):
        rows = [{"x": 500000, "y": 3600000, "dbh_cm": 30.0, "dbh_se_cm": 0.5, "height_m": 22.0, "height_se_m": se}]
        trees = tree_list([{**row, "species": "PITA"} for row in rows])
        found[se] = stand_of(trees, plots).values
    assert found[None].sd["volume"] == pytest.approx(found[0.0].sd["volume"])
    assert found[2.0].sd["ba"] == pytest.approx(found[0.0].sd["ba"])
    # Volume goes about with the height: 2 m of 22 are 9 %.
    more = np.sqrt(found[2.0].sd["volume"][0] ** 2 - found[0.0].sd["volume"][0] ** 2) / found[0.0].raw["volume"][0]
    assert 0.06 < more < 0.11
    assert found[2.0].value["volume"] == pytest.approx(found[0.0].value["volume"])


def plots_file(tmp_path, text, **more):
    path = tmp_path / "plots.csv"
    path.write_text(text)
    return read_sample(path, UTM, **more)


def stand_of(trees, plots, boundary=None, treatment="impute", min_dbh_cm=0.0, edge="zone", **options):
    expanded = expand(trees, plots, boundary, edge, min_dbh_cm)
    return make_stand(trees, expanded, BOOK, ValueOptions(**{"common_se_cm": 0.0, **options}), treatment)


def test_a_fifth_acre_plot_by_hand(tmp_path):
    """1/5 acre: 5 trees an acre (12.355 a hectare) for each tallied tree; three trees of 10, 12 and 14 inches."""
    plots = plots_file(tmp_path, "plot_id,easting,northing,radius_ft\np,500000,3600000,52.6604\n")
    assert plots[0].area_ha / ACRE_HA == pytest.approx(0.2, rel=1e-5)
    trees = tree_list([{"x": 500000 + k, "y": 3600000, "dbh_cm": 2.54 * d} for k, d in enumerate((10, 12, 14))])
    stand = stand_of(trees, plots)
    us = UNITS["us"]
    assert stand.estimates["trees"].mean == pytest.approx(3 * 12.3553, rel=1e-4)
    assert stand.estimates["trees"].mean * us["trees"].factor == pytest.approx(15.0, rel=1e-4)
    # 0.005454 d^2 ft2 a tree: 0.5454 + 0.7854 + 1.0690 = 2.3998, times 5.
    assert stand.estimates["ba"].mean * us["ba"].factor == pytest.approx(11.999, rel=1e-4)
    assert stand.estimates["qmd"].mean * us["qmd"].factor == pytest.approx(np.sqrt((100 + 144 + 196) / 3), rel=1e-9)
    # One plot: no error of the stand is known, and none is given.
    assert all(np.isnan(stand.estimates[n].low) and np.isnan(stand.estimates[n].se_plots) for n in ("trees", "ba"))
    assert any("One plot" in text for text in stand.warnings)


def test_plot_means_and_t_intervals_by_hand(tmp_path):
    """Plots of 0.01 ha with 2, 4 and 6 trees of 20 cm: 200, 400, 600 a hectare, s = 200, s.e. 115.47, t(2) = 4.303."""
    rows = [
        {"x": 500000 + 100 * p + 0.1 * k, "y": 3600000, "dbh_cm": 20.0, "dbh_se_cm": 0.0}
        for p, n in enumerate((2, 4, 6))
        for k in range(n)
    ]
    text = "plot_id,x,y,width_m,length_m\n" + "".join(f"p{p},{500000 + 100 * p},3600000,10,10\n" for p in range(3))
    stand = stand_of(tree_list(rows), plots_file(tmp_path, text))
    found = stand.estimates["trees"]
    assert [found.mean, found.se_plots, found.df] == pytest.approx([400, 115.470, 2], rel=1e-5)
    assert found.high == pytest.approx(400 + 4.302653 * 115.470, rel=1e-5) and found.low == 0.0
    assert stand.estimates["ba"].mean == pytest.approx(400 * np.pi / 4 * 0.04) and found.half_pct > 100


def test_ratio_of_means_is_the_mean_for_equal_plots():
    y = np.array([3.0, 7.0, 8.0, 1.0])
    mean, se = ratio(y * 0.04, np.full(4, 0.04))
    assert mean == pytest.approx(y.mean()) and se == pytest.approx(stats.sem(y))
    assert np.isnan(ratio(y[:1], y[:1])[1])


def test_everything_at_once_against_a_plain_loop(tmp_path):
    """Unequal plots, dead, refused and thin trees, a tally limit: recomputed tree by tree."""
    rng = np.random.default_rng(5)
    rows = []
    for _ in range(900):
        d = rng.uniform(6, 45)
        kind = rng.random()
        rows.append(
            {
                "x": 500000 + rng.uniform(0, 200),
                "y": 3600000 + rng.uniform(0, 100),
                "dbh_cm": None if kind < 0.1 else d,
                "dbh_se_cm": 0.02 * d,
                "height_m": 1.37 + (d / (1.5 + 0.19 * d)) ** 2,
                "species": "PITA",
                "dead": kind > 0.85,
                "qc_reason": "too_small" if kind < 0.03 else "few_views" if kind < 0.1 else "",
            }
        )
    centres = [(40, 50, 12.0), (100, 50, 8.0), (160, 50, 10.0)]
    text = "plot_id,easting,northing,radius_m\n"
    text += "".join(f"p{k},{500000 + x},{3600000 + y},{r}\n" for k, (x, y, r) in enumerate(centres))
    stand = stand_of(tree_list(rows), plots_file(tmp_path, text), min_dbh_cm=10.0, origin="planted")
    total = np.zeros(4)
    without = 0.0
    area = 0.0
    # A stem lower than seven tenths of the small trees that count is none of the tally.
    counting = [t["height_m"] for t in rows if t["dbh_cm"] is not None and t["dbh_cm"] >= 10 and not t["dead"]]
    small = np.quantile(counting, 0.05)

    def chance(t):
        return (
            min(float(np.clip((t["height_m"] / small - 0.7) / 0.3, 0, 1)), NOTHING_KNOWN)
            if t["qc_reason"] != "too_small"
            else 0.0
        )

    for x, y, r in centres:
        area += np.pi * r * r / 1e4
        inside = [t for t in rows if np.hypot(t["x"] - 500000 - x, t["y"] - 3600000 - y) <= r and not t["dead"]]
        measured = [t for t in inside if t["dbh_cm"] is not None]
        gone = sum(chance(t) for t in inside if t["dbh_cm"] is None)
        for t in measured:
            if t["dbh_cm"] < 10:
                continue
            w, d, s = 1 + gone / len(measured), t["dbh_cm"], t["dbh_se_cm"]
            without += np.pi / 4e4 * (d * d - s * s)

            def volume(d, h=t["height_m"]):
                return 0.00186491 * (d / 2.54) ** 2.137300891 * (h / 0.3048) ** 1.007045365 * 0.3048**3

            r3 = np.sqrt(3) * s
            total += w * np.array(
                [
                    1,
                    np.pi / 4e4 * (d * d - s * s),
                    volume(d) * 4 / 3 - (volume(d - r3) + volume(d + r3)) / 6,
                    d * d - s * s,
                ]
            )
    found = stand.estimates
    assert found["trees"].mean == pytest.approx(total[0] / area)
    assert found["ba"].mean == pytest.approx(total[1] / area) and stand.other["ba"].mean == pytest.approx(
        without / area
    )
    assert found["volume"].mean == pytest.approx(total[2] / area)
    assert found["qmd"].mean == pytest.approx(np.sqrt(total[3] / total[0]))
    assert stand.plot_rows["n_missing"].sum() == len(stand.missing) > 0 and stand.n_thin > 0 and stand.n_left > 0
    assert (stand.dead["weight"].sum() / area) == pytest.approx(stand.dead_per_ha["trees"]) and len(stand.dead)


def test_dbh_error_is_taken_off_and_its_error_is_right(tmp_path):
    """Many measurings of the same trees: the corrected figures are unbiased, the stated errors are the real ones."""
    rng = np.random.default_rng(11)
    true = rng.uniform(12, 40, 60)
    height = 1.37 + (true / (1.5 + 0.19 * true)) ** 2
    plots = plots_file(tmp_path, "plot_id,easting,northing,radius_m\np,500000,3600000,20\n")
    sigma, common = 3.0, 0.5

    def measure(d, **more):
        rows = [
            {"x": 500000, "y": 3600000, "dbh_cm": a, "dbh_se_cm": sigma, "height_m": b, "species": "PITA"}
            for a, b in zip(d, height, strict=True)
        ]
        return stand_of(tree_list(rows), plots, common_se_cm=common, **more)

    truth = measure(true)
    made = [measure(true + rng.normal(0, sigma, 60) + rng.normal(0, common)) for _ in range(150)]
    for name in ("ba", "volume", "biomass"):
        exact = truth.uncorrected[name]
        values = np.array([m.estimates[name].mean for m in made])
        raw = np.mean([m.uncorrected[name] for m in made])
        spread = values.std() / np.sqrt(len(values))
        assert abs(values.mean() - exact) < 3 * spread, name
        assert raw - exact > 3 * spread, name  # without the correction it is plainly too large
        assert np.mean([m.estimates[name].se for m in made]) == pytest.approx(values.std(), rel=0.16), name
        inside = np.mean([m.estimates[name].low <= exact <= m.estimates[name].high for m in made])
        assert 0.9 <= inside <= 0.99, name
    # E[BA] is too large by pi/4 s^2 a tree: exactly what is shown.
    shown = truth.uncorrected["ba"] - truth.estimates["ba"].mean
    assert shown == pytest.approx(np.pi / 4e4 * sigma**2 * truth.estimates["trees"].mean)
    qmd = np.array([m.estimates["qmd"].mean for m in made])
    assert abs(qmd.mean() - np.sqrt(np.mean(true**2))) < 3 * qmd.std() / np.sqrt(len(qmd)) + 0.02
    assert np.mean([m.estimates["qmd"].se for m in made]) == pytest.approx(qmd.std(), rel=0.16)


def test_edge_rules_that_are_unbiased_are_and_the_others_are_not(tmp_path):
    """A pointed stand, trees crowded along its edge; plot centres fall anywhere inside it."""
    rng = np.random.default_rng(7)
    stand = Polygon([(0, 0), (100, 0), (0, 80)])
    xy = rng.uniform(0, 100, (4000, 2))
    xy = xy[xy[:, 0] / 100 + xy[:, 1] / 80 < 1]
    xy = xy[(xy[:, 0] < 8) | (rng.random(len(xy)) < 0.2)]
    truth = len(xy) / (stand.area / 1e4)
    centres = rng.uniform(0, 100, (1600, 2))
    centres = centres[centres[:, 0] / 100 + centres[:, 1] / 80 < 1]
    path = tmp_path / "plots.csv"
    table = pd.DataFrame({"plot_id": range(len(centres)), "x": centres[:, 0], "y": centres[:, 1], "radius_m": 9.0})
    table.to_csv(path, index=False)
    sample = read_sample(path, None)
    off = {}
    for rule in ("zone", "walkthrough", "area", "none"):
        plots, notes = at_the_edge(sample, stand, rule)
        assert len(plots) == len(centres) and "over the stand's edge" in notes[0]
        density = []
        for plot in plots:
            inside = np.hypot(*(xy - [plot.x, plot.y]).T) <= 9.0
            density.append(weights(plot, *xy[inside].T, stand, rule).sum() / plot.weight_area_ha)
        off[rule] = (np.mean(density) - truth) / truth, stats.sem(density) / truth
    assert abs(off["zone"][0]) < 3 * off["zone"][1] < 0.1
    # Pointed corners cost the walkthrough a little; cutting off costs far more.
    assert -0.05 < off["walkthrough"][0] < 3 * off["walkthrough"][1]
    assert off["none"][0] < -0.1


def test_plots_outside_or_unseen_are_left_out_and_reported(tmp_path):
    text = "plot_id,easting,northing,radius_m\nin,500050,3600050,8\nout,500150,3600050,8\nfar,500090,3600090,8\n"
    trees = tree_list([{"x": 500050 + k, "y": 3600050, "dbh_cm": 20.0, "dbh_se_cm": 0.5} for k in range(5)])
    stand = stand_of(trees, plots_file(tmp_path, text), box(500000, 3600000, 500100, 3600100))
    assert [plot.plot_id for plot in stand.plots] == ["in"]
    assert any("out: its centre is outside" in w for w in stand.warnings)
    assert any("far: the nearest measured tree is 54 m away" in w for w in stand.warnings)


def test_an_empty_plot_counts(tmp_path):
    text = "plot_id,easting,northing,radius_m\na,500050,3600050,8\nb,500090,3600050,8\n"
    trees = tree_list([{"x": 500050 + k, "y": 3600050, "dbh_cm": 20.0, "dbh_se_cm": 0.5} for k in range(5)])
    stand = stand_of(trees, plots_file(tmp_path, text))
    assert stand.design.n == 2 and stand.estimates["trees"].mean == pytest.approx(2.5 / (np.pi * 64 / 1e4))
    assert any("b: no tree stands in it" in w for w in stand.warnings)


def test_slope_correction(tmp_path):
    """A circle of 10 m along a slope of 60 % covers cos(30.96 deg) of its area, and is an ellipse on the map."""
    head = "plot_id,easting,northing,radius_m,slope_pct,aspect_deg\n"
    flat = plots_file(tmp_path, head + "p,500000,3600000,10,60,90\n", along="slope")[0]
    cosine = np.cos(np.arctan(0.6))
    assert flat.area_ha == pytest.approx(np.pi * 100 / 1e4 * cosine)
    assert flat.outline.area == pytest.approx(flat.area_ha * 1e4, rel=1e-4)
    # Facing east: short from west to east, full from south to north.
    x, y = np.array([500009.5, 500008.0, 500000.0]), np.array([3600000.0, 3600000.0, 3600009.5])
    assert flat.contains(x, y).tolist() == [False, True, True]
    assert plots_file(tmp_path, head + "p,500000,3600000,10,60,90\n")[0].area_ha == pytest.approx(np.pi / 100)
    with pytest.raises(InputError, match="aspect_deg"):
        plots_file(tmp_path, head + "p,500000,3600000,10,60,\n", along="slope")
    with pytest.raises(InputError, match="no slope_pct"):
        plots_file(tmp_path, head + "p,500000,3600000,10,,90\n", along="slope")


def test_a_turned_rectangle_holds_the_right_trees(tmp_path):
    text = "plot_id,easting,northing,width_m,length_m,azimuth_deg\np,500000,3600000,4,40,90\n"
    plot = plots_file(tmp_path, text)[0]
    assert plot.contains(np.array([500019.0, 500000.0]), np.array([3600000.0, 3600019.0])).tolist() == [True, False]
    assert plot.area_ha == pytest.approx(0.016)


def test_a_census_has_no_sampling_error():
    rows = [{"x": 500000 + k, "y": 3600000.5, "dbh_cm": 20.0, "dbh_se_cm": 1.0} for k in range(50)]
    outline = box(500000, 3600000, 500100, 3600100)
    stand = stand_of(tree_list(rows), [census(outline)], outline, common_se_cm=0.2)
    ba = stand.estimates["ba"]
    assert stand.estimates["trees"].mean == 50.0 and stand.design.census and np.isnan(ba.se_plots)
    assert ba.se_trees == pytest.approx(np.pi / 4e4 * np.sqrt(50 * (4 * 400 + 2)), rel=1e-3)
    assert ba.se_common == pytest.approx(50 * np.pi / 4e4 * 2 * 20 * 0.2) and ba.se > ba.se_common


def test_dominant_and_lorey_height_by_hand(tmp_path):
    """0.05 ha: the 5 thickest of 8 trees stand for 100 a hectare; one more plot of 0.025 ha needs 2.5 trees."""
    plots = plots_file(tmp_path, "plot_id,x,y,width_m,length_m\na,500000,3600000,20,25\nb,500100,3600000,10,25\n")
    rows = [{"x": 500000, "y": 3600000 + 0.1 * k, "dbh_cm": 10 + k, "height_m": 10 + k} for k in range(8)]
    rows += [{"x": 500100, "y": 3600000 + 0.1 * k, "dbh_cm": 20 + k, "height_m": 20 + k} for k in range(4)]
    stand = stand_of(tree_list(rows), plots, heights="measured")
    by_hand = [np.mean([13, 14, 15, 16, 17]), (23 + 22 + 0.5 * 21) / 2.5]
    assert stand.plot_rows["dominant_m"].tolist() == pytest.approx(by_hand)
    assert stand.estimates["dominant"].mean == pytest.approx((2 * by_hand[0] + by_hand[1]) / 3)
    d = np.array([r["dbh_cm"] for r in rows])
    assert stand.estimates["lorey"].mean == pytest.approx(np.sum(d**2 * d) / np.sum(d**2))


def test_what_is_not_known_is_not_given(tmp_path):
    plots = plots_file(tmp_path, "plot_id,easting,northing,radius_m\na,500000,3600000,8\n")
    row = {"x": 500000, "y": 3600000, "dbh_cm": 20.0, "dbh_se_cm": 0.5, "species": "PITA"}
    stand = stand_of(tree_list([{**row, "height_m": 15.0}, row]), plots)
    assert np.isnan(stand.estimates["volume"].mean) and np.isnan(stand.estimates["lorey"].mean)
    assert any("No volume for the stand: 1 tree without a height" in w for w in stand.warnings)
    assert np.isnan(stand.uncorrected["volume"]), "an unknown volume is not 0"
    assert np.isfinite(stand.estimates["biomass"].mean)  # the tree without a height takes the equation of DBH alone
    odd = stand_of(tree_list([{**row, "height_m": 15.0, "species": "XX"}]), plots)
    assert np.isnan(odd.estimates["biomass"].mean) and any("species XX without an equation" in w for w in odd.warnings)
    huge = tree_list([{**row, "dbh_cm": 150.0, "height_m": 40.0}])
    assert any("Extrapolated" in w for w in stand_of(huge, plots).warnings)
    with pytest.raises(InputError, match="No tree with a DBH"):
        stand_of(tree_list([{**row, "dbh_cm": None, "qc_reason": "few_views"}]), plots)


def test_class_limits():
    cm, inch = make_classes("metric", None), make_classes("us", None)
    assert cm.of(np.array([14.999, 15.0, 19.99])).tolist() == [2, 3, 3] and cm.label(3) == "15–20"
    # The 8-inch class is 7.0 to 8.9 inches; 7 inches are 17.78 cm.
    assert inch.of(np.array([17.77, 17.78, 8.99 * 2.54, 9 * 2.54])).tolist() == [3, 4, 4, 5] and inch.label(4) == "8"
    one = make_classes("us", 1.0)
    assert all(one.label(int(one.of(np.array([d * 2.54]))[0])) == str(d) for d in range(1, 60))


def test_loreys_error_is_found_by_leaving_out_plots():
    """By hand for three plots; and larger where the heights of a plot also carry the curve."""
    from types import SimpleNamespace

    from treedgs_geo.inventory.stand.estimate import Design, weighted_height

    ba, height = np.array([0.1, 0.2, 0.4]), np.array([10.0, 14.0, 22.0])
    rows = pd.DataFrame({"plot": [0, 1, 2], "tree": [0, 1, 2], "weight": 1.0})
    values = SimpleNamespace(height=height, value={"ba": ba}, refit=None)
    found = weighted_height(Design(np.full(3, 0.05), False), rows, values)
    left = [np.average(np.delete(height, k), weights=np.delete(ba, k)) for k in range(3)]
    assert found.mean == pytest.approx(np.average(height, weights=ba))
    assert found.se_plots == pytest.approx(np.sqrt(2 / 3 * np.sum((np.array(left) - np.mean(left)) ** 2)))
    # Without a plot the curve would be 3 m lower for every tree of the others.
    asked = []

    def refit(without):
        asked.append(np.flatnonzero(without).tolist())
        return height - 3.0 * without[2]

    values.refit = refit
    assert weighted_height(Design(np.full(3, 0.05), False), rows, values).se_plots > 1.1 * found.se_plots
    assert asked == [[0], [1], [2]]
