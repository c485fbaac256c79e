"""An existing GeoPackage: only our layers are replaced, waiting has an end, and the result is never lost."""

from __future__ import annotations

import json
import os
import sqlite3
import subprocess
import sys
from contextlib import closing

import geopandas as gpd
import numpy as np
import pyproj
import pytest
from shapely.geometry import Point

from treedgs_geo.core import geopackage
from treedgs_geo.core.errors import OutputError
from treedgs_geo.inventory.tree_layer import check_output, write_trees
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.stems.quality.tree import Tree

CRS = pyproj.CRS("EPSG:6344")
SLICE = {
    "tree_id": 1,
    "height_m": 1.0,
    "d_se_cm": 0.5,
    "d_cm": 30.0,
    "rms_cm": 1.0,
    "n_pts": 50,
    "arc_deg": 300.0,
    "x": 611337.0,
    "y": 3718451.0,
}


def trees(count: int) -> list[Tree]:
    return [
        Tree(n + 1, 611337.0 + n, 3718451.0, 38.0, dbh_cm=30.0 + n, dbh_se_cm=0.4, n_views=7, method="photos")
        for n in range(count)
    ]


@pytest.fixture
def site(tmp_path):
    """A user's GeoPackage: two layers in other CRSs, one named almost like ours, a saved style, a QGIS project."""
    path = tmp_path / "site.gpkg"
    roads = gpd.GeoDataFrame({"name": ["a", "b"]}, geometry=[Point(9.1, 50.2), Point(9.2, 50.3)], crs="EPSG:4326")
    roads.to_file(path, layer="roads", driver="GPKG", engine="pyogrio")
    odd = pyproj.CRS("+proj=tmerc +lon_0=7.3 +k=1 +x_0=500 +ellps=bessel +units=m")
    roads.to_crs(odd).to_file(path, layer="trees_2019", driver="GPKG", engine="pyogrio", mode="a")
    with closing(sqlite3.connect(path)) as there, there:
        there.execute("CREATE TABLE qgis_projects (name TEXT PRIMARY KEY, metadata BLOB, content BLOB)")
        there.execute("INSERT INTO qgis_projects VALUES ('plan', '{}', 'zip')")
    geopackage.put_style(path, "roads", "<qgis mine='yes'/>")
    return path


def contents(path):
    """Everything that is not ours, as text."""
    with closing(sqlite3.connect(path)) as there:
        reported = {
            name: there.execute(f"SELECT * FROM {name}").fetchall()
            for name in ("roads", "trees_2019", "rtree_roads_geom", "rtree_trees_2019_geom", "qgis_projects")
        }
        reported["styles"] = there.execute("SELECT * FROM layer_styles WHERE f_table_name = 'roads'").fetchall()
        reported["entries"] = there.execute(
            "SELECT * FROM gpkg_contents WHERE table_name IN ('roads', 'trees_2019')"
        ).fetchall()
        assert there.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    return reported


def layers(path):
    return set(gpd.list_layers(path)["name"]) - {"layer_styles"}


@pytest.mark.parametrize("crs", ["EPSG:6344", "EPSG:4326+5773", "+proj=tmerc +lon_0=9 +x_0=77 +ellps=bessel +units=m"])
def test_the_users_layers_styles_and_project_stay(site, crs):
    before, crs = contents(site), pyproj.CRS(crs)
    write_trees(site, trees(3), crs, [SLICE])
    assert contents(site) == before
    assert layers(site) == {"roads", "trees_2019", "trees", "circles", "sections"}
    # A second run with fewer trees and no sections: ours are replaced, what is not made any more goes.
    write_trees(site, trees(1), crs)
    assert contents(site) == before and layers(site) == {"roads", "trees_2019", "trees", "circles"}
    fresh = read_trees(write_trees(site.with_name("fresh.gpkg"), trees(1), crs))
    found = read_trees(site)
    assert found.crs == fresh.crs == crs and found.equals(fresh)
    assert found.sindex.query(found.geometry.iloc[0]).tolist() == [0]
    with closing(sqlite3.connect(site)) as there:
        count = "SELECT feature_count FROM gpkg_ogr_contents WHERE table_name = 'trees'"
        assert there.execute(count).fetchone() == (1,)
        assert there.execute("SELECT count(*) FROM rtree_trees_geom").fetchone() == (1,)
    # GDAL can still edit what was put in: triggers and index work.
    found["tree_id"] = 7
    found.to_file(site, layer="trees", driver="GPKG", engine="pyogrio", mode="a")
    assert len(read_trees(site)) == 2


def test_a_style_that_a_person_made_the_default_stays_it(tmp_path):
    path = write_trees(tmp_path / "t.gpkg", trees(1), CRS)
    with closing(sqlite3.connect(path)) as there, there:
        there.execute("UPDATE layer_styles SET useAsDefault = 0 WHERE f_table_name = 'trees'")
        there.execute(
            "INSERT INTO layer_styles (f_table_name, f_geometry_column, styleName, styleQML, useAsDefault, "
            "description) VALUES ('trees', 'geom', 'by species', '<qgis/>', 1, 'my own')"
        )
    write_trees(path, trees(2), CRS)
    with closing(sqlite3.connect(path)) as there:
        rows = there.execute(
            "SELECT description, useAsDefault FROM layer_styles WHERE f_table_name = 'trees'"
        ).fetchall()
    assert sorted(rows) == [("TreeDGS trees", 0), ("my own", 1)]


