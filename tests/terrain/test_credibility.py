"""Is the ground under a stem the ground? Cut clouds, shrubs, and terrain models that are not the cloud's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import rasterio
from affine import Affine
from synthetic_cloud import plot_cloud

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.terrain.cloud_ground import given_ground, own_ground
from treedgs_geo.terrain.credibility import NO_GROUND_M, GroundLayer
from treedgs_geo.terrain.dtm import height_above, read_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud, flat_ground
from treedgs_geo.terrain.sparse_ground import dtm_from_sparse, sparse_ground_se, with_gaps_filled

STEMS = [(3.0, 3.0, 25.0), (8.0, 8.0, 35.0), (3.0, 9.0, 18.0), (9.0, 3.0, 22.0)]
PLACES = np.array([stem[:2] for stem in STEMS])


class Recorder(Reporter):
    """Keeps the warnings."""

    def __init__(self):
        super().__init__()
        self.warnings = []

    def warn(self, message):
        self.warnings.append(message)


def ground_of(xyz):
    return 100 + 0.05 * xyz[:, 0] + 0.1 * np.sin(xyz[:, 1] / 3)


@pytest.fixture(scope="module")
def cloud():
    return plot_cloud(np.random.default_rng(1), STEMS, shrubs=1500)


def se_at(xyz):
    return own_ground(xyz, None).se_m(PLACES, np.full(len(PLACES), 0.3))


def test_whole_ground_is_sure_and_a_cut_one_is_none(cloud):
    assert (se_at(cloud) < 0.05).all()
    for cut in (0.5, 1.0, 2.0):
        assert (se_at(cloud[cloud[:, 2] - ground_of(cloud) > cut]) >= 0.5).all(), cut


def test_shrubs_cut_off_flat_are_no_ground(cloud):
    """Vegetation that fills the air and ends at the cut covers the area as ground does, but nothing stands out."""
    rng = np.random.default_rng(2)
    shrubs = rng.uniform((0, 0, 0), (12, 12, 1.5), (60_000, 3))
    shrubs[:, 2] += ground_of(shrubs)
    xyz = np.concatenate([cloud, shrubs])
    assert (se_at(xyz) < 0.05).all()  # the ground under them still stands out
    height = xyz[:, 2] - ground_of(xyz)
    assert (se_at(xyz[height > 0.6]) > 0.25).all()


def test_a_slope_cut_level_keeps_the_ground_that_is_left():
    """A plane through a slope: below it the ground is there, above it not."""
    xyz = plot_cloud(np.random.default_rng(3), [(2.0, 6.0, 25.0), (10.0, 6.0, 25.0)], slope=0.25)
    left = xyz[xyz[:, 2] > 101.6]
    found = own_ground(left, None)
    gone, there = found.se_m(np.array([[2.0, 6.0], [10.0, 6.0]]), np.full(2, 0.3))
    assert there < 0.05 and gone > 0.25


def test_sparse_and_shaded_ground_is_still_ground(cloud):
    rng = np.random.default_rng(4)
    height = cloud[:, 2] - ground_of(cloud)
    low = np.abs(height) < 0.06
    sparse = cloud[~low | (rng.uniform(size=len(cloud)) < 0.04)]  # 6 ground points a square metre
    assert (se_at(sparse) < 0.05).all()
    hidden = low & (np.hypot(cloud[:, 0] - 3, cloud[:, 1] - 3) < 2.3)
    near, *others = se_at(cloud[~hidden])
    # That of the rest of the cloud is carried there.
    assert 0.05 < near < 0.5 and max(others) < 0.05


def test_no_points_and_unknown_heights_are_no_evidence():
    layer = GroundLayer.of(np.tile(np.linspace(0, 10, 50)[:, None], (1, 3)), flat_ground(np.full((11, 3), 1000.0)))
    assert (
        layer.ground.sum() == 0
        and layer.se_m(np.array([[5.0, 5.0], [-40.0, 3.0]]), flat_ground(np.zeros((11, 3)))).tolist()
        == [NO_GROUND_M] * 2
    )
    assert layer.se_m(np.empty((0, 2)), flat_ground(np.zeros((11, 3)))).shape == (0,)


def test_one_bare_tree_stands_on_its_lowest_points():
    rng = np.random.default_rng(5)
    tree = plot_cloud(rng, [(6.0, 6.0, 30.0)], shrubs=0)
    tree = tree[tree[:, 2] - ground_of(tree) > 0.15]
    found = own_ground(tree, None)
    assert found.lowest and found.se_m(np.array([[6.0, 6.0]]), np.array([0.3])) == pytest.approx(1.0)


def given(xyz, change):
    """The cloud's own ground on a wider grid, with ``change(x, y, heights)`` applied."""
    dtm = dtm_from_cloud(xyz)
    heights = change(*dtm.centres(), dtm.heights.copy())
    return dataclasses.replace(dtm, heights=heights, support=None)


