"""The published fit of a whole scene in torch: density control and its optimiser, the loop, the time limit."""

from __future__ import annotations

import itertools
import sys
from dataclasses import replace

import numpy as np
import pytest
from gaussian_reference import smoothed
from painted_stem import GROUND, RADIUS, STEM, ground, scene

torch = pytest.importorskip("torch")

from treedgs_geo.core.errors import InputError, MissingComponentError  # noqa: E402
from treedgs_geo.core.progress import Reporter  # noqa: E402
from treedgs_geo.reconstruction.area import Area  # noqa: E402
from treedgs_geo.stems.splats.camera import CropCamera  # noqa: E402
from treedgs_geo.stems.splats.on_torch.scene import DensityRule, Scene, grow, to_prune, update_filter  # noqa: E402
from treedgs_geo.stems.splats.on_torch.scene_fit import SceneFit, fit_scene, plan  # noqa: E402
from treedgs_geo.stems.splats.options import SceneOptions  # noqa: E402
from treedgs_geo.stems.splats.scene_start import Box, WholePhotos, start_scales, thinned  # noqa: E402

QUICK = SceneOptions(steps=60, max_gaussians=900, tried_every=0, factor=1.0)


def small_photos() -> WholePhotos:
    """The painted scene at a third of its size."""
    import cv2

    found = WholePhotos([], [], [])
    for view in scene()[0]:
        camera = CropCamera(260, 260, 2200, 2200, 130, 130, view.rotation, view.translation).scaled(0.3)
        found.cameras.append(camera)
        picture = scene()[1][view.name]
        found.images.append(cv2.resize(picture, (camera.width, camera.height), interpolation=cv2.INTER_AREA))
        found.inside.append(np.ones((camera.height, camera.width), np.float32))
    return found


