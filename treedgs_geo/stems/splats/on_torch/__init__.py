"""Gaussians as torch tensors: draw them, write a loss of your own, let torch pull the gradients back."""

from ....core.errors import MissingComponentError

try:
    import torch as _torch  # noqa: F401
except ImportError:
    raise MissingComponentError(
        "Gaussians on torch tensors need the package torch, which is not installed; run 'pip install torch' in the "
        "engine's environment."
    ) from None
