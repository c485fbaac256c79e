"""Other people's segmenters, run as programs of their own: files in, files out, nothing imported, nothing bundled.

ForestFormer3D (licence CC BY-NC 4.0, an environment of its own) takes a PLY with dummy labels and writes a text PLY in
input order, shifted to its own origin. SegmentAnyTree (MIT, a container) takes and writes LAS/LAZ. Whatever comes back
is checked point by point against what went in; a result that does not fit is an error, never a guess.
"""

from __future__ import annotations

import shlex
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....core.errors import InputError, MissingComponentError, OutputError
from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud

#: A returned point may be this far from the one that went in (single precision, text), metres.
SAME_POINT_M = 1e-3
NAME = "cloud"
SEGMENTERS = ("forestformer3d", "segmentanytree", "treex")
#: Names under which SegmentAnyTree and its kin write the tree number.
_LAS_FIELDS = ("PredInstance", "preds_instance_segmentation", "instance_pred", "tree_id", "treeID")
_PLY_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}


@dataclass(frozen=True)
class ExternalLabels:
    """tree_id: (N,) int32 in the order of the cloud, 0 = no tree, numbered from 1. n_trees. reordered: the program
    returned the points in another order and they were matched by place."""

    tree_id: np.ndarray
    n_trees: int
    reordered: bool


def segment_external(
    cloud: PointCloud,
    segmenter: str,
    command: str,
    reporter: Reporter | None = None,
) -> ExternalLabels:
    """Run a segmenter on a cloud.

    segmenter: one of ``SEGMENTERS``. command: its command line with ``{input}`` (folder with the
    cloud), ``{output}`` (folder for the result) and, if wanted, ``{name}``; no shell is involved.

    Raises:
        MissingComponentError: the program is not there. InputError: a bad command. OutputError: the program failed, or
        what it wrote does not fit the cloud.
    """
    reporter = reporter or Reporter()
    if segmenter not in SEGMENTERS:
        raise InputError(f"segmenter: found {segmenter!r}, expected one of {', '.join(SEGMENTERS)}.")
    if "{input}" not in command or "{output}" not in command:
        raise InputError(
            f"segmenter command: found {command!r}, expected a command line with {{input}} and {{output}} "
            "in it, for example 'docker run --rm -v {input}:/in -v {output}:/out IMAGE'."
        )
    if len(cloud) == 0:
        raise InputError("segmenter: the cloud has no points; give one that has.")
    with tempfile.TemporaryDirectory(prefix="treedgs-segmenter-") as folder:
        return _run(cloud, segmenter, command, reporter, Path(folder))


def _run(cloud: PointCloud, segmenter: str, command: str, reporter: Reporter, work: Path) -> ExternalLabels:
    given, made = work / "input", work / "output"
    given.mkdir()
    made.mkdir()
    origin = np.floor(cloud.xyz.min(axis=0))
    local = cloud.xyz - origin
    if segmenter == "forestformer3d":
        write_labelled_ply(given / f"{NAME}.ply", local)
    else:
        from ....pointcloud.files import write_cloud

        write_cloud(given / f"{NAME}.laz", PointCloud(local))
    words = [word.format(input=given, output=made, name=NAME) for word in shlex.split(command)]
    reporter.info(f"{segmenter}: {' '.join(words)}")
    try:
        done = subprocess.run(words, capture_output=True, text=True, errors="replace")
    except FileNotFoundError:
        raise MissingComponentError(
            f"{words[0]}: no such program; install {segmenter} (docs/analyst/measuring.md) or correct the command."
        ) from None
    except PermissionError:
        raise InputError(f"{words[0]}: may not be run; make it executable.") from None
    if done.returncode:
        last = " / ".join((done.stderr or done.stdout).strip().splitlines()[-3:]) or "it said nothing"
        raise OutputError(
            f"{segmenter}: ended with exit code {done.returncode} ({last[:400]}); correct that and run again."
        )
    result = _result(made, segmenter)
    xyz, instance = _read_ply(result) if result.suffix == ".ply" else _read_las(result)
    return _checked(local, xyz, instance, result, segmenter)


def _result(folder: Path, segmenter: str) -> Path:
    """The one result file. ForestFormer3D skips a scan it cannot read without an error: then there is none."""
    endings = (".ply",) if segmenter == "forestformer3d" else (".laz", ".las", ".ply")
    found = [path for path in sorted(folder.rglob("*")) if path.suffix.lower() in endings]
    exact = [path for path in found if path.stem == NAME]
    if not found:
        raise OutputError(
            f"{folder}: {segmenter} ended without an error but wrote no {' or '.join(endings)}; see its "
            "own log, it skips clouds that it cannot read."
        )
    if len(found) > 1 and len(exact) != 1:
        raise OutputError(
            f"{folder}: found {len(found)} results ({', '.join(p.name for p in found[:4])}), expected "
            "one; let the command write only the final one."
        )
    return exact[0] if exact else found[0]


