"""Guided matching, how sure poses are at the stems, and when more is spent on a block."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_block import CAMERA, LENS, block_of, known_of, ring, still_sensor

from treedgs_geo.core import progress
from treedgs_geo.core.errors import ReconstructionError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction import incremental_block, matching_strategy
from treedgs_geo.reconstruction.adjustment import adjust
from treedgs_geo.reconstruction.bundle import Problem
from treedgs_geo.reconstruction.bundle_kernels import N_POSE
from treedgs_geo.reconstruction.covariance import SYSTEMATIC, posterior_of
from treedgs_geo.reconstruction.guided_matching import Guide, match_guided
from treedgs_geo.reconstruction.incremental_block import Joined
from treedgs_geo.reconstruction.matching_strategy import LEFT_PX, SURE_WORST_PX, better, levels_of, not_enough
from treedgs_geo.reconstruction.poses import rotation_from_gimbal
from treedgs_geo.reconstruction.resection import confirmed
from treedgs_geo.reconstruction.sift import FeatureStore, PhotoFeatures
from treedgs_geo.reconstruction.tracks import Block
from treedgs_geo.stems.quality.limits import judge

GOOD = {
    "photos": 62,
    "registered": 62,
    "confirmed": 62,
    "placed_by_ground": 0,
    "left_out_by_ground": 0,
    "poses_px_median": 0.03,
    "poses_px_worst": 0.1,
    "reprojection_rms_px": 0.17,
    "points_per_photo_median": 260.0,
    "track_length": 4.1,
}


def _store(seed: int, views, points: np.ndarray, clutter: int) -> SimpleNamespace:
    """Features of points that all photos describe nearly alike, in any order among others that belong to nothing."""
    rng = np.random.default_rng(seed)
    looks = _described(rng, len(points))
    angle, bright = rng.uniform(0, 2 * np.pi, len(points)), rng.uniform(size=len(points)) < 0.5
    along = 0.05 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(points))])
    found, numbers = [], []
    for view in views:
        pixels, _ = view.project(points)
        step = view.project(points + along)[0] - pixels
        turned = np.arctan2(step[:, 1], step[:, 0]) + rng.normal(0, 0.1, len(points))
        seen = np.flatnonzero(view.contains(pixels))
        own = np.clip(looks[seen] + rng.normal(0, 6, (len(seen), 128)), 0, 255).astype(np.uint8)
        order = rng.permutation(len(seen) + clutter)
        anywhere = rng.uniform([0, 0], [CAMERA.width, CAMERA.height], (clutter, 2))
        found.append(
            PhotoFeatures(
                np.vstack([pixels[seen] + rng.normal(0, 0.3, (len(seen), 2)), anywhere])[order],
                np.vstack([own, _described(rng, clutter)])[order],
                (np.concatenate([turned[seen], rng.uniform(0, 2 * np.pi, clutter)])[order] % (2 * np.pi)).astype("f4"),
                np.concatenate([bright[seen], rng.uniform(size=clutter) < 0.5])[order],
            )
        )
        numbers.append(np.concatenate([seen, np.full(clutter, -1)])[order])
    store = FeatureStore(found)
    return SimpleNamespace(**vars(store), numbers=numbers)


def _described(rng: np.random.Generator, count: int) -> np.ndarray:
    values = rng.exponential(1.0, (count, 128))
    return np.clip(512 * values / np.linalg.norm(values, axis=1, keepdims=True), 0, 255).astype(np.uint8)


def _guide(views, rng: np.random.Generator, error_deg: float) -> Guide:
    upright = rotation_from_gimbal(0, 0, 0)
    turned = [rotation_from_gimbal(*rng.normal(0, error_deg, 3)) @ upright.T @ view.rotation for view in views]
    return Guide(np.array(turned), np.array([view.centre for view in views]), CAMERA, -2.0, 8.0)


def test_guided_matches_are_right_and_the_same_on_any_number_of_threads() -> None:
    rng = np.random.default_rng(3)
    views = ring(8)
    store = _store(1, views, rng.uniform([-15, -15, 0], [15, 15, 6], (400, 3)), 600)
    guide, pairs = _guide(views, rng, 0.3), np.array([(i, (i + 1) % 8) for i in range(7)])
    match_guided(store, pairs, guide, 1, 1, Reporter())
    first = store.matches
    match_guided(store, pairs, guide, 1, 2, Reporter())
    assert first.keys() == store.matches.keys() == {tuple(pair) for pair in pairs.tolist()}
    right = total = 0
    for (i, j), rows in first.items():
        np.testing.assert_array_equal(rows, store.matches[i, j])
        one, two = store.numbers[i][rows[:, 0]], store.numbers[j][rows[:, 1]]
        right, total = right + int(((one == two) & (one >= 0)).sum()), total + len(rows)
        assert len(np.unique(rows[:, 0])) == len(np.unique(rows[:, 1])) == len(rows)
    assert right > 0.97 * total and total > 7 * 100


def test_consumer_geotags_guide_where_their_error_is_stated() -> None:
    rng = np.random.default_rng(7)
    views = ring(8)
    store = _store(1, views, rng.uniform([-15, -15, 0], [15, 15, 6], (400, 3)), 600)
    guide, pairs = _guide(views, rng, 0.3), np.array([(i, (i + 1) % 8) for i in range(7)])
    guide = replace(guide, centres=guide.centres + rng.normal(0, 1.0, guide.centres.shape))
    match_guided(store, pairs, guide, 1, 1, Reporter())
    believed = sum(map(len, store.matches.values()))
    match_guided(store, pairs, replace(guide, baseline_sd_m=1.4), 1, 1, Reporter())
    right = total = 0
    for (i, j), rows in store.matches.items():
        one, two = store.numbers[i][rows[:, 0]], store.numbers[j][rows[:, 1]]
        right, total = right + int(((one == two) & (one >= 0)).sum()), total + len(rows)
    assert right > 0.95 * total and total > max(6 * 300, 1.2 * believed)


def test_a_first_block_guides_to_more_matches_than_gimbals_and_only_where_it_is_sure() -> None:
    """Twice as many features that belong to nothing, so that rivals are about."""
    rng = np.random.default_rng(9)
    views = ring(8)
    store = _store(5, views, rng.uniform([-15, -15, 0], [15, 15, 6], (400, 3)), 1600)
    coarse, pairs = _guide(views, rng, 0.5), np.array([[0, 1], [4, 5]])
    match_guided(store, pairs, coarse, 1, 1, Reporter())
    before = dict(store.matches)
    rotations = np.array([view.rotation for view in views])
    # Photos 4 to 7 are not sure, and the block has them where they are not.
    rotations[4:] = rotation_from_gimbal(20, 0, 0)
    fine = coarse.finer(rotations, coarse.centres, CAMERA, np.arange(8) < 4)
    assert fine.reach(0, 1) < 0.2 * coarse.reach(0, 1) and fine.reach(0, 4) == coarse.reach(0, 4)
    match_guided(store, pairs, fine, 1, 1, Reporter())
    assert len(store.matches[0, 1]) > 1.1 * len(before[0, 1])
    rows = store.matches[0, 1]
    one, two = store.numbers[0][rows[:, 0]], store.numbers[1][rows[:, 1]]
    assert ((one == two) & (one >= 0)).mean() > 0.97
    # Where the gimbals' directions are still those of before, so are nearly all the matches.
    assert len(set(map(tuple, store.matches[4, 5])) & set(map(tuple, before[4, 5]))) > 0.9 * len(before[4, 5])


def test_gimbals_that_are_wrong_or_photos_that_share_nothing_give_no_matches() -> None:
    rng = np.random.default_rng(4)
    views = ring(8)
    points = rng.uniform([-15, -15, 0], [15, 15, 6], (400, 3))
    store, other = _store(1, views, points, 200), _store(2, views, points, 200)
    guide, pairs = _guide(views, rng, 0.3), np.array([[0, 1], [2, 3]])
    guide.rotations[1] = rotation_from_gimbal(20, 0, 0) @ rotation_from_gimbal(0, 0, 0).T @ guide.rotations[1]
    match_guided(store, pairs, guide, 1, 1, Reporter())
    assert list(store.matches) == [(2, 3)]
    store.own[3] = other.own[3]
    match_guided(store, pairs, guide, 1, 1, Reporter())
    assert not store.matches


def test_reduced_equations_are_those_of_the_whole() -> None:
    """Points eliminated from the dense normal equations, travel free or not, a photo that sees a point twice."""
    rng = np.random.default_rng(5)
    block = block_of(ring(5), rng.uniform([-9, -9, 0], [9, 9, 4], (12, 3)), 0.3, rng)
    block.keypoints[2] = np.vstack([block.keypoints[2], block.keypoints[2][:1] + 0.4])
    block.image, block.key = np.append(block.image, 2), np.append(block.key, len(block.keypoints[2]) - 1)
    block.point = np.append(block.point, block.point[block.image[:-1] == 2][0])
    for travel_m in (0.0, 0.05):
        known = known_of(block.centres, 0.02, readout_sd_s=0.02, travel_sd_m=travel_m)
        problem = Problem(block, known, LENS | {"travel"})
        state = problem.start
        problem.linearise(state)
        weights = problem.weigh(state, 0.3, 3.0)._replace(tags=np.zeros(5))
        problem.weight[:] = 0
        matrix, right, _ = problem.normal(state, weights, 0.0)
        size, rows = len(right), len(block.image)
        whole = np.zeros((2 * rows, size + 3 * len(block.points)))
        for m in range(rows):
            at = slice(2 * m, 2 * m + 2)
            own = block.image[m] * N_POSE
            whole[at, own : own + N_POSE] = problem.linear.by_pose[m]
            whole[at, 5 * N_POSE : size] = problem.linear.by_shared[m]
            whole[at, size + 3 * block.point[m] : size + 3 * block.point[m] + 3] = problem.linear.by_point[m]
        weight = np.repeat(weights.pixels, 2)
        normal, pull = whole.T @ (weight[:, None] * whole), -whole.T @ (weight * problem.linear.residual.ravel())
        inner = np.linalg.solve(normal[size:, size:], np.column_stack([normal[size:, :size], pull[size:]]))
        reduced = normal[:size, :size] - normal[:size, size:] @ inner[:, :-1]
        free = problem.free
        upper = np.triu_indices(len(free))
        scale = np.sqrt(np.outer(np.diag(normal)[free], np.diag(normal)[free]))
        difference = (matrix - reduced)[np.ix_(free, free)] / np.maximum(scale, 1e-12)
        assert np.abs(difference[upper]).max() < 1e-7
        np.testing.assert_allclose(
            right[free], (pull[:size] - normal[:size, size:] @ inner[:, -1])[free], rtol=1e-5, atol=1e-3
        )


def test_pose_errors_at_the_stems_are_those_of_repeated_adjustments() -> None:
    views, rng = ring(9) + ring(6, 80.0, -75.0), np.random.default_rng(6)
    points, place = rng.uniform([-15, -15, 0], [15, 15, 6], (60, 3)), np.array([[0.0, 0, 1]])
    shown, stated = [], []
    for repeat in range(25):
        own = np.random.default_rng(100 + repeat)
        block = block_of(views, points, 0.3, own)
        tags = block.centres + own.normal(0, 0.02, (len(views), 3))
        adjusted = adjust(block, known_of(tags, 0.02), LENS, tolerance=1e-6)
        stated.append(posterior_of(adjusted).poses_px / SYSTEMATIC)
        found = np.array([block.view(i).project(place)[0][0] for i in range(len(views))])
        # Less what a shift of the place would do, as if it were intersected from all photos.
        toward = np.array(
            [block.view(i).project(place + step)[0][0] - found[i] for i in range(15) for step in 1e-3 * np.eye(3)]
        )
        toward = toward.reshape(15, 3, 2).transpose(0, 2, 1).reshape(30, 3)
        off = (found - np.array([view.project(place)[0][0] for view in views])).ravel()
        shown.append((off - toward @ np.linalg.lstsq(toward, off, rcond=None)[0]).reshape(15, 2))
    scatter = np.sqrt(np.mean(np.square(shown), axis=(0, 2)))
    assert np.mean(stated, axis=0) == pytest.approx(scatter, rel=0.4)
    assert np.mean(stated) == pytest.approx(scatter.mean(), rel=0.15)


def test_more_is_spent_where_a_block_is_not_sure_enough() -> None:
    guided, fine, full = levels_of(20, True)
    assert not_enough(guided, GOOD) == ""
    assert not_enough(guided, GOOD | {"registered": 60}) == "2 of 62 photos are not placed"
    assert not_enough(guided, GOOD | {"registered": 61}) == ""
    assert not_enough(guided, GOOD | {"photos": 24, "registered": 23}) == "1 of 24 photos are not placed"
    assert "0.31 px" in not_enough(guided, GOOD | {"poses_px_worst": 0.31})
    assert "0.16 px" in not_enough(guided, GOOD | {"poses_px_median": 0.16})
    assert not_enough(guided, GOOD | {"poses_px_worst": SURE_WORST_PX, "reprojection_rms_px": LEFT_PX}) == ""
    assert "0.66 px are left" in not_enough(guided, GOOD | {"reprojection_rms_px": 0.66})
    assert "92 points" in not_enough(guided, GOOD | {"points_per_photo_median": 92.0})
    assert not_enough(guided, GOOD | {"poses_px_median": None, "poses_px_worst": None})
    # What matches in the wind cannot give, matching without a guide does not give either.
    assert not_enough(fine, GOOD | {"poses_px_worst": 0.31, "reprojection_rms_px": 0.66}) == ""
    assert not_enough(fine, GOOD | {"registered": 57}) == ""
    assert not_enough(fine, GOOD | {"registered": 55}) == "7 of 62 photos are not placed"
    assert [level.name for level in (guided, fine, full)] == ["guided", "fine", "full"]
    assert [(level.name, level.neighbours) for level in levels_of(20, False)] == [("full", 20)]
    assert [level.neighbours for level in levels_of(6, True)] == [6, 6, 6]


@pytest.mark.parametrize(
    ("blocks", "chosen", "asked", "reasons"),
    [
        ([GOOD], "guided", 1, ""),
        ([GOOD | {"poses_px_worst": 0.4}, GOOD | {"poses_px_median": 0.04}], "fine", 2, "0.40 px"),
        ([GOOD | {"registered": 60}, GOOD | {"registered": 59}], "guided", 2, "2 of 62 photos are not placed"),
        ([GOOD | {"registered": 20}, GOOD | {"registered": 30}, GOOD | {"registered": 30}], "fine", 3, "; 32 of 62"),
        ([GOOD | {"registered": 20}, GOOD | {"registered": 31}], "fine", 2, "; 31 of 62"),
        ([GOOD | {"registered": 60}, GOOD | {"registered": 61}], "fine", 2, "2 of 62 photos are not placed"),
        ([GOOD | {"registered": 20}, GOOD | {"registered": 30}, GOOD], "full", 3, "are not placed; 32 of 62"),
        ([GOOD | {"registered": 20}, GOOD | {"registered": 30}, GOOD | {"registered": 29}], "fine", 3, "; 32 of 62"),
        ([GOOD | {"registered": 30}, GOOD | {"registered": 29}, None], "guided", 3, "; 33 of 62"),
        ([None, GOOD], "full", 2, "nothing there"),
    ],
)
def test_the_best_block_of_the_levels_is_taken(monkeypatch, blocks, chosen, asked, reasons) -> None:
    left, tried, said = list(blocks), [], []

    class Ear(Reporter):
        def _emit(self, kind, body):
            if kind == "warn":
                said.append(body["message"])

    def at_level(work, level, held, former=None):
        tried.append(level.name)
        report = left.pop(0)
        held.warn(f"of {level.name}")
        if report is None:
            raise ReconstructionError("nothing there.")
        return SimpleNamespace(level=level.name), report

    monkeypatch.setattr(matching_strategy, "at_level", at_level)
    monkeypatch.setattr(matching_strategy, "kept_poses", lambda former, survey: former)
    level, joined, report, because = matching_strategy.climb(SimpleNamespace(survey=None), levels_of(20, True), Ear())
    assert (level.name, joined.level, len(tried)) == (chosen, chosen, asked)
    assert reasons in because and bool(because) == bool(reasons)
    assert said == [f"of {chosen}"]
    monkeypatch.setattr(
        matching_strategy, "at_level", lambda *_: (_ for _ in ()).throw(ReconstructionError("no photo."))
    )
    with pytest.raises(ReconstructionError, match="no photo"):
        matching_strategy.climb(SimpleNamespace(survey=None), levels_of(20, True), Ear())


def test_photos_that_the_ground_placed_are_enough_where_crowns_hide_it_from_the_others() -> None:
    guided, fine, full = levels_of(20, True)
    placed = GOOD | {"registered": 42, "placed_by_ground": 10, "left_out_by_ground": 20}
    assert not not_enough(guided, placed)
    assert "not placed" in not_enough(guided, placed | {"registered": 41})
    assert "sure to" in not_enough(guided, placed | {"poses_px_median": 0.2})
    assert not not_enough(guided, placed | {"points_per_photo_median": 60.0, "reprojection_rms_px": 0.7})
    # Those that the ground has nothing to do with are missed.
    assert "not placed" in not_enough(guided, placed | {"left_out_by_ground": 18})
    # As many photos from more matches in moving crowns are no gain.
    assert better(fine, GOOD, GOOD) and not better(fine, placed, placed) and not better(full, GOOD, GOOD)


def test_nothing_is_spent_on_a_block_that_cannot_be_better(monkeypatch) -> None:
    unsure = GOOD | {"poses_px_median": 0.19}
    for missing, tried in ((0, ["guided"]), (31, ["guided"]), (32, ["guided", "full"])):
        asked: list[str] = []

        def at_level(work, level, held, former=None, asked=asked, missing=missing):
            asked.append(level.name)
            return SimpleNamespace(level=level.name), unsure | {"registered": 62 - missing}

        monkeypatch.setattr(matching_strategy, "at_level", at_level)
        monkeypatch.setattr(matching_strategy, "kept_poses", lambda former, survey: None)
        level, *_, because = matching_strategy.climb(SimpleNamespace(survey=None), levels_of(20, True), Reporter())
        assert (level.name, asked) == ("guided", tried) and because


def test_messages_of_work_that_is_not_used_are_not_passed_on() -> None:
    said: list[tuple[str, str]] = []

    class Ear(Reporter):
        def _emit(self, kind, body):
            if kind in ("warn", "info", "stage"):
                said.append((kind, body.get("message", body.get("name"))))

    held = progress.Collector(Ear(), held=True)
    with held.stage("matching"):
        held.warn("a photo is left out")
        held.progress(0.5)
    assert said == [("stage", "matching")]
    held.release()
    held.release()
    assert said[1:] == [("warn", "a photo is left out")]


def test_a_reporter_with_words_of_its_own_hears_what_was_kept_back() -> None:
    heard: list[str] = []

    class Own(Reporter):
        def warn(self, message):
            heard.append(message)

    held = progress.Collector(Own(), held=True)
    held.warn("a photo is left out")
    assert not heard and held.warnings == ["a photo is left out"]
    held.release()
    held.warn("and another one")
    assert heard == ["a photo is left out", "and another one"]


def test_a_photo_that_few_points_tie_is_less_sure() -> None:
    rng = np.random.default_rng(8)
    many = block_of(ring(9), rng.uniform([-15, -15, 0], [15, 15, 6], (200, 3)), 0.3, rng)
    few = replace(many, rotations=many.rotations.copy(), translations=many.translations.copy())
    few.keep((few.image != 4) | (few.point % 20 == 0))
    known = known_of(many.centres, 0.02)
    sure, unsure = (posterior_of(adjust(block, known, LENS)).poses_px for block in (many, few))
    assert unsure[4] > 2 * sure[4] and unsure[1] < 1.3 * sure[1]


def test_the_next_level_starts_from_the_sure_poses(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(11)
    block = block_of(ring(10), rng.uniform([-15, -15, 0], [15, 15, 6], (200, 3)), 0.3, rng)
    weak = np.flatnonzero(block.image == 3)[9:]
    kept = np.ones(len(block.image), bool)
    kept[weak] = False
    block.keep(kept)
    known = known_of(block.centres, 0.02)
    joined = Joined(block, adjust(block, known, LENS, final=True), known, LENS, False, block.is_posed, 0, 0)
    survey = SimpleNamespace(known=known, rotations=block.rotations.copy())
    pixels = posterior_of(joined.adjusted).poses_px
    others = np.delete(pixels, 3)
    assert pixels[3] > 1.5 * others.max()
    monkeypatch.setattr(matching_strategy, "SURE_WORST_PX", 0.5 * (pixels[3] + others.max()))
    placement = matching_strategy.kept_poses(joined, survey)
    assert placement is not None and placement.mapped.tolist() == [k != 3 for k in range(10)]
    np.testing.assert_array_equal(placement.translations[placement.mapped], block.translations[placement.mapped])
    # The weak one stands at its geotag, not where the block had it.
    centre = -placement.rotations[3].T @ placement.translations[3]
    np.testing.assert_allclose(centre, known.xyz[3], atol=1e-9)
    every = matching_strategy.kept_poses(joined, survey, all_poses=True)
    assert every is not None and every.mapped.all()
    np.testing.assert_array_equal(every.translations, block.translations)
    monkeypatch.setattr(matching_strategy, "SURE_WORST_PX", 0.5 * np.sort(pixels)[3])
    assert matching_strategy.kept_poses(joined, survey) is None
    assert matching_strategy.kept_poses(joined, survey, all_poses=True) is None
    assert matching_strategy.kept_poses(None, survey) is None


def test_a_photo_that_hangs_on_few_points_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(12)
    block = block_of(ring(10), rng.uniform([-15, -15, 0], [15, 15, 6], (200, 3)), 0.3, rng)
    kept = np.ones(len(block.image), bool)
    kept[np.flatnonzero(block.image == 3)[8:]] = False
    block.keep(kept)
    known = known_of(block.centres, 0.02)
    pixels = posterior_of(adjust(block, known, LENS, final=True)).poses_px
    names, told = [f"{k}.jpg" for k in range(10)], Collector()
    monkeypatch.setattr(incremental_block, "LOOSE_PX", 1.1 * pixels[3])
    assert not incremental_block.leave_out_loose(block, pixels, names, told) and block.is_posed.all()
    monkeypatch.setattr(incremental_block, "LOOSE_PX", 0.9 * pixels[3])
    monkeypatch.setattr(incremental_block, "LOOSE_TIMES", 0.9 * pixels[3] / np.median(pixels))
    assert incremental_block.leave_out_loose(block, pixels, names, told)
    assert block.is_posed.tolist() == [k != 3 for k in range(10)]
    assert "3.jpg" in told.said[0] and 3 not in block.image
    assert not incremental_block.leave_out_loose(block, np.full(10, np.nan), names, told)


class Collector(Reporter):
    """Keeps warnings."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []

    def warn(self, message: str) -> None:
        self.said.append(message)


