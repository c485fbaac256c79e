"""The network: a U-Net of some 8,000 multiplications a pixel, and its export."""

from __future__ import annotations

import base64
import json
import tempfile
from pathlib import Path
from typing import Any

import torch
from torch import nn

from treedgs_geo.stems.photos.network.inference import CLASSES

#: Letters of a piece of the packed weights: longer ones look like secrets to the plugin repository's scan.
PIECE = 8
#: Channels at half, a quarter, an eighth and a sixteenth of the size.
WIDTHS = (24, 40, 64, 128)


def _block(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True)
    )


class _Up(nn.Module):
    """Twice the size, and added to what was seen there: sums cost half of what channels side by side do."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.narrow, self.wider = nn.Conv2d(inputs, outputs, 1), nn.Upsample(scale_factor=2, mode="nearest")
        self.block = _block(outputs, outputs)

    def forward(self, deep: torch.Tensor, seen: torch.Tensor) -> torch.Tensor:
        return self.block(self.wider(self.narrow(deep)) + seen)


class StemNet(nn.Module):
    """(N, 3, H, W) normalised photos -> (N, 5, H, W) scores of the classes; H, W multiples of 16."""

    def __init__(self) -> None:
        super().__init__()
        a, b, c, d = WIDTHS
        self.to_half = nn.Sequential(nn.Conv2d(3, a, 4, 2, 1), nn.ReLU(inplace=True), _block(a, a))
        self.to_quarter = nn.Sequential(_block(a, b, 2), _block(b, b))
        self.to_eighth = nn.Sequential(_block(b, c, 2), _block(c, c))
        self.to_sixteenth = nn.Sequential(_block(c, d, 2), _block(d, d), _block(d, d))
        self.up_eighth, self.up_quarter, self.up_half = _Up(d, c), _Up(c, b), _Up(b, a)
        self.head = nn.Sequential(nn.Conv2d(a, 4 * len(CLASSES), 1), nn.PixelShuffle(2))

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """Scores."""
        half = self.to_half(image)
        quarter = self.to_quarter(half)
        eighth = self.to_eighth(quarter)
        deep = self.up_eighth(self.to_sixteenth(eighth), eighth)
        return self.head(self.up_half(self.up_quarter(deep, quarter), half))


def export(network: StemNet, path: Path, card: dict[str, Any]) -> None:
    """Write the network, for images of any size, as ONNX in a JSON file (needs the package onnx).

    card: what is to be said of the training.
    """
    network.eval()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "network.onnx"
        torch.onnx.export(
            network,
            (torch.zeros(1, 3, 64, 64),),
            str(file),
            input_names=["photo"],
            output_names=["scores"],
            dynamic_axes={"photo": {2: "rows", 3: "columns"}, "scores": {2: "rows", 3: "columns"}},
            opset_version=17,
            dynamo=False,
        )
        pack(file, path, card)


def pack(file: Path, path: Path, card: dict[str, Any]) -> None:
    """An ONNX file as what :mod:`treedgs_geo.stems.photos.network.inference` reads."""
    text = base64.b64encode(file.read_bytes()).decode("ascii")
    packed = [text[at : at + PIECE] for at in range(0, len(text), PIECE)]
    head = json.dumps({"card": card, "classes": CLASSES}, indent=1).removesuffix("\n}")
    path.write_text(f'{head},\n "onnx_base64": {json.dumps(packed)}\n}}\n', encoding="utf-8")
