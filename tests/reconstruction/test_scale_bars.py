"""Known lengths scale a block by what they are worth; photos that were held level say where up is."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_flight import Listening
from synthetic_block import CAMERA, block_of, known_of, ring

from treedgs_geo.geotags.control import ScaleBars
from treedgs_geo.reconstruction.adjustment import adjust
from treedgs_geo.reconstruction.checks import _check_bars
from treedgs_geo.reconstruction.control import bar_lengths
from treedgs_geo.reconstruction.covariance import posterior_of
from treedgs_geo.reconstruction.georeference import Placement, _levelled, _matches_met, _Model, level_as_held
from treedgs_geo.reconstruction.incremental_block import Joined, _scaled_to_bars, leave_out_apart
from treedgs_geo.reconstruction.poses import rotation_angle_deg, rotation_from_gimbal

FREE = frozenset({"focal"})


def _with_bars(rng: np.random.Generator, tag_sd_m: float, times: float):
    """A block scaled by ``times``, its geotags too, and three true lengths of 6 m whose marks err by 0.5 px."""
    views, points = ring(), rng.uniform([-15, -15, 0], [15, 15, 6], (150, 3))
    block = block_of(views, points, 0.3, rng)
    ways = rng.normal(size=(3, 3))
    first = rng.uniform([-8, -8, 0], [8, 8, 2], (3, 3))
    ends = np.stack([first, first + 6.0 * ways / np.linalg.norm(ways, axis=1, keepdims=True)], axis=1).reshape(-1, 3)
    rows = [(end, i, *view.project(ends[end][None])[0][0]) for end in range(6) for i, view in enumerate(views)]
    point, photo = np.array([row[:2] for row in rows], int).T
    pixels = np.array([row[2:] for row in rows]) + rng.normal(0, 0.5, (len(rows), 2))
    centres = np.array([view.centre for view in views])
    block.points *= times
    block.translations *= times
    known = known_of(times * centres + rng.normal(0, 0.1 * tag_sd_m, centres.shape), tag_sd_m)
    return block, replace(known, bars=ScaleBars(["A", "B", "C"], np.full(3, 6.0), point, photo, pixels))


def _checked(block, adjusted, known) -> tuple[float, list[dict], list[str]]:
    joined, told = Joined(block, adjusted, known, FREE, False, block.is_posed, 0, 0), list[str]()
    return *_check_bars(joined, posterior_of(adjusted).scale, told), told


def test_lengths_give_the_scale_where_geotags_hardly_do_and_little_where_these_are_precise() -> None:
    for sd_m, times, left in ((3.0, 1.05, 0.003), (0.01, 1.0, 0.001)):
        block, known = _with_bars(np.random.default_rng(4), sd_m, times)
        adjusted = adjust(block, known, FREE, final=True)
        before = posterior_of(adjusted).scale
        log, sd = bar_lengths(block, known.bars).scale
        assert abs(log + np.log(times)) < 3 * sd and 0.0005 < sd < 0.004
        adjusted, after = _scaled_to_bars(block, adjusted, known, FREE)
        assert abs(bar_lengths(block, known.bars).scale[0]) < left
        scale, rows, told = _checked(block, adjusted, after)
        assert (before > 0.01) == (sd_m > 1) and scale < min(before, sd) and not told
        assert [row["label"] for row in rows] == ["A", "B", "C"]
        assert [row["block_m"] for row in rows] == pytest.approx([6.0] * 3, rel=0.01)


def test_lengths_that_contradict_the_block_are_said_and_widen_its_scale() -> None:
    block, known = _with_bars(np.random.default_rng(5), 0.01, 1.0)
    adjusted = adjust(block, known, FREE, final=True)
    apart = bar_lengths(block, replace(known.bars, length_m=np.array([6.0, 6.0, 6.6]))).scale[1]
    assert apart > 5 * bar_lengths(block, known.bars).scale[1]  # lengths that disagree are less sure
    known = replace(known, bars=replace(known.bars, length_m=np.full(3, 6.6)))
    same, after = _scaled_to_bars(block, adjusted, known, FREE)
    assert same is adjusted and after is known
    scale, _, told = _checked(block, adjusted, known)
    assert 0.08 < scale < 0.12 and len(told) == 1 and "they are not used" in told[0]


def test_lengths_that_no_two_placed_photos_show_are_not_used() -> None:
    block, known = _with_bars(np.random.default_rng(6), 3.0, 1.05)
    adjusted = adjust(block, known, FREE, final=True)
    known = replace(known, bars=replace(known.bars, photo=np.zeros(len(known.bars.photo), int)))
    same, after = _scaled_to_bars(block, adjusted, known, FREE)
    assert same is adjusted and after is known
    scale, rows, told = _checked(block, adjusted, known)
    assert scale == posterior_of(adjusted).scale and rows[0]["block_m"] is None and "No known length" in told[0]


def test_photos_that_share_nothing_with_the_others_are_left_out_where_geotags_do_not_place_them() -> None:
    rng, names = np.random.default_rng(8), [f"{k}.jpg" for k in range(16)]
    for sd_m, few, left in ((3.0, 3, 3), (0.01, 3, 0), (3.0, 7, 0)):
        block = block_of(ring(16), rng.uniform([-15, -15, 0], [15, 15, 6], (300, 3)), 0.3, rng)
        block.keep((block.image < few) == (block.point % 2 == 0))
        said = Listening()
        assert leave_out_apart(block, known_of(block.centres, sd_m), names, said) == (left > 0)
        assert block.is_posed.tolist() == [k >= left for k in range(16)]
        assert len(said.warnings) == (left > 0) and all("0.jpg, 1.jpg" in each for each in said.warnings)


def test_a_model_whose_photos_lie_where_they_do_not_is_told_by_its_matches() -> None:
    rng, views = np.random.default_rng(9), ring(6)
    block = block_of(views, rng.uniform([-15, -15, 0], [15, 15, 6], (200, 3)), 0.3, rng)
    matches = {}
    for i, j in ((0, 1), (2, 3), (4, 5)):
        own, other = (
            dict(zip(block.point[block.image == k], block.key[block.image == k], strict=True)) for k in (i, j)
        )
        matches[i, j] = np.array([(own[point], other[point]) for point in own.keys() & other.keys()])
    store = SimpleNamespace(keypoints=block.keypoints, matches=matches)
    count = sum(map(len, matches.values()))
    assert _matches_met(store, _Model(np.arange(6), CAMERA, block.rotations, block.centres)) > 0.99 * count
    moved = block.centres + np.where(np.arange(6)[:, None] % 2, rng.normal(0, 15, (6, 3)), 0.0)
    assert _matches_met(store, _Model(np.arange(6), CAMERA, block.rotations, moved)) < 0.5 * count
    # Photos that the model lacks meet nothing.
    three = _Model(np.arange(3), CAMERA, block.rotations[:3], block.centres[:3])
    assert _matches_met(store, three) <= len(matches[0, 1])


@pytest.mark.parametrize("upright", [False, True])
def test_photos_that_were_held_level_level_their_model(upright: bool) -> None:
    rng = np.random.default_rng(7)
    yaw, pitch = rng.uniform(0, 360, 40), rng.normal(5, 10, 40)
    held = np.array([rotation_from_gimbal(y, p, rng.normal(0, 1.0)) for y, p in zip(yaw, pitch, strict=True)])
    stored = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) if upright else np.eye(3)
    leaning = rotation_from_gimbal(0, 12, 7) @ rotation_from_gimbal(0, 0, 0).T
    centres = rng.uniform(-10, 10, (40, 3))
    rotations, moved = _levelled(stored @ held @ leaning.T, centres)
    away = rotations @ (stored @ held).transpose(0, 2, 1)
    # What is left is a turn about the vertical, one for all.
    vertical = np.einsum("nij,j->ni", (stored @ held).transpose(0, 2, 1) @ away @ (stored @ held), [0.0, 0, 1])
    assert np.degrees(np.arccos(np.clip(vertical[:, 2], -1, 1))).max() < 1.0
    np.testing.assert_allclose(np.linalg.norm(moved - moved[0], axis=1), np.linalg.norm(centres - centres[0], axis=1))
    placed = Placement(CAMERA, rotations, np.zeros((40, 3)), np.arange(40) > 3)
    assert np.isfinite(level_as_held(placed)).all(axis=(1, 2)).tolist() == placed.mapped.tolist()
    # Photos held anyhow say nothing of it, nor do those that all look one way.
    anyhow = np.array([rotation_from_gimbal(*each) for each in rng.uniform(-60, 60, (40, 3))])
    one_way = np.array([rotation_from_gimbal(y, 0, 0) for y in rng.normal(0, 5, 40)])
    for odd in (anyhow, one_way):
        assert _levelled(odd, centres)[0] is odd
        assert np.isnan(level_as_held(replace(placed, rotations=odd))).all()
    assert rotation_angle_deg(rotations[0]) >= 0
