"""stand-table --taped: totals against sums by hand, every table the same numbers, and what is refused."""

import json

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest

from tests.inventory.stand_helpers import Ears, make_survey
from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.reviewed import TAPE_SE_CM
from treedgs_geo.inventory.stand.run import make_report as run
from treedgs_geo.inventory.stand.run import read_stand
from treedgs_geo.inventory.stand.tables import species_class_table, trees_table
from treedgs_geo.inventory.stand.values import BA
from treedgs_geo.inventory.taping.sample import sample_tapes as sample
from treedgs_geo.verbs.stand_table import StandTableSettings
from treedgs_geo.verbs.tape_sample import TapeSampleSettings


@pytest.fixture(scope="module")
def survey(tmp_path_factory):
    return make_survey(tmp_path_factory.mktemp("taped"))


def draw(survey, folder, n=20, **more):
    given = {"trees": survey / "trees.gpkg", "plots": survey / "plots.csv", "n": n, "output": folder, **more}
    sample(TapeSampleSettings(**given), Ears())
    return pd.read_csv(folder / "tapes.csv")


def stand(survey, table, path, **more):
    table.to_csv(path, index=False)
    given = {
        "trees": survey / "trees.gpkg",
        "plots": survey / "plots.csv",
        "species": "PITA",
        "output": path.parent / "o",
        **more,
    }
    return read_stand(StandTableSettings(**given, taped=path), Ears())


def test_all_trees_taped_give_the_tapes_own_sums(survey, tmp_path):
    table = draw(survey, tmp_path / "t", n=1000)
    rng = np.random.default_rng(4)
    table["taped_cm"] = (table["dbh_cm"].fillna(20.0) * rng.uniform(0.8, 1.1, len(table))).round(1)
    gone = table.index[[3, 8]]
    table.loc[gone, "taped_cm"] = np.nan
    table["state"] = table["state"].astype(object)
    table.loc[gone, "state"] = "none"
    extra = pd.DataFrame([{"plot_id": "B", "taped_cm": 33.0}])
    found = stand(survey, pd.concat([table, extra]), tmp_path / "filled.csv")
    area = 4 * np.pi * 11.28**2 / 1e4
    d = np.append(table["taped_cm"].dropna().to_numpy(), 33.0)
    assert found.estimates["trees"].mean == pytest.approx(len(d) / area)
    assert found.estimates["ba"].mean == pytest.approx(BA * (d**2).sum() / area)
    assert found.estimates["qmd"].mean == pytest.approx(np.sqrt((d**2).mean()))
    # What is left is the spread of the plots and the tapes' own error; a bias that all DBHs share is none any more.
    ba = found.estimates["ba"]
    own = np.sqrt(((2 * BA * TAPE_SE_CM * d[:-1]) ** 2).sum()) / area
    assert ba.se_taped == pytest.approx(own, 1e-3) and ba.se == pytest.approx(np.hypot(ba.se_plots, ba.se_taped))
    assert np.isnan(ba.se_common)


def test_one_plot_with_all_its_trees_taped_is_no_certainty(survey, tmp_path):
    table = draw(survey, tmp_path / "t")
    one = table["plot_id"].iloc[0]
    plots = pd.read_csv(survey / "plots.csv", dtype={"plot_id": str})
    plots[plots["plot_id"] == str(one)].to_csv(tmp_path / "plots.csv", index=False)
    table = draw(survey, tmp_path / "one", plots=tmp_path / "plots.csv")
    table["taped_cm"] = table["dbh_cm"].fillna(20.0).round(1)
    found = stand(survey, table, tmp_path / "filled.csv", plots=tmp_path / "plots.csv")
    # How many trees the next plot has nobody knows; basal area has the error of the tapes at least.
    assert np.isnan(found.estimates["trees"].se) and np.isnan(found.estimates["trees"].half_pct)
    assert found.estimates["ba"].se > 0 and found.estimates["qmd"].se > 0
    rows = {row["tree_id"]: row["taped_cm"] for row in trees_table(found, "metric").rows}
    assert rows[str(table["tree_id"].iloc[0])] == pytest.approx(table["taped_cm"].iloc[0])


