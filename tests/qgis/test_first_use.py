"""A new user: no engine, the offer with one click, a real set-up without network, repair, and freeing the disk."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from qgis_driver import PATIENCE_S, ROOT, Qgis, load
from qgis_helpers import stems_cloud

load("treedgs_shell", ROOT / "treedgs_qgis" / "__init__.py", ROOT / "treedgs_qgis")
maker = load("treedgs_tools_make_sample", ROOT / "tools" / "make_sample.py")
from treedgs_shell import engine_users, environment, locked, missing, pip_meter, pythons  # noqa: E402

#: A Python that makes environments; the wheels are those of this one.
BASE = Path(sys.base_prefix) / "bin" / "python3"
#: What the plugin says that the engine takes on disk, in words.
SIZE = missing.takes().split(",")[0]


@pytest.fixture(scope="module")
def wheels(tmp_path_factory) -> Path:
    """The real wheels of the locked list, as ``pip download`` gets them on a machine with network."""
    folder = tmp_path_factory.mktemp("roues à part")
    listed = locked.write_list("cpu", folder / "list.txt", extras=("reports",))
    pip = [str(ROOT / ".venv" / "bin" / "python"), "-I", "-m", "pip", "download", "-q", "-d", str(folder), "--no-deps"]
    done = subprocess.run([*pip, *listed], capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"the package index cannot be reached: {done.stderr[-300:]}")
    return folder


@pytest.fixture(scope="module")
def newcomer(tmp_path_factory):
    """QGIS with the plugin from its zip, so that no ``.venv`` lies in it; no engine is named or set up."""
    base = tmp_path_factory.mktemp("nouveau")
    made = Qgis(base / "profil")
    command = [sys.executable, str(ROOT / "tools" / "package.py"), "--no-scan", "--output", str(base)]
    assert subprocess.run(command, capture_output=True).returncode == 0
    with zipfile.ZipFile(next(base.glob("treedgs-*.zip"))) as packed:
        packed.extractall(base / "plugins")
    variables = made.environment(TREEDGS_HOME=base / "home", QGIS_PLUGINPATH=base / "plugins")
    variables.pop("TREEDGS_PYTHON")
    # The Python whose wheels are there is the one that is found.
    tools = base / "bin"
    tools.mkdir()
    (tools / f"python3.{pythons.MINORS[0]}").symlink_to(BASE)
    variables["PATH"] = f"{tools}{os.pathsep}{variables['PATH']}"
    return made, variables, base


@pytest.fixture(scope="module")
def sample(newcomer, simulated_plot) -> Path:
    """The sample in the plugin, as a release has it."""
    folder = newcomer[2] / "plugins" / "treedgs" / "sample"
    maker.write(simulated_plot, folder)
    return folder


def ran(newcomer, algorithm: str, *words: str, network: bool = True, **more: str) -> subprocess.CompletedProcess:
    made, variables, _ = newcomer
    command = [made.program, "run", f"treedgs:{algorithm}", "--", *words]
    if not network and os.geteuid() == 0 and shutil.which("unshare"):
        command = ["unshare", "--net", *command]
    return subprocess.run(command, env={**variables, **more}, capture_output=True, text=True, timeout=PATIENCE_S)


def test_a_shell_without_an_engine_is_given_the_command_with_size_and_time(newcomer, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    words = [f"INPUT={tmp_path / 'cloud.laz'}", f"OUTPUT={tmp_path / 'trees.gpkg'}"]
    done = ran(newcomer, "pointcloudtodbh", *words, TREEDGS_HOME=str(tmp_path / "home"))
    said = done.stdout + done.stderr
    assert done.returncode == 1 and "qgis_process run treedgs:setupengine" in said and "Traceback" not in said
    assert f"{SIZE}, " in said and " min)" in said


def test_while_the_engine_is_set_up_a_job_and_a_second_set_up_are_told_so(newcomer, tmp_path):
    cloud = tmp_path / "cloud.laz"
    stems_cloud(cloud)
    home = tmp_path / "home"
    target = home / f"engine-{locked.lock_hash()}"
    environment.going_on(target)
    for algorithm, words in (
        ("pointcloudtodbh", [f"INPUT={cloud}", "CRS=EPSG:32617", f"OUTPUT={tmp_path / 'trees.gpkg'}"]),
        ("setupengine", []),
    ):
        done = ran(newcomer, algorithm, *words, TREEDGS_HOME=str(home))
        said = done.stdout + done.stderr
        assert done.returncode != 0 and "The engine is being set up; wait until" in said, said
        assert not target.exists() and not (tmp_path / "trees.gpkg").exists()
    environment.over(target)
    assert not environment.set_up_runs(target)


def test_the_sample_is_copied_to_where_one_may_write(newcomer, sample, tmp_path):
    folder = tmp_path / "vol é"
    for _ in range(2):
        done = ran(newcomer, "sampleflight", f"FOLDER={folder}", network=False)
        assert done.returncode == 0, done.stdout + done.stderr
        names = {path.name for path in folder.iterdir()}
        assert {"images", "plots.csv", "dtm.tif", "README.txt"} <= names and not names & {"truth", "lidar"}
        (folder / "trees.gpkg").write_text("a former try")
        (folder / "plots.csv").unlink(missing_ok=True)
    away = sample.rename(sample.with_name("away"))
    done = ran(newcomer, "sampleflight", f"FOLDER={tmp_path / 'other'}")
    away.rename(sample)
    assert (
        done.returncode == 1 and "run: make sample" in done.stdout + done.stderr and not (tmp_path / "other").exists()
    )


def test_one_click_sets_it_up_and_the_algorithm_runs(newcomer, wheels, sample, tmp_path):
    made, variables, _ = newcomer
    home = tmp_path / "home é"
    program, frame = made.tools.qgis(), shutil.which("xvfb-run")
    if program is None or frame is None:
        pytest.skip("the graphical QGIS or xvfb-run is not installed here; make setup installs them")
    stems_cloud(tmp_path / "cloud.laz", (0.15, 0.2))
    pictures = Path(os.environ.get("TREEDGS_PICTURES", tmp_path))
    job = {"cloud": str(tmp_path / "cloud.laz"), "output": str(tmp_path / "trees.gpkg"),
           "report": str(tmp_path / "seen.json"), "pictures": str(pictures)}  # fmt: skip
    more = {
        **variables,
        "TREEDGS_HOME": str(home),
        "TREEDGS_OFFER": json.dumps(job),
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": wheels.as_uri(),
    }
    seen = made.windows("offer_inside.py", tmp_path / "seen.json", ("TREEDGS_PYTHON",), **more)
    for place in ("first", "dialog"):
        sentence = f"The engine is not set up ({SIZE}, "
        assert any(words.startswith(sentence) for words in seen[place][0])
    assert "Set up now" in seen["dialog"][1]  # on the main window QGIS may put a message of its own above it
    assert any(words.startswith("Set up the engine") for words in seen["menu"])
    # Finer than by steps: many values, never back, and in the words what is fetched and installed.
    assert seen["progress"] == sorted(seen["progress"]) and len(set(seen["progress"])) > 20
    assert any("Fetching numpy (" in words for words in seen["words"])
    # Which packages a look falls on depends on the disk; that it goes from package to package does not.
    assert len({words for words in seen["words"] if re.match(r"Installing \S+ \(\d+ of \d+\)", words)}) > 1
    assert seen["bar"] and 200 < seen["bar"][0] < 1000
    assert "The engine is set up" in seen["ended"][0][0] and "Set up now" not in seen["ended"][1]
    assert (tmp_path / "trees.gpkg").exists() and seen["results"]["N_MEASURED"] == "2"
    assert "SIMULATE (1.1 GB" in seen["extra"][0][0] and "Add it now" in seen["extra"][1]
    assert "damaged" in seen["broken"][0][0] and "Set up again" in seen["broken"][1]
    assert not (home / "pip-cache").exists()
    # Try it: fetched, terrain and plots on the map, everything filled in.
    assert seen["sample"]["layers"] == ["Plots", "Terrain model"] and seen["sample"]["plots"] == 1
    assert "Measure DBH from drone photos" in seen["sample"]["title"]
    values = seen["sample"]["values"]
    assert Path(values["PHOTOS"]).name == "images" and "6344" in values["CRS"]
    assert seen["sample"]["problem"] == "" and Path(values["PLOTS"]).exists()


def test_upgrade_and_repair_without_network_keep_jobs_and_removing_frees_the_disk(newcomer, wheels, tmp_path):
    home = tmp_path / "home"
    job = home / "jobs" / "20260101-000000-geotag-x"
    job.mkdir(parents=True)
    (job / "engine.log").write_text("kept")
    former = home / "engine-0123456789"
    former.mkdir()
    (former / "library.so").write_bytes(bytes(30_000_000))
    (home / "engine-notours").mkdir()
    # The engine of an older plugin, in the profile of another QGIS.
    elsewhere, theirs = tmp_path / "perfil 3.22" / "treedgs", home / "engine-aaaaaaaaaa"
    elsewhere.mkdir(parents=True)
    (elsewhere / "metadata.txt").write_text("[general]")
    theirs.mkdir()
    engine_users.uses(home, elsewhere, theirs.name)

    def run(algorithm: str, *words: str) -> subprocess.CompletedProcess:
        return ran(newcomer, algorithm, *words, network=False, TREEDGS_HOME=str(home))

    # An upgrade: the environment of the former list goes.
    done = run("setupengine", f"WHEELS={wheels}", "COMPILE=false")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "30 MB free again" in done.stdout
    assert (job / "engine.log").read_text() == "kept" and not former.exists() and (home / "engine-notours").exists()
    assert theirs.exists()
    # What it built imports every library for real.
    done = run("checkengine")
    assert done.returncode == 0, done.stdout + done.stderr
    # A repair.
    python = next(home.glob("engine-*/bin/python"))
    shutil.rmtree(next(home.glob("engine-*/lib/python3*/site-packages/laspy")))
    done = run("setupengine", f"WHEELS={wheels}", "REBUILD=true", "COMPILE=false")
    assert done.returncode == 0, done.stdout + done.stderr
    assert next(home.glob("engine-*/lib/python3*/site-packages/laspy")).is_dir() and job.exists()
    # Removed, but not while a program runs from it.
    waits = [str(python), "-c", "import time; print(1, flush=True); time.sleep(600)"]
    with subprocess.Popen(waits, stdout=subprocess.PIPE) as sleeper:
        assert sleeper.stdout.readline()
        done = run("removeengine")
        sleeper.kill()
    assert done.returncode == 1 and "is in use" in done.stdout + done.stderr and python.exists()
    done = run("removeengine")
    assert done.returncode == 0, done.stdout + done.stderr
    freed = float(next(line.split()[-1] for line in done.stdout.splitlines() if line.startswith("FREED_GB")))
    assert 0.9 < freed < 1.6
    assert job.exists()
    assert f"{theirs} stays: the plugin in {elsewhere} uses it" in done.stdout
    assert {path.name for path in home.iterdir()} == {"engine-notours", "jobs", "users", theirs.name}
    # Once that plugin is gone, so is its engine.
    shutil.rmtree(elsewhere)
    done = run("removeengine", "JOBS=true")
    assert done.returncode == 0 and [path.name for path in home.iterdir()] == ["engine-notours"]


def test_the_meter_reads_what_pip_prints(tmp_path):
    meter = pip_meter.Meter(100.0, 60.0, 60.0)
    meter.site = tmp_path
    assert not meter.line("Collecting numpy==2.4.6 (from -r list.txt (line 1))")
    assert not meter.line("  Downloading numpy-2.4.6-cp311-cp311-linux.whl.metadata (6.6 kB)")
    assert meter.fraction == 0
    assert not meter.line("  Downloading numpy-2.4.6-cp311-cp311-manylinux_2_27_x86_64.whl (40.0 MB)")
    assert meter.line("Progress 20000000 of 40000000")
    assert meter.fraction == pytest.approx(0.03 + (meter.boundary - 0.03) * 0.2)
    assert meter.message == "Fetching numpy (20 of 100 MB are here)"
    meter.line("Downloading scipy-1.17.1-cp311-cp311-manylinux.whl (60.0 MB)")
    assert meter.fraction == pytest.approx(0.03 + (meter.boundary - 0.03) * 0.4)
    other = pip_meter.Meter(100.0, 60.0, 60.0)
    (tmp_path / "roues à part").mkdir()
    wheel = tmp_path / "roues à part" / "tiny_thing-1.0-py3-none-any.whl"
    wheel.write_bytes(bytes(50_000_000))
    other.line(f"Processing {wheel} (from -r list.txt (line 3))")
    assert other.message == "Fetching tiny-thing (50 of 100 MB are here)"
    meter.line("Installing collected packages: numpy, scipy")
    assert meter.fraction == pytest.approx(meter.boundary)
    assert meter.message == "Installing numpy (1 of 2)"
    (tmp_path / "numpy-2.4.6.dist-info").mkdir()
    (tmp_path / "numpy-2.4.6.dist-info" / "INSTALLER").touch()
    meter.look()
    assert meter.message == "Installing scipy (2 of 2)"
    assert meter.fraction == pytest.approx(meter.boundary + (meter.compiling - meter.boundary) * 0.4)
    meter.line("Compiled 500 of 1000")
    assert meter.fraction == pytest.approx((meter.compiling + 1) / 2)
