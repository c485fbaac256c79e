"""Segmenters that are not ours, whatever runs them: a program of its own or a network in a file.

A network of the user's is run in this process: a TorchScript or ONNX file, nothing bundled. The contract. In: one
tensor of all points, (N, 3) float32, metres: x and y east and north of the cloud's westernmost and southernmost point,
z above its lowest. Out: one tensor of (N,) whole numbers in the same order (or (N, 1)), 0 and less for no tree, every
other number one tree. What else the network wants (heights above ground, voxels, tiles) it makes itself.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ....core.errors import InputError, MissingComponentError, OutputError
from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud
from .external_programs import numbered, segment_external


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
        As :func:`.external_programs.segment_external` and :func:`segment_model`.
    """
    if segmenter == "model":
        assert model is not None
        return segment_model(cloud, model, reporter)
    return segment_external(cloud, segmenter, command or "", reporter)


#: Endings of the files that are understood; what is missing where one is given.
TORCH, ONNX = (".pt", ".pth", ".ts"), (".onnx",)
Network = Callable[[np.ndarray], np.ndarray]


def segment_model(cloud: PointCloud, path: Path, reporter: Reporter | None = None) -> np.ndarray:
    """(N,) int32 tree of each point, from 1, 0 = none, as the network in ``path`` has them.

    Raises:
        InputError: the file is missing or cannot be loaded. MissingComponentError: torch or
        onnxruntime is not installed. OutputError: the network fails, or gives something else than one whole number a
        point, or no tree.
    """
    reporter = reporter or Reporter()
    network = load_network(path)
    points = np.ascontiguousarray(cloud.xyz - cloud.xyz.min(axis=0), np.float32)
    reporter.info(f"{path.name}: {len(points):,} points")
    try:
        given = np.asarray(network(points))
    except Exception as problem:  # whatever the network raises
        said = str(problem).strip().splitlines() or ["no message"]
        raise OutputError(f"{path}: the network failed ({type(problem).__name__}: {said[-1][:200]}).") from None
    return _checked(given, len(points), path)


def load_network(path: Path) -> Network:
    """The network in a file as a function of points (N, 3) float32; without gradients, on the CPU.

    Raises:
        InputError, MissingComponentError: as :func:`segment_model`.
    """
    ending = path.suffix.lower()
    if ending not in TORCH + ONNX:
        raise InputError(
            f"{path}: found the ending {ending or 'none'}, expected a TorchScript file ({', '.join(TORCH)}) or an ONNX "
            "file (.onnx); export the network (docs/analyst/measuring.md)."
        )
    if not path.is_file():
        raise InputError(f"{path}: not found, expected a network that tells trees apart; correct the path.")
    load = _torch if ending in TORCH else _onnx
    try:
        return load(path)
    except MissingComponentError:
        raise
    except Exception as problem:
        said = str(problem).strip().splitlines() or ["no message"]
        what = "TorchScript (torch.jit.save)" if ending in TORCH else "ONNX"
        raise InputError(f"{path}: is not a network in {what} ({said[0][:160]}); export it again.") from None


def _torch(path: Path) -> Network:
    try:
        import torch
    except ImportError:
        raise MissingComponentError(_missing(path, "torch")) from None
    module = torch.jit.load(str(path), map_location="cpu").eval()

    def run(points: np.ndarray) -> np.ndarray:
        with torch.inference_mode():
            found = module(torch.from_numpy(points))
        if not isinstance(found, torch.Tensor):
            raise TypeError(f"gave {type(found).__name__}, expected one tensor")
        return found.numpy()

    return run


def _onnx(path: Path) -> Network:
    try:
        import onnxruntime
    except ImportError:
        raise MissingComponentError(_missing(path, "onnxruntime")) from None
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 3
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    inputs, outputs = session.get_inputs(), session.get_outputs()
    if len(inputs) != 1 or len(outputs) != 1:
        raise ValueError(f"has {len(inputs)} inputs and {len(outputs)} outputs, expected one of each")
    return lambda points: session.run(None, {inputs[0].name: points})[0]


def _missing(path: Path, package: str) -> str:
    return (
        f"{path.name} needs the package {package}, which is not installed; run 'pip install {package}' in the engine's "
        "environment."
    )


def _checked(given: np.ndarray, count: int, path: Path) -> np.ndarray:
    if given.shape not in ((count,), (count, 1)):
        raise OutputError(
            f"{path}: the network gave numbers of the shape {given.shape}, expected ({count},), one for each point."
        )
    given = given.reshape(count)
    if not np.issubdtype(given.dtype, np.number) or np.issubdtype(given.dtype, np.complexfloating):
        raise OutputError(f"{path}: the network gave {given.dtype}, expected whole numbers.")
    if not np.isfinite(given).all() or (given != np.round(given)).any():
        raise OutputError(
            f"{path}: the network gave numbers that are not whole (scores?), expected one tree number for each point."
        )
    trees = given > 0
    if not trees.any():
        raise OutputError(f"{path}: the network found no tree in {count} points; try it on a cloud it was trained for.")
    return numbered(given, trees)
