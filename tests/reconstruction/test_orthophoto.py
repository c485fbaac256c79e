"""The orthophoto of the ground: it shows the ground where crowns hide it in most photos, and at its place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pyproj
import pytest
import rasterio
from rendered_stems import Stem, leaves, oblique_views, render

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.images import load_image
from treedgs_geo.reconstruction.orthophoto import write_orthophoto

FRAME = LocalFrame(pyproj.CRS.from_epsg(32617), np.array([500000.0, 3450000.0, 100.0]))
BOX = (-4.0, -4.0, 4.0, 4.0)
STEMS = [Stem(-1.5, 1.0, 0.20), Stem(2.0, -1.5, 0.15)]


def ground(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.zeros(np.shape(x))


@pytest.fixture(scope="module")
def flown(tmp_path_factory) -> list[View]:
    """36 photos from all sides of a textured ground with two stems, under leaves that hide more than half of it."""
    views = oblique_views(tmp_path_factory.mktemp("flown"), 36, distance=18.0)
    render(views, STEMS)
    assert 0.5 < leaves(views, np.random.default_rng(7)) < 0.8
    return views


@pytest.fixture(scope="module")
def written(flown, tmp_path_factory) -> tuple[Path, dict]:
    """The orthophoto, and what was said of it."""
    path = tmp_path_factory.mktemp("written") / "ortho.tif"
    return path, write_orthophoto(path, flown, ground, FRAME, BOX, Reporter())


def true_ground(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """What :func:`rendered_stems.render` paints at local x, y."""
    rng = np.random.default_rng(0)
    litter = cv2.GaussianBlur(rng.normal(size=(1200, 1200)).astype(np.float32), (0, 0), 1.5)
    return litter[(np.abs(y + 30) * 20).astype(int) % 1200, (np.abs(x + 30) * 20).astype(int) % 1200]


def read(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Grey values, mask, and local x and y of the pixels' centres."""
    with rasterio.open(path) as source:
        grey, shown, t = source.read(2).astype(np.float32), source.dataset_mask() > 0, source.transform
    row, column = np.mgrid[: grey.shape[0], : grey.shape[1]] + 0.5
    return grey, shown, t.c + t.a * column - FRAME.origin[0], t.f + t.e * row - FRAME.origin[1]


def offsets(path: Path) -> np.ndarray:
    """(K, 2) metres east and north between where the picture shows patches of 1.2 m and where they are, of those away
    from stems."""
    grey, _, x, y = read(path)
    size, reach, gsd = int(0.6 / (x[0, 1] - x[0, 0])), 6, x[0, 1] - x[0, 0]
    truth = cv2.GaussianBlur(true_ground(x, y), (0, 0), 1.0)
    found = []
    for i in range(size + reach, len(grey) - size - reach, size):
        for j in range(size + reach, len(grey) - size - reach, size):
            if min(np.hypot(x[i, j] - stem.x, y[i, j] - stem.y) for stem in STEMS) < 1.0:
                continue
            piece = grey[i - size : i + size, j - size : j + size]
            around = truth[i - size - reach : i + size + reach, j - size - reach : j + size + reach]
            score = cv2.matchTemplate(around, piece, cv2.TM_CCOEFF_NORMED)
            down, right = np.unravel_index(score.argmax(), score.shape)
            found.append([gsd * (reach - right), gsd * (down - reach)] if score.max() > 0.5 else [np.nan, np.nan])
    return np.array(found)


