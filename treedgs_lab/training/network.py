"""The network: a U-Net of some 10,000 multiplications a pixel, and its export."""

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
WIDTHS = (24, 40, 64, 96)


def _block(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True)
    )


class StemNet(nn.Module):
    """(N, 3, H, W) normalised photos -> (N, 5, H, W) scores of the classes; H, W multiples of 16."""

    def __init__(self) -> None:
        super().__init__()
        a, b, c, d = WIDTHS
        self.to_half = nn.Sequential(nn.Conv2d(3, a, 4, 2, 1), nn.ReLU(inplace=True), _block(a, a))
        self.to_quarter = nn.Sequential(_block(a, b, 2), _block(b, b), _block(b, b))
        self.to_eighth = nn.Sequential(_block(b, c, 2), _block(c, c), _block(c, c))
        self.to_sixteenth = nn.Sequential(_block(c, d, 2), _block(d, d), _block(d, d))
        self.wider = nn.Upsample(scale_factor=2, mode="nearest")
        self.up_eighth = _block(c + d, c)
        self.up_quarter = _block(b + c, b)
        self.up_half = _block(a + b, a)
        self.head = nn.Sequential(nn.Conv2d(a, 4 * len(CLASSES), 1), nn.PixelShuffle(2))

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """Scores."""
        half = self.to_half(image)
        quarter = self.to_quarter(half)
        eighth = self.to_eighth(quarter)
        deep = self.to_sixteenth(eighth)
        deep = self.up_eighth(torch.cat([self.wider(deep), eighth], 1))
        deep = self.up_quarter(torch.cat([self.wider(deep), quarter], 1))
        return self.head(self.up_half(torch.cat([self.wider(deep), half], 1)))


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


def start_from(network: StemNet, path: Path, images: torch.Tensor) -> None:
    """Begin with the weights of a file of :func:`pack`; classes that it lacks begin as its foliage.

    The file's convolutions hold their batch normalisation. It is taken out again with the mean and spread that
    ``images``, (N, 3, H, W), give at each place, so that the network answers as the file does.
    """
    import onnx

    packed = json.loads(path.read_text(encoding="utf-8"))
    graph = onnx.load_model_from_string(base64.b64decode("".join(packed["onnx_base64"]))).graph
    arrays = {item.name: torch.from_numpy(onnx.numpy_helper.to_array(item).copy()) for item in graph.initializer}
    convolutions = iter([[arrays[name] for name in node.input[1:]] for node in graph.node if node.op_type == "Conv"])
    known = packed["classes"]
    source = [known.index(name if name in known else "foliage") for name in CLASSES]
    rows = torch.tensor([4 * k + part for k in source for part in range(4)])
    bias: torch.Tensor = torch.zeros(0)

    def take(module: Any, _: Any) -> None:
        nonlocal bias
        weight, bias = next(convolutions)
        if module is network.head[0]:
            weight, bias = weight[rows], bias[rows]
        module.weight.data.copy_(weight)
        if module.bias is not None:
            module.bias.data.copy_(bias)

    def unfold(module: Any, given: Any) -> None:
        mean, spread = given[0].mean((0, 2, 3)), given[0].std((0, 2, 3))
        module.weight.data.copy_(spread.clamp(min=1e-3))
        module.bias.data.copy_(mean + bias)

    hooks = [m.register_forward_pre_hook(take) for m in network.modules() if isinstance(m, nn.Conv2d)]
    hooks += [m.register_forward_pre_hook(unfold) for m in network.modules() if isinstance(m, nn.BatchNorm2d)]
    with torch.no_grad():
        network(images)
    for hook in hooks:
        hook.remove()
