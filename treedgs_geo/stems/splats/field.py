"""The Gaussian field: what is fitted, stored and sampled.

Parameters are those of 3D Gaussian splatting (Kerbl et al. 2023; ``paper.tex`` sec:radegs): centre, orientation,
scales, opacity and a colour. Colour is spherical-harmonic degree 0, one RGB value a Gaussian.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InputError

#: Columns of the packed parameter matrix that the kernels and the optimiser work on.
COLUMNS = MEAN, QUATERNION, LOG_SCALE, LOGIT, COLOUR = slice(0, 3), slice(3, 7), slice(7, 10), 10, slice(11, 14)

#: float32 coordinates beyond this lose more than half a millimetre (24 bits of mantissa).
LARGEST_COORDINATE_M = 1e4


@dataclass(frozen=True)
class GaussianField:
    """N Gaussians in the local frame.

    means: (N, 3) float32, metres, local frame. quaternions: (N, 4) float32, w x y z, unit length. log_scales: (N, 3)
    float32, natural logarithm of the standard deviations in metres. opacity_logits: (N,) float32. colours: (N, 3)
    float32, RGB 0..1 as in the photos (gamma space).

    Raises:
        InputError: wrong shapes, non-finite values, zero quaternions, or coordinates too large for float32.
    """

    means: np.ndarray
    quaternions: np.ndarray
    log_scales: np.ndarray
    opacity_logits: np.ndarray
    colours: np.ndarray

    def __post_init__(self) -> None:
        n = len(self.means)
        columns = {"means": 3, "quaternions": 4, "log_scales": 3, "opacity_logits": 0, "colours": 3}
        for name, width in columns.items():
            value, shape = np.asarray(getattr(self, name)), (n, width) if width else (n,)
            if (found := value.shape) != shape:
                raise InputError(f"Gaussian field: {name} has shape {found}, expected {shape}; rebuild the field.")
            if not np.all(np.isfinite(value)):
                raise InputError(f"Gaussian field: {name} holds values that are not finite; fit the field again.")
            object.__setattr__(self, name, np.ascontiguousarray(value, np.float32))
        if n and np.abs(self.means).max() > LARGEST_COORDINATE_M:
            raise InputError(
                f"Gaussian field: coordinates reach {np.abs(self.means).max():.3g} m, expected a local frame within "
                f"{LARGEST_COORDINATE_M:g} m of its origin; subtract a local origin first."
            )
        length = np.linalg.norm(self.quaternions, axis=1, keepdims=True)
        if n and length.min() <= 0:
            raise InputError("Gaussian field: a quaternion has zero length; fit the field again.")
        object.__setattr__(self, "quaternions", (self.quaternions / np.maximum(length, 1e-30)).astype(np.float32))

    def __len__(self) -> int:
        return len(self.means)

    @property
    def opacities(self) -> np.ndarray:
        """(N,) float32 opacity 0..1."""
        return (1 / (1 + np.exp(-self.opacity_logits.astype(float)))).astype(np.float32)

    @property
    def scales(self) -> np.ndarray:
        """(N, 3) float32 standard deviations, metres."""
        return np.exp(self.log_scales)

    @property
    def rotations(self) -> np.ndarray:
        """(N, 3, 3) float64 rotation matrices, Gaussian axes -> local frame."""
        return quaternion_matrices(self.quaternions)

    @property
    def packed(self) -> np.ndarray:
        """(N, 14) float64 parameter matrix in the column order of :data:`MEAN` ... :data:`COLOUR`."""
        parts = [self.means, self.quaternions, self.log_scales, self.opacity_logits[:, None], self.colours]
        return np.concatenate(parts, axis=1).astype(float)

    @classmethod
    def from_packed(cls, parameters: np.ndarray) -> GaussianField:
        """Field from an (N, 14) parameter matrix."""
        return cls(*(np.asarray(parameters)[:, part] for part in COLUMNS))

    def select(self, which: np.ndarray) -> GaussianField:
        """The Gaussians that ``which`` (mask or indices) names."""
        return GaussianField.from_packed(self.packed[which])


def quaternion_matrices(quaternions: np.ndarray) -> np.ndarray:
    """(N, 4) quaternions w x y z of any length -> (N, 3, 3) float64 rotation matrices."""
    return Rotation.from_quat(np.asarray(quaternions, float)[:, [1, 2, 3, 0]]).as_matrix()
