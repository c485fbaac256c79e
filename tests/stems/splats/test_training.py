"""Fits of a small painted scene: a dark stem on speckled ground, drawn with the reference-checked rasteriser."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from painted_stem import FRAME, GROUND, STEM, ground, load, scene

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.splats.bands import Volume, choose_views
from treedgs_geo.stems.splats.crops import Crop, GroundPlane, band_outline, crop_camera, cut_out
from treedgs_geo.stems.splats.options import GaussianOptions
from treedgs_geo.stems.splats.project import CropCamera
from treedgs_geo.stems.splats.raster import render
from treedgs_geo.stems.splats.splat_fit.band_fit import FitSettings, fit_stem
from treedgs_geo.stems.splats.train import fit_gaussians, fit_with_report

QUICK = GaussianOptions(stems="free", gaussians=250, coarse_epochs=5, fine_epochs=1, max_views=12, threads=1)


class Heard(Reporter):
    """Keeps the warnings."""

    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        self.warnings.append(message)


def test_a_stem_is_found_where_it_stands_and_the_ground_stays_clear():
    views, _ = scene()
    seeds = np.array([STEM + [0.08, -0.06], [500.0, 500.0]])
    heard = Heard()
    options = replace(QUICK, gaussians=600, coarse_epochs=8, fine_epochs=4)
    field, report = fit_with_report(views, FRAME, ground, seeds, None, options, heard, load)
    assert set(np.unique(field.groups)) == {0} and len(field) <= 600
    assert any("got no Gaussians" in warning for warning in heard.warnings)
    assert report.stems[0]["crops"] == 12 and report.megapixels > 0 and report.foliage is None
    band = (field.means[:, 2] > GROUND + 0.8) & (field.means[:, 2] < GROUND + 2.0)
    mass = field.opacities[band] * field.scales[band].prod(axis=1)
    axis = (field.means[band, :2] * mass[:, None]).sum(axis=0) / mass.sum()
    assert np.linalg.norm(axis - STEM) < 0.06
    view = views[3]
    camera = view.camera
    seen = render(
        field.packed,
        CropCamera(260, 260, camera.fx, camera.fy, camera.cx, camera.cy, view.rotation, view.translation),
        full=False,
    )
    pixels, _ = view.project(np.array([[*STEM, GROUND + 1.4]]))
    u, v = pixels[0].astype(int)
    beside = int(2200 * 0.38 / 60)
    assert seen.alpha[v, u] > 0.6
    assert max(seen.alpha[v, u - beside], seen.alpha[v, u + beside]) < 0.35


def test_the_same_seed_gives_the_same_field_for_any_number_of_threads():
    views, _ = scene()
    seeds = np.array([STEM, STEM + [0.3, 0.3]])
    one = fit_gaussians(views, FRAME, ground, seeds, None, QUICK, None, load)
    two = fit_gaussians(views, FRAME, ground, seeds, None, replace(QUICK, threads=2), None, load)
    for name in ("means", "quaternions", "log_scales", "opacity_logits", "colours", "groups"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    other = fit_gaussians(views, FRAME, ground, seeds, None, replace(QUICK, seed=1), None, load)
    assert len(other) != len(one) or not np.array_equal(other.means, one.means)


@pytest.mark.parametrize("case", ["constant", "black", "one view", "noise", "paper losses", "dense"])
def test_poor_input_gives_a_finite_field_or_a_refusal(case):
    views, photos = scene()
    options, dense = QUICK, None
    if case == "one view":
        views = views[:1]
    elif case == "paper losses":
        options = replace(QUICK, preset="paper-crops")
    elif case == "dense":
        rng = np.random.default_rng(2)
        dense = (np.column_stack([STEM + rng.normal(0, 0.1, (400, 2)), GROUND + rng.uniform(0, 3, 400)]), None)

    def shown(view: View) -> np.ndarray:
        if case in ("constant", "black"):
            return np.full((260, 260, 3), 120 if case == "constant" else 0, np.uint8)
        if case == "noise":
            return np.random.default_rng(int(view.name[:2])).integers(0, 255, (260, 260, 3), dtype=np.uint8)
        return photos[view.name]

    try:
        field, report = fit_with_report(views, FRAME, ground, STEM[None], dense, options, None, shown)
    except InputError as refusal:
        assert case in ("constant", "black", "noise") and "No stem" in str(refusal)
        return
    assert len(field) <= 250  # construction refuses non-finite values
    assert np.abs(field.means[:, :2] - STEM).max() <= 0.51
    assert report.stems[0]["stopped"] == "schedule"


def test_budget_is_shared_and_bad_photos_and_positions_are_left_out():
    views, photos = scene()

    def flawed(view: View) -> np.ndarray:
        if view.name.startswith("03"):
            raise InputError("03.jpg: cannot be decoded")
        return photos[view.name]

    heard = Heard()

    def partly(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.where(np.asarray(x) > 400, np.nan, GROUND)

    seeds = np.array([STEM, STEM + [0.4, 0], [450.0, 0.0]])
    field, report = fit_with_report(views, FRAME, partly, seeds, None, replace(QUICK, max_gaussians=200), heard, flawed)
    assert len(field) <= 200 and all(stem["gaussians"] <= 100 for stem in report.stems)
    assert any("03.jpg" in warning for warning in heard.warnings)
    assert any("no ground height" in warning for warning in heard.warnings)


def test_refusals():
    views, _ = scene()
    with pytest.raises(InputError, match="no registered photo"):
        fit_gaussians([], FRAME, ground, STEM[None], None, QUICK)
    with pytest.raises(InputError, match="no stem position"):
        fit_gaussians(views, FRAME, ground, np.zeros((0, 2)), None, QUICK)
    with pytest.raises(InputError, match="expected local coordinates"):
        fit_gaussians(views, FRAME, ground, np.array([[611337.0, 3718451.0]]), None, QUICK)
    with pytest.raises(InputError, match="No stem could be fitted"):
        fit_gaussians(views, FRAME, ground, np.array([[900.0, 900.0]]), None, QUICK, None, load)


def stem_crops(factor: float) -> tuple[list[Crop], GroundPlane, Volume]:
    """The scene as stem crops, in units of 1 / factor metres."""
    views, photos = scene()
    origin = np.array([*STEM, GROUND])
    plane = GroundPlane(0, 0, 0, 6.0 * factor, 0.08 * factor)
    crops = []
    for number, view in enumerate(views):
        crop = crop_camera(view, origin, band_outline(0.8, -0.1, 3.0))
        image, inside = cut_out(photos[view.name], view, crop)
        camera = replace(crop, translation=crop.translation * factor)
        pixels = image.astype(np.float32) / 255
        crops.append(Crop(camera, pixels, inside, plane.texels(camera), inside, number, view.flight))
    return crops, plane, Volume(0.5 * factor, -0.1 * factor, 3.4 * factor, 0.008 * factor, 0.15 * factor)


def test_units_do_not_matter():
    """The same scene in millimetres: the same fit, a thousand times larger."""
    settings = FitSettings(gaussians=150, coarse_epochs=3, fine_epochs=0)
    one = fit_stem(*stem_crops(1.0), settings, 0.027)
    two = fit_stem(*stem_crops(1000.0), settings, 27.0)
    assert len(one.parameters) == len(two.parameters)
    np.testing.assert_allclose(two.parameters[:, :3] / 1000, one.parameters[:, :3], atol=0.02)
    np.testing.assert_allclose(two.parameters[:, 10], one.parameters[:, 10], atol=0.3)


def test_views_are_oblique_and_spread():
    views, _ = scene()
    nadir = View("n", Path("n"), views[0].camera, np.diag([1.0, -1, -1]), -np.diag([1.0, -1, -1]) @ [*STEM, 60.0])
    chosen = choose_views([*views, nadir], np.array([*STEM, GROUND]), 4)
    assert len(chosen) == 4 and 12 not in chosen
    azimuths = np.sort([np.arctan2(*(views[i].centre[:2] - STEM)) for i in chosen])
    assert np.diff(azimuths).min() > 1.0
    assert choose_views([nadir], np.array([*STEM, GROUND]), 4) == [0]
