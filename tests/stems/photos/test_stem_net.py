"""The network that tells stems: its maps, what they say of a place, and what it makes of photos it never saw."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import expit

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.fit.null_model import BREAST
from treedgs_geo.stems.photos.images.axis_patches import StemAxis, Strips
from treedgs_geo.stems.photos.images.crops import GroundGrid
from treedgs_geo.stems.photos.network.inference import (
    CLASSES,
    MAX_ODDS,
    OUTSIDE,
    STEM,
    STEPS,
    NetworkMaps,
    OddsMaps,
    class_odds,
    normalised,
    stem_ratios,
)
from treedgs_geo.stems.photos.network.silhouettes import covered_share, cut_bark, stem_layers, weigh_edges
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.propose.network_seeds import network_seeds
from treedgs_geo.stems.photos.tuned import HEIGHTS, MIN_SHARE, MIN_STEP

PLACE, RADIUS = np.array([0.4, -0.3]), 0.15
FLAT = GroundGrid(-6.0, -6.0, 0.5, np.zeros((25, 25), np.float32))


def ring_of_maps(photos: int = 12, seen: int = 12) -> OddsMaps:
    """Maps of cameras all round that see an upright stem at PLACE, or nothing (those from ``seen`` on)."""
    step, maps, grids, centres = 0.0004, [], [], []
    for k in range(photos):
        turn = 2 * np.pi * k / photos
        centre = np.array([45 * np.cos(turn), 45 * np.sin(turn), 60.0])
        azimuth0, nadir0 = turn + np.pi - 0.12, 0.52
        odds = np.full((600, 600), -4.0)
        dx, dy = PLACE - centre[:2]
        swing = (np.arctan2(dy, dx) - azimuth0) % (2 * np.pi)
        half = np.arcsin(RADIUS / np.hypot(dx, dy))
        columns = np.abs(np.arange(600) * step - swing) < half
        if k < seen:
            odds[:, columns] = 4.0
        maps.append(np.round(STEPS * odds).astype(np.int8))
        grids.append((azimuth0, step, nadir0, step))
        centres.append(centre)
    shape = np.array([each.shape for each in maps], np.int64)
    start = np.concatenate([[0], np.cumsum(shape.prod(axis=1))[:-1]]).astype(np.int64)
    flat = np.concatenate([each.ravel() for each in maps])
    return OddsMaps(flat, start, shape, np.array(grids), np.array(centres))


def at(xy: np.ndarray) -> StemAxis:
    return StemAxis(np.asarray(xy, float), np.zeros(2), np.zeros(2), 0.0, 1.37)


def test_evidence_is_highest_where_the_stem_stands():
    cells = GroundGrid(-2.0, -2.0, 0.1, np.zeros((41, 41), np.float32))
    layers = stem_layers(ring_of_maps(), np.zeros((12, 2)), cells, HEIGHTS)
    total = layers.sum(axis=0)
    row, column = np.unravel_index(total.argmax(), total.shape)
    assert np.hypot(column * 0.1 - 2.0 - PLACE[0], row * 0.1 - 2.0 - PLACE[1]) < 0.16
    assert total.max() > 0 > np.median(total)


@pytest.mark.parametrize("radius", [0.05, 0.10, 0.20, 0.30])
def test_the_silhouette_is_clearest_at_the_true_place_and_width(radius):
    outline = cut_bark(ring_of_maps(), at(PLACE), BREAST.silhouette)
    true = outline.contrast(np.array([0.0, 0.0, 0.0, 0.0, RADIUS]))
    assert true > outline.contrast(np.array([0.0, 0.0, 0.0, 0.0, radius]))
    assert true > 2 * outline.contrast(np.array([0.12, 0.0, 0.0, 0.0, RADIUS]))


def test_a_photo_that_shows_nothing_here_is_blind_and_adds_nothing():
    maps = ring_of_maps()
    gone = maps._replace(odds=maps.odds.copy())
    rows, columns = maps.shape[3]
    gone.odds[maps.start[3] : maps.start[3] + rows * columns] = OUTSIDE
    outline = cut_bark(gone, at(PLACE), BREAST.silhouette)
    assert outline.blind[3] and outline.blind.sum() == 1
    cells = GroundGrid(PLACE[0], PLACE[1], 0.1, np.zeros((1, 1), np.float32))
    less, all_of_them = (stem_layers(m, np.zeros((12, 2)), cells, HEIGHTS).sum() for m in (gone, maps))
    assert 0 < less < all_of_them


def test_the_stem_is_a_seed_and_what_no_photo_sees_is_not():
    area, box = Area.circle(0, 0, 2.0), (-2.0, -2.0, 2.0, 2.0)
    options, rng = PhotoStemOptions(max_lean_deg=10), np.random.default_rng(0)
    found = network_seeds(NetworkMaps(*3 * [ring_of_maps()]), FLAT, area, box, options, rng)
    best, again = found.seeds[0], found.beside[0]
    assert best.sure and np.hypot(best.x - PLACE[0], best.y - PLACE[1]) < 0.05
    assert best.r == pytest.approx(RADIUS, abs=0.02)
    assert np.hypot(again.x - PLACE[0], again.y - PLACE[1]) < 0.1 and not again.sure
    nothing = NetworkMaps(*3 * [ring_of_maps(seen=0)])
    assert not any(seed.sure for seed in network_seeds(nothing, FLAT, area, box, options, rng).seeds)


def test_ground_speaks_against_a_stem_and_leaves_say_nothing():
    stem = ring_of_maps().odds.reshape(12, 600, 600)
    ground = -stem
    leaves = (stem < 0) & (np.arange(600) % 3 == 0)
    ground[leaves] = stem[leaves] = -STEPS * 4
    stem[0, 0] = OUTSIDE
    found = np.array(stem_ratios(list(stem), list(ground))) / STEPS
    shown = stem > OUTSIDE
    seen, share = shown & (stem > 0), expit(stem[shown] / STEPS).mean()
    assert found[seen] == pytest.approx(np.log((1 - leaves[shown].mean()) / share), abs=0.1)
    assert found[shown & leaves] == pytest.approx(0.0, abs=0.3)
    assert (found[shown & ~leaves & ~seen] < -0.8).all() and (found[~shown] == OUTSIDE / STEPS).all()
    # A likelihood ratio is 1 on average where nothing stands; ground is more than nothing to it.
    assert 1.0 < np.exp(found[shown]).mean() < 1.2


def test_exposure_and_white_balance_hardly_change_what_the_network_gets():
    rng = np.random.default_rng(1)
    photo, good = rng.uniform(0.1, 0.6, (40, 50, 3)), np.ones((40, 50), bool)
    good[:5] = False
    one = normalised((255 * photo).astype(np.uint8), good)
    other = normalised((255 * (photo * 1.4 + [0.03, 0.0, 0.06])).astype(np.uint8), good)
    assert np.abs(one - other).max() < 0.06 and one.shape == (3, 40, 50)
    assert (one[:, :5] == 0).all() and np.abs(one[:, 5:].mean(axis=(1, 2))).max() < 1e-4
    assert (normalised(np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4), bool)) == 0).all()


def test_odds_are_those_of_the_wanted_classes_against_all_else():
    scores = np.random.default_rng(2).normal(0, 1.5, (len(CLASSES), 3, 4)).astype(np.float32)
    share, certain = (np.exp(k * scores) / np.exp(k * scores).sum(axis=0) for k in (1, 8))
    for wanted in (("stem",), ("stem", "ivy")):
        yes = sum(share[CLASSES.index(name)] for name in wanted)
        expected = np.clip(np.log(yes / (1 - yes)), -MAX_ODDS, MAX_ODDS)
        assert class_odds(share, *wanted) == pytest.approx(expected, abs=1e-4)
    assert CLASSES.index("stem") == STEM and np.abs(class_odds(certain, "stem")).max() == MAX_ODDS


@pytest.mark.parametrize(("ivy", "expected"), [(0, 0.0), (6, 0.5), (12, 1.0)])
def test_the_share_of_ivy_is_that_over_the_photos(ivy, expected):
    share = covered_share(ring_of_maps(seen=12 - ivy), ring_of_maps(), range(12), at(PLACE), RADIUS, 0.0)
    assert share == pytest.approx(expected, abs=0.03)


def test_no_photo_says_nothing_of_ivy():
    maps = ring_of_maps()
    gone = maps._replace(odds=np.full_like(maps.odds, OUTSIDE))
    assert np.isnan(covered_share(gone, gone, range(12), at(PLACE), RADIUS, 0.0))
    assert np.isnan(covered_share(maps, maps, [], at(PLACE), RADIUS, 0.0))


def test_edges_count_where_the_network_sees_the_stem_end():
    maps, places, heights = ring_of_maps(seen=9), 0.005 * np.arange(-60, 61), np.array([-0.4, 0.0, 0.8])
    away = PLACE - maps.centre[:, :2]
    normal = np.column_stack([-away[:, 1], away[:, 0]]) / np.hypot(*away.T)[:, None]
    nothing, one = np.zeros((12, 3, 121, 3), np.float32), np.ones((12, 3, 121), np.float32)
    strips = Strips(places, heights, one, nothing, normal, np.full(12, 0.02), np.ones(12))
    cut = np.arange(12) != 4
    weigh_edges(strips, cut, at(PLACE), RADIUS, 0.0, maps)
    off = np.abs(np.abs(places) - RADIUS)
    assert (one[~cut] == 1.0).all()
    assert one[:9][cut[:9]][..., off < 0.015].min() > 0.9
    assert one[:9][cut[:9]][..., off > 0.06] == pytest.approx(MIN_STEP)
    assert one[9:] == pytest.approx(MIN_SHARE * MIN_STEP)


def test_edges_keep_their_weight_where_a_map_ends():
    maps = ring_of_maps()
    gone = maps._replace(odds=np.full_like(maps.odds, OUTSIDE))
    one, nothing = np.ones((12, 1, 121), np.float32), np.zeros((12, 1, 121, 3), np.float32)
    strips = Strips(
        0.005 * np.arange(-60, 61), np.zeros(1), one, nothing, np.ones((12, 2)), np.full(12, 0.02), np.ones(12)
    )
    weigh_edges(strips, np.ones(12, bool), at(PLACE), RADIUS, 0.0, gone)
    assert (one == 1.0).all()
