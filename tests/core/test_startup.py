"""What surrounds a job does not end it or make it do what nobody asked for: streams, variables, other libraries,
signals, files that name an address."""

from __future__ import annotations

import http.server
import os
import subprocess
import sys
import threading
from pathlib import Path

import pyogrio
import pytest
from small_campaign import make_cloud

ROOT = Path(__file__).parents[2]
posix = pytest.mark.skipif(sys.platform == "win32", reason="streams and signals of POSIX")


@pytest.fixture(scope="module")
def cloud(tmp_path_factory) -> Path:
    return make_cloud(tmp_path_factory.mktemp("cloud") / "cloud.laz", 1)


def command(*words: object) -> list[str]:
    return [sys.executable, "-m", "treedgs_geo", *map(str, words)]


def measured(cloud: Path, output: Path, *more: str) -> list[str]:
    return command("pointcloud-to-dbh", "--input", cloud, "--output", output, "--sheets", "none", *more)


def run(words: list[str], **environment: str) -> subprocess.CompletedProcess:
    named = os.pathsep.join(filter(None, (environment.pop("PYTHONPATH", ""), str(ROOT))))
    return subprocess.run(
        words,
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | environment | {"PYTHONPATH": named},
        cwd=ROOT,
    )


def count(layer: Path) -> int:
    return len(pyogrio.read_dataframe(layer, layer="trees"))


@posix
@pytest.mark.parametrize("more", ["--json | head -1", ">&-", "<&- >&- 2>&-", "--log-format bar 2>&1 | head -c 9"])
def test_a_job_goes_on_without_its_reader(tmp_path, cloud, more):
    words = " ".join(f"'{word}'" for word in measured(cloud, tmp_path / "t.gpkg"))
    done = run(["bash", "-c", f"{words} {more}; exit ${{PIPESTATUS[0]}}"])
    assert done.returncode == 0 and "Traceback" not in done.stderr
    assert count(tmp_path / "t.gpkg") > 0


@posix
@pytest.mark.parametrize("what", ["describe", "--help", "terrain --help"])
def test_help_to_a_reader_that_leaves(what):
    done = run(["bash", "-c", f"'{sys.executable}' -m treedgs_geo {what} | head -1; exit ${{PIPESTATUS[0]}}"])
    assert done.returncode == 0 and not done.stderr


@pytest.mark.parametrize("value", ["0", "-2", "many", ""])
def test_a_number_of_threads_that_is_none(tmp_path, cloud, value):
    done = run(measured(cloud, tmp_path / "t.gpkg"), NUMBA_NUM_THREADS=value)
    assert done.returncode == 0, done.stderr


def test_another_numpy_on_the_path(tmp_path, cloud):
    for name in ("numpy", "pyproj"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("__version__ = '1.8.0'\n")
    done = run(measured(cloud, tmp_path / "t.gpkg"), PYTHONPATH=str(tmp_path))
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", ["a;b", "a!b", "x;y/c!d", "a#b?c=1&d"])
@pytest.mark.parametrize("suffix", [".gpkg", ".shp", ".csv", ".geojson"])
def test_names_that_look_like_addresses(tmp_path, cloud, name, suffix):
    if sys.platform == "win32" and "?" in name:
        pytest.skip("no such name on Windows")
    target = tmp_path / f"{name}{suffix}"
    before = set(ROOT.iterdir())
    done = run(measured(cloud, target))
    assert done.returncode == 0 and target.is_file() and set(ROOT.iterdir()) == before, done.stderr
    if suffix == ".gpkg":
        done = run(command("tape-sample", "--trees", target, "--n", 2, "--output", tmp_path / "t;!"))
        assert done.returncode == 0, done.stderr


@posix
def test_a_stop_is_heard_after_pycolmap_is_imported():
    code = """
import os, signal, sys
sys.path.insert(0, {root!r})
from treedgs_geo.cli import run_command
from treedgs_geo.verbs import get_command
from treedgs_geo.core.command import Command
from treedgs_geo.core.progress import make_reporter
def work(settings, reporter):
    import pycolmap
    os.kill(os.getpid(), signal.SIGTERM)
    return {{}}
verb = get_command("reconstruct")
values = {{"photos": ".", "crs": "EPSG:6344", "workspace": {work!r}}}
sys.exit(run_command(Command(**{{**vars(verb), "run": work}}), values, make_reporter("plain")))
"""
    done = run([sys.executable, "-c", code.format(root=str(ROOT), work="/does/not/exist/work")])
    assert done.returncode == 130 and "Stopped: cancelled by the user" in done.stderr and "@" not in done.stderr


@pytest.fixture
def server():
    asked: list[str] = []

    class Listening(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            self.send_error(404)

        do_HEAD = do_GET

        def log_message(self, *_: object):
            pass

    made = http.server.HTTPServer(("127.0.0.1", 0), Listening)
    threading.Thread(target=made.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{made.server_port}", asked
    made.shutdown()


RASTER = """<VRTDataset rasterXSize="40" rasterYSize="40"><SRS>EPSG:6344</SRS>
<GeoTransform>424998,0.5,0,3718018,0,-0.5</GeoTransform><VRTRasterBand dataType="Float32" band="1"><SimpleSource>
<SourceFilename relativeToVRT="0">/vsicurl/{0}/s.tif</SourceFilename><SourceBand>1</SourceBand></SimpleSource>
</VRTRasterBand></VRTDataset>"""
LAYER = """<OGRVRTDataSource><OGRVRTLayer name="trees"><SrcDataSource>/vsicurl/{0}/layer.gpkg</SrcDataSource>
</OGRVRTLayer></OGRVRTDataSource>"""
TILES = """<GDAL_WMS><Service name="TMS"><ServerUrl>{0}/${{z}}/${{x}}/${{y}}.png</ServerUrl></Service><DataWindow>
<UpperLeftX>-1</UpperLeftX><UpperLeftY>1</UpperLeftY><LowerRightX>1</LowerRightX><LowerRightY>-1</LowerRightY>
<TileLevel>1</TileLevel></DataWindow><Projection>EPSG:6344</Projection></GDAL_WMS>"""


@pytest.mark.parametrize("kind", ["raster", "layer", "tiles", "http", "vsicurl"])
def test_a_file_of_somebody_else_makes_no_request(tmp_path, cloud, server, kind):
    address, asked = server
    text = {"raster": RASTER, "layer": LAYER, "tiles": TILES}.get(kind, "").format(address)
    file = tmp_path / ("dtm.vrt" if kind != "tiles" else "dtm.xml")
    file.write_text(text)
    words = measured(cloud, tmp_path / "t.gpkg", "--dtm", str(file))
    if kind in ("layer", "http", "vsicurl"):
        given = {"layer": file, "http": f"{address}/x.gpkg", "vsicurl": f"/vsicurl/{address}/x.gpkg"}[kind]
        words = command("tape-sample", "--trees", given, "--n", 2, "--output", tmp_path / "o")
    done = run(words, no_proxy="*", PROJ_NETWORK="ON")
    assert done.returncode == 2 and not asked, done.stderr
    assert "TREEDGS_NETWORK=1" in done.stderr or kind == "layer"
    if kind == "raster":
        assert run(words, TREEDGS_NETWORK="1", no_proxy="*").returncode == 2 and asked
