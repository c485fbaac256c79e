"""Heights from photos that nothing but chance speaks for are not given; those that are state an honest error."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.run.heights import _entry, _trusted
from treedgs_geo.stems.quality.tips import covers, rises, tips_of
from treedgs_geo.stems.quality.tops import HEIGHT_REASONS, Joined

LEVEL = np.log(3.7)
DBH = np.array([20.0, 25.0, 30.0, 35.0])
TIPS = np.column_stack([np.arange(4.0), np.zeros(4), 3.7 * np.sqrt(DBH)])


def joined(scatter=0.05, share=1.0):
    return Joined(np.arange(4), np.full(4, "", object), scatter, share, LEVEL, np.zeros(4))


def test_full_crowns_that_suit_are_kept():
    tops, reasons = _trusted(joined(), TIPS, DBH, np.ones(4))
    assert list(tops) == [0, 1, 2, 3] and not any(reasons)


def test_lonely_tips_and_odd_heights_are_refused_with_a_reason():
    tips = TIPS.copy()
    tips[:, 2] *= [0.88, 1.0, 0.8, 1.0]
    cover = np.array([0.1, 0.9, 0.9, 0.1])
    tops, reasons = _trusted(joined(), tips, DBH, cover)
    # The last one stands alone too, but suits the diameter well.
    assert list(tops) == [-1, 1, -1, 3] and list(reasons) == ["sparse", "", "other_tree", ""]
    assert list(_trusted(joined(0.12), tips, DBH, cover)[1]) == ["sparse", "", "other_tree", "sparse"]
    assert set(reasons) - {""} <= set(HEIGHT_REASONS)


@pytest.mark.parametrize(("changed", "why"), [({"scatter": 0.29}, "sparse"), ({"share": 0.4}, "moving")])
def test_a_plot_whose_heights_scatter_or_move_has_none(changed, why):
    tops, reasons = _trusted(joined(**changed), TIPS, DBH, np.ones(4))
    assert set(tops) == {-1} and set(reasons) == {why}


def test_a_stem_without_a_diameter_keeps_its_top_with_a_wider_error():
    tops, _ = _trusted(joined(), TIPS, np.full(4, np.nan), np.ones(4))
    assert (tops >= 0).all()
    assert _entry(20.0, "", 0.08)["height_se_m"] > 1.5 * _entry(20.0, "", 0.04)["height_se_m"] > 1.0
    assert _entry(np.nan, "sparse", 0.04) == {"height_m": None, "height_se_m": None, "height_why": "sparse"}


def test_covers_and_rises_of_a_crown_beside_a_lonely_cell():
    x, y = np.arange(0, 12, 0.2), np.arange(0, 8, 0.2)
    gx, gy = np.meshgrid(x, y)
    away = np.hypot(gx - 4.0, gy - 4.0)
    height = np.where(away < 1.5, 15 - away, np.nan)
    height[20, 40] = 9.0
    tips = tips_of(x, y, height)
    assert len(tips) == 2 and tips[0] == pytest.approx([4.0, 4.0, 15.0], abs=0.01)
    assert covers(x, y, height, tips) == pytest.approx([1.0, 0.04], abs=0.01)
    assert rises(x, y, height, tips) == pytest.approx([15.0, 9.0], abs=0.01)
    bridge = np.where((np.abs(gy - 4.0) < 0.3) & (gx > 5.0) & (gx < 8.0), 8.0, height)
    bridge[20, 40] = 9.0
    assert rises(x, y, bridge, tips)[1] == pytest.approx(1.0, abs=0.01)