def test_a_model_at_another_height_is_refused_with_both_heights(cloud):
    for off in (-22.5, 22.5):
        with pytest.raises(InputError, match=rf"at {100.3 + off:.1f} m where .* 100\.3 m \([+-]22\.5 m"):
            given_ground(given(cloud, lambda x, y, z, off=off: z + off), cloud, "dtm", Reporter())
    with pytest.raises(InputError, match="where the cloud's own ground lies"):
        given_ground(given(cloud, lambda x, y, z: 3.28084 * z), cloud, "dtm", Reporter())
    # Two thirds of it: the lower quartile of the gaps would have taken it.
    with pytest.raises(InputError, match="-22.5 m, at"):
        given_ground(given(cloud, lambda x, y, z: np.where(x < 8, z - 22.5, z)), cloud, "dtm", Reporter())


def test_gaps_and_wrong_patches_of_a_model_are_filled_from_the_cloud(cloud):
    for change, said in (
        (lambda x, y, z: np.where(x < 5, np.nan, z), "no height in"),
        (lambda x, y, z: np.where(x < 5, z - 22.5, z), "more than 3 m off in"),
    ):
        heard = Recorder()
        found = given_ground(given(cloud, change), cloud, "dtm", heard)
        assert any(said in message for message in heard.warnings)
        np.testing.assert_allclose(found.dtm.height(*PLACES.T), ground_of(np.c_[PLACES, PLACES]), atol=0.06)
        assert (found.se_m(PLACES, np.full(4, 0.3)) < 0.1).all()


def test_a_tilted_model_is_unsure_where_it_is_off(cloud):
    heard = Recorder()
    found = given_ground(given(cloud, lambda x, y, z: z + 0.15 * (x - 6)), cloud, "dtm", heard)
    np.testing.assert_allclose(found.se_m(PLACES, np.full(4, 0.3)), 0.15 * np.abs(PLACES[:, 0] - 6), atol=0.05)
    assert not heard.warnings  # the median is right


def test_a_cloud_without_ground_says_nothing_about_a_model(cloud):
    left = cloud[cloud[:, 2] - ground_of(cloud) > 1.0]
    found = given_ground(given(cloud, lambda x, y, z: z), left, "dtm", Reporter())
    assert (found.se_m(PLACES, np.full(4, 0.3)) == 0).all()
    above = given_ground(given(cloud, lambda x, y, z: z + 1.6), left, "dtm", Reporter())
    assert (above.se_m(PLACES, np.full(4, 0.3)) > 0.3).all()  # stems reach below it
    for off in (-22.5, 22.5):
        with pytest.raises(InputError, match="lowest points lie"):
            given_ground(given(cloud, lambda x, y, z, off=off: z + off), left, "dtm", Reporter())


def sparse_plot(rng, per_m2=10.0, rough_m=0.03):
    """SfM-like points of a 30 x 30 m slope: litter, and stems and crowns above it."""
    xy = rng.uniform(-15, 15, (int(900 * per_m2), 2))
    z = 0.1 * xy[:, 0] + rng.normal(0, rough_m, len(xy))
    z[::6] += rng.uniform(0.6, 15, len(z[::6]))
    return np.column_stack([xy, z])


def test_ground_from_photos_is_as_sure_as_the_points_near_the_stem():
    points = sparse_plot(np.random.default_rng(6))
    stems = np.array([[-8.0, -8.0], [8.0, 0.0], [0.0, 8.0]])
    bare = points[np.hypot(points[:, 0] - 8, points[:, 1]) > 2.5]
    shrubs = np.hypot(*(bare[:, :2] - (0.0, 8.0)).T) < 3
    bare[shrubs, 2] += np.random.default_rng(7).uniform(0, 0.6, shrubs.sum())
    clear, hidden, rough = sparse_ground_se(bare, dtm_from_sparse(bare), stems)
    assert clear < 0.1 and 0.5 < hidden < 5 and 0.5 < rough < 5
    outside = sparse_ground_se(points, dtm_from_sparse(points), np.array([[60.0, 0.0]]))
    assert outside == [NO_GROUND_M]