@pytest.mark.parametrize("missing", ["impute", "exclude"])
def test_every_table_holds_the_corrected_totals(survey, tmp_path, missing):
    table = draw(survey, tmp_path / "t")
    table["taped_cm"] = (0.93 * table["dbh_cm"]).round(1).fillna(14.0)
    found = stand(survey, table, tmp_path / "f.csv", missing=missing)
    assert found.taped is not None
    before, after = found.taped.before, found.estimates
    assert 0.8 < after["ba"].mean / before["ba"].mean < 0.95 and after["ba"].low < after["ba"].mean < after["ba"].high
    sums = species_class_table(found, "metric", None).rows[-1]
    for name, key in (
        ("trees", "trees_ha"),
        ("ba", "ba_m2_ha"),
        ("volume", "volume_m3_ha"),
        ("biomass", "biomass_t_ha"),
    ):
        assert sums[key] == pytest.approx(after[name].mean)
        assert np.average(found.plot_rows[key], weights=found.design.areas) == pytest.approx(after[name].mean)
    whole = np.hypot(after["ba"].se_plots, after["ba"].se_taped)
    assert after["ba"].se == pytest.approx(whole) and after["ba"].df >= 3
    assert any("more tapes would halve" in note for note in found.notes)


def test_the_files_say_it_too(survey, tmp_path):
    table = draw(survey, tmp_path / "t", n=30)
    table["taped_cm"] = (0.95 * table["dbh_cm"]).round(1).fillna(15.0)
    table.to_csv(tmp_path / "f.csv", index=False)
    run(
        StandTableSettings(
            trees=survey / "trees.gpkg", plots=survey / "plots.csv", boundary=survey / "stand.gpkg", species="PITA",
            taped=tmp_path / "f.csv", units="us", output=tmp_path / "out",
        ),
        Ears(),
    )  # fmt: skip
    kept = json.loads((tmp_path / "out" / "summary.json").read_text())
    ba = kept["taped"]["quantities"]["ba"]
    assert ba["corrected"] < ba["measured"] and kept["estimates"]["ba_m2_ha"]["mean"] == pytest.approx(ba["corrected"])
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Corrected by 30 taped trees of" in page and "s.e. of the tapes" in page and "By the tapes" in page
    rows = pd.read_csv(tmp_path / "out" / "stand_corrections.csv").set_index("key")
    row = rows.loc["ba_ft2_ac"]
    assert row["uncorrected"] - row["inflation"] + row["taped"] == pytest.approx(row["corrected"])
    layer = gpd.read_file(tmp_path / "out" / "stand.gpkg", layer="stand_trees")
    assert (layer["tph"] * layer["ba_m2"]).sum() == pytest.approx(ba["corrected"], rel=1e-6)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda t: t.assign(n_frame=50), "stand for 91 trees, expected the 50 that were drawn from"),
        (lambda t: t.drop(columns="prob"), "lacks stratum, prob, n_frame"),
        (
            lambda t: t.assign(taped_cm=t["taped_cm"].where(t["stratum"] != "no DBH")),
            "stratum 'no DBH' no tree was taped",
        ),
    ],
)
def test_what_cannot_correct_is_refused(survey, tmp_path, change, sentence):
    table = draw(survey, tmp_path / "t")
    table["taped_cm"] = table["dbh_cm"].round(1).fillna(15.0)
    with pytest.raises(InputError, match=sentence):
        stand(survey, change(table), tmp_path / "f.csv")


def test_tapes_need_measured_trees(survey, tmp_path):
    settings = StandTableSettings(
        field=survey / "plots.csv", plots=survey / "plots.csv", taped=survey / "plots.csv", output=tmp_path
    )
    with pytest.raises(InputError, match="--taped: corrects measured trees, so it needs --trees"):
        read_stand(settings, Ears())
