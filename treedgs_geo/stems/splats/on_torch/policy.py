"""The recurrent policy of RLGS: proposes bounded log factors for some knobs, and learns from what they earned."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

#: A knob is turned to at least a half and at most twice its scheduled value.
BOUND = math.log(2)


@dataclass
class GruPolicy:
    """A GRU cell and a linear head: mean log factors of ``knobs`` knobs, about which proposals are normal.

    REINFORCE: advantage over the mean of the trials, with an entropy bonus; gradients stop at the previous hidden
    state (RLGS, arXiv 2508.04078; number of trials, bounds and rates are not in the paper).
    """

    knobs: int
    seed: int = 0
    inputs: int = 2
    hidden: int = 16
    rate: float = 3e-3
    entropy: float = 1e-3

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        size, inputs = self.hidden, self.inputs
        draw = self._rng.standard_normal
        self.weights: dict[str, np.ndarray] = {
            **{f"w{gate}": 0.3 * draw((size, inputs)) for gate in "zrn"},
            **{f"u{gate}": draw((size, size)) / math.sqrt(size) for gate in "zrn"},
            **{f"b{gate}": np.zeros(size) for gate in "zrn"},
            "head": np.zeros((self.knobs, size)),
            "base": np.zeros(self.knobs),
            "log_sigma": np.full(self.knobs, math.log(0.25)),
        }
        self._h = np.zeros(size)

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

    def propose(self, x: np.ndarray, trials: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """What the cell saw, and (trials, knobs) log factors to try."""
        seen = self.forward(x, self._h)
        sigma = np.exp(self.weights["log_sigma"])
        return seen, seen["mu"] + sigma * self._rng.standard_normal((trials, self.knobs))

    def learn(self, seen: dict[str, np.ndarray], actions: np.ndarray, rewards: np.ndarray) -> None:
        """One step of REINFORCE with what the proposals earned; the cell moves on."""
        sigma = np.exp(self.weights["log_sigma"])
        advantage = np.nan_to_num(rewards - rewards.mean()) / max(float(rewards.std()), 1e-6)
        off = (actions - seen["mu"]) / sigma
        d_mu = (advantage[:, None] * off / sigma).mean(axis=0)
        d_log_sigma = (advantage[:, None] * (off * off - 1)).mean(axis=0) + self.entropy
        for name, step in self.gradient(seen, d_mu, d_log_sigma).items():
            self.weights[name] += self.rate * np.clip(step, -2.4, 2.4)
        self.weights["log_sigma"] = np.clip(self.weights["log_sigma"], math.log(0.05), math.log(0.6))
        self._h = seen["new"]


def factors_of(actions: np.ndarray) -> np.ndarray:
    """Log factors -> factors within the bound."""
    return np.exp(np.clip(actions, -BOUND, BOUND))


def _sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))
