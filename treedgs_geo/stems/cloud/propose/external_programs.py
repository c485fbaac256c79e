"""Other people's segmenters, run as programs of their own: files in, files out, nothing imported, nothing bundled.

ForestFormer3D (licence CC BY-NC 4.0, an environment of its own) takes a PLY with dummy labels and writes a text PLY in
input order, shifted to its own origin. SegmentAnyTree (MIT, a container) takes and writes LAS/LAZ. Whatever comes back
is checked point by point against what went in; a result that does not fit is an error, never a guess.
"""

from __future__ import annotations

import shlex
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from ....core.errors import InputError, MissingComponentError, OutputError
from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud
from ....pointcloud.files import write_cloud
from ....pointcloud.ply_file import TYPES, ply_header

#: A returned point may be this far from the one that went in (single precision, text), metres.
SAME_POINT_M = 1e-3
NAME = "cloud"
SEGMENTERS = ("forestformer3d", "segmentanytree", "treex")
#: Names under which SegmentAnyTree and its kin write the tree number.
_LAS_FIELDS = ("PredInstance", "preds_instance_segmentation", "instance_pred", "tree_id", "treeID")


def check_segmenter(segmenter: str, command: str | None) -> None:
    """A program has its command line, said before anything expensive starts.

    Raises:
        InputError: it has none, or one without its two folders.
    """
    if segmenter == "own":
        return
    if not command:
        raise InputError(
            f"--segmenter {segmenter}: needs its command line, give --segmenter-command (docs/analyst/measuring.md has "
            "one)."
        )
    if "{input}" not in command or "{output}" not in command:
        raise InputError(
            f"--segmenter-command: found {command!r}, expected a command line with {{input}} and {{output}} "
            "in it, for example 'docker run --rm -v {input}:/in -v {output}:/out IMAGE'."
        )


def segment_external(cloud: PointCloud, segmenter: str, command: str, reporter: Reporter | None = None) -> np.ndarray:
    """(N,) int32 tree of each point, from 1, 0 = none, as a segmenter has them; a warning where it returned the points
    in another order.

    segmenter: one of ``SEGMENTERS``. command: its command line with ``{input}`` (folder with the cloud), ``{output}``
    (folder for the result) and, if wanted, ``{name}``; no shell is involved.

    Raises:
        MissingComponentError: the program is not there. InputError: it may not be run. OutputError: it failed, or what
        it wrote does not fit the cloud.
    """
    reporter = reporter or Reporter()
    with tempfile.TemporaryDirectory(prefix="treedgs-segmenter-") as folder:
        given, made = Path(folder, "input"), Path(folder, "output")
        given.mkdir()
        made.mkdir()
        origin = np.floor(cloud.xyz.min(axis=0))
        local = cloud.xyz - origin
        if segmenter == "forestformer3d":
            # With the dummy labels that it insists on.
            kinds = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("semantic_seg", "<i4"), ("treeID", "<i4")]
            rows = np.zeros(len(local), kinds)
            rows["x"], rows["y"], rows["z"] = local.T
            rows["semantic_seg"] = 1
            with open(given / f"{NAME}.ply", "wb") as stream:
                stream.write(ply_header(len(rows), rows.dtype))
                rows.tofile(stream)
        else:
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
        return _checked(local, xyz, instance, result, segmenter, reporter)


def numbered(given: np.ndarray, trees: np.ndarray) -> np.ndarray:
    """(N,) int32 from 1 on, of the (N,) numbers of those that are ``trees``, 0 of the others."""
    tree_id = np.zeros(len(given), np.int32)
    tree_id[trees] = np.unique(given[trees], return_inverse=True)[1] + 1
    return tree_id


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


def _checked(
    sent: np.ndarray, back: np.ndarray, instance: np.ndarray, path: Path, segmenter: str, reporter: Reporter
) -> np.ndarray:
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
    if np.abs(moved - sent).max() > SAME_POINT_M:
        from scipy.spatial import cKDTree

        away, nearest = cKDTree(moved).query(sent)
        twins = len(sent) - len(np.unique(nearest))
        if away.max() > SAME_POINT_M or twins > len(sent) - len(np.unique(sent.round(4), axis=0)):
            raise OutputError(
                f"{path.name}: {segmenter} returned other points than it was given (one is "
                f"{away.max():.3f} m off), expected the same coordinates; its labels cannot be used."
            )
        instance = instance[nearest]
        reporter.warn(f"{segmenter} returned the points in another order; they were matched by place.")
    trees = instance > (-1 if segmenter == "forestformer3d" else 0)
    if not trees.any():
        raise OutputError(
            f"{path.name}: {segmenter} found no tree at all in {len(sent)} points; that is how a broken "
            "installation shows, check it on its own example."
        )
    return numbered(instance, trees)


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
        big = any("big_endian" in h for h in head)
        try:
            if any(h.startswith("format ascii") for h in head):
                rows = np.loadtxt(stream, [(name, float) for name in names], ndmin=1, max_rows=count or None)
            else:
                kinds = [
                    (name, np.dtype(TYPES.get(kind, kind)).newbyteorder(">" if big else "<")) for kind, name in fields
                ]
                rows = np.fromfile(stream, np.dtype(kinds), count)
        except (ValueError, IndexError, TypeError) as problem:
            raise OutputError(f"{path.name}: cannot be read ({problem}); run the segmenter again.") from None
    if len(rows) != count:
        raise OutputError(f"{path.name}: promises {count} points and holds {len(rows)}; run the segmenter again.")
    return np.column_stack([rows[axis] for axis in "xyz"]).astype(float), rows[wanted].astype(np.int64)


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