def test_a_given_model_is_as_unsure_as_it_is_off_the_photos_ground_at_the_stem():
    points = sparse_plot(np.random.default_rng(8))
    found = dtm_from_sparse(points)
    x, _ = found.centres()
    tilted = dataclasses.replace(found, heights=found.heights + 0.3 + 0.05 * x)
    above = height_above(tilted, found)
    stems = np.array([[-8.0, 1.0], [0.0, 0.0], [8.0, -3.0]])
    np.testing.assert_allclose(sparse_ground_se(points, tilted, stems, above), [0.1, 0.3, 0.7], atol=0.06)
    holes = dataclasses.replace(tilted, heights=np.where(x < -5, np.nan, tilted.heights))
    filled, m2 = with_gaps_filled(holes, found, above)
    assert m2 == pytest.approx(300, abs=20) and filled.height(-8.0, 1.0) == pytest.approx(-0.8 + above, abs=0.05)
    assert filled.height(8.0, -3.0) == pytest.approx(0.8 + 0.7, abs=0.05)
    assert with_gaps_filled(tilted, found, above) == (tilted, 0.0)


def raster(path, values, nodata=None):
    values = np.asarray(values, np.float32)
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=values.shape[1],
        height=values.shape[0],
        count=1,
        dtype="float32",
        crs="EPSG:32615",
        nodata=nodata,
        transform=Affine(0.5, 0, 0, 0, -0.5, 20),
    ) as target:
        target.write(values, 1)
    return path


@pytest.mark.parametrize("filling", [0.0, -99.0, 9999.0, -1.0])
def test_unmarked_nodata_is_unknown_and_said(tmp_path, filling):
    terrain = 100 + np.add.outer(np.linspace(0, 3, 40), np.linspace(0, 2, 30))
    terrain[5:20, 4:12] = filling
    heard = Recorder()
    dtm = read_dtm(raster(tmp_path / "d.tif", terrain), reporter=heard)
    assert np.isnan(dtm.heights[5:20, 4:12]).all() and np.isfinite(dtm.heights).sum() == 40 * 30 - 120
    assert len(heard.warnings) == 1
    assert f"hold {filling:g} m" in heard.warnings[0] and "100.0 to 105.0" in heard.warnings[0]


def test_blends_round_unmarked_nodata_go_with_it_and_slopes_stay(tmp_path):
    """A raster resampled over its zeros: the rim of the hole is neither height nor hole. Cliffs elsewhere stay."""
    from scipy.ndimage import zoom

    coarse = 100 + np.add.outer(np.linspace(0, 3, 12), np.linspace(0, 2, 12))
    coarse[9:, :] += 6.0  # a cliff
    coarse[2:5, 3:6] = 0.0
    fine = zoom(coarse, 4, order=1)
    heights = read_dtm(raster(tmp_path / "d.tif", fine)).heights
    assert np.nanmin(heights) > 99.5 and np.isfinite(heights[40:]).all()
    assert np.isnan(heights).sum() < 0.25 * heights.size


@pytest.mark.parametrize(
    "values",
    [
        np.zeros((8, 8)),
        np.where(np.eye(8) > 0, 0.3, 0.0),
        np.add.outer(np.arange(8.0), np.arange(8.0)),
        np.full((8, 8), 3.0),
    ],
)
def test_heights_near_zero_are_heights(tmp_path, values):
    heard = Recorder()
    assert (
        np.isfinite(read_dtm(raster(tmp_path / "d.tif", values), reporter=heard).heights).all() and not heard.warnings
    )


def test_level_zero_ground_with_a_high_filling_keeps_its_zeros(tmp_path):
    values = np.zeros((8, 8))
    values[2:4] = 9999.0
    heights = read_dtm(raster(tmp_path / "d.tif", values)).heights
    assert (heights[:2] == 0).all() and np.isnan(heights[2:4]).all()
