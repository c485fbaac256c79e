"""Damaged and odd geotag files: a value that was in the file, or a clear error; never a crash or a made-up value."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pyproj
import pytest
from damaged import damage
from hypothesis import given, settings
from hypothesis import strategies as st
from shared_data import needs_shared

from treedgs_geo.core.errors import InputError
from treedgs_geo.geotags.mrk import read_mrk
from treedgs_geo.geotags.ppk import read_rinex_header
from treedgs_geo.geotags.rtklib import read_pos
from treedgs_geo.geotags.tables import read_position_table

UTM = pyproj.CRS.from_epsg(32615)


@pytest.fixture(scope="module")
def scratch(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


MRK = "".join(
    f"{k}\t{267313.99 + 2 * k:.6f}\t[2164]\t    17,N\t   -10,E\t   "
    f"193,V\t35.93{k:06d},Lat\t139.97336529,Lon\t84.704,Ellh\t"
    "1.021122, 1.216043, 2.734893\t16,Q\n"
    for k in range(1, 9)
)
POS = (
    "% ref pos   :   35.1  139.9  80.0\n"
    "%  GPST         latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)\n"
) + "".join(
    f"2026/03/12 15:15:{k:02d}.200   33.59984{k:04d}  -91.800149874   108.28{k:02d}   1  16   0.011 0.010 0.027\n"
    for k in range(12)
)
TABLE = "name,lat,lon,h,sd_e,sd_n,sd_u\n" + "".join(
    f"p{k}.jpg,33.6{k:04d},-91.8,10{k}.5,0.01,0.01,0.02\n" for k in range(9)
)


def test_damaged_mrk(scratch):
    rng = np.random.default_rng(1)
    path, read = scratch / "a.MRK", 0
    for _ in range(400):
        path.write_text(damage(MRK, rng), encoding="utf-8")
        try:
            marks = read_mrk(path)
        except InputError as problem:
            assert str(path) in str(problem)
            continue
        read += 1
        assert len(np.unique(marks.index)) == len(marks.index) and (np.abs(marks.lat_deg) <= 90).all()
        assert np.isfinite(np.column_stack([marks.gps_s, marks.lon_deg, marks.lat_deg, marks.height_m])).all()
        assert np.isfinite(marks.offset_enu).all()
        text = re.sub(r"\s", "", path.read_text(encoding="utf-8"))
        for latitude in marks.lat_deg:  # every value stands in the file
            assert f"{latitude:.15g}".rstrip("0").rstrip(".") in text.replace("+", "")
    assert 50 < read < 390


def test_damaged_pos(scratch):
    rng = np.random.default_rng(2)
    path, read = scratch / "a.pos", 0
    for _ in range(400):
        path.write_text(damage(POS, rng), encoding="utf-8")
        try:
            track = read_pos(path)
        except InputError as problem:
            assert str(path) in str(problem)
            continue
        read += 1
        assert (np.diff(track.gps_s) > 0).all() and (np.abs(track.lat_deg) <= 90).all()
        assert np.isfinite(np.column_stack([track.gps_s, track.lon_deg, track.lat_deg, track.height_m])).all()
        assert set(track.quality) <= set(range(10))
    assert 20 < read < 390


def test_damaged_tables(scratch):
    rng = np.random.default_rng(3)
    path, read = scratch / "a.csv", 0
    for _ in range(300):
        path.write_text(damage(TABLE, rng), encoding="utf-8")
        try:
            table = read_position_table(path, UTM)
        except InputError as problem:
            assert str(path) in str(problem)
            continue
        read += 1
        assert np.isfinite(table.xyz).all() and len(set(table.names)) == len(table.names)
    assert 5 < read < 290


def test_bytes_of_any_kind(scratch):
    rng = np.random.default_rng(4)
    for number in range(120):
        path = scratch / f"b{number % 3}.obs"
        path.write_bytes(rng.integers(0, 256, int(rng.integers(0, 3000)), dtype=np.uint8).tobytes())
        for read in (read_mrk, read_pos, lambda p: read_position_table(p, UTM)):
            with pytest.raises(InputError):
                read(path)
        assert read_rinex_header(path) is None


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(
            st.floats(0, 604799),
            st.floats(-90, 90),
            st.floats(-180, 180),
            st.floats(-400, 9000),
            st.integers(-2000, 2000),
            st.integers(-2000, 2000),
            st.integers(-2000, 2000),
        ),
        min_size=1,
        max_size=5,
    ),
    st.integers(2100, 2600),
    st.permutations(["N", "E", "V", "Lat", "Lon", "Ellh", "Q"]),
)
def test_mrk_written_is_mrk_read(scratch, rows, week, order):
    """Any values, any order of the columns."""
    text = ""
    for k, (tow, lat, lon, h, n, e, v) in enumerate(rows, start=1):
        values = {"N": n, "E": e, "V": v, "Lat": f"{lat:.9f}", "Lon": f"{lon:.9f}", "Ellh": f"{h:.4f}", "Q": 50}
        text += f"{k}\t{tow:.6f}\t[{week}]\t" + "\t".join(f"{values[key]},{key}" for key in order) + "\n"
    path = scratch / "w.MRK"
    path.write_text(text)
    marks = read_mrk(path)
    wanted = np.array(rows)
    np.testing.assert_allclose(marks.lat_deg, wanted[:, 1], atol=1e-9)
    np.testing.assert_allclose(marks.lon_deg, wanted[:, 2], atol=1e-9)
    np.testing.assert_allclose(marks.height_m, wanted[:, 3], atol=1e-4)
    np.testing.assert_allclose(marks.offset_enu, wanted[:, [5, 4, 6]] * [1e-3, 1e-3, -1e-3], atol=1e-9)
    assert (marks.flag == 50).all() and len(marks.index) == len(rows)
    tow = marks.gps_s % 604800
    assert np.allclose(tow, wanted[:, 0], atol=1e-5) or np.allclose(np.minimum(tow, 604800 - tow), 0, atol=1)


def test_real_files_without_loss():
    """Every number of the real MRK and .pos files is found again in what was read."""
    mrk = needs_shared("ppk_helenenschacht") / "101FTASK_Timestamp.mrk"
    marks = read_mrk(mrk)
    lines = [line for line in mrk.read_text().splitlines() if line.strip()]
    assert len(lines) == len(marks.index)
    for line, lat, lon, h, sd, tow in zip(
        lines, marks.lat_deg, marks.lon_deg, marks.height_m, marks.sd, marks.gps_s % 604800, strict=True
    ):
        fields = dict(reversed(part.split(",")) for part in re.findall(r"[-\d.]+,(?:Lat|Lon|Ellh)", line))
        assert (lat, lon, h) == (float(fields["Lat"]), float(fields["Lon"]), float(fields["Ellh"]))
        assert tow == pytest.approx(float(line.split()[1]), abs=1e-6) and (sd > 0).all()
    sources = (
        sorted(needs_shared("ppk_pos_samples").glob("*.pos"))
        + sorted(needs_shared("ppk_matrtklib").rglob("*.pos"))
        + [needs_shared("plot_a") / "plot_a_ppk.pos"]
    )
    seen = 0
    for path in sources:
        if "Invalid" in path.name:
            continue
        track = read_pos(path)
        rows = [line for line in path.read_text().splitlines() if line.strip() and not line.startswith("%")]
        assert len(track.gps_s) == len(rows), path.name
        first = [float(v) for v in re.split(r"[\s,]+", rows[0].strip())[2:6]]
        if "x-ecef" not in path.read_text()[:3000]:
            assert [track.lat_deg[0], track.lon_deg[0], track.height_m[0], track.quality[0]] == first
        seen += 1
    assert seen >= 8
