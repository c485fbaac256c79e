"""``treedgs doctor``: what is installed, which steps work, what is missing and how to correct it."""

from __future__ import annotations

import importlib
import importlib.metadata
import platform
import shutil
import sys
import tempfile
from dataclasses import dataclass
from typing import Any

from ..core.command import Command
from ..core.errors import MissingComponentError
from ..core.machine import cores
from ..core.progress import Reporter

#: Import name -> name of the package that ``pip`` installs.
PACKAGES = {
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "pyproj": "pyproj",
    "shapely": "shapely",
    "pyogrio": "pyogrio",
    "geopandas": "geopandas",
    "rasterio": "rasterio",
    "matplotlib": "matplotlib",
    "psutil": "psutil",
    "tqdm": "tqdm",
    "laspy": "laspy",
    "lazrs": "lazrs",
    "CSF": "cloth-simulation-filter",
    "PIL": "pillow",
    "cv2": "opencv-python-headless",
    "pycolmap": "pycolmap",
    "open3d": "open3d",
    "dask": "dask",
    "distributed": "distributed",
    "cryptography": "cryptography",
    "openpyxl": "openpyxl",
    "reportlab": "reportlab",
    "pygeomag": "pygeomag",
}
#: Used when installed, needed by nothing.
OPTIONAL = {"torch": "torch", "dask_jobqueue": "dask-jobqueue", "warp": "warp-lang"}

_BASE = (
    "numpy",
    "scipy",
    "numba",
    "pyproj",
    "shapely",
    "pyogrio",
    "geopandas",
    "rasterio",
    "matplotlib",
    "psutil",
    "tqdm",
)
_CLOUDS = ("laspy", "lazrs", "CSF")
_PHOTOS = ("PIL", "cv2", "pycolmap")
_MANY = ("dask", "distributed", "cryptography")

#: Verb -> the modules it imports; the QGIS plugin checks them before it starts a job.
NEEDS: dict[str, tuple[str, ...]] = {
    "photos-to-dbh": (*_BASE, *_CLOUDS, *_PHOTOS),
    "pointcloud-to-dbh": (*_BASE, *_CLOUDS),
    "campaign": (*_BASE, *_CLOUDS, *_PHOTOS, *_MANY),
    "geotag": (*_BASE, "PIL"),
    "reconstruct": (*_BASE, *_CLOUDS, *_PHOTOS),
    "terrain": (*_BASE, *_CLOUDS),
    "fit-gaussians": (*_BASE, *_CLOUDS, *_PHOTOS),
    "sample-surface": (*_BASE, *_CLOUDS),
    "segment-stems": (*_BASE, *_CLOUDS),
    "measure-dbh": (*_BASE, *_CLOUDS),
    "match-plots": _BASE,
    "evaluate": _BASE,
    "stand-table": (*_BASE, "openpyxl", "reportlab"),
    "benchmark": (*_BASE, *_CLOUDS, *_PHOTOS, "open3d"),
    "simulate-plot": (*_BASE, *_CLOUDS, "PIL", "cv2", "open3d"),
    "doctor": (),
}

#: Below these the whole chain on a plot of 60 photos is likely to fail.
LOW_MEMORY_GB, LOW_DISK_GB = 6.0, 5.0


@dataclass(frozen=True, kw_only=True)
class DoctorSettings:
    """Nothing to set."""


def check_libraries(modules: dict[str, str], reporter: Reporter) -> tuple[dict[str, str], dict[str, str]]:
    """Import each module for real (a wheel may be there and broken).

    modules: import name -> package name. Returns ``(versions, problems)``: package -> version, import name -> reason.
    """
    versions: dict[str, str] = {}
    problems: dict[str, str] = {}
    for done, (module, package) in enumerate(modules.items()):
        reporter.progress(done / len(modules), module)
        try:
            importlib.import_module(module)
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "unknown version"
        except ModuleNotFoundError as problem:
            problems[module] = "not installed" if problem.name == module else f"needs {problem.name}, not installed"
        except Exception as problem:
            problems[module] = f"does not load ({type(problem).__name__}: {problem})".replace("\n", " ")
    return versions, problems


