"""RLGS: what steers a fit from outside, by trying before doing.

A fit runs in phases. The controller is handed each phase as something that it may run, measure on photos that the fit
does not see (the two reward views), undo and run again. Recurrent policies propose factors for the five learning rates
and for the density control, try several, keep the best and learn from all (RLGS, arXiv 2508.04078, built from its
equations; number of trials, bounds and the policies' rates are not in the paper).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .scene_fit import SceneFit

#: Tensors whose learning rates are scaled (:data:`.scene.RATES` has their names), in the order of the factors.
SCALED = ("means", "log_scales", "quats", "opacity_logits", "constant")
#: Knobs of the density control: the gradient from which Gaussians are split or cloned, and how much a split shrinks.
KNOBS = 2
#: Proposals that a policy tries in a phase.
TRIALS = 3
#: A knob is turned to at least a half and at most twice its scheduled value.
BOUND = math.log(2)
#: What a policy's cell sees, and how many numbers it remembers.
_INPUTS, _HIDDEN = 2, 16
#: Weight of the entropy bonus.
_ENTROPY = 1e-3


class GruPolicy:
    """A GRU cell and a linear head: mean log factors of ``knobs`` knobs, about which proposals are normal.

    REINFORCE: advantage over the mean of the trials, with an entropy bonus; gradients stop at the previous hidden
    state.
    """

    def __init__(self, knobs: int, seed: int = 0, rate: float = 3e-3) -> None:
        self.rate = rate
        self._rng = np.random.default_rng(seed)
        draw = self._rng.standard_normal
        self.weights: dict[str, np.ndarray] = {
            **{f"w{gate}": 0.3 * draw((_HIDDEN, _INPUTS)) for gate in "zrn"},
            **{f"u{gate}": draw((_HIDDEN, _HIDDEN)) / math.sqrt(_HIDDEN) for gate in "zrn"},
            **{f"b{gate}": np.zeros(_HIDDEN) for gate in "zrn"},
            "head": np.zeros((knobs, _HIDDEN)),
            "base": np.zeros(knobs),
            "log_sigma": np.full(knobs, math.log(0.25)),
        }
        self._h = np.zeros(_HIDDEN)

    def forward(self, x: np.ndarray, h: np.ndarray) -> dict[str, np.ndarray]:
        """GRU cell and head; keeps what the gradient needs."""
        w = self.weights
        z = _sigmoid(w["wz"] @ x + w["uz"] @ h + w["bz"])
        r = _sigmoid(w["wr"] @ x + w["ur"] @ h + w["br"])
        n = np.tanh(w["wn"] @ x + w["un"] @ (r * h) + w["bn"])
        new = (1 - z) * n + z * h
        return {"x": x, "h": h, "z": z, "r": r, "n": n, "new": new, "mu": w["head"] @ new + w["base"]}

    def gradient(self, seen: dict[str, np.ndarray], d_mu: np.ndarray, d_log_sigma: np.ndarray) -> dict[str, np.ndarray]:
        """Gradient of a scalar with these derivatives with respect to every weight."""
        w, x, h, z, r, n = self.weights, seen["x"], seen["h"], seen["z"], seen["r"], seen["n"]
        d_new = w["head"].T @ d_mu
        d_n, d_z = d_new * (1 - z) * (1 - n * n), d_new * (h - n) * z * (1 - z)
        d_r = (w["un"].T @ d_n) * h * r * (1 - r)
        out = {"head": np.outer(d_mu, seen["new"]), "base": d_mu, "log_sigma": d_log_sigma}
        for gate, d, through in (("z", d_z, h), ("r", d_r, h), ("n", d_n, r * h)):
            out |= {f"w{gate}": np.outer(d, x), f"u{gate}": np.outer(d, through), f"b{gate}": d}
        return out

    def best_of_trials(self, x: np.ndarray, reward: Callable[[np.ndarray], float]) -> np.ndarray:
        """(knobs,) factors of the proposal that earned most; one step of REINFORCE with what all earned, and the cell
        moves on. x: (2,) what the cell sees. reward: of factors."""
        seen, sigma = self.forward(x, self._h), np.exp(self.weights["log_sigma"])
        actions = seen["mu"] + sigma * self._rng.standard_normal((TRIALS, len(sigma)))
        rewards = np.array([reward(_factors_of(action)) for action in actions])
        advantage = np.nan_to_num(rewards - rewards.mean()) / max(float(rewards.std()), 1e-6)
        off = (actions - seen["mu"]) / sigma
        d_mu = (advantage[:, None] * off / sigma).mean(axis=0)
        d_log_sigma = (advantage[:, None] * (off * off - 1)).mean(axis=0) + _ENTROPY
        for name, step in self.gradient(seen, d_mu, d_log_sigma).items():
            self.weights[name] += self.rate * np.clip(step, -2.4, 2.4)
        self.weights["log_sigma"] = np.clip(self.weights["log_sigma"], math.log(0.05), math.log(0.6))
        self._h = seen["new"]
        return _factors_of(actions[int(np.argmax(np.nan_to_num(rewards, nan=-np.inf)))])


class Rlgs:
    """Two recurrent policies: one scales the five learning rates, one the knobs of the density control.

    State of both: reward-view loss of the last phase relative to the first, and progress. Each phase, :data:`TRIALS`
    proposals for the rates are simulated from the same state and the best is taken; with these rates as many
    proposals for the density; then the best of both is run for good. Both policies learn from all that was tried.
    A phase costs twice :data:`TRIALS` plus one passes.

    factors, density: (5,) and (2,) that won the last trials. phases: how many were tried.
    """

    def __init__(self, seed: int = 0, rate: float = 3e-3) -> None:
        self._rates, self._knobs = GruPolicy(len(SCALED), seed, rate), GruPolicy(KNOBS, seed + 1, rate)
        self._first, self._last = math.nan, 1.0
        self.factors, self.density, self.phases = np.ones(len(SCALED)), np.ones(KNOBS), 0

    def phase(self, fit: SceneFit) -> None:
        """Try, keep the best, learn; as it stands where no photo can tell."""
        before, state = fit.reward_loss(), fit.save()
        if not math.isfinite(before):
            fit.run(np.ones(len(SCALED)), np.ones(KNOBS))
            return
        self._first = before if math.isnan(self._first) else self._first
        x = np.array([self._last - 1, 2 * fit.done - 1])

        def reward(factors: np.ndarray, density: np.ndarray) -> float:
            fit.run(factors, density)
            earned = (before - fit.reward_loss()) / max(self._first, 1e-9)
            fit.restore(state)
            return earned

        factors = self._rates.best_of_trials(x, lambda tried: reward(tried, np.ones(KNOBS)))
        density = self._knobs.best_of_trials(x, lambda tried: reward(factors, tried))
        fit.run(factors, density)
        self._last = fit.reward_loss() / self._first
        self.factors, self.density, self.phases = factors, density, self.phases + 1


def _factors_of(actions: np.ndarray) -> np.ndarray:
    """Log factors -> factors within the bound."""
    return np.exp(np.clip(actions, -BOUND, BOUND))


def _sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))