def test_a_photo_that_wrong_matches_turned_is_not_confirmed_by_the_points_of_others() -> None:
    rng = np.random.default_rng(11)
    views, points = ring(8), rng.uniform([-15, -15, 0], [15, 15, 6], (400, 3))
    store = _store(1, views, points, 600)
    turn = rotation_from_gimbal(1, 0, 0) @ rotation_from_gimbal(0, 0, 0).T
    rotations = np.array([view.rotation for view in views])
    rotations[3] = turn @ rotations[3]
    # Half of what a photo shows ties it.
    rows = [(i, key) for i, own in enumerate(store.numbers) for key in np.flatnonzero(own >= 0) if rng.uniform() < 0.5]
    image, key = np.array(rows).T
    point = np.array([store.numbers[i][k] for i, k in rows])
    translations = -np.einsum("nij,nj->ni", rotations, [view.centre for view in views])
    block = Block(still_sensor(CAMERA, 8), rotations, translations, store.keypoints, points, image, key, point)
    np.testing.assert_array_equal(confirmed(block, store), np.arange(8) != 3)


def test_a_block_whose_photos_are_not_confirmed_is_not_enough_and_flags_its_trees() -> None:
    guided, fine, _ = levels_of(20, True)
    weak = GOOD | {"confirmed": 30}
    assert "confirmed" in not_enough(guided, weak) and "confirmed" in not_enough(fine, weak)
    assert judge("photos", {"confirmed": 30 / 62}).flagged and not judge("photos", {"confirmed": 32 / 62}).reasons
