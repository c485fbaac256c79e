"""Stems found by the ground that they hide: leaning ones, in painted photos."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.fit.edge_adjustment import NO_STEMS
from treedgs_geo.stems.photos.fit.null_model import BREAST
from treedgs_geo.stems.photos.images.background import cut_silhouette, make_backdrop
from treedgs_geo.stems.photos.images.crops import GroundGrid, load_stack
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.propose.space_carving import carved_seeds, clear_known, hidden_ground, searched
from treedgs_geo.stems.photos.tile_calibration import chance_contrast
from treedgs_geo.stems.photos.tuned import CELL_M, HEIGHTS

AREA, BOX = Area.circle(0, 0, 2.2), (-2.5, -2.5, 2.5, 2.5)
UPRIGHT = Stem(1.0, 0.8, 0.12)
LEANING = Stem(-0.8, -0.6, 0.13, lx=0.30, ly=0.25)
#: As the fit writes them: place, lean, bend, ground, breast height, radius, taper.
UPRIGHT_ROW = np.array([[1.0, 0.8, 0, 0, 0, 0, 0, 1.37, 0.12, -0.005]])


def seen(folder: Path, stems: list[Stem]) -> tuple:
    """Stack, ground, backdrop and the contrast that chance reaches."""
    views = oblique_views(folder, 16)
    render(views, stems, seed=5)
    flat = lambda x, y: np.zeros_like(np.asarray(x, float))  # noqa: E731
    grid = GroundGrid.sample(flat, AREA, 3.0)
    stack = load_stack(views, AREA, grid, 96, 2.0)
    backdrop = make_backdrop(stack, grid, AREA.bounds(3.0))
    places = np.array([[-1.5, 1.2], [0.2, 1.9], [1.6, -1.1], [0.4, -1.8], [-1.9, 0.3]])
    outline_of = lambda axis: cut_silhouette(stack, backdrop, grid, axis, BREAST.silhouette)  # noqa: E731
    return stack, grid, backdrop, chance_contrast(outline_of, grid, places, np.arange(0.03, 0.3, 0.02), 1.37)


def seeds_of(scene: tuple, known: np.ndarray = NO_STEMS, **options: float) -> list:
    stack, grid, backdrop, chance = scene
    x0, y0, rows, columns = searched(BOX)
    layers = hidden_ground(stack, grid, backdrop, x0, y0, rows, columns)
    outline_of = lambda axis: cut_silhouette(stack, backdrop, grid, axis, BREAST.silhouette)  # noqa: E731
    wanted = PhotoStemOptions(margin_m=0.3, **options)
    return carved_seeds(layers, (x0, y0), grid, outline_of, AREA, wanted, known, chance)


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> tuple:
    return seen(tmp_path_factory.mktemp("carved"), [UPRIGHT, LEANING])


def test_both_stems_are_found_with_their_leans(scene):
    seeds = seeds_of(scene)
    for stem in (UPRIGHT, LEANING):
        seed = min(seeds, key=lambda s: np.hypot(s.x - stem.x, s.y - stem.y))
        assert np.hypot(seed.x - stem.x, seed.y - stem.y) < 0.05
        assert np.hypot(seed.lx - stem.lx, seed.ly - stem.ly) < 0.05
        assert seed.r == pytest.approx(stem.r, abs=0.03)


def test_known_stems_and_leans_that_are_not_asked_for_are_left_out(scene):
    def near(stem: Stem, **options: float) -> list:
        every = seeds_of(scene, UPRIGHT_ROW, **options)
        return [seed for seed in every if np.hypot(seed.x - stem.x, seed.y - stem.y) < 0.3]

    assert not near(UPRIGHT) and near(LEANING)
    assert not near(LEANING, max_lean_deg=15.0)


def test_a_point_in_the_stem_hides_the_ground_and_one_beside_it_does_not(scene):
    stack, grid, backdrop, _ = scene
    layers = hidden_ground(stack, grid, backdrop, -3.0, -3.0, 61, 61)

    def at(x: float, y: float, layer: int) -> float:
        return float(layers[layer, round((y + 3.0) / CELL_M), round((x + 3.0) / CELL_M)])

    for layer, height in enumerate(HEIGHTS):
        x, y = LEANING.x + (height - 1.37) * LEANING.lx, LEANING.y + (height - 1.37) * LEANING.ly
        inside, beside = at(x, y, layer), [at(x + 0.4, y, layer), at(x, y + 0.4, layer)]
        assert inside > 0 and inside > 2 * max(beside)
    known = layers.copy()
    clear_known(known, UPRIGHT_ROW, -3.0, -3.0, 1.37)
    changed = np.argwhere((known != layers).any(axis=0)) * CELL_M - 3.0
    assert np.hypot(changed[:, 1] - UPRIGHT.x, changed[:, 0] - UPRIGHT.y).max() < 0.3 and len(changed) > 10


def test_bare_ground_gives_no_seed(tmp_path):
    stack, grid, backdrop, chance = seen(tmp_path, [])
    assert not seeds_of((stack, grid, backdrop, max(chance, 1.0)))
