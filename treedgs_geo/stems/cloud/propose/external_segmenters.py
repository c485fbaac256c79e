"""Segmenters that are not ours, whatever runs them: a program of its own or a network in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....core.errors import InputError
from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud
from .external_programs import segment_external
from .network_model import load_network, segment_model


def check_segmenter(segmenter: str, command: str | None, model: Path | None) -> None:
    """What the segmenter needs is there and nothing else is given, said before anything expensive starts.

    Raises:
        InputError, MissingComponentError: it is not.
    """
    if model is not None and segmenter != "model":
        raise InputError("--segmenter-model: only --segmenter model uses it; leave it out, or add --segmenter model.")
    if segmenter == "own":
        return
    if segmenter == "model":
        if command is not None:
            raise InputError("--segmenter-command: a network in a file needs none; leave it out.")
        if model is None:
            raise InputError(
                "--segmenter model: needs its network, give --segmenter-model FILE, TorchScript or ONNX "
                "(docs/analyst/measuring.md)."
            )
        load_network(model)
    elif not command:
        raise InputError(
            f"--segmenter {segmenter}: needs its command line, give --segmenter-command "
            "(docs/analyst/measuring.md has one)."
        )
    elif "{input}" not in command or "{output}" not in command:
        raise InputError(
            f"--segmenter-command: found {command!r}, expected a command line with {{input}} and {{output}} "
            "in it, for example 'docker run --rm -v {input}:/in -v {output}:/out IMAGE'."
        )


def segment_other(
    cloud: PointCloud, segmenter: str, command: str | None, model: Path | None, reporter: Reporter
) -> np.ndarray:
    """(N,) int32 tree of each point as another segmenter has them, :func:`check_segmenter` passed.

    Raises:
        As :func:`.external_programs.segment_external` and :func:`.network_model.segment_model`.
    """
    if segmenter == "model":
        assert model is not None
        return segment_model(cloud, model, reporter)
    return segment_external(cloud, segmenter, command or "", reporter)
