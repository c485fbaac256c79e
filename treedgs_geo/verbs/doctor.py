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
from ..core.extras import EXTRAS, extra_of
from ..core.machine import cores
from ..core.progress import Reporter
from ..core.settings import param

_CLOUDS = ("laspy", "lazrs")
_PHOTOS = ("PIL", "cv2", "pycolmap")
#: Name of the package that ``pip`` installs, where it is not the import name.
_PACKAGE_OF = {"PIL": "pillow", "cv2": "opencv-python-headless", "warp": "warp-lang"}
#: Import name -> name of the package: what every engine has, and what extras bring (:mod:`treedgs_geo.core.extras`).
PACKAGES = {
    name: _PACKAGE_OF.get(name, name)
    for name in (
        "numpy", "scipy", "numba", "pyproj", "shapely", "pyogrio", "geopandas", "rasterio", "matplotlib", "psutil",
        "threadpoolctl", "tqdm", *_CLOUDS, *_PHOTOS, "pygeomag", "jinja2",
    )
}  # fmt: skip
OPTIONAL = {name: _PACKAGE_OF.get(name, name) for modules in EXTRAS.values() for name in modules}
#: What every verb imports.
_BASE = tuple(name for name in PACKAGES if name not in (*_CLOUDS, *_PHOTOS, "threadpoolctl", "pygeomag"))

#: Verb -> the modules it imports; the QGIS plugin checks them before it starts a job.
NEEDS: dict[str, tuple[str, ...]] = {
    "photos-to-dbh": (*_BASE, *_CLOUDS, *_PHOTOS),
    "pointcloud-to-dbh": (*_BASE, *_CLOUDS),
    "plan-flight": (*_BASE, *_CLOUDS, "reportlab"),
    "campaign": (*_BASE, *_CLOUDS, *_PHOTOS),
    "geotag": (*_BASE, "PIL"),
    "reconstruct": (*_BASE, *_CLOUDS, *_PHOTOS),
    "terrain": (*_BASE, *_CLOUDS),
    "fit-gaussians": (*_BASE, *_CLOUDS, *_PHOTOS, "torch"),
    "sample-surface": (*_BASE, *_CLOUDS, "torch"),
    "segment-stems": (*_BASE, *_CLOUDS),
    "measure-dbh": (*_BASE, *_CLOUDS),
    "review": _BASE,
    "match-plots": _BASE,
    "evaluate": _BASE,
    "tape-sample": (*_BASE, "reportlab"),
    "tape-check": (*_BASE, "reportlab"),
    "trial": (*_BASE, "reportlab"),
    "compare": (*_BASE, "reportlab"),
    "stand-table": (*_BASE, "openpyxl", "reportlab"),
    "benchmark": (*_BASE, *_CLOUDS, *_PHOTOS, "open3d"),
    "simulate-plot": (*_BASE, *_CLOUDS, "PIL", "cv2", "open3d"),
    "doctor": (),
}

#: Below these the whole chain on a plot of 60 photos is likely to fail.
LOW_MEMORY_GB, LOW_DISK_GB = 6.0, 5.0
#: Share of the progress that looking takes where compiling follows.
CHECKING = 0.1


@dataclass(frozen=True, kw_only=True)
class DoctorSettings:
    """What to do beside looking."""

    compile: bool = param(
        False,
        help="Compile now what jobs otherwise compile when they first need it, for this processor; what is compiled "
        "already is kept. Setting up the engine does it.",
    )


def check_libraries(
    modules: dict[str, str], reporter: Reporter, share: float = 1.0
) -> tuple[dict[str, str], dict[str, str]]:
    """Import each module for real (a wheel may be there and broken).

    modules: import name -> package name. share: of the whole progress. Returns ``(versions, problems)``: package ->
    version, import name -> reason.
    """
    versions: dict[str, str] = {}
    problems: dict[str, str] = {}
    for done, (module, package) in enumerate(modules.items()):
        reporter.progress(share * done / len(modules), module)
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


