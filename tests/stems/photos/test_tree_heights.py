"""Heights along stems: from a volume in which crowns of known height are seen faintly, in noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from treedgs_geo.reconstruction.canopy import CELL_M, MIN_M, CanopyVolume
from treedgs_geo.reconstruction.ground_sight import GroundSight
from treedgs_geo.stems.photos.tree_heights import heights_of, profiles

#: No photo tells where it sees the ground.
BLIND = GroundSight(np.zeros(2), 0.4, np.zeros((1, 1)), np.empty((0, 1, 1), np.float32), np.empty((0, 3)))
PLACES = np.array([[4.0 * (k % 4), 4.0 * (k // 4)] for k in range(16)])


def stand(seed: int, alike: float = 0.12, scatter: float = 0.05):
    """Axes, diameters, heights; and a volume where the highest 6 m of each crown are ``alike`` within 0.8 m."""
    rng = np.random.default_rng(seed)
    slopes, dbh = rng.normal(0, 0.02, (16, 2)), rng.uniform(15, 45, 16)
    height = 3.8 * np.sqrt(dbh) * np.exp(rng.normal(0, scatter, 16))
    x = y = np.arange(-3.0, 15.0, CELL_M)
    levels = np.arange(MIN_M, 40.0, CELL_M)
    gx, gy = np.meshgrid(x, y)
    noise = gaussian_filter(rng.normal(0, 1, (len(levels), *gx.shape)), 1.0)
    volume = 0.03 * noise / noise.std()
    pairs = np.full(volume.shape, 24, np.uint8)
    for place, slope, top in zip(PLACES, slopes, height, strict=True):
        for k in np.flatnonzero((levels < top) & (levels > top - 6)):
            at = place + slope * levels[k] + rng.normal(0, 0.1, 2)
            volume[k] += alike * (np.hypot(gx - at[0], gy - at[1]) < 0.8)
    return slopes, dbh, height, CanopyVolume(x, y, levels, np.zeros(gx.shape), volume.astype(np.float32), pairs)


def measured(volume, places, slopes, dbh):
    return heights_of(profiles(volume, BLIND, places, slopes), volume.levels_m, dbh, places, slopes)


def test_faint_crowns_have_heights_that_are_right_within_their_errors():
    errors, inside = [], []
    for seed in range(6):
        slopes, dbh, height, volume = stand(seed)
        found = measured(volume, PLACES, slopes, dbh)
        assert np.isfinite(found.height_m).mean() > 0.9
        errors.append(found.height_m - height)
        inside.append(np.abs(errors[-1]) < 1.645 * found.se_m)
    errors = np.concatenate(errors)
    # Crowns that are alike to their very tops might go on: they read half a metre too high.
    assert np.sqrt(np.nanmean(errors**2)) < 0.7
    assert np.mean(np.concatenate(inside)) > 0.85


def test_a_tree_whose_crown_is_not_seen_has_no_height():
    slopes, dbh, height, volume = stand(1)
    far = np.vstack([PLACES, [2.0, 2.0]])
    found = measured(volume, far, np.vstack([slopes, [0.0, 0.0]]), np.append(dbh, 30.0))
    assert found.why[-1] == "no_top" and np.isnan(found.height_m[-1]) and np.isnan(found.se_m[-1])


def test_a_sapling_does_not_get_the_height_of_the_crown_above_it():
    slopes, dbh, height, volume = stand(2)
    places = np.vstack([PLACES, PLACES[5] + [0.4, 0.0]])
    found = measured(volume, places, np.vstack([slopes, slopes[5]]), np.append(dbh, 4.0))
    assert np.isnan(found.height_m[-1]) and found.why[-1] == "other_tree"
    assert found.height_m[5] == pytest.approx(height[5], abs=1.0)


def test_a_smaller_tree_is_told_from_the_crown_that_leans_over_it():
    low, tall = [], []
    for seed in range(5, 13):
        slopes, dbh, height, volume = stand(seed)
        under, above = int(dbh.argmin()), int(dbh.argmax())
        gx, gy = np.meshgrid(volume.x, volume.y)
        over = np.hypot(gx - PLACES[under][0] - 0.5, gy - PLACES[under][1]) < 0.8
        volume.alike[(volume.levels_m < height[above]) & (volume.levels_m > height[above] - 6)] += 0.06 * over
        places, lean = np.vstack([PLACES, PLACES[under] + [0.9, 0.0]]), np.vstack([slopes, [0.0, 0.0]])
        found = measured(volume, places, lean, np.append(dbh, dbh[above]))
        low.append(found.height_m[under] - height[under])
        tall.append(found.height_m[above] - height[above])
    assert np.isfinite(low).sum() >= 5 and np.nanmax(np.abs(low)) < 2.5
    assert np.nanmax(np.abs(tall)) < 1.5


def test_without_a_diameter_there_is_no_height():
    slopes, dbh, height, volume = stand(3, alike=0.3)
    found = measured(volume, PLACES, slopes, np.where(np.arange(16) < 3, np.nan, dbh))
    assert np.isnan(found.height_m[:3]).all() and np.isfinite(found.height_m[3:]).sum() > 10
    assert len(measured(volume, PLACES[:0], slopes[:0], dbh[:0]).height_m) == 0


def test_a_top_above_which_hardly_a_photo_looks_is_not_clear():
    slopes, dbh, height, volume = stand(4)
    high = volume.levels_m > np.median(height) - 1
    volume.pairs[high], volume.alike[high] = 3, 0.0
    found = measured(volume, PLACES, slopes, dbh)
    cut = height > np.median(height) + 1
    assert cut.sum() > 3 and np.isnan(found.height_m[cut]).all()
