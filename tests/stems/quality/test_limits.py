"""The table of quality limits: bounds, order of reasons, sources, and the pages written from it."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.quality_control import Evidence, quality_control
from treedgs_geo.stems.quality.findings import TOGETHER, Bound, Findings, Limit
from treedgs_geo.stems.quality.limits import LIMITS, bound_of, judge
from treedgs_geo.stems.quality.methods import METHODS, points_method
from treedgs_geo.stems.quality.reasons import REASONS, explain, split_reasons
from treedgs_geo.stems.quality.tree import Tree

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    "route,quantity,values,dbh_cm",
    [
        # inside, on the limit that flags, beyond it, up to the one that refuses, beyond it
        ("photos", "sure", (0.91, 0.9, 0.89, 0.5, 0.49), 30),
        ("photos", "n_views", (6, 5, 4, 3, 2), 30),
        ("photos", "outline_off_cm", (2.9, 3.0, 3.1, 5.39, 5.41), 30),  # 10 % and 18 % of 30 cm
        ("photos", "outline_off_cm", (2.4, 2.5, 2.6, 4.0, 4.1), 12),  # the least, cm
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
    more = judge("photos", {"n_views": 4}) + judge("photos", {"sure": 0.8})
    assert more.flag("photos") == "reject" and more.flag("photos", count=1) == "check"
    assert more.quantities == {"n_views", "sure"} and Findings().flag("points") == "ok"


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
        bound_of("photos", "gain", "reject")
    assert bound_of("photos", "gain", "check") == 38.0


def test_every_row_has_a_source_and_every_flag_its_limit_before_the_one_that_refuses():
    for route, rows in LIMITS.items():
        for row in rows:
            assert row.source and row.measured, (route, row.quantity)
            if row.check and row.reject and not (row.check.setting or row.reject.setting):
                check, reject = row.check.at(30.0), row.reject.at(30.0)
                assert check < reject if row.side == "above" else check > reject, (route, row.quantity)
    # The published method's remark and a person's word follow from no measurement; all others have a limit.
    assert {row.reason for rows in LIMITS.values() for row in rows} == set(REASONS) - {"unchecked", "not_found"}
    assert set(TOGETHER) == set(LIMITS)


def test_a_photo_fit_meets_the_table_s_limits():
    clear = dict(
        dbh_cm=30.0,
        polish_cm=30.0,
        r1=-0.0045,
        lean_deg=1.0,
        llr=120.0,
        gap=60.0,
        n_views=12,
        kish=10.0,
        se_cm=0.5,
        rms_px=0.48,
    )
    options = PhotoStemOptions()

    def of(**change):
        return quality_control(Evidence(**clear | change), options)

    assert of() == ("ok", ())
    assert of(lean_deg=27.1) == ("reject", ("lean",)) and of(lean_deg=26.9)[0] == "ok"
    # Ragged edges count where they are weak; a clear silhouette makes up for weak edges.
    assert of(rms_px=0.54, llr=99.0) == ("check", ("occluded",)) and of(rms_px=0.54, llr=101.0)[0] == "ok"
    assert of(rms_px=0.56, llr=99.0)[0] == "reject"
    assert of(llr=40.0) == ("reject", ("few_views",))
    assert of(llr=40.0, contrast=1.2, outline_cm=29.0)[0] == "ok"
    # A section that no stem has is flagged, and with another reason refused.
    assert of(oval=0.06) == ("check", ("not_round",)) and of(oval=0.05)[0] == "ok"
    assert of(oval=0.06, n_views=4) == ("reject", ("few_views", "not_round"))
    # Two independent reasons refuse, in the table's order.
    assert of(gap=8.0, polish_cm=33.0) == ("reject", ("ambiguous", "disagree"))


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
