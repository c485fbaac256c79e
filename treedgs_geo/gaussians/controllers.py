"""What steers a fit from outside: step sizes, going back, stopping. One interface, four ways.

A fit runs in phases (one pass over the crops). A controller is handed each phase as something that it may run, measure
on photos that the fit does not see (the two reward views), undo and run again:

* ``FixedSchedule``: every phase once, decaying steps;
* ``PlateauStop``: the same, stopped when the reward views no longer improve;
* ``Backtrack``: a phase that made the reward views worse is undone and repeated with half the steps;
* ``Rlgs``: a recurrent policy proposes factors for the five learning rates, tries several, keeps the best and learns
  from all (RLGS, arXiv 2508.04078, built from its equations; the number of trials and the bounds are not in the paper).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from .field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION

#: The five rates that RLGS scales.
GROUPS = (MEAN, LOG_SCALE, QUATERNION, LOGIT, COLOUR)
_COLUMNS = [np.atleast_1d(np.arange(N_PARAMETERS)[group]) for group in GROUPS]


class Phase(Protocol):
    """One pass over the crops, as a controller sees it."""

    done: float

    def run(self, factors: np.ndarray) -> None:
        """Do it; factors: (14,) multipliers of the scheduled steps."""

    def save(self) -> Any:
        """Everything that running changes."""

    def restore(self, state: Any) -> None:
        """Back to a saved state."""

    def reward_loss(self) -> float:
        """Loss of the reward views now; NaN where there are none."""


class Controller(Protocol):
    """``reason`` says afterwards why the fit ended."""

    reason: str

    def factors(self, done: float) -> np.ndarray:
        """(14,) scheduled multipliers of the learning rates at progress ``done`` (0..1)."""

    def phase(self, phase: Phase) -> bool:
        """Run one phase; True stops the fit."""


@dataclass
class FixedSchedule:
    """Exponential decay of the position rate to ``last`` of its start, the rest to a quarter; never stops early."""

    last: float = 0.05
    reason: str = "schedule"

    def factors(self, done: float) -> np.ndarray:
        factor = np.full(N_PARAMETERS, 0.25**done)
        factor[MEAN] = self.last**done
        return factor

    def phase(self, phase: Phase) -> bool:
        phase.run(np.ones(N_PARAMETERS))
        return False


@dataclass
class PlateauStop(FixedSchedule):
    """Stops when the reward views have not improved by ``least`` for ``patience`` phases."""

    least: float = 0.01
    patience: int = 3
    _best: float = math.inf
    _since: int = 0

    def phase(self, phase: Phase) -> bool:
        phase.run(np.ones(N_PARAMETERS))
        loss = phase.reward_loss()
        return not math.isnan(loss) and self.epoch(loss)

    def epoch(self, held_out_loss: float) -> bool:
        """Told the held-out loss after each phase; True stops the fit."""
        if held_out_loss < self._best * (1 - self.least):
            self._best, self._since = held_out_loss, 0
            return False
        self._since += 1
        if self._since < self.patience:
            return False
        self.reason = "plateau"
        return True


@dataclass
class Backtrack(FixedSchedule):
    """Line search on the reward views: a worse phase is undone and run again with half the steps, at most ``tries``
    times; then it is left out and the fit ends.
    """

    worse: float = 1.002
    tries: int = 2
    scale: float = 1.0

    def phase(self, phase: Phase) -> bool:
        before, state = phase.reward_loss(), phase.save()
        for _ in range(self.tries + 1):
            phase.run(np.full(N_PARAMETERS, self.scale))
            after = phase.reward_loss()
            if not (math.isfinite(before) and after > before * self.worse):
                self.scale = min(1.2 * self.scale, 1.0)
                return False
            phase.restore(state)
            self.scale *= 0.5
        self.reason = "backtracked"
        return True


@dataclass
class Rlgs(FixedSchedule):
    """A GRU policy on the learning rates.

    State: reward-view loss of the last phase relative to the first, and progress. Action: log factors of the five
    rates, normal about the policy's mean, within +-log 2. Each phase: ``trials`` proposals are simulated from the same
    state, the policy takes a REINFORCE step (advantage over their mean, entropy bonus), the best proposal is run for
    good. Gradients stop at the previous hidden state.
    """

    seed: int = 0
    trials: int = 3
    hidden: int = 16
    rate: float = 3e-3
    entropy: float = 1e-3
    history: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        size, inputs = self.hidden, 2
        draw = self._rng.standard_normal
        self.weights: dict[str, np.ndarray] = {
            **{f"w{gate}": 0.3 * draw((size, inputs)) for gate in "zrn"},
            **{f"u{gate}": draw((size, size)) / math.sqrt(size) for gate in "zrn"},
            **{f"b{gate}": np.zeros(size) for gate in "zrn"},
            "head": np.zeros((len(GROUPS), size)),
            "base": np.zeros(len(GROUPS)),
            "log_sigma": np.full(len(GROUPS), math.log(0.25)),
        }
        self._h = np.zeros(size)
        self._first = math.nan
        self._last = 1.0

    def forward(self, x: np.ndarray, h: np.ndarray) -> dict[str, np.ndarray]:
        """GRU cell and heads; keeps what the gradient needs."""
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

    def phase(self, phase: Phase) -> bool:
        before, state = phase.reward_loss(), phase.save()
        if not math.isfinite(before):
            phase.run(np.ones(N_PARAMETERS))
            return False
        self._first = before if math.isnan(self._first) else self._first
        seen = self.forward(np.array([self._last - 1, 2 * phase.done - 1]), self._h)
        sigma = np.exp(self.weights["log_sigma"])
        actions = seen["mu"] + sigma * self._rng.standard_normal((self.trials, len(GROUPS)))
        rewards = np.empty(self.trials)
        for k, action in enumerate(actions):
            phase.run(self._expand(action))
            rewards[k] = (before - phase.reward_loss()) / max(self._first, 1e-9)
            phase.restore(state)
        best = int(np.argmax(np.nan_to_num(rewards, nan=-np.inf)))
        phase.run(self._expand(actions[best]))
        advantage = np.nan_to_num(rewards - rewards.mean()) / max(float(rewards.std()), 1e-6)
        off = (actions - seen["mu"]) / sigma
        d_mu = (advantage[:, None] * off / sigma).mean(axis=0)
        d_log_sigma = (advantage[:, None] * (off * off - 1)).mean(axis=0) + self.entropy
        for name, step in self.gradient(seen, d_mu, d_log_sigma).items():
            self.weights[name] += self.rate * np.clip(step, -2.4, 2.4)
        self.weights["log_sigma"] = np.clip(self.weights["log_sigma"], math.log(0.05), math.log(0.6))
        self._h, self._last = seen["new"], phase.reward_loss() / self._first
        factors = np.exp(np.clip(actions[best], -math.log(2), math.log(2))).tolist()
        self.history.append({"done": phase.done, "rewards": rewards.tolist(), "factors": factors})
        self.reason = "rlgs"
        return False

    @staticmethod
    def _expand(action: np.ndarray) -> np.ndarray:
        factors = np.ones(N_PARAMETERS)
        for columns, value in zip(_COLUMNS, np.clip(action, -math.log(2), math.log(2)), strict=True):
            factors[columns] = math.exp(value)
        return factors


def _sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))


def make_controller(name: str, seed: int = 0) -> Controller:
    """By the name of the option."""
    if name == "rlgs":
        return Rlgs(seed=seed)
    return {"fixed": FixedSchedule, "plateau": PlateauStop, "backtrack": Backtrack}[name]()
