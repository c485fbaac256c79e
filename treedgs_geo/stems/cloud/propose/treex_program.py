"""TreeX (pointtree, MIT) as a program for ``--segmenter treex``: run by the Python of an environment that has it.

    ENV/bin/python treex_program.py INPUT_FOLDER OUTPUT_FOLDER [uls|tls]

Reads ``cloud.laz``, writes it with the dimension ``tree_id`` (0 = no tree). Needs laspy and pointtree, nothing of ours.
"""

import sys
from pathlib import Path

import laspy
import numpy as np


def main() -> int:
    """Segment the one cloud."""
    from pointtree.instance_segmentation import TreeXAlgorithm, TreeXPresetTLS, TreeXPresetULS

    preset = TreeXPresetTLS() if "tls" in sys.argv[3:] else TreeXPresetULS()
    las = laspy.read(Path(sys.argv[1]) / "cloud.laz")
    label, _, _ = TreeXAlgorithm(**{**preset, "random_seed": 0, "invalid_tree_id": -1})(np.array(las.xyz))
    las.add_extra_dim(laspy.ExtraBytesParams(name="tree_id", type="int32"))
    las.tree_id = np.asarray(label) + 1
    las.write(str(Path(sys.argv[2]) / "cloud.laz"))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
