"""The field's checks and the 3DGS PLY."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import InputError
from treedgs_geo.stems.splats.field import GaussianField, quaternion_matrices
from treedgs_geo.stems.splats.ply import frame_path, read_field, write_field

FRAME = LocalFrame(pyproj.CRS.from_epsg(6344), np.array([611337.0, 3718451.0, 38.0]))


def field(count: int = 20, seed: int = 0) -> GaussianField:
    return GaussianField.from_packed(np.random.default_rng(seed).normal(size=(count, 14)))


def test_round_trip_is_exact_and_local(tmp_path):
    path = tmp_path / "field.ply"
    write_field(path, field(), FRAME)
    back = read_field(path, FRAME)
    for name in ("means", "log_scales", "opacity_logits"):
        np.testing.assert_array_equal(getattr(back, name), getattr(field(), name))
    np.testing.assert_allclose(back.quaternions, field().quaternions, atol=1e-7)
    np.testing.assert_allclose(back.colours, field().colours, atol=1e-6)
    np.testing.assert_array_equal(LocalFrame.load(frame_path(path)).origin, FRAME.origin)
    with pytest.raises(InputError, match="another local frame"):
        read_field(path, LocalFrame(FRAME.crs, FRAME.origin + 1))
    header = path.read_bytes().split(b"end_header")[0].decode()
    assert "local_origin 611337.000 3718451.000 38.000" in header and "property float f_dc_0" in header
    assert sorted(p.name for p in tmp_path.iterdir()) == ["field.frame.json", "field.ply"]


def test_another_trainers_file_with_more_colour_bands(tmp_path):
    names = [
        "x",
        "y",
        "z",
        "f_dc_0",
        "f_dc_1",
        "f_dc_2",
        "f_rest_0",
        "f_rest_1",
        "opacity",
        "scale_0",
        "scale_1",
        "scale_2",
        "rot_0",
        "rot_1",
        "rot_2",
        "rot_3",
    ]
    rows = np.random.default_rng(0).normal(size=(4, len(names))).astype("<f4")
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "element vertex 4",
        *[f"property float {n}" for n in names],
        "end_header",
        "",
    ]
    (tmp_path / "other.ply").write_bytes("\n".join(header).encode() + rows.tobytes())
    found = read_field(tmp_path / "other.ply", FRAME)  # no frame beside it: taken to be in the one asked for
    np.testing.assert_array_equal(found.means, rows[:, :3])
    np.testing.assert_array_equal(found.opacity_logits, rows[:, 8])


@pytest.mark.parametrize(
    "damage, message",
    [
        (lambda raw: raw[:-50], "truncated"),
        (lambda raw: b"hello", "not a binary little-endian PLY"),
        (lambda raw: raw.replace(b"float opacity", b"float opaqueX"), "lacks the vertex properties opacity"),
    ],
)
def test_broken_files_are_refused(tmp_path, damage, message):
    path = tmp_path / "field.ply"
    write_field(path, field(), FRAME)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=message):
        read_field(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_field(tmp_path / "none.ply")


def test_fields_refuse_nonsense():
    good = field().packed
    for column, value, message in (
        (0, np.nan, "not finite"),
        (0, 611337.0, "expected a local frame"),
        (slice(3, 7), 0.0, "zero length"),
    ):
        bad = good.copy()
        bad[3, column] = value
        with pytest.raises(InputError, match=message):
            GaussianField.from_packed(bad)
    with pytest.raises(InputError, match="shape"):
        GaussianField(good[:, :3], good[:, 3:7], good[:, 7:10], good[:5, 10], good[:, 11:])


def test_some_of_a_field_and_its_rotations():
    whole, some = field(9, 1), np.arange(9) % 3 == 1
    np.testing.assert_array_equal(whole.select(some).means, whole.means[some])
    turn = quaternion_matrices(whole.quaternions)
    np.testing.assert_allclose(turn @ turn.transpose(0, 2, 1), np.broadcast_to(np.eye(3), turn.shape), atol=1e-12)
