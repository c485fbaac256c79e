"""Hard surroundings: long and odd paths, a read-only plugin, no network, a worker that the kernel kills."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from child_processes import words_of
from qgis_driver import PATIENCE_S, ROOT, load
from qgis_helpers import refused, stems_cloud, wait_for


def test_a_path_of_more_than_200_characters_with_spaces_and_accents(qgis, tmp_path):
    folder = tmp_path / "Forêt de l'État – été 2026"
    while len(str(folder)) < 215:
        folder = folder / "parcelle d'essai nº 1 (Kiefer, Größe 50 %)"
    folder.mkdir(parents=True)
    stems_cloud(folder / "nuage ñ.laz", (0.15,))
    done = qgis.run(
        "pointcloudtodbh",
        INPUT=folder / "nuage ñ.laz",
        OUTPUT=folder / "arbres été.gpkg",
        REPORT=folder / "page é.html",
    )
    assert done.returncode == 0, done.stdout
    assert (folder / "arbres été.gpkg").exists() and (folder / "page é.html").exists()
    assert not [p for p in folder.iterdir() if p.name.startswith(".")]


def test_a_geopackage_that_qgis_names_as_a_table(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    target = f"ogr:dbname='{tmp_path / 'trees é.gpkg'}' table=\"trees\" (geom)"
    done = qgis.run("pointcloudtodbh", INPUT=tmp_path / "cloud.laz", OUTPUT=target)
    assert done.returncode == 0 and (tmp_path / "trees é.gpkg").exists(), done.stdout


def test_shapefile_and_csv_keep_every_field(qgis, tmp_path):
    """Also where Processing names the output: a shapefile cuts names at ten characters, a CSV drops the geometry."""
    import geopandas
    import pandas

    from treedgs_geo.inventory.tree_reading import SHORT_NAMES
    from treedgs_geo.stems.quality.tree import TREE_FIELDS

    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    for name in ("trees.shp", "trees.csv"):
        assert qgis.run("pointcloudtodbh", INPUT=tmp_path / "cloud.laz", OUTPUT=tmp_path / name).returncode == 0
    shape, table = geopandas.read_file(tmp_path / "trees.shp"), pandas.read_csv(tmp_path / "trees.csv")
    assert list(shape.columns[:-1]) == [SHORT_NAMES.get(name, name) for name in TREE_FIELDS]
    assert list(table.columns) == list(TREE_FIELDS)
    assert abs(table.loc[0, "x"] - shape.geometry[0].x) < 0.001 and abs(table.loc[0, "y"] - shape.geometry[0].y) < 0.001
    page = (ROOT / "docs" / "technician" / "tree-layer.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in page for name in TREE_FIELDS), "every field is documented"


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Path:
    """The plugin from its own zip, in a folder that nobody may write."""
    base = tmp_path_factory.mktemp("nur lesen")
    done = subprocess.run(
        [sys.executable, str(ROOT / "tools" / "package.py"), "--no-scan", "--output", str(base)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (archive,) = base.glob("treedgs-*.zip")
    (base / "plugins").mkdir()
    with zipfile.ZipFile(archive) as packed:
        packed.extractall(base / "plugins")
    for path in (base / "plugins").rglob("*"):
        path.chmod(0o555 if path.is_dir() else 0o444)
    yield base / "plugins"
    for path in (base / "plugins").rglob("*"):
        if path.is_dir():
            path.chmod(0o755)


def unprivileged(command: list[str], *, network: bool) -> list[str]:
    """Root may write everywhere: without that power, and, if asked, without network."""
    if os.geteuid() != 0:
        return command
    drop = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search", "--inh-caps", "-dac_override"]
    net = [] if network else ["unshare", "--net"]
    missing = [name for name in (drop[0], *net[:1]) if shutil.which(name) is None]
    if missing:
        pytest.skip(f"{', '.join(missing)} is not installed")
    return [*net, *drop, *command]


def test_the_packaged_plugin_works_read_only_and_without_network(qgis, installed, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    before = sorted(str(path) for path in installed.rglob("*"))
    variables = qgis.environment(QGIS_PLUGINPATH=installed)
    # Enabled in the profile under the same name: the packaged one is what is found now.
    command = [qgis.program, "run", "treedgs:pointcloudtodbh", "--"]
    command += [f"INPUT={tmp_path / 'cloud.laz'}", f"OUTPUT={tmp_path / 'trees.gpkg'}"]
    done = subprocess.run(
        unprivileged(command, network=False), env=variables, capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "trees.gpkg").exists()
    probe = unprivileged(["touch", str(installed / "treedgs" / "x")], network=False)
    assert subprocess.run(probe, capture_output=True).returncode != 0, "the folder was not read-only at all"
    assert sorted(str(path) for path in installed.rglob("*")) == before, "something was written into the plugin"


def test_the_zip_is_what_the_plugin_repository_takes(installed):
    folder = installed / "treedgs"
    names = [path for path in folder.rglob("*") if path.is_file()]
    suffixes = {path.suffix for path in names}
    assert (folder / "LICENSE").exists() and (folder / "metadata.txt").exists() and (folder / "__init__.py").exists()
    assert not suffixes & {".sh", ".bat", ".exe", ".dll", ".so", ".pyc", ".whl", ".ipynb"}
    left_out = {"tests", "__pycache__", ".git", "training"}
    assert not any(left_out & set(path.parts) for path in names)
    # Beside the sample flight, which is in it where it was made; the zip itself is weighed by tools/package.py.
    assert sum(path.stat().st_size for path in names if folder / "sample" not in path.parents) < 25e6
    assert not (folder / "processing" / "__init__.py").exists()
    assert len(list((folder / "treedgs_qgis" / "models").glob("*.model3"))) == 3
    assert (folder / "treedgs_qgis" / "i18n" / "treedgs_de.qm").exists()


@pytest.fixture
def package():
    return load("treedgs_tools_package", ROOT / "tools" / "package.py")


def test_what_the_repository_refuses_is_found(package, tmp_path, monkeypatch):
    for name in package.SINGLE:
        (tmp_path / name).write_text("x", encoding="utf-8")
    monkeypatch.setattr(package, "ROOT", tmp_path)
    package.check_files(list(package.SINGLE))
    for name, content in {"run.sh": b"#!/bin/sh", "lib.so": b"\x7fELF", "no-name/a.py": b"", "bad.py": b"\xff"}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
        with pytest.raises(package.PackageError, match=name.split("/")[0]):
            package.check_files([*package.SINGLE, name])
    with pytest.raises(package.PackageError, match="LICENSE: is missing"):
        package.check_files([name for name in package.SINGLE if name != "LICENSE"])


def metadata_with(folder: Path, package, monkeypatch, **values: str) -> None:
    """The repository's metadata.txt with some values changed, where the tool looks for it."""
    lines = (ROOT / "metadata.txt").read_text(encoding="utf-8").splitlines()
    lines = [f"{line.partition('=')[0]}={values.get(line.partition('=')[0], line.partition('=')[2])}" for line in lines]
    (folder / "metadata.txt").write_text("\n".join(lines).replace("[general]=", "[general]") + "\n", encoding="utf-8")
    (folder / "treedgs_geo").mkdir(exist_ok=True)
    shutil.copy(ROOT / "treedgs_geo" / "__init__.py", folder / "treedgs_geo")
    monkeypatch.setattr(package, "ROOT", folder)


