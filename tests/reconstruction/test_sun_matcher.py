"""The example of a matcher plug-in on torch: it is loaded as the user's file is, and matches what is the same."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

torch = pytest.importorskip("torch")

from treedgs_geo.reconstruction.matchers import Plugin, load_matcher  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / "examples" / "sun_matcher.py"
SIZE = 480, 640


@pytest.fixture(scope="module")
def match(tmp_path_factory):
    """With weights that nobody trained: what looks alike is described alike by any weights."""
    from examples.sun_matcher import Descriptor

    torch.manual_seed(0)
    weights = tmp_path_factory.mktemp("weights") / "drawn.pt"
    torch.save(Descriptor().state_dict(), weights)
    return load_matcher(Plugin(EXAMPLE, weights))


@pytest.fixture(scope="module")
def ground() -> np.ndarray:
    """Litter from above, larger than a photo."""
    rng = np.random.default_rng(0)
    fine, coarse = (rng.normal(0, 1, (900 // k, 900 // k)).astype(np.float32) for k in (1, 6))
    blurred = cv2.GaussianBlur(fine, (0, 0), 1.5) * 3 + cv2.resize(coarse, (900, 900))[:900, :900]
    return np.clip(120 + 35 * blurred, 0, 255).astype(np.uint8)


def photo(ground: np.ndarray, move: np.ndarray, light: float = 1.0) -> np.ndarray:
    grey = cv2.warpAffine(ground, move, (SIZE[1], SIZE[0]))
    return np.repeat(np.clip(light * grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def test_it_matches_the_same_ground_shifted_and_darker(match, ground) -> None:
    """Shifted by whole cells, which drawn weights bear."""
    one, other = np.array([[1.0, 0, -100], [0, 1.0, -150]]), np.array([[1.0, 0, -132], [0, 1.0, -190]])
    here, there, alike = match(photo(ground, one), photo(ground, other, 0.7))
    assert len(here) == len(there) == len(alike) > 150 and (alike <= 1).all()
    # Pixel centres at halves, as the contract has them.
    places = here - 0.5 - one[:, 2]
    expected = places @ other[:, :2].T + other[:, 2] + 0.5
    assert np.median(np.linalg.norm(there - expected, axis=1)) < 6


def test_it_finds_nothing_where_two_photos_share_nothing(match, ground) -> None:
    one = np.array([[1.0, 0, -100], [0, 1.0, -150]])
    noise = np.random.default_rng(5).normal(0, 1, (900, 900)).astype(np.float32)
    other = np.clip(120 + 100 * cv2.GaussianBlur(noise, (0, 0), 1.5), 0, 255).astype(np.uint8)
    here, there, alike = match(photo(ground, one), photo(other, one))
    assert len(here) == len(there) == len(alike) == 0


def test_it_keeps_no_more_descriptions_than_it_may(ground, monkeypatch) -> None:
    from examples import sun_matcher

    torch.manual_seed(0)
    matcher = sun_matcher.Matcher(sun_matcher.Descriptor().eval())
    photos = [photo(ground, np.array([[1.0, 0, -move], [0, 1.0, -move]])) for move in (10, 60, 110)]
    first = matcher.described(photos[0], 0.0)
    one = sum(part.nbytes for part in first)
    assert matcher.described(photos[0], 0.0) is first
    monkeypatch.setattr(sun_matcher, "KEPT_BYTES", int(2.5 * one))
    for picture in photos[1:]:
        matcher.described(picture, 0.0)
    assert len(matcher._kept) == 2 and matcher._bytes == 2 * one
    again = matcher.described(photos[0], 0.0)  # the oldest had to go, and is made anew, the same
    assert again is not first and all((a == b).all() for a, b in zip(again, first, strict=True))
    monkeypatch.setattr(sun_matcher, "KEPT_BYTES", 0)
    matcher.described(photos[1], 45.0)
    assert len(matcher._kept) == 1