def prior(rng=None, n=300):
    """Points on the stem and on the ground about it, as stereo would find them, and their colours."""
    rng = rng or np.random.default_rng(0)
    turn = rng.uniform(0, 2 * np.pi, n // 3)
    stem = STEM + RADIUS * np.column_stack([np.cos(turn), np.sin(turn)])
    stem = np.column_stack([stem, GROUND + rng.uniform(0, 5, n // 3)])
    flat = np.column_stack([STEM + rng.uniform(-4, 4, (n - n // 3, 2)), np.full(n - n // 3, GROUND)])
    return np.concatenate([stem, flat]), np.repeat([[0.2] * 3, [0.6] * 3], [n // 3, n - n // 3], axis=0)


def box() -> Box:
    whole = Box.of(Area.circle(*STEM, 3.0), ground)
    return Box(whole.low, whole.high - [0, 0, 34.0])


def stepped(n=6) -> Scene:
    """A scene with moments in its optimiser."""
    points, colours = prior(n=n)
    made = Scene(points, colours, np.full(n, 0.1))
    for power in (1, 2):
        made.optimiser.zero_grad()
        sum(((k + 1) * (tensor**power)).sum() for k, tensor in enumerate(made.tensors.values())).backward()
        made.optimiser.step()
    return made


def moments(made: Scene) -> dict[str, torch.Tensor]:
    return {name: made.optimiser.state[tensor]["exp_avg"] for name, tensor in made.tensors.items()}


def test_growing_and_pruning_keep_the_optimisers_state_with_its_gaussians():
    made = stepped()
    before, kept = moments(made), {name: tensor.detach().clone() for name, tensor in made.tensors.items()}
    pull = torch.tensor([[0.0, 1, 0, 0, 1, 0], [1.0] * 6])
    with torch.no_grad():
        made.tensors["log_scales"][4] = 1.0  # large: it is split; the other is cloned
    kept["log_scales"][4] = 1.0
    split, cloned = grow(made, pull, 10.0, 100, DensityRule(), torch.Generator().manual_seed(0))
    assert (split, cloned, len(made)) == (1, 1, 8)  # six, less the one split, with two halves and a clone
    stays = [0, 1, 2, 3, 5]
    for name, tensor in made.tensors.items():
        assert torch.equal(tensor[:5].detach(), kept[name][stays])
        assert torch.equal(moments(made)[name][:5], before[name][stays])
        assert float(moments(made)[name][5:].abs().sum()) == 0
        assert tensor.requires_grad and tensor is next(
            group["params"][0] for group in made.optimiser.param_groups if group["name"] == name
        )
    assert torch.equal(made.tensors["means"][5], kept["means"][1])  # a clone starts where its parent stands
    half = torch.exp(made.tensors["log_scales"][6:])
    torch.testing.assert_close(half, torch.full((2, 3), np.e / 1.6))
    assert len(made.optimiser.state) == len(made.tensors) and len(made.filter_m) == 8
    made.keep(torch.arange(8) != 2)
    assert torch.equal(moments(made)["means"][:4], before["means"][[0, 1, 3, 5]])
    # The steps go on counting, and a step moves old and new alike.
    now = made.tensors["means"].detach().clone()
    (made.tensors["means"] ** 2).sum().backward()
    made.optimiser.step()
    assert float(made.optimiser.state[made.tensors["means"]]["step"]) == 3
    assert ((made.tensors["means"] - now).abs().sum(dim=1) > 0).all()


def test_growing_stops_at_the_limit_and_takes_the_most_pulled():
    made = stepped()
    pull = torch.tensor([[1.0, 5, 2, 4, 3, 0], [1.0] * 6])
    assert grow(made, pull, 1e3, 2, DensityRule(), torch.Generator()) == (0, 2)
    assert torch.equal(made.tensors["means"][6:], made.tensors["means"][[1, 3]])
    assert grow(made, torch.zeros(2, 8), 1e3, 5, DensityRule(), torch.Generator()) == (0, 0)
    weak = torch.tensor([[3e-4] * 8, [1.0] * 8])
    assert grow(made, weak, 1e3, 9, DensityRule(), torch.Generator(), 2.0) == (0, 0)


def test_what_is_pruned():
    made, rule = stepped(), DensityRule()
    with torch.no_grad():
        made.tensors["opacity_logits"][:] = 1.0
        made.tensors["opacity_logits"][0] = -4.0  # faint
        made.tensors["log_scales"][:] = np.log(0.05)
        made.tensors["log_scales"][1] = np.log(2.0)  # huge for an extent of 10 m
        made.tensors["log_scales"][2] = np.log(0.3)  # wide in a photo, as a stem's are
        made.tensors["means"][3, 0] = torch.nan
        made.tensors["opacity_logits"][3] = torch.nan
    inside = torch.tensor([True] * 4 + [False, True])
    gone = to_prune(made, inside, 10.0, rule, True, True)
    assert gone.tolist() == [True, True, False, True, True, False]
    gone = to_prune(made, inside, 10.0, rule, False, False)
    assert gone.tolist() == [False, False, False, True, True, False]


def test_a_start_that_is_wide_for_want_of_gaussians_is_not_pruned_for_it():
    points, colours = prior()
    fit = SceneFit(Scene(points, colours, np.full(300, 1.0)), small_photos(), box(), QUICK)
    # Resets after a few steps, which prune nothing as faint.
    fit.rule = replace(fit.rule, rest_steps=2, faint=0.0)
    fit.fit()
    assert fit.now.last_reset > 0 and len(fit.scene) > 200


def test_what_a_fit_warns_of():
    points, colours = prior()
    fit = SceneFit(Scene(points, colours, np.full(300, 0.02)), small_photos(), box(), QUICK)
    whole = replace(fit.report(300), steps=30_000)
    assert whole.warnings(QUICK) == []
    (cut,) = replace(whole, steps=700).warnings(replace(QUICK, time_limit_min=8))
    assert "cut short by the time limit of 8 minutes" in cut and "700 of the published" in cut
    (lost,) = replace(whole, gaussians=147).warnings(QUICK)
    assert "147 of the 300" in lost
    (limited,) = replace(whole, full=True).warnings(QUICK)
    assert "stopped at 900" in limited


def test_a_saved_scene_comes_back_to_the_bit():
    made = stepped()
    kept = made.save()
    expected = {name: tensor.detach().clone() for name, tensor in made.tensors.items()}
    for _ in range(2):
        (made.tensors["means"] ** 2).sum().backward()
        made.optimiser.step()
        made.keep(torch.arange(len(made)) > 0)
        made.restore(kept)
        assert all(torch.equal(tensor.detach(), expected[name]) for name, tensor in made.tensors.items())
        assert float(made.optimiser.state[made.tensors["quats"]]["step"]) == 2


def test_the_filter_is_that_of_the_numpy_field_and_of_the_nearest_photo():
    points, colours = prior(n=30)
    made, cameras = Scene(points, colours, np.full(30, 0.02)), small_photos().cameras
    update_filter(made, cameras)
    depth = np.full(30, np.inf)
    for camera in cameras:
        pixels, away = camera.project(points)
        shown = (np.abs(pixels / [camera.width, camera.height] - 0.5) < 0.65).all(axis=1)
        depth = np.where(shown, np.minimum(depth, away / camera.fx), depth)
    np.testing.assert_allclose(made.filter_m.numpy(), 0.2**0.5 * depth, rtol=1e-4)
    packed = made.field().packed
    made.filter_m[:] = 0
    unfiltered = made.field().packed
    for k in (0, 7):
        np.testing.assert_allclose(packed[k], smoothed(unfiltered[k : k + 1], 0.2**0.5 * depth[k])[0], rtol=2e-4)


def test_the_box_cuts_points_and_pixels():
    cut = box()
    assert cut.contains(
        np.array([[*STEM, GROUND + 1], [*STEM, GROUND + 7], [STEM[0] + 7, STEM[1], GROUND]])
    ).tolist() == [
        True,
        False,
        False,
    ]
    camera = small_photos().cameras[0]
    seen = cut.seen(camera)
    rays = camera.pixel_rays() @ camera.rotation
    for row, column in ((39, 39), (0, 0), (5, 70), (70, 20)):
        at = camera.centre + rays[row, column] * np.linspace(0, 120, 20_000)[:, None]
        assert seen[row, column] == cut.contains(at).any()
    with pytest.raises(InputError, match="ground under the plots"):
        Box.of(Area.circle(0, 0, 3), lambda x, y: np.full(np.shape(x), np.nan))


def test_points_are_thinned_to_the_limit_and_scaled_by_their_neighbours():
    points, colours = prior(n=3000)
    few, shades = thinned(points, colours, 500)
    assert 200 < len(few) <= 500 and shades.min() >= 0.199 and shades.max() <= 0.601
    line = np.column_stack([np.arange(20.0), np.zeros(20), np.zeros(20)])
    assert start_scales(line)[10] == pytest.approx(np.sqrt((1 + 1 + 4) / 3))


def test_a_fit_lowers_its_loss_grows_and_repeats_to_the_bit():
    photos, (points, colours) = small_photos(), prior()
    first, report = fit_scene(photos, box(), points, colours, QUICK)
    assert report.steps == 60 and report.ended == "schedule" and report.gaussians_first <= 300
    assert report.loss[1] < 0.7 * report.loss[0]
    assert report.counts["split"] + report.counts["cloned"] > 0 and report.gaussians > report.gaussians_first
    assert len(first) <= 900 and box().contains(first.means.astype(float)).all()
    again, same = fit_scene(photos, box(), points, colours, QUICK)
    assert np.array_equal(first.packed, again.packed)
    assert replace(same, cpu_s=0) == replace(report, cpu_s=0)
    other, _ = fit_scene(photos, box(), points, colours, replace(QUICK, seed=1))
    assert not np.array_equal(first.packed[:50], other.packed[:50])


def test_a_fit_that_was_cut_off_goes_on_to_the_bit(tmp_path, monkeypatch):
    photos, (points, colours), kept = small_photos(), prior(), tmp_path / "fit.pt"
    whole, report = fit_scene(photos, box(), points, colours, QUICK)
    minutes = itertools.count(step=60.0)
    monkeypatch.setattr("treedgs_geo.stems.splats.on_torch.scene_fit._clock", lambda device: next(minutes))

    class Cut(Reporter):
        def progress(self, fraction):
            if fraction > 0.5:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fit_scene(photos, box(), points, colours, QUICK, Cut(), kept)
    again, same = fit_scene(photos, box(), points, colours, QUICK, kept=kept)
    assert np.array_equal(whole.packed, again.packed)
    assert replace(same, cpu_s=0) == replace(report, cpu_s=0)


def test_rlgs_tries_takes_back_and_repeats():
    photos, (points, colours) = small_photos(), prior()
    options = replace(QUICK, phase_steps=5, tried_every=3, steps=30)
    field, report = fit_scene(photos, box(), points, colours, options)
    # Six phases, two of them tried: six trials each beside the one that counts.
    assert report.steps == 30 and report.phases_tried == 2 and report.tried == 2 * 6 * 5
    assert np.array_equal(field.packed, fit_scene(photos, box(), points, colours, options)[0].packed)


def test_a_time_limit_plans_fewer_steps_and_smaller_photos_and_is_kept(monkeypatch):
    # More steps than any machine does in three seconds: the smallest size is taken.
    monkeypatch.setattr("treedgs_geo.stems.splats.on_torch.scene_fit.MIN_STEPS", 20_000)
    photos, (points, colours) = small_photos(), prior()
    options = replace(QUICK, steps=30_000, factor=0.0, time_limit_min=0.05)
    _, report = fit_scene(photos, box(), points, colours, options)
    assert report.cpu_s < 3.5 and 1 <= report.steps < 30_000
    assert report.factor == 0.25 and "0.25 times their size" in report.sentence()
    assert f"{report.steps:,} of the published 30,000" in report.sentence()


def test_the_plan_counts_the_controllers_trials():
    alone = plan(0.1, 600, SceneOptions(tried_every=0))
    assert alone == 3000
    assert 300 < plan(0.1, 600, SceneOptions(tried_every=1)) < alone / 7
    assert plan(0.1, 600, SceneOptions(tried_every=4)) > alone / 3
    assert plan(1e-6, 600, SceneOptions()) == 30_000 and plan(100.0, 1, SceneOptions()) == 1


def test_normals_and_harmonics_come_in_when_they_are_due():
    points, colours = prior()
    fit = SceneFit(Scene(points, colours, start_scales(points)), small_photos(), box(), replace(QUICK, steps=90))
    assert fit.degree == 0
    fit.now.steps = 5
    assert fit.degree == 1
    fit.now.steps = 89
    assert fit.degree == 3
    fit.step(np.ones(5), np.ones(2))
    assert np.isfinite(fit.now.losses).all() and fit.done == 1
    assert all(torch.isfinite(tensor).all() for tensor in fit.scene.tensors.values())
    assert fit.scene.tensors["harmonics"].abs().sum() > 0


def test_nothing_to_start_from_or_to_see_is_said():
    photos, (points, colours) = small_photos(), prior()
    with pytest.raises(InputError, match="None of the 300 points of the dense prior lies in the plot's box"):
        fit_scene(photos, box(), points + 100, colours, QUICK)
    away = Box(np.array([500.0, 500, 0]), np.array([510.0, 510, 5]))
    with pytest.raises(InputError, match="None of the photos shows the plot's box"):
        fit_scene(photos, away, points * 0 + 505.0 * np.array([1, 1, 0]) + [0, 0, 2], colours, QUICK)


def test_without_torch_one_sentence_says_how_to_get_it(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("treedgs_geo.stems.splats.on_torch")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingComponentError, match="pip install torch"):
        __import__("treedgs_geo.stems.splats.on_torch")
