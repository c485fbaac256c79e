"""The turns of all photos from candidate matches of which nine in ten are wrong."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from treedgs_geo.reconstruction.turns import Candidates, agreed_turns

FOCAL = 3800.0


def candidates(rng, right: int, wrong: int, turns: Rotation, reach_rad: float = 0.02):
    """Photos in a ring of 25 m, 60 m up, that look at a plot; rays as gimbals have them, turned by ``turns``."""
    count = len(turns)
    angle = 2 * np.pi * np.arange(count) / count
    centres = np.column_stack([25 * np.cos(angle), 25 * np.sin(angle), np.full(count, 60.0)])
    pairs, starts, a, b, good = [], [0], [], [], []
    for i in range(count):
        for j in range(i + 1, count):
            points = np.column_stack([rng.uniform(-12, 12, (right + wrong, 2)), rng.uniform(0, 20, right + wrong)])
            rays = [points - centres[k] for k in (i, j)]
            rays = [ray / np.linalg.norm(ray, axis=1, keepdims=True) for ray in rays]
            # Half a pixel of noise; wrong ones lie anywhere in the reach.
            rays[1] = rays[1] + rng.normal(0, 0.5 / FOCAL, rays[1].shape)
            rays[1][right:] += rng.uniform(-reach_rad, reach_rad, (wrong, 3))
            # What gimbals say is the truth turned back.
            a.append(turns[i].inv().apply(rays[0]))
            b.append(turns[j].inv().apply(rays[1]))
            pairs.append((i, j))
            starts.append(starts[-1] + right + wrong)
            good.append(np.arange(right + wrong) < right)
    return (
        Candidates(np.array(pairs), np.array(starts), np.concatenate(a), np.concatenate(b)),
        centres,
        np.concatenate(good),
    )


def turned(rng, count: int, sd_deg: tuple[float, float, float]) -> Rotation:
    return Rotation.from_rotvec(np.radians(sd_deg) * rng.standard_normal((count, 3)))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_right_candidates_are_told_from_nine_times_as_many_wrong_ones(seed):
    rng = np.random.default_rng(seed)
    true = turned(rng, 12, (0.2, 0.2, 0.5))
    found, centres, good = candidates(rng, 8, 72, true)
    sd = np.tile(np.radians([0.3, 0.3, 0.6]), (12, 1))
    turns, off = agreed_turns(found, centres, sd, np.full((12, 3), 0.03), FOCAL, (40.0, 4.0))
    near = np.abs(off) < 4
    assert near[good].mean() > 0.98
    assert near[~good].mean() < 0.15
    # Less the turn that all share, which candidates hardly tell.
    away = (Rotation.from_matrix(turns) * true.inv()).as_rotvec()
    assert np.abs(np.degrees(away - away.mean(axis=0))).max() < 0.1


def test_a_photo_far_from_its_gimbal_is_found_by_search():
    rng = np.random.default_rng(3)
    vectors = np.radians([0.1, 0.1, 0.2]) * rng.standard_normal((12, 3))
    vectors[4] = np.radians([0.55, -0.5, 1.0])
    found, centres, good = candidates(rng, 10, 60, Rotation.from_rotvec(vectors))
    sd = np.tile(np.radians([0.3, 0.3, 0.6]), (12, 1))
    # A loss so narrow from the start settles beside it.
    _, off = agreed_turns(found, centres, sd, np.full((12, 3), 0.03), FOCAL, (6.0, 4.0))
    own = np.repeat((found.pairs == 4).any(axis=1), np.diff(found.starts)) & good
    assert (np.abs(off[own]) < 4).mean() > 0.95


def test_the_same_on_one_thread_and_on_all():
    import numba

    rng = np.random.default_rng(4)
    found, centres, _ = candidates(rng, 8, 40, turned(rng, 8, (0.2, 0.2, 0.5)))
    sd = np.tile(np.radians([0.3, 0.3, 0.6]), (8, 1))
    results = []
    threads = numba.get_num_threads()
    for number in (1, threads):
        numba.set_num_threads(number)
        results.append(agreed_turns(found, centres, sd, np.full((8, 3), 0.03), FOCAL, (40.0, 4.0))[1])
    numba.set_num_threads(threads)
    np.testing.assert_array_equal(*results)