def machine() -> dict[str, Any]:
    """Cores, memory and disk. memory_gb and free_memory_gb are ``None`` when psutil is missing."""
    found: dict[str, Any] = {
        "system": platform.platform(),
        "python": platform.python_version(),
        "interpreter": sys.executable,
        "cores": cores(),
        "memory_gb": None,
        "free_memory_gb": None,
        "free_disk_gb": round(shutil.disk_usage(tempfile.gettempdir()).free / 1e9, 1),
    }
    try:
        import psutil

        memory = psutil.virtual_memory()
        found.update(memory_gb=round(memory.total / 1e9, 1), free_memory_gb=round(memory.available / 1e9, 1))
    except ImportError:
        pass
    return found


def run(settings: DoctorSettings, reporter: Reporter) -> dict[str, Any]:  # noqa: ARG001 - as every verb's
    """Check this environment.

    Raises:
        MissingComponentError: a library that some step needs is missing or broken; names library, steps and remedy.
    """
    here = machine()
    reporter.info(f"Python {here['python']} ({here['interpreter']}) on {here['system']}")
    memory = (
        "memory unknown"
        if here["memory_gb"] is None
        else (f"{here['memory_gb']} GB memory, {here['free_memory_gb']} GB free")
    )
    reporter.info(f"{here['cores']} cores, {memory}, {here['free_disk_gb']} GB free in {tempfile.gettempdir()}")
    if here["free_memory_gb"] is not None and here["free_memory_gb"] < LOW_MEMORY_GB:
        reporter.warn(
            f"Only {here['free_memory_gb']} GB of memory are free: a plot of 60 photos may need {LOW_MEMORY_GB:g} GB."
        )
    if here["free_disk_gb"] < LOW_DISK_GB:
        reporter.warn(f"Only {here['free_disk_gb']} GB of disk are free: a workspace may need {LOW_DISK_GB:g} GB.")
    versions, problems = check_libraries({**PACKAGES, **OPTIONAL}, reporter)
    for package, version in versions.items():
        reporter.info(f"{package} {version}")
    optional = {name: reason for name, reason in problems.items() if name in OPTIONAL}
    needed = {name: reason for name, reason in problems.items() if name not in OPTIONAL}
    for name, reason in optional.items():
        reporter.info(f"{OPTIONAL[name]}: {reason}; optional, nothing here needs it")
    broken = {verb: [name for name in modules if name in needed] for verb, modules in NEEDS.items()}
    for verb, names in broken.items():
        if names:
            reporter.warn(f"{verb}: does not work, {', '.join(f'{PACKAGES[n]} {needed[n]}' for n in names)}")
        else:
            reporter.info(f"{verb}: works")
    if needed:
        stuck = [verb for verb, names in broken.items() if names]
        why = "; ".join(f"{PACKAGES[name]} {reason}" for name, reason in needed.items())
        raise MissingComponentError(
            f"{why} in {here['interpreter']}, so {', '.join(stuck)} cannot run; run 'make setup', or "
            "'Set up the engine' (treedgs:setupengine) in QGIS."
        )
    return {
        "python": here["python"],
        "cores": here["cores"],
        "memory_gb": here["memory_gb"],
        "free_disk_gb": here["free_disk_gb"],
        "n_libraries": len(versions),
        "versions": ", ".join(f"{name} {version}" for name, version in versions.items()),
        "status": "all steps work",
    }


COMMAND = Command(
    name="doctor",
    qgis_id="checkengine",
    title="Check the engine",
    group="Setup",
    summary="Say what is installed, which steps work and how to install the rest.",
    help="Loads every library of the engine, lists versions, cores, memory and disk, and says for each command whether "
    "it can run. Ends with an error and one sentence when something is missing.",
    settings=DoctorSettings,
    run=run,
    example="treedgs doctor",
    outputs={
        "python": "Python version",
        "cores": "processor cores",
        "memory_gb": "memory, GB",
        "free_disk_gb": "free disk for temporary files, GB",
        "n_libraries": "libraries found",
        "versions": "libraries with versions",
        "status": "in words",
    },
)
