"""Fits of a small painted scene: what is left out, what is refused, and that a fit repeats."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from painted_stem import FRAME, GROUND, STEM, ground, load, scene

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.splats.bands import choose_views
from treedgs_geo.stems.splats.options import GaussianOptions
from treedgs_geo.stems.splats.train import fit_with_report

QUICK = GaussianOptions(gaussians=250, max_views=12, threads=1)


class Heard(Reporter):
    """Keeps the warnings."""

    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        self.warnings.append(message)


def test_the_field_is_the_same_for_any_number_of_threads():
    views, _ = scene()
    seeds = np.array([STEM, STEM + [0.3, 0.3]])
    one, _ = fit_with_report(views, FRAME, ground, seeds, QUICK, None, load)
    two, _ = fit_with_report(views, FRAME, ground, seeds, replace(QUICK, threads=2), None, load)
    for name in ("means", "quaternions", "log_scales", "opacity_logits", "colours", "groups"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


@pytest.mark.parametrize("case", ["constant", "black", "one view", "noise"])
def test_poor_input_gives_a_finite_field_or_a_refusal(case):
    views, photos = scene()
    if case == "one view":
        views = views[:1]

    def shown(view: View) -> np.ndarray:
        if case in ("constant", "black"):
            return np.full((260, 260, 3), 120 if case == "constant" else 0, np.uint8)
        if case == "noise":
            return np.random.default_rng(int(view.name[:2])).integers(0, 255, (260, 260, 3), dtype=np.uint8)
        return photos[view.name]

    try:
        field, report = fit_with_report(views, FRAME, ground, STEM[None], QUICK, None, shown)
    except InputError as refusal:
        assert "No stem" in str(refusal)
        return
    assert len(field) <= 250  # construction refuses non-finite values
    assert report.primitives[0].primitive.findings.refused or case == "noise"


def test_budget_is_kept_and_bad_photos_and_positions_are_left_out():
    views, photos = scene()

    def flawed(view: View) -> np.ndarray:
        if view.name.startswith("03"):
            raise InputError("03.jpg: cannot be decoded")
        return photos[view.name]

    heard = Heard()

    def partly(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.where(np.asarray(x) > 400, np.nan, GROUND)

    seeds = np.array([STEM, STEM + [0.4, 0], [450.0, 0.0]])
    field, report = fit_with_report(views, FRAME, partly, seeds, replace(QUICK, gaussians=100), heard, flawed)
    assert len(field) <= 200 and all(stem["gaussians"] <= 100 for stem in report.stems)
    assert any("03.jpg" in warning for warning in heard.warnings)
    assert any("no ground height" in warning for warning in heard.warnings)


def test_refusals():
    views, _ = scene()
    with pytest.raises(InputError, match="no registered photo"):
        fit_with_report([], FRAME, ground, STEM[None], QUICK)
    with pytest.raises(InputError, match="no stem position"):
        fit_with_report(views, FRAME, ground, np.zeros((0, 2)), QUICK)
    with pytest.raises(InputError, match="expected local coordinates"):
        fit_with_report(views, FRAME, ground, np.array([[611337.0, 3718451.0]]), QUICK)
    with pytest.raises(InputError, match="No stem could be fitted"):
        fit_with_report(views, FRAME, ground, np.array([[900.0, 900.0]]), QUICK, None, load)


def test_views_are_oblique_and_spread():
    views, _ = scene()
    nadir = View("n", Path("n"), views[0].camera, np.diag([1.0, -1, -1]), -np.diag([1.0, -1, -1]) @ [*STEM, 60.0])
    chosen = choose_views([*views, nadir], np.array([*STEM, GROUND]), 4)
    assert len(chosen) == 4 and 12 not in chosen
    azimuths = np.sort([np.arctan2(*(views[i].centre[:2] - STEM)) for i in chosen])
    assert np.diff(azimuths).min() > 1.0
    assert choose_views([nadir], np.array([*STEM, GROUND]), 4) == [0]