def compiled(reporter: Reporter) -> int:
    """Compile what the jobs need (:mod:`treedgs_geo.core.precompile`); returns how many functions were not compiled
    yet."""
    from ..core.precompile import compile_ahead

    with reporter.stage("compile", CHECKING, 1.0):
        found = compile_ahead(reporter)
    for reason in found.failed:
        reporter.warn(f"Not compiled ahead, so the first job that needs it will: {reason}")
    reporter.info(f"{found.compiled} functions compiled, {found.kept} were compiled already")
    return found.compiled


def run(settings: DoctorSettings, reporter: Reporter) -> dict[str, Any]:
    """Check this environment.

    Raises:
        MissingComponentError: a library that some step needs is missing or broken; names library, steps and remedy.
    """
    here = machine()
    reporter.info(f"Python {here['python']} ({here['interpreter']}) on {here['system']}")
    free = here["free_memory_gb"]
    memory = "memory unknown" if free is None else f"{here['memory_gb']} GB memory, {free} GB free"
    reporter.info(f"{here['cores']} cores, {memory}, {here['free_disk_gb']} GB free in {tempfile.gettempdir()}")
    if free is not None and free < LOW_MEMORY_GB:
        reporter.warn(f"Only {free} GB of memory are free: a plot of 60 photos may need {LOW_MEMORY_GB:g} GB.")
    if here["free_disk_gb"] < LOW_DISK_GB:
        reporter.warn(f"Only {here['free_disk_gb']} GB of disk are free: a workspace may need {LOW_DISK_GB:g} GB.")
    library = {**PACKAGES, **OPTIONAL}
    versions, problems = check_libraries(library, reporter, CHECKING if settings.compile else 1.0)
    for package, version in versions.items():
        reporter.info(f"{package} {version}")
    # An extra that was not chosen is no fault; one that is there and does not load is.
    absent = {name for name, reason in problems.items() if name in OPTIONAL and reason == "not installed"}
    faults = {name: reason for name, reason in problems.items() if name not in absent}
    for name in sorted(absent):
        reporter.info(f"{library[name]}: not installed; the extra '{extra_of(name)}' brings it")
    stuck, unchosen = {}, {}
    for verb, modules in NEEDS.items():
        if broken := [name for name in modules if name in faults]:
            stuck[verb] = broken
            reporter.warn(f"{verb}: does not work, {', '.join(f'{library[n]} {faults[n]}' for n in broken)}")
        elif lacking := sorted({extra_of(name) for name in modules if name in absent}):
            unchosen[verb] = lacking
            reporter.info(f"{verb}: not set up, it needs the extra {', '.join(lacking)}")
        else:
            reporter.info(f"{verb}: works")
    for name in sorted({name for name in faults if name in OPTIONAL} - {n for names in stuck.values() for n in names}):
        reporter.warn(f"{library[name]}: {faults[name]}; no step needs it")
    if stuck:
        names = sorted({name for broken in stuck.values() for name in broken})
        why = "; ".join(f"{library[name]} {faults[name]}" for name in names)
        raise MissingComponentError(
            f"{why} in {here['interpreter']}, so {', '.join(stuck)} cannot run; run 'make setup', or "
            "'Set up the engine' (treedgs:setupengine) in QGIS."
        )
    status = "all steps work"
    if unchosen:
        extras = sorted({extra for lacking in unchosen.values() for extra in lacking})
        status += f" but {', '.join(unchosen)} (choose {', '.join(extras)} in 'Set up the engine')"
    return {
        **({"n_compiled": compiled(reporter)} if settings.compile else {}),
        **{name: here[name] for name in ("python", "cores", "memory_gb", "free_disk_gb")},
        "n_libraries": len(versions),
        "versions": ", ".join(f"{name} {version}" for name, version in versions.items()),
        "status": status,
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
    main=("compile",),
    example="treedgs doctor",
    outputs={
        "python": "Python version",
        "cores": "processor cores",
        "memory_gb": "memory, GB",
        "free_disk_gb": "free disk for temporary files, GB",
        "n_libraries": "libraries found",
        "versions": "libraries with versions",
        "n_compiled": "functions compiled now",
        "status": "in words",
    },
)
