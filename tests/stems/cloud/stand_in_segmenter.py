"""A segmenter of its own process that honours ForestFormer3D's file contract: text PLY, input order, own origin.

    python stand_in_segmenter.py INPUT_DIR OUTPUT_DIR [fault]

It clusters points by place (2 m cells, joined), so that its labels mean something. ``fault`` makes it break the
contract in one of the ways that real ones do.
"""

import sys
from pathlib import Path

import numpy as np


def main() -> int:
    given, made = Path(sys.argv[1]), Path(sys.argv[2])
    fault = sys.argv[3] if len(sys.argv) > 3 else ""
    raw = (given / "cloud.ply").read_bytes()
    head, body = raw.split(b"end_header\n", 1)
    kinds = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("semantic_seg", "<i4"), ("treeID", "<i4")])
    assert b"property int semantic_seg" in head and b"property int treeID" in head
    rows = np.frombuffer(body, kinds)
    assert (rows["semantic_seg"] == 1).all() and (rows["treeID"] == 0).all()
    xyz = np.column_stack([rows["x"], rows["y"], rows["z"]]).astype(np.float32)
    above = xyz[:, 2] > xyz[:, 2].min() + 0.5
    cell = np.floor(xyz[:, :2] / 2).astype(int)
    _, label = np.unique(cell[:, 0] * 1000 + cell[:, 1], return_inverse=True)
    instance = np.where(above, label, -1)
    if fault == "crash":
        print("CUDA out of memory", file=sys.stderr)
        return 1
    if fault == "skips":
        print("Failed export scan")
        return 0
    if fault == "nothing":
        instance[:] = -1
    offset = np.array([xyz[:, 0].mean(), xyz[:, 1].mean(), xyz[:, 2].min()], np.float32)
    out, tree = xyz - offset, instance
    if fault == "thinned":
        out, tree = out[::2], tree[::2]
    if fault == "shuffled":
        order = np.random.default_rng(0).permutation(len(out))
        out, tree = out[order], tree[order]
    if fault == "moved":
        out = out.copy()
        out[5, 1] += 0.02
    if fault == "squeezed":
        out = np.round(out / 0.05) * 0.05
    names = ["x", "y", "z", "semantic_pred", "instance_pred", "score", "semantic_gt", "instance_gt"]
    if fault == "unlabelled":
        names[4] = "something"
    with open(made / "cloud.ply", "w") as stream:
        stream.write("ply\nformat ascii 1.0\n" + f"element vertex {len(out)}\n")
        stream.writelines(f"property {'float' if n in ('x', 'y', 'z', 'score') else 'int'} {n}\n" for n in names)
        stream.write("end_header\n")
        for (x, y, z), number in zip(out, tree, strict=True):
            stream.write(f"{x:.6f} {y:.6f} {z:.6f} 1 {number} 0.9 1 0\n")
            if fault == "truncated" and number > 3:
                break
    return 0


if __name__ == "__main__":
    sys.exit(main())
