"""Crowns in a canopy height grid: of made trees, whose crowns are known."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.inventory.side_layers import crown_table
from treedgs_geo.stems.quality.crowns import crown_cells
from treedgs_geo.stems.quality.tree import Tree

CELL = 0.2


def canopy(trees: list[tuple[float, float, float, float]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and heights (NaN between crowns) of paraboloids: x, y, height, radius; down to 0.6 of the height."""
    x = y = np.arange(0, 24, CELL) + CELL / 2
    top = np.full((len(y), len(x)), np.nan)
    for east, north, height, radius in trees:
        share = np.hypot(x[None] - east, y[:, None] - north) / radius
        top = np.fmax(top, np.where(share <= 1, height * (1 - 0.4 * share**2), np.nan))
    return x, y, top


def tree(number: int, east: float, north: float, height: float | None) -> Tree:
    return Tree(number, east, north, dbh_cm=30.0, z_ground=0.0, height_m=height)


def test_a_crown_that_stands_alone_has_its_area():
    made = crown_table([tree(5, 12, 12, 20.0)], {}, [canopy([(12.0, 12.0, 20.0, 2.5)])], "EPSG:32632")
    assert made["tree_id"].tolist() == [5]
    assert made["crown_m2"][0] == pytest.approx(np.pi * 2.5**2, rel=0.06)
    assert made.geometry[0].area == pytest.approx(made["crown_m2"][0], abs=0.01)


def test_touching_crowns_meet_in_the_middle_and_a_neighbour_keeps_its_own():
    """Trees 1 and 2 are measured; the third is nobody's."""
    places = [(8.0, 12.0, 20.0, 2.5), (12.0, 12.0, 20.0, 2.5), (16.0, 12.0, 20.0, 2.5)]
    made = crown_table([tree(1, 8, 12, 20.0), tree(2, 12, 12, 20.0)], {}, [canopy(places)], "EPSG:32632")
    assert made["tree_id"].tolist() == [1, 2]
    lens = 2 * 2.5**2 * np.arccos(2 / 2.5) - 4 * np.sqrt(2.5**2 - 2**2)
    disc = np.pi * 2.5**2
    assert made["crown_m2"][0] == pytest.approx(disc - lens / 2, rel=0.07)
    assert made["crown_m2"][1] == pytest.approx(disc - lens, rel=0.07)
    assert made.geometry[0].intersection(made.geometry[1]).area < 0.2


def test_a_leaning_tree_has_the_crown_over_its_top():
    curve = np.array([[9.0, 12.0, 0.0, 34.0], [9.75, 12.0, 5.0, 28.0]])
    made = crown_table([tree(1, 9.2, 12, 20.0)], {1: curve}, [canopy([(12.0, 12.0, 20.0, 2.5)])], "EPSG:32632")
    assert made["tree_id"].tolist() == [1]


@pytest.mark.parametrize("height", [None, 12.0])
def test_without_a_top_there_is_no_crown(height):
    """No height, or one that no tip has."""
    assert not len(crown_table([tree(1, 12, 12, height)], {}, [canopy([(12.0, 12.0, 20.0, 2.5)])], "EPSG:32632"))
    tops = np.array([[12.0, 12.0, np.nan if height is None else height]])
    assert (crown_cells(*canopy([(12.0, 12.0, 20.0, 2.5)]), tops) <= 0).all()
