"""RLGS on a toy problem, and its policy's gradient."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")

from treedgs_geo.stems.splats.on_torch.rlgs import GruPolicy, Rlgs


class Bowl:
    """Steps down a bowl: a factor of 1 is ``best`` times too long or too short, and so is the knob, if it does
    anything."""

    def __init__(self, best: float, knob: bool = False) -> None:
        self.best, self.x, self.done, self.knob = best, 1.0, 0.0, knob

    def run(self, factors: np.ndarray, density: np.ndarray) -> None:
        self.x -= self.x * factors[0] / self.best
        if self.knob:
            self.x -= self.x * density[0] / self.best

    def save(self) -> float:
        return self.x

    def restore(self, state: float) -> None:
        self.x = state

    def reward_loss(self) -> float:
        return abs(self.x)


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
    policy, factors = Rlgs(seed=0, rate=0.01), []
    for _ in range(150):
        policy.phase(Bowl(2.0))  # twice the step would be right
        factors.append(policy.factors[0])
    # Among random proposals the best of three averages 1.2; a policy that has learned sits near the upper bound of 2.
    assert np.mean(factors[-30:]) > 1.7 > np.mean(factors[:3])


def test_the_density_has_a_policy_of_its_own():
    policy, rates, knob = Rlgs(seed=1, rate=0.01), [], []
    for _ in range(150):
        bowl = Bowl(4.0, knob=True)
        policy.phase(bowl)
        rates.append(policy.factors[0])
        knob.append(policy.density[0])
    assert np.mean(rates[-30:]) > 1.7 and np.mean(knob[-30:]) > 1.7 > np.mean(knob[:3])
    # What is kept is the best of both tried in that phase, on the state the phase began with.
    assert bowl.x == pytest.approx((1 - rates[-1] / 4) * (1 - knob[-1] / 4))
    assert policy.phases == 150
