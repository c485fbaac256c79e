"""Colours that change with the viewing direction: real spherical harmonics up to degree 3."""

from __future__ import annotations

import math

import torch

#: Coefficients of a colour by degree.
COEFFICIENTS = (1, 4, 9, 16)
#: Value of the constant harmonic.
_CONSTANT = 0.5 / math.sqrt(math.pi)


def harmonics(directions: torch.Tensor, degree: int) -> torch.Tensor:
    """(N, K) values of the K = (degree + 1)^2 real harmonics (with the Condon-Shortley sign), l by l, m from -l to l.

    directions: (N, 3) unit vectors.
    """
    x, y, z = directions.unbind(1)
    values = [torch.full_like(x, _CONSTANT)]
    if degree >= 1:
        one = math.sqrt(3 / (4 * math.pi))
        values += [-one * y, one * z, -one * x]
    if degree >= 2:
        two = 0.5 * math.sqrt(15 / math.pi)
        flat = 0.25 * math.sqrt(5 / math.pi)
        values += [two * x * y, -two * y * z, flat * (3 * z * z - 1), -two * x * z, 0.5 * two * (x * x - y * y)]
    if degree >= 3:
        outer, inner = 0.25 * math.sqrt(35 / (2 * math.pi)), 0.25 * math.sqrt(21 / (2 * math.pi))
        mixed, polar = 0.5 * math.sqrt(105 / math.pi), 0.25 * math.sqrt(7 / math.pi)
        values += [
            -outer * y * (3 * x * x - y * y),
            mixed * x * y * z,
            -inner * y * (5 * z * z - 1),
            polar * z * (5 * z * z - 3),
            -inner * x * (5 * z * z - 1),
            0.5 * mixed * z * (x * x - y * y),
            -outer * x * (x * x - 3 * y * y),
        ]
    return torch.stack(values, 1)


def seen_colours(coefficients: torch.Tensor, means: torch.Tensor, camera_centre: torch.Tensor) -> torch.Tensor:
    """(N, 3) colours as seen from a place: 0.5 + the harmonics' sum, not below 0.

    coefficients: (N, K, 3), K of :data:`COEFFICIENTS`. means: (N, 3); the direction carries no gradient. camera_centre:
    (3,), the same frame.
    """
    if coefficients.shape[1] == 1:
        return (0.5 + _CONSTANT * coefficients[:, 0]).clamp_min(0)
    away = means.detach() - camera_centre
    basis = harmonics(away / away.norm(dim=1, keepdim=True), COEFFICIENTS.index(coefficients.shape[1]))
    return (0.5 + torch.bmm(basis[:, None, :], coefficients)[:, 0]).clamp_min(0)


def constant_of(colours: torch.Tensor) -> torch.Tensor:
    """The constant's coefficient (N, 3) of a colour (N, 3) that all see."""
    return (colours - 0.5) / _CONSTANT


def colours_of(constant: torch.Tensor) -> torch.Tensor:
    """(N, 3) colours of the constant's coefficients (N, 3), not below 0."""
    return (0.5 + _CONSTANT * constant).clamp_min(0)
