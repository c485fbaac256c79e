"""RLGS: what steers a fit from outside, by trying before doing.

A fit runs in phases. The controller is handed each phase as something that it may run, measure on photos that the fit
does not see (the two reward views), undo and run again. Recurrent policies (:mod:`.policy`) propose factors for the
five learning rates and for the density control, try several, keep the best and learn from all (RLGS, arXiv 2508.04078,
built from its equations).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ..field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION
from .policy import GruPolicy, factors_of

#: The five rates that RLGS scales.
GROUPS: tuple[slice | int, ...] = (MEAN, LOG_SCALE, QUATERNION, LOGIT, COLOUR)
_COLUMNS = [np.atleast_1d(np.arange(N_PARAMETERS)[group]) for group in GROUPS]


class Phase(Protocol):
    """Some steps of a fit, as the controller sees them."""

    @property
    def done(self) -> float:
        """Share of the fit that is done."""

    @property
    def knobs(self) -> int:
        """How many there are of what steers the number and size of Gaussians; 0 = none."""

    def run(self, factors: np.ndarray, density: np.ndarray | None = None) -> None:
        """Do it; factors: (14,) multipliers of the scheduled steps. density: (``knobs``,) multipliers; None: all 1."""

    def save(self) -> Any:
        """Everything that running changes."""

    def restore(self, state: Any) -> None:
        """Back to a saved state."""

    def reward_loss(self) -> float:
        """Loss of the reward views now; NaN where there are none."""


@dataclass
class Rlgs:
    """Two recurrent policies: one scales the five learning rates, one the knobs of the density control.

    State of both: reward-view loss of the last phase relative to the first, and progress. Each phase, ``trials``
    proposals for the rates are simulated from the same state and the best is taken; with these rates as many
    proposals for the density; then the best of both is run for good. Both policies learn from all that was tried.
    A phase costs twice ``trials`` plus one passes.
    """

    seed: int = 0
    trials: int = 3
    rate: float = 3e-3
    history: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._rates = GruPolicy(len(GROUPS), self.seed, rate=self.rate)
        self._density: GruPolicy | None = None
        self._first = math.nan
        self._last = 1.0

    def phase(self, phase: Phase) -> None:
        """Try, keep the best, learn."""
        before, state = phase.reward_loss(), phase.save()
        if not math.isfinite(before):
            phase.run(np.ones(N_PARAMETERS))
            return
        self._first = before if math.isnan(self._first) else self._first
        if self._density is None and phase.knobs:
            self._density = GruPolicy(phase.knobs, self.seed + 1, rate=self.rate)
        x = np.array([self._last - 1, 2 * phase.done - 1])

        def best(policy: GruPolicy, run: Callable[[np.ndarray], None]) -> tuple[np.ndarray, np.ndarray]:
            """Factors of the proposal that earned most, and what each earned."""
            seen, actions = policy.propose(x, self.trials)
            rewards = np.empty(self.trials)
            for k, action in enumerate(actions):
                run(factors_of(action))
                rewards[k] = (before - phase.reward_loss()) / max(self._first, 1e-9)
                phase.restore(state)
            policy.learn(seen, actions, rewards)
            return factors_of(actions[int(np.argmax(np.nan_to_num(rewards, nan=-np.inf)))]), rewards

        factors, rewards = best(self._rates, lambda tried: phase.run(_columns(tried)))
        entry: dict[str, Any] = {"done": phase.done, "rewards": rewards.tolist(), "factors": factors.tolist()}
        knobs = None
        if self._density is not None:
            knobs, earned = best(self._density, lambda tried: phase.run(_columns(factors), tried))
            entry |= {"density_rewards": earned.tolist(), "density_factors": knobs.tolist()}
        phase.run(_columns(factors), knobs)
        self._last = phase.reward_loss() / self._first
        self.history.append(entry)


def _columns(factors: np.ndarray) -> np.ndarray:
    """(14,) multipliers from one a group."""
    spread = np.ones(N_PARAMETERS)
    for columns, value in zip(_COLUMNS, factors, strict=True):
        spread[columns] = value
    return spread
