"""Stems without a DBH: only what can be a tree of the tally stands in the table; the interval says how sure that is."""

from __future__ import annotations

import json

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from inventory.stand_helpers import CRS, EAST, NORTH, Ears, figures, report

from treedgs_geo.inventory.side_layers import readings_table
from treedgs_geo.inventory.stand.unmeasured import NOTHING_KNOWN
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs import match_plots

AREA_HA = np.pi * 0.1**2


def height(d):
    return 1.37 + (d / (1.5 + 0.19 * d)) ** 2


def stems(seed, n=20):
    """``n`` trees in a circle of 10 m, as drone LiDAR measures them: six points a centimetre of DBH."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < n:
        x, y = rng.uniform(-9.5, 9.5, 2)
        if np.hypot(x, y) > 9.3 or any(np.hypot(x + EAST - t.x, y + NORTH - t.y) < 1.3 for t in found):
            continue
        d = float(rng.uniform(14, 42))
        k = len(found) + 1
        found.append(Tree(k, EAST + x, NORTH + y, dbh_cm=d, dbh_se_cm=0.5, height_m=height(d), n_pts=int(6 * d)))
    return found


def sapling(number, **more):
    """What the LiDAR route says of a sapling of 3.3 cm: refused, some points, the height of twigs above it."""
    values = {"height_m": 7.65, "n_pts": 41, "qc_reason": "wide_error,occluded", **more}
    return Tree(number, EAST + 0.2, NORTH + 0.1, qc_flag="reject", **values)


def survey(folder, trees):
    """The layer and a plots table of one circle of 10 m."""
    write_trees(folder / "trees.gpkg", trees, CRS)
    plot = {"plot_id": "p", "easting": EAST, "northing": NORTH, "epsg": 6344, "radius_m": 10.0}
    pd.DataFrame([plot]).to_csv(folder / "plots.csv", index=False)
    return folder


def true_ba(trees):
    return sum(np.pi / 4e4 * t.dbh_cm**2 for t in trees) / AREA_HA


def test_a_refused_sapling_is_no_mean_tree(tmp_path):
    """Its height says that it is none: it is left out, named, and the interval holds the truth."""
    trees = stems(3)
    stand, ears = figures(survey(tmp_path, [*trees, sapling(99)]), boundary=None)
    ba = stand.estimates["ba"]
    assert ba.mean == pytest.approx(true_ba(trees), rel=0.01) and ba.se_missing == 0
    assert stand.n_left == 1 and len(stand.missing) == 0
    assert any("lower than 70%" in text and "(tree 99)" in text for text in ears.infos)


def test_a_stem_that_may_be_a_sapling_counts_by_its_chance_and_widens_the_interval(tmp_path):
    """Under a crown the height is the crown's: only its few points speak against it."""
    trees = stems(3)
    clear = figures(survey(tmp_path, trees), boundary=None)[0].estimates["ba"]
    stand, ears = figures(survey(tmp_path, [*trees, sapling(99, height_m=19.0)]), boundary=None)
    ba, trees_ha = stand.estimates["ba"], stand.estimates["trees"]
    chance = stand.missing["chance"].item()
    assert 0.1 < chance < 0.9
    assert trees_ha.mean == pytest.approx((20 + chance) / AREA_HA)
    assert clear.mean < ba.mean < clear.mean * 21 / 20
    # Both answers lie in the interval: no tree at all, and a tree like the others.
    assert ba.low < clear.mean and ba.high > clear.mean * 21 / 20
    assert trees_ha.se_missing == pytest.approx(np.sqrt(chance * (1 - chance)) / AREA_HA)
    assert any(f"({chance:.1f} trees in all)" in text for text in ears.warnings)


def refused(number, **more):
    """A stem that photos saw and refused."""
    return Tree(number, EAST + 0.2 * number / 100, NORTH, qc_flag="reject", qc_reason="few_views", **more)


def test_a_refused_stem_counts_as_what_it_was_read(tmp_path):
    """Thin ones as thin trees, by the chance that they are trees; the interval is the figure that is said."""
    trees = stems(3)
    survey(tmp_path, trees)
    alone = figures(tmp_path, boundary=None)[0].estimates["ba"].mean
    for read, others in ((16.0, [t for t in trees if t.dbh_cm < 20]), (38.0, [t for t in trees if t.dbh_cm > 33])):
        rows = [(98, read, 1.0), (99, read, 1.0)]
        write_trees(tmp_path / "trees.gpkg", [*trees, refused(98), refused(99)], CRS, readings=readings_table(rows))
        stand, ears = figures(tmp_path, boundary=None)
        added = (stand.estimates["ba"].mean - alone) * AREA_HA / (2 * NOTHING_KNOWN)
        assert added == pytest.approx(np.pi / 4e4 * read**2, rel=0.25)
        low, high = (np.pi / 4e4 * f([t.dbh_cm for t in others]) ** 2 for f in (min, max))
        assert low < added < high and stand.missing["read_cm"].tolist() == [read, read]
        found = stand.estimates["ba"]
        assert any(f"Basal area {found.low:.2f} to {found.high:.2f} m²/ha" in text for text in ears.warnings)
        assert any("2 of them count as trees of about the diameter that was read" in text for text in ears.warnings)
    # Whether each is a tree: mostly each by itself.
    assert stand.estimates["trees"].se_missing * AREA_HA == pytest.approx(np.sqrt(0.1875 * (2 * 12 + 4) / 13))


