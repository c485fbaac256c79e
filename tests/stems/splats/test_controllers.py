"""Controllers on a toy problem, the policy's gradient, and density control under its budget."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from painted_stem import FRAME, STEM, ground, load, scene

from treedgs_geo.stems.splats.bands import Volume
from treedgs_geo.stems.splats.field import LOG_SCALE, LOGIT, MEAN, QUATERNION
from treedgs_geo.stems.splats.options import GaussianOptions
from treedgs_geo.stems.splats.splat_fit import band_fit
from treedgs_geo.stems.splats.splat_fit.controllers import FixedSchedule, Rlgs, make_controller
from treedgs_geo.stems.splats.splat_fit.optimise import Adam, densify, learning_rates
from treedgs_geo.stems.splats.splat_fit.policy import GruPolicy
from treedgs_geo.stems.splats.train import fit_with_report

VOLUME = Volume(0.5, 0.0, 3.0, 0.01, 0.2)


class Bowl:
    """Steps down a bowl: a factor of 1 is ``best`` times too long or too short, and so is the knob, where there is
    one."""

    def __init__(self, best: float, knobs: int = 0) -> None:
        self.best, self.x, self.done, self.knobs = best, 1.0, 0.0, knobs

    def run(self, factors: np.ndarray, density: np.ndarray | None = None) -> None:
        self.x -= self.x * factors[0] / self.best
        if density is not None:
            self.x -= self.x * density[0] / self.best

    def save(self) -> float:
        return self.x

    def restore(self, state: float) -> None:
        self.x = state

    def reward_loss(self) -> float:
        return abs(self.x)


def test_a_fit_without_reward_views_is_not_stopped():
    blind = Bowl(1e9)
    blind.reward_loss = lambda: float("nan")
    assert not any(make_controller(name).phase(blind) for name in ("rlgs", "fixed"))


def test_policy_gradient_against_finite_differences():
    policy, rng = GruPolicy(5, seed=3), np.random.default_rng(0)
    policy.weights["head"] = rng.standard_normal(policy.weights["head"].shape)
    x, h, d_mu = rng.standard_normal(2), rng.standard_normal(16), rng.standard_normal(5)
    gradient = policy.gradient(policy.forward(x, h), d_mu, np.zeros(5))
    for name in ("wz", "ur", "un", "bn", "uz", "head", "base", "wr"):
        weight = policy.weights[name]
        at = tuple(rng.integers(n) for n in weight.shape)
        kept, values = weight[at], []
        for step in (1e-5, -1e-5):
            weight[at] = kept + step
            values.append(d_mu @ policy.forward(x, h)["mu"])
        weight[at] = kept
        assert gradient[name][at] == pytest.approx((values[0] - values[1]) / 2e-5, rel=1e-4, abs=1e-8)


def test_the_policy_learns_which_way_to_scale():
    policy = Rlgs(seed=0, rate=0.01)
    for _ in range(150):
        policy.phase(Bowl(2.0))  # twice the step would be right
    factors = np.array([item["factors"][0] for item in policy.history])
    # Among random proposals the best of three averages 1.2; a policy that has learned sits near the upper bound of 2.
    assert np.mean(factors[-30:]) > 1.7 > np.mean(factors[:3])


def test_the_density_has_a_policy_of_its_own():
    policy = Rlgs(seed=1, rate=0.01)
    bowls = [Bowl(4.0, knobs=1) for _ in range(150)]
    for bowl in bowls:
        policy.phase(bowl)
    rates, knob = (np.array([item[name][0] for item in policy.history]) for name in ("factors", "density_factors"))
    assert np.mean(rates[-30:]) > 1.7 and np.mean(knob[-30:]) > 1.7 > np.mean(knob[:3])
    # What is kept is the best of both tried in that phase, on the state the phase began with.
    assert bowls[-1].x == pytest.approx((1 - rates[-1] / 4) * (1 - knob[-1] / 4))
    plain = Rlgs(seed=1)
    plain.phase(Bowl(2.0))
    assert "density_factors" not in plain.history[0]


def test_a_pass_that_is_undone_leaves_nothing_behind():
    """The density control keeps what it needs from pass to pass; going back must bring that back too."""
    views, _ = scene()
    options = GaussianOptions(stems="free", gaussians=150, coarse_epochs=3, fine_epochs=1, threads=1, density="split")

    class Twice(FixedSchedule):
        """Runs each pass with wild density, undoes it, and runs it as scheduled."""

        def phase(self, phase):
            state = phase.save()
            phase.run(np.full(14, 2.0), np.full(phase.knobs, 2.0))
            phase.restore(state)
            return super().phase(phase)

    def field(controller):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(band_fit, "make_controller", lambda *_: controller)
            return fit_with_report(views, FRAME, ground, STEM[None], None, options, None, load)[0].packed

    assert np.array_equal(field(FixedSchedule()), field(Twice()))


def test_densify_keeps_the_budget_and_what_is_drawn():
    rng = np.random.default_rng(0)
    p = np.zeros((60, 14))
    p[:, MEAN] = rng.uniform(-0.3, 0.3, (60, 3)) + [0, 0, 1.5]
    p[:, QUATERNION] = rng.standard_normal((60, 4))
    p[:, LOG_SCALE] = np.log(rng.uniform(0.02, 0.08, (60, 3)))
    p[:10, LOGIT], p[10, 0] = -9, np.nan
    pull = np.zeros(60)
    pull[20:30] = np.arange(1, 11)
    adam = Adam.start(60, learning_rates(0.02))
    adam.moment[:] = 1
    new, grown = densify(p, adam, pull, VOLUME, 54, rng, share=0.5)
    assert len(new) == len(grown.moment) == len(grown.square) == 54  # 49 live + 5 more
    assert np.isfinite(new).all() and (grown.moment == 0).all(axis=1).sum() == 10
    assert len(densify(p, adam, pull, VOLUME, 40, rng)[0]) == 49  # never deletes live ones to reach the budget
    dead = p.copy()
    dead[:, LOGIT] = -9
    assert densify(dead, adam, pull, VOLUME, 54, rng)[0] is dead
    assert len(densify(p, adam, np.zeros(60), VOLUME, 60, rng)[0]) == 49


@pytest.mark.parametrize(
    "change",
    [
        {"controller": "rlgs"},
        {"density": "split"},
        {"controller": "rlgs", "density": "split"},
    ],
)
def test_every_way_fits_a_stem(change):
    views, _ = scene()
    options = GaussianOptions(stems="free", gaussians=200, coarse_epochs=3, fine_epochs=1, threads=1)
    field, report = fit_with_report(views, FRAME, ground, STEM[None], None, replace(options, **change), None, load)
    assert 20 < len(field) <= 200 and report.stems[0]["held_out"]["l1"] < 0.1
