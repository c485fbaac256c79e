"""Optimiser and density control of one stem's Gaussians."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np

from .bands import Volume
from .field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION


def learning_rates(pixel_m: float) -> np.ndarray:
    """(14,) base step per column. Positions move by a share of a pixel's footprint, the rest are scale-free."""
    rates = np.empty(N_PARAMETERS)
    rates[MEAN] = 0.12 * pixel_m
    rates[QUATERNION] = 0.02
    rates[LOG_SCALE] = 0.03
    rates[LOGIT] = 0.10
    rates[COLOUR] = 0.015
    return rates


def decay(done: float) -> np.ndarray:
    """(14,) multipliers of the rates at progress ``done`` (0..1): positions to a twentieth, the rest to a quarter."""
    factor = np.full(N_PARAMETERS, 0.25**done)
    factor[MEAN] = 0.05**done
    return factor


@dataclass
class Adam:
    """Adam with a rate per column. ``moment`` and ``square`` are (N, 14)."""

    rates: np.ndarray
    moment: np.ndarray
    square: np.ndarray
    steps: int = 0

    @classmethod
    def start(cls, count: int, rates: np.ndarray) -> Adam:
        """Without momentum. rates: (14,)."""
        return cls(rates, np.zeros((count, N_PARAMETERS)), np.zeros((count, N_PARAMETERS)))

    def step(self, parameters: np.ndarray, gradient: np.ndarray, factor: np.ndarray) -> None:
        """Update ``parameters`` in place; rows whose gradient is not finite stay. factor: (14,)."""
        self.steps += 1
        _adam(
            parameters,
            gradient,
            self.moment,
            self.square,
            self.rates * factor,
            1 - 0.9**self.steps,
            1 - 0.99**self.steps,
        )

    def forget(self, rows: np.ndarray) -> None:
        """Clear the history of Gaussians that became something else."""
        self.moment[rows] = 0
        self.square[rows] = 0


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _adam(parameters, gradient, moment, square, rates, correct1, correct2):
    for i in range(parameters.shape[0]):
        finite = True
        for j in range(parameters.shape[1]):
            finite &= np.isfinite(gradient[i, j])
        if not finite:
            continue
        for j in range(parameters.shape[1]):
            g = gradient[i, j]
            moment[i, j] = 0.9 * moment[i, j] + 0.1 * g
            square[i, j] = 0.99 * square[i, j] + 0.01 * g * g
            parameters[i, j] -= rates[j] * (moment[i, j] / correct1) / (math.sqrt(square[i, j] / correct2) + 1e-15)


def constrain(parameters: np.ndarray, volume: Volume) -> None:
    """Keep sizes, opacities and colours in range and quaternions at unit length, in place."""
    np.clip(
        parameters[:, LOG_SCALE], math.log(volume.smallest_m), math.log(volume.largest_m), out=parameters[:, LOG_SCALE]
    )
    np.clip(parameters[:, LOGIT], -8, 6, out=parameters[:, LOGIT])
    np.clip(parameters[:, COLOUR], 0, 1, out=parameters[:, COLOUR])
    length = np.linalg.norm(parameters[:, QUATERNION], axis=1, keepdims=True)
    parameters[:, QUATERNION] = np.where(
        length > 1e-9, parameters[:, QUATERNION] / np.maximum(length, 1e-9), [1.0, 0, 0, 0]
    )


def relocate(
    parameters: np.ndarray, adam: Adam, volume: Volume, rng: np.random.Generator, dead_below: float = 0.01
) -> int:
    """Move dead Gaussians (too faint, outside the volume, not finite) onto live ones, drawn by opacity.

    As in 3DGS-MCMC (Kheradmand et al. 2024, eq. 9): n Gaussians that share a place get opacity 1 - (1 - o)^(1/n) and
    the scale that keeps the rendered sum. The number of Gaussians never changes. Returns how many were moved.
    """
    finite = np.isfinite(parameters).all(axis=1)
    opacity = 1 / (1 + np.exp(-np.where(finite, parameters[:, LOGIT], -20)))
    dead = ~finite | (opacity < dead_below) | ~volume.contains(np.where(finite[:, None], parameters[:, MEAN], np.inf))
    live = np.flatnonzero(~dead)
    moved = np.flatnonzero(dead)
    if len(live) == 0 or len(moved) == 0:
        return 0
    chosen = rng.choice(live, len(moved), p=opacity[live] / opacity[live].sum())
    copies = np.bincount(chosen, minlength=len(parameters)) + 1
    parents = np.unique(chosen)
    for parent in parents:
        n, old = min(int(copies[parent]), 51), float(opacity[parent])
        new = 1 - (1 - old) ** (1 / n)
        total = (
            sum(
                math.comb(i - 1, k) * (-1) ** k * new ** (k + 1) / math.sqrt(k + 1)
                for i in range(1, n + 1)
                for k in range(i)
            )
            if n <= 12
            else old
        )
        parameters[parent, LOG_SCALE] += math.log(max(old / total, 1e-3)) if total > 0 else 0.0
        new = min(max(new, dead_below), 0.995)
        parameters[parent, LOGIT] = math.log(new / (1 - new))
    parameters[moved] = parameters[chosen]
    scale = np.exp(parameters[moved, LOG_SCALE]).min(axis=1, keepdims=True)
    parameters[moved, MEAN] += rng.standard_normal((len(moved), 3)) * 0.5 * scale
    adam.forget(moved)
    adam.forget(parents)
    return len(moved)
