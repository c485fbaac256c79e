"""Heights from a cloud: the tip that is a stem's own, over sloping ground, among noise and neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.stems.cloud.estimate import heights as module
from treedgs_geo.stems.cloud.estimate.heights import canopy_of_points, tree_heights

BH_M = 1.37
SLOPE = 0.2


def crown(rng, foot, top_m, wide_m, n=4000):
    """Points on a cone of ``wide_m`` radius below ``top_m``, height above the foot's ground."""
    down = rng.uniform(0, 1, n) ** 0.5
    turn = rng.uniform(0, 2 * np.pi, n)
    return np.column_stack(
        [foot[0] + wide_m * down * np.cos(turn), foot[1] + wide_m * down * np.sin(turn), top_m - 0.6 * top_m * down]
    )


@pytest.fixture
def stand():
    """Twelve trees on a slope: points, heights above the ground under each point, and what is true of the trees."""
    rng = np.random.default_rng(5)
    places = np.array([[4.5 * (k % 4), 4.5 * (k // 4)] for k in range(12)]) + rng.uniform(-0.4, 0.4, (12, 2))
    dbh = rng.uniform(18, 45, 12)
    true = 3.7 * np.sqrt(dbh) * np.exp(rng.normal(0, 0.03, 12))
    slopes = rng.normal(0, 0.02, (12, 2))
    parts = []
    for place, slope, height in zip(places, slopes, true, strict=True):
        # The crown stands over the leaning axis's upper end; z counts from the ground at the foot.
        part = crown(rng, place + slope * (height - BH_M), height, 1.6)
        part[:, 2] += SLOPE * place[0]
        parts.append(part)
    floor = np.column_stack([rng.uniform(-3, 17, 20000), rng.uniform(-3, 12, 20000), np.zeros(20000)])
    floor[:, 2] = SLOPE * floor[:, 0]
    xyz = np.vstack([*parts, floor])
    return xyz, places, slopes, dbh, true


def found_in(stand, extra=None, **changed):
    xyz, places, slopes, dbh, _ = stand
    xyz = xyz if extra is None else np.vstack([xyz, extra])
    values = {"places": places, "slopes": slopes, "dbh_cm": dbh} | changed
    z_ground = SLOPE * values["places"][:, 0]
    return tree_heights(xyz, xyz[:, 2] - SLOPE * xyz[:, 0], z_ground=z_ground, bh_m=BH_M, **values)


def test_heights_count_from_the_foot_on_a_slope(stand):
    found = found_in(stand)
    assert found.height_m == pytest.approx(stand[-1], abs=0.4)
    assert (found.se_m == module._TIP_SE_M).all() and not any(found.why)


def test_single_returns_above_the_crowns_are_no_tops(stand):
    rng = np.random.default_rng(1)
    birds = np.column_stack([stand[1], stand[4] + rng.uniform(3, 20, 12) + SLOPE * stand[1][:, 0]])
    assert found_in(stand, birds).height_m == pytest.approx(found_in(stand).height_m)


def test_a_sapling_under_a_crown_has_no_height_and_its_tree_keeps_its_own(stand):
    _, places, slopes, dbh, _ = stand
    under = places[5] + [0.9, 0.2]
    found = found_in(
        stand, places=np.vstack([places, under]), slopes=np.vstack([slopes, slopes[5]]), dbh_cm=np.append(dbh, 6.0)
    )
    assert np.isnan(found.height_m[-1]) and found.why[-1] in ("other_tree", "no_top")
    assert found.height_m[:12] == pytest.approx(found_in(stand).height_m)


def test_a_tip_that_hardly_rises_states_a_wider_error_or_none(stand):
    """A tip 0.4 m above a bridge of branches to a higher crown: the stem below it has it where it suits its diameter,
    with a wider error, and no height where it does not."""
    _, places, slopes, dbh, true = stand
    rng = np.random.default_rng(2)
    axis = places[6] + slopes[6] * (true[6] - BH_M)
    high = 0.55 * true[6]
    along = np.column_stack([rng.uniform(0.9, 2.4, 900), rng.uniform(-0.3, 0.3, 900)])
    bridge = np.column_stack([axis + along, high - 0.4 - rng.uniform(0, 0.1, 900)])
    knob = np.column_stack([axis + [2.4, 0.0] + rng.normal(0, 0.08, (60, 2)), high - rng.uniform(0, 0.1, 60)])
    extra = np.vstack([bridge, knob]) + [0, 0, SLOPE * places[6, 0]]
    where = {"places": np.vstack([places, axis + [2.4, 0.1]]), "slopes": np.vstack([slopes, [0.0, 0.0]])}
    suits = (high / 3.7) ** 2
    found = found_in(stand, extra, dbh_cm=np.append(dbh, suits), **where)
    assert found.height_m[-1] == pytest.approx(high, abs=0.8) and found.se_m[-1] > 2 * module._TIP_SE_M
    found = found_in(stand, extra, dbh_cm=np.append(dbh, 0.6 * suits), **where)
    assert np.isnan(found.height_m[-1]) and found.why[-1] == "other_tree"
    assert found.height_m[:12] == pytest.approx(found_in(stand).height_m)


def test_a_cloud_that_ends_below_the_crowns_gives_none(stand):
    xyz, places, slopes, dbh, _ = stand
    low = xyz[xyz[:, 2] - SLOPE * xyz[:, 0] < 4.0]
    found = found_in((low, places, slopes, dbh, None))
    assert np.isnan(found.height_m).all() and not any(found.why)


def test_pieces_hold_every_tree_once_and_read_the_same(stand, monkeypatch):
    whole = found_in(stand)
    monkeypatch.setattr(module, "_MAX_STEMS", 7)
    assert sorted(np.concatenate(module._pieces(stand[1]))) == list(range(12))
    assert len(module._pieces(stand[1])) == 2
    assert found_in(stand).height_m == pytest.approx(whole.height_m)
    assert module._pieces(np.empty((0, 2))) == []


def test_the_canopy_of_a_thin_cloud_has_wider_cells(stand):
    xyz = stand[0]
    height = xyz[:, 2] - SLOPE * xyz[:, 0]
    box = np.array([-3.0, -3.0, 17.0, 12.0])
    dense, thin = (canopy_of_points(xyz[::step], height[::step].copy(), box) for step in (1, 200))
    assert dense[0][1] - dense[0][0] == pytest.approx(0.2) and thin[0][1] - thin[0][0] > 1.0
    point = dense[3][dense[3] >= 0]
    assert (height[point] == dense[2][dense[3] >= 0]).all()
