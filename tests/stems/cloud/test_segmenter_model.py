"""A network in a file as segmenter: files that torch and onnx write, run on clouds, and every way to break the
contract."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from synthetic_cloud import plot_cloud

from treedgs_geo.core.errors import InputError, MissingComponentError, OutputError
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.stems.cloud.propose.external_segmenters import check_segmenter, segment_model

#: Stems: x, y, diameter in cm. The plot begins at its own west and south.
STEMS = [(3.0, 3.0, 25.0), (9.0, 9.0, 35.0)]


@pytest.fixture(scope="module")
def cloud() -> PointCloud:
    xyz = plot_cloud(np.random.default_rng(1), STEMS)
    return PointCloud(xyz + (611300.0, 3718400.0, 20.0))


@pytest.fixture(scope="module")
def torchscript(tmp_path_factory) -> Path:
    """A small network: a convolution counts the points of each half-metre cell at 1 to 3 m, a point belongs to the
    fullest cell within two metres."""
    torch = pytest.importorskip("torch")

    class Votes(torch.nn.Module):
        def forward(self, points: torch.Tensor) -> torch.Tensor:
            cell = torch.floor(2 * points[:, :2]).to(torch.int64)
            size = int(cell.max()) + 1
            band = (points[:, 2] > 1) & (points[:, 2] < 3)
            votes = torch.zeros(size * size)
            ones = torch.ones(int(band.sum()))
            votes.index_add_(0, (cell[:, 0] * size + cell[:, 1])[band], ones)
            votes = torch.nn.functional.avg_pool2d(votes.view(1, 1, size, size), 3, 1, 1)
            highest = torch.nn.functional.max_pool2d(votes, 9, 1, 4)
            peak = ((votes == highest) & (votes > 0.5 * votes.max())).view(-1)
            number = torch.cumsum(peak.to(torch.int64), 0) * peak
            near = torch.nn.functional.max_pool2d(number.view(1, 1, size, size).float(), 5, 1, 2).view(-1)
            return near[cell[:, 0] * size + cell[:, 1]].to(torch.int64)

    path = tmp_path_factory.mktemp("network") / "votes.pt"
    torch.jit.save(torch.jit.script(Votes()), str(path))
    return path


def scripted(tmp_path: Path, body: str) -> Path:
    """A TorchScript file of one line of code."""
    torch = pytest.importorskip("torch")
    # Methods belong to the class: one of its own for each file.
    module = type("Given", (torch.jit.ScriptModule,), {})()
    module.define(f"def forward(self, points):\n    return {body}\n")
    torch.jit.save(module, str(tmp_path / "given.pt"))
    return tmp_path / "given.pt"


def near_stem(cloud: PointCloud, number: int) -> np.ndarray:
    x, y, _ = STEMS[number]
    local = cloud.xyz - (611300.0, 3718400.0, 20.0)
    return (np.hypot(local[:, 0] - x, local[:, 1] - y) < 0.4) & (local[:, 2] > 0.5)


def test_a_torchscript_file_tells_the_trees_apart(cloud, torchscript) -> None:
    found = segment_model(cloud, torchscript)
    assert found.dtype == np.int32 and found.max() == 2
    one, two = (np.unique(found[near_stem(cloud, k)]) for k in (0, 1))
    assert len(one) == len(two) == 1 and {int(one[0]), int(two[0])} == {1, 2}


def test_the_verbs_measure_its_trees(cloud, torchscript, tmp_path) -> None:
    import geopandas as gpd

    from treedgs_geo.cli import main
    from treedgs_geo.pointcloud.files import write_cloud

    write_cloud(tmp_path / "plot.laz", PointCloud(cloud.xyz - (611300.0, 3718400.0, 20.0)))
    words = ["segment-stems", "--input", tmp_path / "plot.laz", "--crs", "local", "--log-format", "quiet"]
    words += ["--segmenter", "model", "--segmenter-model", torchscript, "--output", tmp_path / "stems.laz"]
    assert main([*map(str, words)]) == 0
    words = ["measure-dbh", "--input", tmp_path / "stems.laz", "--crs", "local", "--log-format", "quiet"]
    assert main([*map(str, words), "--output", str(tmp_path / "trees.gpkg")]) == 0
    trees = gpd.read_file(tmp_path / "trees.gpkg")
    assert sorted(trees["dbh_cm"]) == pytest.approx([25.0, 35.0], abs=1.0)


def test_an_onnx_file_does_the_same(cloud, tmp_path) -> None:
    """The half of the plot that a point lies in, by a matrix and a comparison."""
    pytest.importorskip("onnxruntime")
    onnx = pytest.importorskip("onnx")
    from onnx import TensorProto, helper, numpy_helper

    def constant(name: str, value: np.ndarray):
        return numpy_helper.from_array(value, name)

    nodes = [
        helper.make_node("MatMul", ["points", "across"], ["along"]),
        helper.make_node("Greater", ["along", "middle"], ["beyond"]),
        helper.make_node("Cast", ["beyond"], ["number"], to=TensorProto.INT64),
        helper.make_node("Add", ["number", "one"], ["tree"]),
    ]
    graph = helper.make_graph(
        nodes,
        "halves",
        [helper.make_tensor_value_info("points", TensorProto.FLOAT, ["n", 3])],
        [helper.make_tensor_value_info("tree", TensorProto.INT64, ["n", 1])],
        [
            constant("across", np.array([[1.0], [1.0], [0.0]], np.float32)),
            constant("middle", np.array([12.0], np.float32)),
            constant("one", np.array([1], np.int64)),
        ],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.save(model, str(tmp_path / "halves.onnx"))
    found = segment_model(cloud, tmp_path / "halves.onnx")
    local = cloud.xyz - cloud.xyz.min(axis=0)
    clear = np.abs(local[:, 0] + local[:, 1] - 12) > 1e-3
    assert found.max() == 2
    assert (found == 1 + (local[:, 0] + local[:, 1] > 12))[clear].all()


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("points", r"shape \(\d+, 3\), expected"),
        ("points[1:, 0].long()", r"shape \(\d+,\), expected"),
        ("points[:, 0] * 0 - 1", "found no tree"),
        ("points[:, 0] + 0.25", "not whole"),
        ("points[:, 0] / 0", "not whole"),
        ("points.matmul(points)", "the network failed"),
        ("(points, points)", "gave tuple, expected one tensor"),
    ],
)
def test_what_does_not_keep_the_contract_is_an_error(cloud, tmp_path, body, message) -> None:
    with pytest.raises(OutputError, match=message):
        segment_model(cloud, scripted(tmp_path, body))


def test_files_that_are_no_network(cloud, tmp_path, monkeypatch) -> None:
    (tmp_path / "text.pt").write_text("no network")
    with pytest.raises(InputError, match="expected a TorchScript file"):
        segment_model(cloud, tmp_path / "text.txt")
    with pytest.raises(InputError, match="not found"):
        segment_model(cloud, tmp_path / "none.onnx")
    pytest.importorskip("torch")
    with pytest.raises(InputError, match=r"is not a network in TorchScript"):
        segment_model(cloud, tmp_path / "text.pt")
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    (tmp_path / "text.onnx").write_text("no network")
    for name, package in (("text.pt", "torch"), ("text.onnx", "onnxruntime")):
        with pytest.raises(MissingComponentError, match=f"pip install {package}"):
            segment_model(cloud, tmp_path / name)


def test_what_is_given_must_fit_together(torchscript) -> None:
    check_segmenter("own", None, None)
    check_segmenter("model", None, torchscript)
    with pytest.raises(InputError, match="--segmenter model: needs its network"):
        check_segmenter("model", None, None)
    with pytest.raises(InputError, match="--segmenter-model: only --segmenter model"):
        check_segmenter("own", None, torchscript)
    with pytest.raises(InputError, match="--segmenter-command: a network in a file needs none"):
        check_segmenter("model", "x {input} {output}", torchscript)
    with pytest.raises(InputError, match="needs its command line"):
        check_segmenter("forestformer3d", None, None)