def test_dead_trees_by_status_are_no_part_of_it(tmp_path):
    trees = stems(3)
    trees[0].status = "dead"
    write_trees(tmp_path / "trees.gpkg", [*trees, refused(99)], CRS, readings=readings_table([(99, 20.0, 1.0)]))
    plot = {"plot_id": "p", "easting": EAST, "northing": NORTH, "epsg": 6344, "radius_m": 10.0}
    pd.DataFrame([plot]).to_csv(tmp_path / "plots.csv", index=False)
    stand, _ = figures(tmp_path, boundary=None)
    assert len(stand.dead) == 1 and 0 not in set(stand.rows["tree"])


def test_a_hidden_tree_counts_and_its_diameter_is_in_the_interval(tmp_path):
    """As tall and as full of points as the others: nothing but its diameter is unknown."""
    trees = stems(3)
    hidden = Tree(99, EAST, NORTH, qc_flag="reject", qc_reason="merged", height_m=19.0, n_pts=150)
    stand, _ = figures(survey(tmp_path, [*trees, hidden]), boundary=None)
    assert stand.missing["chance"].item() == 1.0
    values = np.array([stand.values.value["ba"][k] for k in range(20)])
    ba = stand.estimates["ba"]
    assert ba.mean == pytest.approx(values.mean() * 21 / AREA_HA)
    assert ba.se_missing == pytest.approx(values.std() / AREA_HA) and ba.se > ba.se_missing
    assert stand.estimates["trees"].se_missing == 0


def test_the_interval_is_as_wide_as_hidden_trees_make_it(tmp_path):
    """Many plots in which known trees are hidden: the errors of basal area and QMD are as large as their s.e. says."""
    ratio_ba, ratio_qmd = [], []
    for seed in range(40):
        trees = stems(seed, 24)
        truth, q = true_ba(trees), np.sqrt(np.mean([t.dbh_cm**2 for t in trees]))
        hidden = [
            Tree(t.tree_id, t.x, t.y, qc_flag="reject", qc_reason="lean", height_m=22.0, n_pts=250) for t in trees[:6]
        ]
        seen = [
            Tree(t.tree_id, t.x, t.y, dbh_cm=t.dbh_cm, dbh_se_cm=0.0, height_m=t.height_m, n_pts=t.n_pts)
            for t in trees[6:]
        ]
        stand, _ = figures(survey(tmp_path, hidden + seen), boundary=None, common_se_cm=0.0)
        ratio_ba.append((stand.estimates["ba"].mean - truth) / stand.estimates["ba"].se)
        ratio_qmd.append((stand.estimates["qmd"].mean - q) / stand.estimates["qmd"].se)
    for ratio in (ratio_ba, ratio_qmd):
        assert 0.75 < np.std(ratio) < 1.4 and abs(np.mean(ratio)) < 0.6


def pair(folder, tally):
    """``match-plots`` with a tally of (tree, status) as the crew measured it."""
    rows = [
        {
            "plot_id": "p",
            "tree_id": t.tree_id,
            "easting": t.x,
            "northing": t.y,
            "dbh_cm": round(d, 1),
            "status": status,
            "species": "PITA",
        }
        for t, d, status in tally
    ]
    pd.DataFrame(rows).to_csv(folder / "field.csv", index=False)
    settings = match_plots.MatchPlotsSettings(
        trees=folder / "trees.gpkg",
        field=folder / "field.csv",
        plots=folder / "plots.csv",
        output=folder / "pairs.gpkg",
    )
    match_plots.run(settings, Ears())
    return {"boundary": None, "pairs": folder / "pairs.gpkg", "field": folder / "field.csv", "species": None}


def test_a_full_tally_says_that_there_is_no_further_tree(tmp_path):
    """Even one that nothing else speaks against."""
    trees = stems(3)
    uncertain = sapling(99, height_m=19.0, n_pts=150)
    survey(tmp_path, [*trees, uncertain])
    more = pair(tmp_path, [(t, t.dbh_cm, "live") for t in trees])
    stand, ears = figures(tmp_path, **more)
    assert len(gpd.read_file(more["pairs"], layer="pairs")) == 20
    assert stand.estimates["ba"].mean == pytest.approx(true_ba(trees), rel=0.01) and stand.n_left == 1
    assert any("tally pairs every tree" in text and "tree 99" in text for text in ears.infos)


