"""Read and write the standard 3DGS PLY, the format every splat viewer opens (``docs/analyst/gaussians.md``).

float32 positions in full projected coordinates would lose decimetres, so the file holds local coordinates; the header
comment names the local origin and CRS, and ``<name>.frame.json`` beside it holds them in full precision.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...core.crs import LocalFrame
from ...core.errors import InputError
from ...core.files import atomic_path
from ...pointcloud.ply_file import TYPES, ply_header
from .field import GaussianField

#: Zeroth spherical-harmonic basis function; the PLY stores (rgb - 0.5) / SH_0.
SH_0 = 0.28209479177387814

_COLUMNS = (
    *("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"),
    *("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"),
)


def frame_path(path: Path) -> Path:
    """Where the frame of a field file is kept: ``field.ply`` -> ``field.frame.json``."""
    return Path(path).with_suffix(".frame.json")


def write_field(path: Path, field: GaussianField, frame: LocalFrame) -> None:
    """Write ``field`` as binary little-endian 3DGS PLY, and its frame beside it.

    Raises:
        OutputError: the folder cannot be written.
    """
    path = Path(path)
    rows = np.zeros(len(field), [(name, "<f4") for name in _COLUMNS])
    for axis, name in enumerate("xyz"):
        rows[name] = field.means[:, axis]
        rows[f"f_dc_{axis}"] = (field.colours[:, axis] - 0.5) / SH_0
        rows[f"scale_{axis}"] = field.log_scales[:, axis]
    for axis in range(4):
        rows[f"rot_{axis}"] = field.quaternions[:, axis]
    rows["opacity"] = field.opacity_logits
    origin = " ".join(f"{value:.3f}" for value in frame.origin)
    comments = (
        "TreeDGS Gaussian field, local metres, z up",
        f"local_origin {origin}",
        f"crs {' '.join(frame.crs.to_string().split())[:200]}",
    )
    with atomic_path(path) as temporary, open(temporary, "wb") as stream:
        stream.write(ply_header(len(field), rows.dtype, comments))
        stream.write(rows.tobytes())
    frame.save(frame_path(path))


def read_field(path: Path, frame: LocalFrame | None = None) -> GaussianField:
    """Read a 3DGS PLY (ours or another trainer's, any SH degree: the higher bands are dropped).

    frame: that the field has to be in, if a ``.frame.json`` lies beside the file.

    Raises:
        InputError: missing, truncated, not a binary little-endian 3DGS PLY, or in another frame.
    """
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as problem:
        raise InputError(f"{path}: cannot be read ({problem.strerror}); run fit-gaussians first.") from None
    end = raw.find(b"end_header\n")
    lines = raw[: max(end, 0)].decode("ascii", "replace").split("\n")
    if not raw.startswith(b"ply") or end < 0 or "format binary_little_endian 1.0" not in lines:
        raise InputError(f"{path}: is not a binary little-endian PLY file; give a field written by fit-gaussians.")
    count, inside = 0, False
    dtype: list[tuple[str, np.dtype]] = []
    for line in lines:
        words = line.split()
        if words[:1] == ["element"]:
            if dtype:
                break
            inside = words[1] == "vertex"
            count = int(words[2]) if inside else count
        elif words[:1] == ["property"] and inside:
            try:
                dtype.append((words[2], np.dtype(TYPES.get(words[1], words[1])).newbyteorder("<")))
            except TypeError:
                raise InputError(
                    f"{path}: vertex property type {words[1]!r} is not supported, expected a 3DGS PLY."
                ) from None
    names = {name for name, _ in dtype}
    missing = [name for name in _COLUMNS if name not in names and name not in ("nx", "ny", "nz")]
    if missing:
        raise InputError(
            f"{path}: lacks the vertex properties {', '.join(missing[:4])}; expected a 3DGS field, not a plain cloud."
        )
    layout, start = np.dtype(dtype), end + len(b"end_header\n")
    if len(raw) - start < count * layout.itemsize:
        raise InputError(
            f"{path}: is truncated ({len(raw) - start} bytes of data, expected {count * layout.itemsize}); "
            "run fit-gaussians again."
        )
    rows = np.frombuffer(raw, layout, count, start)

    def columns(*wanted: str) -> np.ndarray:
        return np.column_stack([rows[name] for name in wanted]).astype(np.float32)

    beside = frame_path(path)
    own = LocalFrame.load(beside) if beside.exists() else None
    if own and frame and (abs(own.origin - frame.origin).max() > 1e-6 or abs(own.scale - frame.scale) > 1e-9):
        raise InputError(
            f"{path}: is in another local frame than the reconstruction beside it; run the step that wrote it again."
        )
    means, quaternions = columns("x", "y", "z"), columns("rot_0", "rot_1", "rot_2", "rot_3")
    log_scales, colours = columns("scale_0", "scale_1", "scale_2"), 0.5 + SH_0 * columns("f_dc_0", "f_dc_1", "f_dc_2")
    return GaussianField(means, quaternions, log_scales, rows["opacity"].astype(np.float32), colours)