@pytest.fixture
def web(tmp_path):
    """A server that answers 200 for /there, 404 else, and an address where nobody listens."""
    import http.server
    import threading

    class Answer(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200 if self.path == "/there" else 404)
            self.end_headers()

        def log_message(self, *arguments):
            pass

    server = http.server.HTTPServer(("127.0.0.1", 0), Answer)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


def test_a_release_with_placeholders_is_refused(package, tmp_path, monkeypatch, capsys):
    def check(release: bool, **changed: str) -> None:
        metadata_with(tmp_path, package, monkeypatch, **changed)
        package.check_addresses(package.check_metadata(release), release)

    check(False, repository="https://example.org/treedgs")
    assert "placeholders" in capsys.readouterr().out
    with pytest.raises(package.PackageError, match="repository.* still hold placeholders"):
        check(True, repository="https://example.org/treedgs")
    real = dict.fromkeys(("homepage", "tracker", "repository"), "https://codehost.net/forest/treedgs")
    with pytest.raises(package.PackageError, match="txt: email still"):
        check(True, email="me@example.com", **real)
    asked: list[str] = []
    monkeypatch.setattr(package, "check_address", lambda key, address: asked.append(key))
    check(True, email="forest@codehost.net", **real)
    assert asked == ["tracker", "repository", "homepage"]


