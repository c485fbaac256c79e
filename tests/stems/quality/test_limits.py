"""The table of quality limits: bounds, order of reasons, sources, and the pages written from it."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from clear_fit import CLEAR

from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.stems.photos.quality_control import Evidence, quality_control
from treedgs_geo.stems.quality.findings import TOGETHER, Bound, Findings, Limit
from treedgs_geo.stems.quality.limits import INTERCEPT, LIMITS, PREDICTORS, WRONG_CHECK, WRONG_REJECT, bound_of, judge
from treedgs_geo.stems.quality.methods import METHODS, points_method
from treedgs_geo.stems.quality.reasons import REASONS, explain, split_reasons
from treedgs_geo.stems.quality.tree import Tree

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    "route,quantity,values,dbh_cm",
    [
        # inside, on the limit that flags, beyond it, up to the one that refuses, beyond it
        ("photos", "llr_alone", (61, 60, 59, 52, 51), 30),
        ("photos", "se_cm", (2.9, 3.0, 3.1, 12.5, 12.6), 50),  # 6 % and 25 % of 50 cm
        ("points", "arc_deg", (181, 180, 179, 90, 89), 30),
        ("points", "se_cm", (1.1, 1.2, 1.3, 2.0, 2.1), 20),
        ("points", "ground_se_m", (0.25, 0.3, 0.4, 5.0, 99.0), 30),
    ],
)
def test_values_beyond_a_limit_flag_or_refuse_and_those_on_it_do_not(route, quantity, values, dbh_cm):
    flags = [judge(route, {quantity: value}, dbh_cm).flag(route) for value in values]
    assert flags == ["ok", "ok", "check", "check", "reject"]
    assert judge(route, {quantity: math.nan}, dbh_cm).flag(route) == "ok"


def test_both_routes_refuse_what_is_thicker_than_their_setting_by_the_same_row():
    photos, points = (next(row for row in LIMITS[route] if row.reason == "too_large") for route in ("photos", "points"))
    assert photos is points
    settings = {"min_dbh_cm": 5.0, "max_dbh_cm": 60.0}
    for route in ("photos", "points"):
        assert judge(route, {"dbh_cm": 60.0}, settings=settings).reasons == ()
        assert judge(route, {"dbh_cm": 60.1}, settings=settings).refused == ("too_large",)
    with pytest.raises(KeyError, match="max_dbh_cm"):
        judge("photos", {"dbh_cm": 60.1}, settings={"min_dbh_cm": 5.0})


def test_reasons_come_in_the_order_of_the_table_those_that_refuse_first():
    found = judge("points", {"se_cm": 5.0, "arc_deg": 100.0, "lean_deg": 20.0}, 30.0, {"max_lean_deg": 25.0})
    assert (found.refused, found.flagged) == (("wide_error",), ("short_arc", "lean"))
    assert found.reasons == ("wide_error", "short_arc", "lean") and found.flag("points") == "reject"
    more = judge("photos", {"arc_deg": 50}) + judge("photos", {"through": 0.3})
    assert more.flag("photos") == "check" and Findings().flag("points") == "ok"


def test_the_same_reason_from_two_quantities_counts_once():
    found = judge("points", {"lobes": 0.12, "deep": 0.2, "n_slices": 3})
    assert found.flagged == ("not_round", "few_slices") and found.flag("points") == "check"
    assert judge("points", {"lobes": 0.2, "deep": 0.2}).reasons == ("not_round",)


def test_unknown_quantities_and_reasons_are_refused():
    with pytest.raises(KeyError, match="colour"):
        judge("photos", {"colour": 1.0})
    with pytest.raises(ValueError, match="undocumented qc_reason 'ugly'"):
        Limit("ugly", "x", "x", "", "above", Bound(1.0), None, "nobody")
    with pytest.raises(ValueError, match="neither flags nor refuses"):
        Limit("lean", "x", "x", "", "above", None, None, "nobody")
    with pytest.raises(ValueError, match="no plain number"):
        bound_of("photos", "se_cm", "check")
    with pytest.raises(KeyError):
        bound_of("photos", "twins_share", "reject")
    assert bound_of("photos", "twins", "check") == 15.0


def test_every_row_has_a_source_and_every_flag_its_limit_before_the_one_that_refuses():
    for route, rows in LIMITS.items():
        for row in rows:
            assert row.source and row.measured, (route, row.quantity)
            if row.check and row.reject and not (row.check.setting or row.reject.setting):
                check, reject = row.check.at(30.0), row.reject.at(30.0)
                assert check < reject if row.side == "above" else check > reject, (route, row.quantity)
    # The published method's remark and a person's word follow from no measurement; all others have a limit.
    said = {row.reason for rows in LIMITS.values() for row in rows} | {
        predictor.reason for predictor in PREDICTORS.values()
    }
    assert said == set(REASONS) - {"unchecked", "not_found"}
    assert set(TOGETHER) == set(LIMITS) - {"photos"}  # there a probability adds up


def judged(**change) -> tuple[str, tuple[str, ...], float]:
    """Flag, reasons and probability of a wrong diameter of a clear photo fit with other evidence."""
    return quality_control(Evidence(**CLEAR | {"min_dbh_cm": 7.5} | change))


def test_a_photo_fit_meets_the_table_s_limits():
    assert judged()[:2] == ("ok", ())
    assert judged(lean_deg=27.1)[:2] == ("reject", ("lean",)) and judged(lean_deg=26.9)[0] == "ok"
    assert judged(twins=16.0)[:2] == ("check", ("merged",)) and judged(twins=14.0)[0] == "ok"
    thin_flag, thin_reasons, _ = judged(dbh_cm=5, polish_cm=5)
    assert thin_flag == "reject" and "too_small" in thin_reasons
    # Where no silhouettes are to be had, edges have to do alone; with one, few of them will do.
    assert judged(llr=40.0)[:2] == ("reject", ("few_views",))
    assert judged(llr=41.0, on_bark=0.3)[0] == "ok" and judged(llr=41.0, on_bark=0.2)[0] == "reject"
    assert judged(llr=40.0, contrast=1.2, outline_cm=29.0)[0] == "ok"
    assert judged(llr=45.0, contrast=0.9, outline_cm=29.0)[:2] == ("check", ("few_views",))
    assert judged(arc_deg=39.0, on_bark=0.3)[:2] == ("reject", ("few_views",))
    assert judged(arc_deg=39.0, contrast=1.2, outline_cm=29.0)[:2] == ("check", ("few_views",))


@pytest.mark.parametrize(
    ("name", "amounts"),
    [
        ("photos", ({"kish": 10}, {"kish": 3.5}, {"kish": 0.8})),
        ("residual", ({"rms_px": 0.49}, {"rms_px": 0.55}, {"rms_px": 0.64})),
        ("section", ({"oval": 0.02}, {"oval": 0.11}, {"oval": 0.25})),
    ],
)
def test_a_predictor_flags_and_then_refuses_by_itself_and_is_the_reason(name, amounts):
    seen = [judged(**{"contrast": 2.0, "outline_cm": 29.5} | amount) for amount in amounts]
    assert [flag for flag, *_ in seen] == ["ok", "check", "reject"]
    assert [reasons for _, reasons, _ in seen] == [(), (PREDICTORS[name].reason,), (PREDICTORS[name].reason,)]
    wrong = [wrong for *_, wrong in seen]
    assert wrong[0] < WRONG_CHECK < wrong[1] < WRONG_REJECT < wrong[2]


@pytest.mark.parametrize(
    ("little", "much", "reason"),
    [({"thicker_sd": 2.5}, {"thicker_sd": 9.0}, "merged"), ({"llr": 50.0}, {"llr": 1.0}, "few_views")],
)
def test_far_thicker_than_the_stand_and_with_weak_edges_a_stem_is_refused_only_with_other_signs(little, much, reason):
    there = {"contrast": 2.0, "outline_cm": 29.5}
    assert judged(**there, **little)[0] == "ok" and judged(**there, oval=0.14)[0] == "check"
    assert judged(**there, **much)[0] == "check"
    flag, reasons, _ = judged(**there, **much, oval=0.14)
    assert flag == "reject" and set(reasons) == {"not_round", reason}


def test_predictors_add_up_in_log_odds_and_what_is_not_known_is_none():
    def odds(**change) -> float:
        wrong = judged(contrast=2.0, outline_cm=29.0, **change)[2]
        return float(np.log(wrong / (1 - wrong)))

    assert odds(kish=12) == pytest.approx(INTERCEPT)
    assert odds(kish=6, oval=0.04) - odds(kish=6) == pytest.approx(odds(oval=0.04) - odds())
    assert odds(oval=0.04) - odds() == pytest.approx(PREDICTORS["section"].weight * 0.8)
    # A silhouette of another width and other explanations flag a stem together only.
    silhouettes = [{"outline_cm": 29.0}, {"outline_cm": 36.0}]
    shares = [{"sure": 1.0}, {"sure": 0.5}]
    both = [judged(contrast=2.0, **wide, **share)[:2] for wide, share in zip(silhouettes, shares, strict=True)]
    assert both == [("ok", ()), ("check", ("disagree", "ambiguous"))]
    assert judged(contrast=2.0, **silhouettes[1])[0] == judged(contrast=2.0, outline_cm=29.0, **shares[1])[0] == "ok"
    nothing = Evidence(dbh_cm=30.0, kish=12, llr=100.0)
    assert set(nothing.predictors().values()) == {0.0} and nothing.predictors().keys() == PREDICTORS.keys()


def test_a_reason_is_added_once_and_raises_the_flag_only():
    tree = Tree(1, 0.0, 0.0, dbh_cm=30.0, dbh_se_cm=0.5).finish()
    assert tree.add_reason("edge") is tree and (tree.qc_flag, tree.qc_reason) == ("check", "edge")
    tree.add_reason("merged").add_reason("edge")
    assert tree.reasons == ("edge", "merged") and tree.dbh_cm == 30.0
    tree.add_reason("too_short", "reject")
    assert (tree.qc_flag, tree.dbh_cm, tree.dbh_lo_cm, tree.ba_m2) == ("reject", None, None, None)
    assert tree.add_reason("no_ground").qc_flag == "reject" and tree.reasons[-1] == "no_ground"
    with pytest.raises(ValueError, match="undocumented qc_reason"):
        tree.add_reason("fork")


def test_reasons_are_split_and_explained():
    assert split_reasons("few_views, lean") == ["few_views", "lean"]
    assert split_reasons("") == split_reasons(None) == split_reasons(math.nan) == []
    meaning, action = REASONS["lean"]
    assert explain("lean") == f"{meaning}: {action}" and explain("lean,edge").startswith(f"{meaning}: {action}; ")


def test_methods_are_those_of_the_list():
    choices = MeasureOptions.__dataclass_fields__
    for fit in choices["fit"].metadata["param"].choices:
        for method in choices["method"].metadata["param"].choices:
            for weights in choices["weights"].metadata["param"].choices:
                assert Tree(1, 0, 0, method=points_method(fit, method, weights)).method in METHODS
    with pytest.raises(ValueError, match="undocumented method 'guess'"):
        Tree(1, 0, 0, method="guess")


def test_the_pages_are_those_of_the_table():
    done = subprocess.run(
        [sys.executable, str(ROOT / "tools" / "write_limits.py"), "--check"], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stdout + done.stderr
    page = (ROOT / "docs" / "analyst" / "quality-limits.md").read_text(encoding="utf-8")
    assert "| `too_large` | diameter |  | above `max_dbh_cm` | setting |" in page
    assert (
        Bound(2.5, 0.1).text("cm") == "2.5 cm or 10 % of the DBH, whichever is more" and Bound(27.0).text("°") == "27°"
    )
    assert np.isclose(Bound(2.5, 0.1).at(20.0), 2.5) and np.isclose(Bound(2.5, 0.1).at(30.0), 3.0)
