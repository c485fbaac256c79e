"""trial on files: sealed, taped, opened; what was changed is refused; the figures are those of evaluate."""

import json

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tests.inventory.stand_helpers import Ears, make_survey
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.settings import build
from treedgs_geo.inventory.trial.result import equivalence
from treedgs_geo.verbs import get_command


def run(verb, ears=None, **given):
    command = get_command(verb)
    return command.run(build(command.settings, given), ears or Ears())


@pytest.fixture
def sealed(tmp_path):
    """A survey of four plots, its layer in the workspace of a run, 40 of its trees sealed and drawn."""
    folder = make_survey(tmp_path)
    stage = {"status": "done", "settings": {"preset": "default"}, "result": {}}
    (folder / "run.json").write_text(json.dumps({"version": "0.2.0", "stages": {"measure": stage}}))
    found = run(
        "trial", trees=folder / "trees.gpkg", plots=folder / "plots.csv", n=40, limit_cm=1, output=folder / "trial"
    )
    assert found["n"] == 40 and len(found["seal"]) == 64
    return folder


def tape(folder, change=None):
    """The table, filled in: 0.3 cm below what was measured, with a spread of 0.5 cm; every third tree twice."""
    table = pd.read_csv(folder / "trial" / "tapes.csv")
    measured = gpd.read_file(folder / "trees.gpkg", layer="trees").set_index("tree_id")["dbh_cm"]
    rng = np.random.default_rng(3)
    dbh = table["tree_id"].map(measured)
    table["taped_cm"] = (dbh - 0.3 + rng.normal(0, 0.5, len(table))).fillna(15.0).round(1)
    table.loc[::3, "second_taped_cm"] = (table["taped_cm"] + rng.normal(0, 0.2, len(table))).round(1)
    table["state"] = table["state"].astype(object)
    path = folder / "filled.csv"
    (table if change is None else change(table)).to_csv(path, index=False)
    return path


def opened(folder, path, **more):
    ears = Ears()
    found = run("trial", ears, taped=path, output=folder / "trial", **more)
    return found, json.loads((folder / "trial" / "bundle.json").read_text()), ears


def test_the_form_shows_no_diameter(sealed):
    trial = sealed / "trial"
    table = gpd.read_file(trial / "tapes.gpkg", layer="tapes")
    assert table[["dbh_cm", "about_cm", "qc_flag"]].isna().all(axis=None) and set(table["stratum"]) == {"all"}
    measured = gpd.read_file(sealed / "trees.gpkg", layer="trees").set_index("tree_id")["dbh_cm"]
    page = (trial / "tape_form.html").read_text(encoding="utf-8")
    record = json.loads((trial / "trial.json").read_text())
    assert record["seal"][:16] in page and "About" not in page and "no DBH" not in page
    cells = {cell.split("</td>")[0] for cell in page.split("<td>")}
    assert not cells & {f"{d:.0f}" for d in measured.dropna() if d > 41}  # 40 are the numbers of the walk
    assert "cm" not in (trial / "tapes.gpx").read_text()


def test_figures_are_those_of_evaluate(sealed):
    path = tape(sealed)
    found, bundle, _ = opened(sealed, path)
    taped = pd.read_csv(path)
    trees = gpd.read_file(sealed / "trees.gpkg", layer="trees").set_index("tree_id")
    places = trees.loc[taped["tree_id"]]
    truth = pd.DataFrame(
        {
            "tree_id": taped["tree_id"], "E_bh": places["x"].to_numpy(), "N_bh": places["y"].to_numpy(),
            "E_base": places["x"].to_numpy(), "N_base": places["y"].to_numpy(), "dbh_cm": taped["taped_cm"],
            "in_plot": True, "n_unoccluded_bh_views": 9,
        }
    )  # fmt: skip
    truth.to_csv(sealed / "truth.csv", index=False)
    trees[trees.index.isin(taped["tree_id"])].reset_index().to_file(sealed / "drawn.gpkg", layer="trees")
    same = run("evaluate", trees=sealed / "drawn.gpkg", truth=sealed / "truth.csv", output=sealed / "evaluation")
    for name in ("n", "n_reference", "success_rate", "rmse_cm", "mae_cm", "me_cm", "coverage_90", "n_false"):
        assert bundle["pooled"][name] == same[name], name
    trial = bundle["trial"]
    assert (
        found["conclusion"] == trial["conclusion"] == "equivalent" and trial["bias_lo_cm"] < 0.3 < trial["bias_hi_cm"]
    )
    twice = (taped["taped_cm"] - taped["second_taped_cm"]).dropna()
    assert trial["n_twice"] == len(twice) == 14
    assert trial["tape_sd_cm"] == pytest.approx(np.sqrt((twice**2).mean() / 2))
    page = (sealed / "trial" / "result" / "evaluation.html").read_text(encoding="utf-8")
    assert "equivalent" in page and "taped twice" in page and "given before" in page