def _checked(sent: np.ndarray, back: np.ndarray, instance: np.ndarray, path: Path, segmenter: str) -> ExternalLabels:
    """The labels in the order of the points that were sent, once it is sure that they belong to them."""
    if len(back) != len(sent):
        raise OutputError(
            f"{path.name}: {segmenter} returned {len(back)} points, expected the {len(sent)} it was "
            "given; switch off its thinning and cropping."
        )
    if not np.isfinite(back).all():
        raise OutputError(f"{path.name}: {segmenter} returned coordinates that are not numbers; run it again.")
    # The program may have moved the cloud as a whole: the bounding box says by how much, whatever the order.
    moved = back + (sent.min(axis=0) - back.min(axis=0))
    reordered = False
    if np.abs(moved - sent).max() > SAME_POINT_M:
        from scipy.spatial import cKDTree

        away, nearest = cKDTree(moved).query(sent)
        twins = len(sent) - len(np.unique(nearest))
        if away.max() > SAME_POINT_M or twins > len(sent) - len(np.unique(sent.round(4), axis=0)):
            raise OutputError(
                f"{path.name}: {segmenter} returned other points than it was given (one is "
                f"{away.max():.3f} m off), expected the same coordinates; its labels cannot be used."
            )
        instance, reordered = instance[nearest], True
    trees = instance > (-1 if segmenter == "forestformer3d" else 0)
    if not trees.any():
        raise OutputError(
            f"{path.name}: {segmenter} found no tree at all in {len(sent)} points; that is how a broken "
            "installation shows, check it on its own example."
        )
    tree_id = np.zeros(len(sent), np.int32)
    _, number = np.unique(instance[trees], return_inverse=True)
    tree_id[trees] = number + 1
    return ExternalLabels(tree_id, int(tree_id.max()), reordered)


def write_labelled_ply(path: Path, xyz: np.ndarray) -> None:
    """Binary PLY as ForestFormer3D wants it: x, y, z and the dummy labels it insists on (semantic_seg 1, treeID 0)."""
    rows = np.zeros(len(xyz), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("semantic_seg", "<i4"), ("treeID", "<i4")])
    rows["x"], rows["y"], rows["z"] = xyz.T
    rows["semantic_seg"] = 1
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(xyz)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += ["property int semantic_seg", "property int treeID", "end_header"]
    with open(path, "wb") as stream:
        stream.write(("\n".join(header) + "\n").encode())
        rows.tofile(stream)


def _read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) coordinates and (N,) instance numbers of a text or binary PLY."""
    with open(path, "rb") as stream:
        head: list[str] = []
        while not head or head[-1] != "end_header":
            line = stream.readline()
            if not line or len(head) > 200:
                raise OutputError(f"{path.name}: is no PLY with a header; run the segmenter again.")
            head.append(line.decode("ascii", "replace").strip())
        count = next((int(h.split()[2]) for h in head if h.startswith("element vertex")), 0)
        fields = [h.split()[1:] for h in head if h.startswith("property") and "list" not in h]
        names = [name for _, name in fields]
        wanted = next((n for n in ("instance_pred", *_LAS_FIELDS) if n in names), None)
        if wanted is None or not {"x", "y", "z"} <= set(names):
            raise OutputError(
                f"{path.name}: has the properties {', '.join(names) or 'none'}, expected x, y, z and "
                "instance_pred; use the segmenter's final output."
            )
        text = any(h.startswith("format ascii") for h in head)
        order = ">" if any("big_endian" in h for h in head) else "<"
        try:
            if text:
                values = np.loadtxt(stream, ndmin=2, max_rows=count or None)
                table = {name: values[:, k] for k, name in enumerate(names)}
            else:
                kinds = np.dtype([(name, order + _PLY_TYPES[kind]) for kind, name in fields])
                rows = np.frombuffer(stream.read(count * kinds.itemsize), kinds)
                table = {name: rows[name] for name in names}
            got = len(table["x"])
        except (ValueError, IndexError, KeyError) as problem:
            raise OutputError(f"{path.name}: cannot be read ({problem}); run the segmenter again.") from None
    if got != count:
        raise OutputError(f"{path.name}: promises {count} points and holds {got}; run the segmenter again.")
    xyz = np.column_stack([table[axis] for axis in "xyz"]).astype(float)
    return xyz, np.asarray(table[wanted]).astype(np.int64)


def _read_las(path: Path) -> tuple[np.ndarray, np.ndarray]:
    import laspy

    try:
        data = laspy.read(path)
    except Exception as problem:
        raise OutputError(f"{path.name}: cannot be read ({str(problem)[:120]}); run the segmenter again.") from None
    names = list(data.point_format.dimension_names)
    wanted = next((name for name in _LAS_FIELDS if name in names), None)
    if wanted is None:
        raise OutputError(
            f"{path.name}: has no {' or '.join(_LAS_FIELDS[:2])} (it has: {', '.join(names)}); use the "
            "segmenter's final output."
        )
    xyz = np.column_stack([np.asarray(data.x), np.asarray(data.y), np.asarray(data.z)])
    return xyz, np.asarray(data[wanted]).astype(np.int64)
