"""Gaussians as torch tensors: draw them, write a loss of your own, let torch pull the gradients back."""

from ....core.errors import InputError, MissingComponentError

try:
    import torch as _torch
except ImportError:
    raise MissingComponentError(
        "Gaussians on torch tensors need the package torch, which is not installed; run 'pip install torch' in the "
        "engine's environment."
    ) from None


def check_device(device: str) -> None:
    """Whether the fit of a whole scene can run on "cpu" or a GPU ("cuda", through NVIDIA Warp and torch).

    Raises:
        MissingComponentError: warp-lang, or torch with CUDA, is not installed. InputError: there is no such GPU.
    """
    if device == "cpu":
        return
    try:
        from . import warp_raster
    except ImportError:
        raise MissingComponentError(
            f"Device {device!r} needs the package warp-lang, which is not installed; run 'pip install warp-lang' in "
            "the engine's environment or use the device cpu."
        ) from None
    if not warp_raster.available(device):
        raise InputError(
            f"Device {device!r}: no such GPU was found here, expected an NVIDIA card with its driver; use device cpu."
        )
    if not _torch.cuda.is_available():
        raise MissingComponentError(
            f"Device {device!r}: the torch {_torch.__version__} installed here finds no CUDA, which the fit of a whole "
            "plot needs; install torch's CUDA build in the engine's environment or use the device cpu."
        )