def test_the_bundle_has_numbers_only(sealed):
    _, bundle, _ = opened(sealed, tape(sealed))
    text = json.dumps(bundle)
    assert len(bundle["trees"]) == 40 and {row["plot_id"] for row in bundle["trees"]} == {1, 2, 3, 4}
    names = set(bundle["trees"][0])
    assert names == {"plot_id", "reference_cm", "dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "qc_flag", "second_cm"}
    for secret in ("6113", "37184", "D & ", "trees.gpkg", "EPSG", "tree_id", str(sealed)):
        assert secret not in text


def rewritten(folder, change):
    layer = gpd.read_file(folder / "trees.gpkg", layer="trees")
    change(layer).to_file(folder / "trees.gpkg", layer="trees")


def test_what_was_changed_is_named(sealed):
    path = tape(sealed)
    rewritten(sealed, lambda layer: layer.assign(species="PITA"))
    opened(sealed, path)  # what says nothing of the diameters may be written
    run_json = sealed / "run.json"
    before = run_json.read_text()
    run_json.write_text(before.replace("default", "fast"))
    with pytest.raises(InputError, match=r"run.json: is not as it was sealed: 1 stage changed \(measure\)"):
        opened(sealed, path)
    run_json.write_text(before)
    with pytest.raises(InputError, match="--limit-cm: 2, but .* was sealed with 1"):
        opened(sealed, path, limit_cm=2)
    record = sealed / "trial" / "trial.json"
    before = record.read_text()
    record.write_text(before.replace('"limit_cm": 1.0', '"limit_cm": 3.0'))
    with pytest.raises(InputError, match=r"changed after it was sealed \(limit_cm\)"):
        opened(sealed, path)
    record.write_text(before)

    def change(layer):
        layer.loc[7, "dbh_cm"] += 0.1
        return layer.drop(index=9)

    rewritten(sealed, change)
    with pytest.raises(InputError, match=r"1 tree changed \(7\); 1 tree gone \(9\)"):
        opened(sealed, path)


def test_a_trial_is_not_sealed_twice_nor_with_tapes_in_the_layer(sealed):
    more = {"trees": sealed / "trees.gpkg", "limit_cm": 2}
    with pytest.raises(InputError, match="is a sealed trial"):
        run("trial", **more, output=sealed / "trial")
    with pytest.raises(InputError, match="needs both"):
        run("trial", trees=sealed / "trees.gpkg", output=sealed / "other")
    rewritten(sealed, lambda layer: layer.assign(rev_flag=["dbh", *[None] * 599], rev_dbh_cm=[20.0, *[np.nan] * 599]))
    with pytest.raises(InputError, match="holds 1 taped diameter"):
        run("trial", **more, output=sealed / "other")


def test_trees_that_were_not_taped_not_there_or_not_on_the_map(sealed):
    def change(table):
        table.loc[table.index[:3], ["taped_cm", "second_taped_cm"]] = np.nan
        table.loc[table.index[0], "state"] = "none"
        missed = pd.DataFrame([{"plot_id": "A", "taped_cm": 22.0}])
        return pd.concat([table, missed])

    path = tape(sealed)
    whole = opened(sealed, path)[1]
    _, bundle, ears = opened(sealed, tape(sealed, change))
    assert bundle["pooled"]["n_reference"] == 37 and any("do not count" in note for note in ears.infos)
    assert bundle["pooled"]["n"] < whole["pooled"]["n"]
    assert any("Not taped: 2 drawn trees" in w for w in ears.warnings)
    assert any("opened before" in w for w in ears.warnings) and bundle["trial"]["n_openings"] == 2
    stranger = tape(
        sealed, lambda table: table.assign(tree_id=table["tree_id"].replace(table["tree_id"].iloc[0], 9999))
    )
    with pytest.raises(InputError, match="tree 9999 was not drawn"):
        opened(sealed, stranger)
    slipped = tape(sealed, lambda table: table.assign(taped_cm=table["taped_cm"].shift(1), second_taped_cm=np.nan))
    with pytest.raises(InputError, match="slipped"):
        opened(sealed, slipped)
    with pytest.raises(InputError, match="inches"):
        opened(sealed, tape(sealed, lambda table: table.assign(taped_cm=(table["taped_cm"] / 2.54).round(1))))


def test_equivalence_is_two_one_sided_t_tests():
    rng = np.random.default_rng(0)
    error = rng.normal(0.4, 1.0, 30)
    found = equivalence(error, np.full(30, "a"), 1.0)
    upper = stats.ttest_1samp(error, 1.0, alternative="less").pvalue
    lower = stats.ttest_1samp(error, -1.0, alternative="greater").pvalue
    assert found["p"] == pytest.approx(max(upper, lower)) and found["by"] == "tree"
    interval = stats.ttest_1samp(error, 0).confidence_interval(0.9)
    assert (found["bias_lo_cm"], found["bias_hi_cm"]) == pytest.approx(interval)
    # Equal plots: the t test of their means.
    plots = np.repeat(list("abcde"), 6)
    means = error.reshape(5, 6).mean(axis=1)
    found = equivalence(error, plots, 1.0)
    interval = stats.ttest_1samp(means, 0).confidence_interval(0.9)
    assert (found["bias_lo_cm"], found["bias_hi_cm"]) == pytest.approx(interval) and found["n_units"] == 5
    # At the limit one in twenty passes, whatever plots share and however unequal they are.
    for sizes in ([3, 8, 12, 20], [2, 2, 2, 30], [30, 30]):
        unit = np.repeat(np.arange(len(sizes)), sizes)
        shared = rng.normal(0, 0.4, (500, len(sizes)))[:, unit]
        passed = [equivalence(1 + row, unit, 1.0)["conclusion"] for row in shared + rng.normal(0, 0.8, shared.shape)]
        assert passed.count("equivalent") / len(passed) < 0.07
    assert equivalence(error + 5, plots, 1.0)["conclusion"] == "not equivalent"
    assert equivalence(error[:2], plots[:2], 0.1)["conclusion"] == "undecided"
