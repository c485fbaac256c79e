"""What predictors weigh: set by fits with their truth, and those that the library has are those of the record."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from clear_fit import clear_photo_fit, error_of, with_changes

from treedgs_geo.core.crs import LocalFrame, project_crs
from treedgs_geo.stems.photos.fit_records import KeptFits, write_fits
from treedgs_geo.stems.photos.tuned import ERROR_WEIGHTS
from treedgs_geo.stems.quality.limits import INTERCEPT, PREDICTORS
from treedgs_lab.benchmarks.photos.wrong_diameters import (
    PARTS,
    calibration,
    error_weights,
    fits_of,
    probabilities,
    regression,
    stated,
    strata,
)
from treedgs_lab.benchmarks.records import RESULTS


def drawn(weights: np.ndarray, count: int = 4000) -> pd.DataFrame:
    """Fits whose predictors and diameters are drawn by these weights."""
    rng = np.random.default_rng(3)
    fits = pd.DataFrame(rng.exponential(0.6, (count, len(PREDICTORS))), columns=list(PREDICTORS))
    fits["wrong"] = rng.uniform(size=count) < probabilities(fits, weights)
    fits["error_cm"] = np.where(fits["wrong"], 9.0, 0.5)
    return fits


def test_the_regression_finds_what_each_predictor_weighs_and_none_is_negative():
    true = np.array([-4.0, 2.0, 1.0, 0.5, 1.5, 0.8, 0.6, -1.0])
    found = regression(drawn(true, 40_000))
    assert found[1:-1] == pytest.approx(true[1:-1], abs=0.35) and found[-1] == 0.0


def test_each_bin_holds_as_many_wrong_ones_as_it_should():
    weights = np.array([-4.0, 2.0, 1.0, 0.5, 1.5, 0.8, 0.6, 1.0])
    fits = drawn(weights)
    rows = calibration(fits, probabilities(fits, weights))
    assert sum(row["fits"] for row in rows) == len(fits) and {row["rmse_of_right_cm"] for row in rows} <= {0.5, None}
    for row in rows:
        assert abs(row["wrong"] - row["expected"]) < 3 * np.sqrt(row["expected"]) + 1


def test_error_weights_are_those_under_which_the_errors_were_drawn():
    rng, count = np.random.default_rng(4), 6000
    fits = pd.DataFrame(0.0, index=range(count), columns=PARTS)
    fits["error_scatter"], fits["error_section"] = rng.exponential(0.2, count), rng.uniform(10, 60, count)
    fits[list(PREDICTORS)], spread = 0.0, np.hypot(1.5 * fits["error_scatter"], 0.012 * fits["error_section"])
    fits["error_cm"] = rng.normal(0, spread)
    found = error_weights(fits)
    assert (found["scatter"], found["section"]) == pytest.approx((1.5, 0.012), rel=0.07)
    assert found["formal"] == pytest.approx(ERROR_WEIGHTS["formal"], rel=0.03)  # of which these fits say nothing


def test_strata_count_right_diameters_that_are_given_out():
    off, sd = [0.2, -0.3, 1.0, 0.1], 0.5
    fits = [clear_photo_fit(0.0, 30.0 + error, error=error_of(0.5)) for error in off]
    fits[3] = with_changes(fits[3], flag="reject")
    rows = pd.DataFrame({"fit": fits, "error_cm": off, "wrong": False})
    row, whole = strata(stated(rows, ERROR_WEIGHTS))
    assert (row["stratum"], row["flag"], row["stems"], row["within_067_se"]) == ("clean", "ok", 3, 0.667)
    assert row["median_se_cm"] == pytest.approx(sd, abs=0.02) and row["inside_90"] == 0.667
    assert whole | {"stratum": "clean", "flag": "ok"} == row
    (wide, _) = strata(stated(rows, ERROR_WEIGHTS | {"soft": 2 * ERROR_WEIGHTS["soft"]}))
    assert wide["median_se_cm"] == pytest.approx(2 * sd, abs=0.02) and wide["inside_90"] == 1.0


def test_a_fit_is_wrong_that_is_far_off_or_where_nothing_stands(plot, tmp_path):
    workspace = plot.folder.with_name(f"{plot.folder.name}_ws")
    (workspace / "sfm").mkdir(parents=True)
    # The chain's frame is not the renderer's; all fits stand at y = 2 of theirs.
    LocalFrame(project_crs("EPSG:6344"), np.array([599990.0, 3699998.0, 40.0])).save(workspace / "sfm" / "frame.json")
    near, far, nothing, sapling = (
        clear_photo_fit(x, dbh) for x, dbh in ((10.1, 31.0), (13.0, 24.0), (15.0, 30.0), (7.1, 12.0))
    )
    second = clear_photo_fit(10.2, 40.0, flag="reject", reasons=("few_views",))
    write_fits(workspace / "fits.json", KeptFits([near, far, nothing, sapling, second]))
    rows = fits_of(workspace)
    assert rows["wrong"].tolist() == [False, True, True]  # a second look and a sapling say nothing
    assert rows["error_cm"].tolist() == pytest.approx([1.0, 4.0, np.nan], nan_ok=True)
    assert rows["photos"].tolist() == pytest.approx([np.log(12 / 10)] * 3) and set(rows["plot"]) == {plot.folder.name}
    assert [fit.dbh_cm for fit in rows["fit"]] == [31.0, 24.0, 30.0]


def test_the_library_has_the_weights_of_the_record():
    record = json.loads((RESULTS / "wrong_diameters.json").read_text(encoding="utf-8"))
    assert record["intercept"] == INTERCEPT
    assert record["error_weights"] == ERROR_WEIGHTS
    assert record["weights"] == {name: predictor.weight for name, predictor in PREDICTORS.items()}
