"""The rasteriser for a device."""

from __future__ import annotations

from typing import Any

from ...core.errors import InputError, MissingComponentError
from .raster import Rasteriser


def check_device(device: str = "cpu", tensors: bool = False) -> None:
    """Whether Gaussians can be drawn on "cpu" or a GPU ("cuda", through NVIDIA Warp). tensors: torch has to work there,
    too, as in the fit of a whole scene.

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
    if tensors:
        import torch

        if not torch.cuda.is_available():
            raise MissingComponentError(
                f"Device {device!r}: the torch {torch.__version__} installed here finds no CUDA, which the fit of a "
                "whole plot needs; install torch's CUDA build in the engine's environment or use the device cpu."
            )


def make_rasteriser(device: str = "cpu", dilation_px2: float = 0.0) -> Any:
    """A rasteriser for "cpu" (Numba) or a GPU ("cuda", through NVIDIA Warp): the same interface, the same pictures.

    Raises:
        MissingComponentError: warp-lang is not installed. InputError: there is no such GPU.
    """
    check_device(device)
    if device == "cpu":
        return Rasteriser(1, dilation_px2)
    from . import warp_raster

    return warp_raster.WarpRasteriser(device, dilation_px2)