def test_the_ground_is_shown_where_it_is_though_leaves_hide_most_of_it(flown, written):
    path, said = written
    away = offsets(path)
    assert len(away) >= 100 and np.isfinite(away).all(axis=1).mean() > 0.95
    assert np.sqrt(np.nanmean((away**2).sum(axis=1))) < 0.03
    grey, shown, x, y = read(path)
    inside = shown & (np.abs(x) < 3.5) & (np.abs(y) < 3.5)
    assert said["seen"] > 0.95
    alike = np.corrcoef(grey[inside], true_ground(x, y)[inside])[0, 1]
    # The median of all photos, the usual picture, shows leaves.
    corner = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    usual = []
    for view in flown:
        at = view.project(corner)[0].astype(np.float32).reshape(*x.shape, 2) - 0.5
        usual.append(cv2.remap(load_image(view)[..., 1], at[..., 0], at[..., 1], cv2.INTER_LINEAR))
    median = np.corrcoef(np.median(usual, axis=0)[inside], true_ground(x, y)[inside])[0, 1]
    print(f"correlation with the true ground {alike:.2f}, of the median {median:.2f}")
    assert alike > 0.8 and alike > median + 0.15


def test_a_wrong_camera_or_ground_moves_it(flown, tmp_path):
    """What the first test holds against the picture can fail."""
    east = [replace(view, translation=view.translation - view.rotation @ [0.10, 0, 0]) for view in flown]
    write_orthophoto(tmp_path / "east.tif", east, ground, FRAME, BOX, Reporter())
    away = offsets(tmp_path / "east.tif")
    assert np.nanmedian(away, axis=0) == pytest.approx([0.10, 0.0], abs=0.03)


def test_feet_of_stems_are_shown_on_the_feet(written):
    grey, _, x, y = read(written[0])
    for stem in STEMS:
        disc, ring = ((np.hypot(*np.mgrid[-12:13, -12:13]) * (x[0, 1] - x[0, 0]) < r) for r in (stem.r, 1.6 * stem.r))
        around = ring & ~disc
        darker = cv2.filter2D(grey, -1, around / around.sum() - disc / disc.sum())
        at = np.where(np.hypot(x - stem.x, y - stem.y) < 0.4, darker, -np.inf).argmax()
        assert np.hypot(x.flat[at] - stem.x, y.flat[at] - stem.y) < 0.05


def test_the_file_is_a_cloud_optimised_geotiff_in_the_project_crs(written):
    path, said = written
    with rasterio.open(path) as source:
        assert source.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert source.crs.to_epsg() == 32617 and source.count == 3 and source.dtypes == ("uint8",) * 3
        assert source.res == (said["gsd_m"], said["gsd_m"])
        # No finer than the photos: 40 m above the ground and 18 m beside it, 1500 pixels of focal length.
        assert np.hypot(40, 18) / 1500 <= said["gsd_m"] <= 0.04
        assert np.allclose(source.bounds, np.add(BOX, [5e5, 3.45e6] * 2), atol=said["gsd_m"])
        assert source.mask_flag_enums[0] == [rasterio.enums.MaskFlags.per_dataset]
    assert [file.name for file in path.parent.iterdir()] == ["ortho.tif"]


def test_pieces_of_a_large_picture_fit_together(flown, written, tmp_path, monkeypatch):
    """Made in pieces of a fifth of the side it is the same picture, without seams."""
    monkeypatch.setattr("treedgs_geo.reconstruction.orthophoto._WRITTEN_PX", 56)
    write_orthophoto(tmp_path / "many.tif", flown, ground, FRAME, BOX, Reporter())
    (one, *_), (many, *_) = read(written[0]), read(tmp_path / "many.tif")
    assert one.shape == many.shape
    assert np.median(np.abs(one - many)) < 8 and np.corrcoef(one.ravel(), many.ravel())[0, 1] > 0.8
    step = np.abs(np.diff(many, axis=1)).mean(axis=0)
    seams = np.arange(56, many.shape[1], 56) - 1
    assert step[seams].mean() < 1.5 * step.mean()


def test_nothing_is_shown_where_photos_do_not_agree(flown, tmp_path):
    """Draped on the air between leaves and ground, no two photos show the same."""
    said = write_orthophoto(tmp_path / "air.tif", flown, lambda x, y: ground(x, y) + 4.0, FRAME, BOX, Reporter())
    assert said["seen"] < 0.6
    none = write_orthophoto(tmp_path / "none.tif", flown, lambda x, y: ground(x, y) * np.nan, FRAME, BOX, Reporter())
    assert none["seen"] == 0
