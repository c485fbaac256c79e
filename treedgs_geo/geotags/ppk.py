"""From RINEX observations to the antenna's trajectory, with RTKLIB's ``rnx2rtkp`` (Debian package ``rtklib``)."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.children import find_program
from ..core.errors import GeotagError, MissingComponentError
from ..core.progress import Reporter
from .rtklib import FROM_ECEF

#: Elevation mask (degrees): what PPK software uses for drones.
_MASK_DEG = 15


@dataclass(frozen=True)
class Rinex:
    """One RINEX file. kind: ``observation`` or ``navigation``. approx_ecef: (3,) metres of an observation file's
    header, NaN where it says nothing."""

    path: Path
    kind: str
    approx_ecef: np.ndarray


def read_rinex_header(path: Path) -> Rinex | None:
    """What kind of RINEX a file is; ``None`` when it is none.

    Raises:
        GeotagError: compressed RINEX (Hatanaka), which ``rnx2rtkp`` cannot read.
    """
    try:
        with open(path, encoding="ascii", errors="replace") as stream:
            first = stream.readline()
            label = first[60:80].strip().upper()
            if label.startswith("CRINEX"):
                raise GeotagError(
                    f"{path}: is compressed RINEX (Hatanaka), expected plain RINEX; unpack it with crx2rnx."
                )
            if label != "RINEX VERSION / TYPE":
                return None
            letter = first[20:21].upper()
            position = np.full(3, np.nan)
            for _ in range(300):
                line = stream.readline()
                if not line or line[60:].strip() == "END OF HEADER":
                    break
                if line[60:].strip() == "APPROX POSITION XYZ":
                    position = np.array([float(line[k : k + 14]) for k in (0, 14, 28)])
    except (OSError, ValueError):
        return None
    if letter == "O":
        return Rinex(path, "observation", position)
    return Rinex(path, "navigation", position) if letter in "NGHLEJCI" else None


def solve(files: list[Path], base: Path | None, base_position: str | None, folder: Path, reporter: Reporter) -> Path:
    """Post-process rover against base; returns the ``.pos`` in ``folder``.

    files: RINEX found with the geotags (rover, perhaps base, navigation). base: the base's observation file when it is
    not among them or its name does not distinguish it from the rover's. base_position: ``lat, lon, h`` (degrees,
    ellipsoidal metres); without it the base file's header is believed, with a warning.

    Raises:
        GeotagError: no or more than one rover, no base, no navigation file, a bad base position, no solution.
        MissingComponentError: ``rnx2rtkp`` is not installed.
    """
    found = [header for header in map(read_rinex_header, files) if header is not None]
    rover, station = _roles([f for f in found if f.kind == "observation"], base)
    beside = sorted(p for p in base.parent.iterdir() if p.is_file()) if base is not None else []
    found += [header for header in map(read_rinex_header, beside) if header is not None]
    navigation = [f.path for f in found if f.kind == "navigation"]
    if not navigation:
        raise GeotagError(
            f"{rover.path}: has no navigation file (.nav, .yyN, .yyP) beside it, expected the broadcast "
            "orbits; put the base's or the drone's navigation RINEX into the folder."
        )
    lat, lon, height = _base_position(station, base_position, reporter)
    program = find_program("rnx2rtkp")
    if program is None:
        raise MissingComponentError(
            f"{rover.path}: RINEX needs RTKLIB's rnx2rtkp, which was not found; install the "
            "Debian package rtklib, or give the solution (.pos)."
        )
    target = folder / f"{rover.path.stem}_ppk.pos"
    options = f"-p 2 -c -m {_MASK_DEG} -f 2 -sys G,R,E,J,C -t -d 4 -l {lat:.10f} {lon:.10f} {height:.4f} -o"
    inputs = (rover.path, station.path, *dict.fromkeys(navigation))
    command = [program, *options.split(), str(target.resolve()), *(str(path.resolve()) for path in inputs)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", cwd=folder, timeout=3600, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as problem:
        raise GeotagError(
            f"{rover.path}: rnx2rtkp did not finish ({problem}); run the PPK by hand and give the .pos."
        ) from None
    lines = target.read_text(errors="replace").splitlines() if target.exists() else []
    if done.returncode or not any(line and not line.startswith("%") for line in lines):
        said = (done.stderr.strip().splitlines() or ["no message"])[-1][-160:]
        raise GeotagError(
            f"{rover.path}: rnx2rtkp found no position against {station.path.name} ({said}); check that "
            "both were recorded at the same time and that the navigation file is of that day."
        )
    return target


def _roles(observations: list[Rinex], base: Path | None) -> tuple[Rinex, Rinex]:
    """Rover and base among the observation files."""
    if base is not None:
        station = read_rinex_header(base)
        if station is None or station.kind != "observation":
            raise GeotagError(
                f"{base}: is no RINEX observation file, expected the base station's; give another --base."
            )
        left = [f for f in observations if f.path.resolve() != base.resolve()]
        if len(left) != 1:
            raise GeotagError(
                f"{base}: found {len(left)} rover observation files for this base, expected one "
                f"({', '.join(f.path.name for f in left) or 'none'}); keep only this flight's."
            )
        return left[0], station
    bases = [f for f in observations if "base" in f.path.name.lower() or "base" in f.path.parent.name.lower()]
    rovers = [f for f in observations if f not in bases]
    if len(bases) == 1 and len(rovers) == 1:
        return rovers[0], bases[0]
    names = ", ".join(f.path.name for f in observations)
    raise GeotagError(
        f"{observations[0].path.parent if observations else Path('geotags')}: which RINEX file is the base station's "
        f"is unclear (found {names or 'no observation file'}), expected one rover and one base; name the base's file "
        "with --base."
    )


def _base_position(station: Rinex, given: str | None, reporter: Reporter) -> tuple[float, float, float]:
    """Latitude, longitude (degrees), ellipsoidal height (m) of the base."""
    if given:
        parts = re.split(r"[\s,;]+", given.strip())
        try:
            lat, lon, height = (float(part) for part in parts)
            if not (abs(lat) <= 90 and abs(lon) <= 180 and -500 <= height <= 9000):
                raise ValueError
        except ValueError:
            raise GeotagError(
                f"--base-position: found {given!r}, expected latitude, longitude (degrees) and "
                "ellipsoidal height (m), for example '33.60000000, -91.80000000, 35.214'."
            ) from None
        return lat, lon, height
    if not np.isfinite(station.approx_ecef).all() or np.linalg.norm(station.approx_ecef) < 6e6:
        raise GeotagError(
            f"{station.path}: its header has no base position; give it with --base-position 'lat, lon, h'."
        )
    lon, lat, height = FROM_ECEF.transform(*station.approx_ecef)
    reporter.warn(
        f"{station.path.name}: the base position is taken from the RINEX header ({lat:.8f}, {lon:.8f}, {height:.3f} "
        "m); receivers often write one that is metres off, and every photo shifts with it: give the surveyed one with "
        "--base-position."
    )
    return float(lat), float(lon), float(height)
