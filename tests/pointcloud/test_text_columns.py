"""Text clouds: what is no coordinate is never read as one, whatever the header says or does not say."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.pointcloud.files import read_cloud

RNG = np.random.default_rng(0)
XYZ = np.round(RNG.uniform([10, 20, 100], [22, 32, 120], (300, 3)), 3)
RGB = RNG.integers(0, 256, XYZ.shape)
IDS = np.arange(1, 301)
NORMALS = RNG.uniform(-0.9, 0.9, XYZ.shape)


def written(path, header, *columns, delimiter=" "):
    table = np.column_stack(columns)
    fmt = ["%d" if (column == np.floor(column)).all() else "%.3f" for column in table.T]
    np.savetxt(path, table, fmt=fmt, delimiter=delimiter, header=header, comments="")
    return path


@pytest.mark.parametrize(
    ("header", "columns", "delimiter"),
    [
        ("//X Y Z R G B", (XYZ, RGB), " "),
        ("//X Y Z R G B\n300", (XYZ, RGB), " "),
        ("300", (XYZ, RGB), " "),
        ("//R G B X Y Z", (RGB, XYZ), " "),
        ("Nx Ny Nz X Y Z", (NORMALS, XYZ), " "),
        ('"id","X","Y","Z"', (IDS, XYZ), ","),
        ("X [m],Y [m],Z [m],Intensity", (XYZ, IDS), ","),
        ("northing;easting;height", (XYZ[:, [1, 0, 2]],), ";"),
        ("# scanned in May\n# id x y z", (IDS, XYZ), " "),
        ("# scanned in May", (XYZ,), "\t"),
        ("//X Y Z Scalar field", (XYZ, IDS), " "),
    ],
)
def test_headers_place_the_coordinates(tmp_path, header, columns, delimiter):
    path = written(tmp_path / "a.txt", header, *columns, delimiter=delimiter)
    np.testing.assert_allclose(read_cloud(path, crs="local").xyz, XYZ)


def test_columns_without_a_header(tmp_path):
    path = tmp_path / "a.xyz"
    np.savetxt(path, np.column_stack([XYZ, RGB]), fmt=["%.3f"] * 3 + ["%d"] * 3)
    np.testing.assert_allclose(read_cloud(path, crs="local").xyz, XYZ)
    for columns, words in (
        ((RGB, XYZ), "columns 1 to 3 hold whole numbers"),
        ((IDS, XYZ), "column 1 counts the lines"),
        ((RNG.integers(1, 9, 300), XYZ), "column 1 holds whole numbers"),
        ((NORMALS, XYZ), "as colours and normals do"),
    ):
        written(path, "", *columns)
        path.write_text(path.read_text().lstrip("\n"))
        with pytest.raises(InputError, match=words) as problem:
            read_cloud(path, crs="local")
        assert "names the columns" in str(problem.value) and str(path) in str(problem.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("lon,lat,h\n" + "1.5,2.5,3.5\n" * 9, "project longitude"),
        ("a b c\n1.5 2.5 3.5\n", "called a, b, c"),
        ("1,5;2,5;3,5\n" * 9, "decimal comma"),
        ("1,5 2,5 3,5\n" * 9, "decimal comma"),
        ("X;Y;Z\n1,5;2,5;3,5\n", "decimal comma"),
        ("X,Y,Z\n1,5,2,5,3,5\n", "names 3 columns"),
        ("x y z\n", "no line of numbers"),
        ("", "columns"),
        ("x y z\nm m m\n1 2 3\n", "not a table"),
        ("hello\n", "1 columns"),
    ],
)
def test_tables_that_cannot_be_read(tmp_path, text, words):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_cloud(tmp_path / "a.csv", crs="local")
