"""External segmenters: a real process that keeps the contract, and every way to break it, distinguished."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from listener import Listener
from synthetic_cloud import plot_cloud

from treedgs_geo.core.errors import InputError, MissingComponentError, OutputError
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.stems.cloud.propose.external_programs import check_segmenter, segment_external

STAND_IN = Path(__file__).with_name("stand_in_segmenter.py")
COMMAND = f"{sys.executable} {STAND_IN} {{input}} {{output}}"


@pytest.fixture(scope="module")
def cloud():
    xyz = plot_cloud(np.random.default_rng(0), [(2.0, 3.0, 20.0), (9.0, 8.0, 30.0)], per_m2=20, bark=60)
    return PointCloud(xyz + (611300.0, 3718400.0, 20.0))


def expected(cloud):
    local = cloud.xyz - np.floor(cloud.xyz.min(axis=0))
    cell = np.floor(local[:, :2].astype(np.float32) / 2).astype(int)
    return np.where(local[:, 2] > local[:, 2].min() + 0.5, cell[:, 0] * 1000 + cell[:, 1], -1)


def same_partition(a, b):
    pairs = np.unique(np.column_stack([a, b]), axis=0)
    return len(pairs) == len(np.unique(a)) == len(np.unique(b))


def test_labels_come_back_in_order_at_utm_coordinates(cloud):
    said = Listener()
    found = segment_external(cloud, "forestformer3d", COMMAND, said)
    assert not said.warnings and found.dtype == np.int32
    assert set(np.unique(found)) == set(range(found.max() + 1))
    assert same_partition(found, expected(cloud))


def test_another_order_is_noticed_and_undone(cloud):
    said = Listener()
    found = segment_external(cloud, "forestformer3d", COMMAND + " shuffled", said)
    assert "another order" in said.warnings[0] and same_partition(found, expected(cloud))


@pytest.mark.parametrize(
    "fault, message",
    [
        ("crash", "exit code 1 .CUDA out of memory"),
        ("skips", "wrote no .ply"),
        ("nothing", "found no tree at all"),
        ("thinned", "expected the"),
        ("moved", "other points than it was given"),
        ("squeezed", "other points"),
        ("unlabelled", "expected x, y, z and instance_pred"),
        ("truncated", "promises"),
    ],
)
def test_a_broken_contract_is_loud(cloud, fault, message):
    with pytest.raises(OutputError, match=message):
        segment_external(cloud, "forestformer3d", f"{COMMAND} {fault}")


def test_bad_commands_are_reported(cloud):
    with pytest.raises(MissingComponentError, match="no such program"):
        segment_external(cloud, "forestformer3d", "no-such-program {input} {output}")
    with pytest.raises(InputError, match="expected a command line"):
        check_segmenter("forestformer3d", "docker run image")
    with pytest.raises(InputError, match="needs its command line"):
        check_segmenter("forestformer3d", None)


@pytest.mark.parametrize("segmenter, field", [("segmentanytree", "PredInstance"), ("treex", "tree_id")])
def test_las_segmenters(cloud, tmp_path, segmenter, field):
    """The way of SegmentAnyTree and our TreeX script: LAZ in, LAZ with tree numbers out (0 = no tree)."""
    script = tmp_path / "las.py"
    script.write_text(
        "import sys, laspy, numpy as np\n"
        "data = laspy.read(sys.argv[1] + '/cloud.laz')\n"
        f"data.add_extra_dim(laspy.ExtraBytesParams('{field}', 'int32'))\n"
        f"data.{field} = np.where(data.z > data.z.min() + 0.5, 7 + (data.x > 6), 0)\n"
        "data.write(sys.argv[2] + '/cloud.laz')\n"
    )
    found = segment_external(cloud, segmenter, f"{sys.executable} {script} {{input}} {{output}}")
    assert found.max() == 2
    right = cloud.xyz[:, 0] - np.floor(cloud.xyz[:, 0].min()) > 6
    assert (found[right & (found > 0)] == 2).all()


def test_the_verb_runs_it_and_measures_its_trees(cloud, tmp_path):
    """segment-stems with another segmenter, then measure-dbh on its labels."""
    from treedgs_geo.cli import main
    from treedgs_geo.pointcloud.files import read_cloud, write_cloud

    xyz = plot_cloud(np.random.default_rng(1), [(3.0, 3.0, 25.0), (9.0, 9.0, 35.0)])
    write_cloud(tmp_path / "plot.laz", PointCloud(xyz))
    words = ["segment-stems", "--input", tmp_path / "plot.laz", "--crs", "local", "--keep-all", "--log-format", "quiet"]
    assert main([*map(str, words), "--output", str(tmp_path / "bad.laz"), "--segmenter", "forestformer3d"]) == 2
    assert not (tmp_path / "bad.laz").exists()
    assert main([*map(str, words), "--output", str(tmp_path / "own.laz")]) == 0
    own = read_cloud(tmp_path / "own.laz", crs="local").attributes
    assert set(np.unique(own["stem_class"])) == {0, 1, 2}
    assert ((own["stem_class"] == 2) == (own["tree_id"] > 0)).all()
    theirs = [
        *map(str, words),
        "--output",
        str(tmp_path / "theirs.laz"),
        "--segmenter",
        "forestformer3d",
        "--segmenter-command",
        COMMAND,
    ]
    assert main(theirs) == 0
    found = read_cloud(tmp_path / "theirs.laz", crs="local").attributes
    assert len(found["tree_id"]) == len(xyz) and found["tree_id"].max() > 10