def test_a_release_is_refused_for_its_addresses_only(tmp_path):
    """Everything else is asked before, and the zip that was refused does not stay."""
    command = [sys.executable, str(ROOT / "tools" / "package.py"), "--no-scan", "--release", "--output", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1 and done.stderr.count("error:") == 1
    assert "tracker, repository, homepage, email still hold placeholders" in done.stderr
    assert "MB" in done.stdout and not list(tmp_path.glob("*.zip"))


def test_an_address_that_does_not_answer_is_refused(package, web):
    package.check_address("homepage", f"{web}/there")
    with pytest.raises(package.PackageError, match="homepage .*/gone answers 404"):
        package.check_address("homepage", f"{web}/gone")
    with pytest.raises(package.PackageError, match="gives no answer within 10 s"):
        package.check_address("homepage", "http://127.0.0.1:9/x")


def test_the_real_engine_killed_by_the_kernel_is_explained(qgis, simulated_plot, tmp_path):
    """SIGKILL to the engine itself, as the kernel does when memory runs out."""
    import psutil

    running = qgis.start(
        "run",
        "treedgs:photostodbh",
        "--",
        f"PHOTOS={simulated_plot / 'images'}",
        f"GEOTAGS={simulated_plot}",
        "CRS=EPSG:6344",
        f"WORKSPACE={tmp_path / 'work'}",
        f"OUTPUT={tmp_path / 'trees.gpkg'}",
    )
    wait_for(tmp_path / "work" / "run.json")
    (killed,) = [child for child in psutil.Process(running.pid).children() if "--job" in words_of(child)]
    killed.send_signal(signal.SIGKILL)
    output, _ = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 1 and "memory ran out" in output and "resume" in output, output
    assert not (tmp_path / "trees.gpkg").exists()


def test_a_worker_of_the_engine_killed_by_the_kernel_is_explained(qgis, simulated_plot, tmp_path):
    """The engine's own child (COLMAP's mapper, for want of gimbal angles) is killed: the engine lives and says so."""
    import time

    import psutil
    from PIL import Image

    photos = tmp_path / "photos"
    photos.mkdir()
    for path in sorted((simulated_plot / "images").iterdir())[:8]:  # all their pairs are matched
        with Image.open(path) as picture:
            picture.save(photos / path.name, exif=picture.info["exif"], xmp=b"", quality=95)
    running = qgis.start(
        "run",
        "treedgs:photostodbh",
        "--",
        f"PHOTOS={photos}",
        "CRS=EPSG:6344",
        f"WORKSPACE={tmp_path / 'work'}",
        f"OUTPUT={tmp_path / 'trees.gpkg'}",
    )
    killed = False
    while not killed:
        assert running.poll() is None, running.communicate()
        for child in psutil.Process(running.pid).children(recursive=True):
            if "worker" in words_of(child) and not killed:
                with contextlib.suppress(psutil.NoSuchProcess):  # it may end by itself: the next one, then
                    child.send_signal(signal.SIGKILL)
                    killed = True
        time.sleep(0.05)
    output, _ = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 1, output
    assert "Traceback" not in output and "memory" in output, output


def test_an_output_of_a_full_disk_is_one_sentence(qgis, tmp_path):
    """/dev/full stands for a disk without room: nothing half-written is left."""
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    done = qgis.run("pointcloudtodbh", INPUT=tmp_path / "cloud.laz", OUTPUT="/dev/full/trees.gpkg")
    refused(done, "cannot be written")
