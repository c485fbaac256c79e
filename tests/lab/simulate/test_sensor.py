"""What the simulated camera's software does to a photo, each effect by itself."""

from __future__ import annotations

import dataclasses
import io

import numpy as np
import pytest
from PIL import Image

from treedgs_lab.simulate.photographs import write_jpeg
from treedgs_lab.simulate.sensor import SENSORS, develop, sensor_of
from treedgs_lab.simulate.settings import SimulateSettings

CLEAN = SENSORS["clean"]


def grey(level=0.2, shape=(120, 160)):
    return np.full((*shape, 3), level, np.float32)


def edge(low=0.05, high=0.4):
    image = grey(low)
    image[:, 80:] = high
    return image


def photo(image, seed=0, **more):
    sensor = dataclasses.replace(CLEAN, **more)
    own = np.random.default_rng(100 + seed)
    return develop(image, 1.0, np.ones(3), np.random.default_rng(seed), sensor, own).astype(float)


def test_presets_and_single_values():
    assert sensor_of(SimulateSettings(output="x")) == CLEAN
    drone = sensor_of(SimulateSettings(output="x", sensor="drone", sharpening=0.0, jpeg_quality=70))
    assert drone == dataclasses.replace(SENSORS["drone"], sharpening=0.0, jpeg_quality=70)


def test_a_mosaic_colours_fine_grey_detail_and_keeps_its_colours():
    stripes = grey(0.05)
    stripes[:, ::3] = 0.5
    colour = [np.abs(np.diff(photo(stripes, mosaic=mosaic), axis=2)).mean() for mosaic in (False, True)]
    assert colour[1] > 3 * colour[0]
    red = grey() * np.array([1.0, 0.4, 0.1], np.float32)
    assert np.allclose(photo(red, mosaic=True).mean((0, 1)), photo(red).mean((0, 1)), atol=1.5)
    # The mosaic does not move the picture.
    step = photo(edge(), mosaic=True)[20:100].mean((0, 2)) - photo(edge())[20:100].mean((0, 2))
    assert abs(step.sum()) / np.ptp(photo(edge()).mean((0, 2))) < 0.15


def test_vignetting_darkens_corners():
    image = photo(grey(), vignetting_pct=30.0)
    assert image[:6, :6].mean() < 0.9 * image[55:65, 75:85].mean()
    assert photo(grey())[:6, :6].mean() == pytest.approx(photo(grey())[55:65, 75:85].mean(), rel=0.02)


def test_sharpening_overshoots_and_contrast_spreads():
    plain, sharp = photo(edge()).mean((0, 2)), photo(edge(), sharpening=1.0).mean((0, 2))
    assert sharp.max() > plain.max() + 4 and sharp.min() < plain.min() - 4
    assert abs(sharp[:70].mean() - plain[:70].mean()) < 1
    assert np.ptp(photo(edge(0.1, 0.5), contrast=0.6)[:, ::40].mean((0, 2))) > np.ptp(
        photo(edge(0.1, 0.5))[:, ::40].mean((0, 2))
    )


def test_noise_of_colour_and_what_is_smoothed():
    assert np.diff(photo(grey(), chroma_noise_pct=3.0), axis=2).std() > 2 * np.diff(photo(grey()), axis=2).std()
    noisy, smooth = photo(grey()), photo(grey(), denoise_pct=4.0)
    assert smooth.std() < 0.7 * noisy.std()
    assert np.ptp(photo(edge(), denoise_pct=4.0).mean((0, 2))) == pytest.approx(
        np.ptp(photo(edge()).mean((0, 2))), 0.05
    )


def test_exposure_and_white_balance_drift_from_photo_to_photo():
    photos = np.array([photo(grey(), seed, exposure_drift=0.05, white_drift=0.02).mean((0, 1)) for seed in range(12)])
    still = np.array([photo(grey(), seed).mean((0, 1)) for seed in range(12)])
    assert photos.std(axis=0).min() > 5 * still.std(axis=0).max()
    assert (photos / photos.mean(axis=1, keepdims=True)).std(axis=0).min() > 0.003


def test_jpeg_quality_is_written(tmp_path):
    tables = {}
    for quality in (60, 92):
        write_jpeg(tmp_path / "a.jpg", photo(edge()).astype(np.uint8), b"Exif\0\0", b"<x/>", quality)
        image = Image.open(io.BytesIO((tmp_path / "a.jpg").read_bytes()))
        tables[quality] = sum(image.quantization[0])
        # Luminance sampled twice as finely as colour, both ways.
        assert image.layer[0][1:3] == (2, 2) and image.layer[1][1:3] == (1, 1)
    assert tables[60] > 3 * tables[92]