def test_the_other_kinds_of_files_keep_foreign_layers_too(site):
    from treedgs_geo.geotags.stations import Stations, read_stations_layer, write_stations

    before, n = contents(site), 2
    nan = np.full(n, np.nan)
    stations = Stations(
        [f"{i}.jpg" for i in range(n)],
        [site] * n,
        np.full((n, 3), 5e5),
        np.full((n, 3), 0.02),
        ["fix"] * n,
        nan,
        np.zeros(n, int),
        nan,
        nan,
        nan,
        nan,
        CRS,
    )
    for _ in range(2):
        write_stations(site, stations)
    write_trees(site, trees(2), CRS)
    assert contents(site) == before and layers(site) >= {"stations", "trees"}
    assert read_stations_layer(site).digest() == stations.digest()
    with closing(sqlite3.connect(site)) as there:
        assert there.execute("SELECT count(*) FROM layer_styles WHERE f_table_name = 'stations'").fetchone() == (1,)


@pytest.mark.parametrize("name", ["trees", "Trees"])
def test_a_foreign_layer_of_our_name_is_refused_before_the_work(tmp_path, name):
    path = tmp_path / "mine.gpkg"
    mine = gpd.GeoDataFrame({"tree_id": [1], "dbh_cm": [30.0]}, geometry=[Point(1, 2)], crs=CRS)
    mine.to_file(path, layer=name, driver="GPKG", engine="pyogrio")
    before = path.read_bytes()
    refused = r"TreeDGS did not make .*lacks qc_flag, run_id.*rename that layer"
    with pytest.raises(OutputError, match=refused):
        check_output(path)
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["mine.gpkg"]
    # Whoever did not ask before the work does not lose it.
    with pytest.raises(OutputError, match=refused + r".*mine\.new\.gpkg"):
        write_trees(path, trees(1), CRS)
    assert path.read_bytes() == before and len(read_trees(tmp_path / "mine.new.gpkg")) == 1


def test_a_database_that_is_no_geopackage_is_refused(tmp_path):
    with closing(sqlite3.connect(tmp_path / "notes.gpkg")) as there, there:
        there.execute("CREATE TABLE notes (text TEXT)")
    with pytest.raises(OutputError, match="is a database but no GeoPackage"):
        check_output(tmp_path / "notes.gpkg")


HOLD = """
import sqlite3, sys
there = sqlite3.connect(sys.argv[1], isolation_level=None)
there.execute(sys.argv[2])
there.execute("SELECT count(*) FROM trees").fetchall()
print("held", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize("kind", ["BEGIN", "BEGIN IMMEDIATE"])  # an attribute table; edits that began while we worked
def test_waiting_for_another_program_ends_and_the_result_is_kept_beside(tmp_path, monkeypatch, kind):
    path = write_trees(tmp_path / "trees.gpkg", trees(1), CRS)
    monkeypatch.setattr(geopackage, "WAIT_S", 0.5)
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path), kind], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert holder.stdout.readline() == "held\n"
        for kept in ("trees.new.gpkg", "trees.new2.gpkg"):
            with pytest.raises(OutputError, match="another program reads or edits it") as reported:
                write_trees(path, trees(3), CRS)
            assert str(tmp_path / kept) in str(reported.value) and len(read_trees(tmp_path / kept)) == 3
            if sys.platform == "linux":
                assert f"process {holder.pid}" in str(reported.value)
    finally:
        holder.communicate("")
    assert len(read_trees(path)) == 1
    assert sorted(os.listdir(tmp_path)) == ["trees.gpkg", "trees.new.gpkg", "trees.new2.gpkg"]
    write_trees(path, trees(3), CRS)
    assert len(read_trees(path)) == 3


WAL_READER = """
import sqlite3, sys
shown = sqlite3.connect(sys.argv[1], isolation_level=None)
count = lambda: print(shown.execute("SELECT count(*) FROM trees").fetchone()[0], flush=True)
shown.execute("PRAGMA journal_mode=WAL")
shown.execute("BEGIN")
count()
sys.stdin.readline()
count()
shown.execute("COMMIT")
count()
"""


def test_a_reader_with_a_write_ahead_log_is_no_hindrance(tmp_path):
    """So QGIS shows a layer: its old state to the reader, the new one to who asks anew."""
    path = write_trees(tmp_path / "trees.gpkg", trees(1), CRS)
    # In a process of its own, as QGIS is: locks of two SQLite libraries in one process undo each other.
    reader = subprocess.Popen(
        [sys.executable, "-c", WAL_READER, str(path)], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert reader.stdin is not None and reader.stdout is not None
    assert reader.stdout.readline().strip() == "1"
    write_trees(path, trees(3), CRS)
    said, _ = reader.communicate("go on\n", timeout=60)
    assert said.split() == ["1", "3"] and reader.returncode == 0
    assert len(read_trees(path)) == 3


def test_a_killed_run_changes_nothing_and_its_leftover_goes_at_the_next(site):
    """Killed inside the transaction."""
    script = """
import os, sys
from treedgs_geo.core import geopackage_merge
from treedgs_geo.inventory.tree_layer import write_trees
sys.path.insert(0, sys.argv[2])
from test_geopackage import CRS, trees
def killed(*_):
    os.kill(os.getpid(), 9)
geopackage_merge._put_styles = killed
write_trees(sys.argv[1], trees(2), CRS)
"""
    before = contents(site)
    folder = os.path.dirname(__file__)
    done = subprocess.run(
        [sys.executable, "-c", script, str(site), folder], cwd=os.path.join(folder, "..", ".."), check=False
    )
    assert done.returncode == -9
    assert [name for name in os.listdir(site.parent) if name.startswith(".site.~")], "it was killed before it wrote"
    assert contents(site) == before and "trees" not in layers(site)
    write_trees(site, trees(2), CRS)
    assert contents(site) == before and len(read_trees(site)) == 2
    assert os.listdir(site.parent) == ["site.gpkg"], json.dumps(os.listdir(site.parent))