def test_a_tally_of_half_the_trees_says_half_as_much(tmp_path):
    trees = stems(3)
    survey(tmp_path, [*trees, sapling(99, height_m=19.0, n_pts=150)])
    stand, _ = figures(tmp_path, **pair(tmp_path, [(t, t.dbh_cm, "live") for t in trees[:10]]))
    # By Bayes: 0.75 / 2 for a tree outside the tally, 0.25 for none.
    assert stand.missing["chance"].item() == pytest.approx(0.375 / 0.625, abs=0.02)
    assert NOTHING_KNOWN == 0.75


def test_a_stem_that_the_crew_measured_takes_their_dbh(tmp_path):
    """Thin or low: the crew walked up to it."""
    trees = stems(3)
    refused = Tree(21, EAST + 0.3, NORTH + 0.3, qc_flag="reject", qc_reason="occluded", height_m=8.0, n_pts=40)
    survey(tmp_path, [*trees, refused])
    more = pair(tmp_path, [*((t, t.dbh_cm, "live") for t in trees), (refused, 24.0, "live")])
    result, ears, out = report(tmp_path, **more)
    truth = true_ba(trees) + np.pi / 4e4 * 24.0**2 / AREA_HA
    assert result["ba_m2_ha"] == pytest.approx(truth, rel=0.01) and result["n_missing"] == 0
    row = pd.read_csv(out / "stand_trees.csv").set_index("tree_id").loc[21]
    assert (row.dbh_cm, row.counts_as, row.note) == (24.0, "measured", "DBH by the field crew")
    assert any("1 stem without a measured DBH has the crew's" in text for text in ears.infos)


def test_summary_and_tables_say_what_it_adds(tmp_path):
    result, _, out = report(survey(tmp_path, [*stems(3), sapling(99, height_m=19.0)]), boundary=None)
    found = json.loads((out / "summary.json").read_text())["estimates"]["ba_m2_ha"]
    assert found["se_missing"] > 0.3 and found["se"] == pytest.approx(
        np.sqrt(found["se_trees"] ** 2 + found["se_common"] ** 2 + found["se_missing"] ** 2)
    )
    table = pd.read_csv(out / "stand_summary.csv").set_index("key")
    assert table.se_missing["ba_m2_ha"] == pytest.approx(found["se_missing"])
    assert "s.e. of stems without a DBH" in (out / "report.html").read_text()


@pytest.mark.parametrize("odd", [{"n_pts": 0}, {"height_m": 0.0}, {"height_m": None, "n_pts": None}])
def test_odd_evidence_counts_as_none(tmp_path, odd):
    stand, _ = figures(
        survey(tmp_path, [*stems(3), sapling(99, **{"height_m": None, "n_pts": None, **odd})]), boundary=None
    )
    assert stand.missing["chance"].item() == pytest.approx(
        NOTHING_KNOWN if "n_pts" not in odd or odd["n_pts"] is None else 0.1, abs=1e-6
    )


def test_a_stem_read_as_thin_but_badly_seen_may_be_a_thin_tree(tmp_path):
    """``too_small`` alone is certain; beside other reasons the reading itself is unsure."""
    trees = stems(3)
    alone = Tree(98, EAST + 2.0, NORTH, qc_flag="reject", qc_reason="too_small")
    unsure = Tree(99, EAST + 0.5, NORTH, qc_flag="reject", qc_reason="too_small,occluded,wide_error")
    stand, ears = figures(survey(tmp_path, [*trees, alone, unsure]), boundary=None)
    assert stand.n_thin == 1 and any("(tree 98)" in text for text in ears.infos)
    assert stand.trees["tree_id"][stand.missing["tree"].item()] == 99
    assert stand.missing["chance"].item() == pytest.approx(0.5 * NOTHING_KNOWN)
    assert any("(1 read as thin: of the thinnest quarter)" in text for text in ears.warnings)
    added = (stand.estimates["ba"].mean - stand.other["ba"].mean) * AREA_HA
    assert 0 < added / stand.missing["chance"].item() < np.pi / 4e4 * np.quantile([t.dbh_cm for t in trees], 0.25) ** 2


def test_what_is_written_in_the_layer_counts_before_the_crew_s(tmp_path):
    """And where they differ, that is said."""
    trees = stems(3)
    trees[0].species, trees[1].status, trees[2].species = "ACRU", "live", "Pinus taeda"
    survey(tmp_path, trees)
    more = pair(tmp_path, [(t, t.dbh_cm, "dead" if k == 1 else "live") for k, t in enumerate(trees)])
    stand, ears = figures(tmp_path, **more)
    assert stand.trees["species"].tolist() == ["ACRU", *["PITA"] * 19] and not stand.trees["dead"].any()
    (said,) = [text for text in ears.warnings if "differ on" in text]
    assert "differ on 2 entries (tree 1: ACRU, crew PITA; tree 2: live, crew dead)" in said
