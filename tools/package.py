"""The plugin's zip and the library's wheel, checked as the QGIS plugin repository checks: ``make package``.

Only tracked files go in, and of those what the plugin needs at run time. What the repository would refuse ends this
with an error: missing metadata, no LICENSE, more than 25 MB, binaries or scripts, names that are no identifiers, and
findings of its security scan (Bandit and detect-secrets) that cannot be waived there.
"""

from __future__ import annotations

import argparse
import configparser
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NAME = "treedgs"
WANTED = ("processing/", "treedgs_qgis/", "treedgs_geo/", "treedgs_lab/", "docs/")
#: Run from the clone only.
LEFT_OUT = (
    "docs/results/", "docs/api/", "docs/_static/", "docs/conf.py", "treedgs_lab/training/",
)  # fmt: skip
SINGLE = ("__init__.py", "metadata.txt", "LICENSE", "README.md", "CHANGELOG.md", ".bandit")
REQUIRED = (
    "name", "description", "version", "qgisMinimumVersion", "author", "email", "about", "tracker", "repository",
    "homepage",
)  # fmt: skip
ADDRESSES = ("tracker", "repository", "homepage")
#: Addresses that stand for one that is not there yet (RFC 2606 names, and our own gap).
PLACEHOLDER = re.compile(r"\bexample\.(org|com|net)\b|\.(example|invalid|test|localhost)\b|\blocalhost\b|TODO", re.I)
ANSWER_S = 10
#: What may lie in the zip; everything else is a binary or a script to the repository.
TEXT = {
    ".py", ".txt", ".md", ".json", ".html", ".js", ".css", ".qml", ".svg", ".ts", ".csv", ".model3", ".xml", ".typed",
    "",
}  # fmt: skip
PICTURES = {".png", ".qm", ".jpg"}
#: The sample flight, which is made, not tracked (``make sample``), and what lies in it.
SAMPLE = "sample/"
OF_SAMPLES = {".mrk", ".pos", ".csv", ".txt", ".jpg", ".tif"}
MAX_BYTES = 25 * 1024 * 1024
#: Findings of Bandit that the plugin repository does not let anybody waive.
BLOCKING = {
    "B102", "B103", "B202", "B301", "B302", "B307", "B308", "B602", "B604", "B605", "B609", "B615", "B701", "B702",
}  # fmt: skip
#: Waivable there, and meant: listed with the reasons.
WAIVED = ROOT / ".bandit"
SCANNERS = ("bandit>=1.7,<2", "detect-secrets>=1.5,<2", "build>=1,<2", "twine>=6,<8")


class PackageError(Exception):
    """What the plugin repository would refuse."""


def chosen_files() -> list[str]:
    """Tracked files of the plugin, relative to the repository; without git whatever lies in its folders."""
    if shutil.which("git"):
        command = ["git", "-c", f"safe.directory={ROOT}", "ls-files"]
        listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    else:
        found = [path for top in WANTED for path in (ROOT / top).rglob("*") if "__pycache__" not in path.parts]
        listed = [path.relative_to(ROOT).as_posix() for path in found] + list(SINGLE)
    files = [name for name in listed if name.startswith(WANTED) or name in SINGLE]
    files += [path.relative_to(ROOT).as_posix() for path in (ROOT / SAMPLE).rglob("*")]
    return [name for name in files if not name.startswith(LEFT_OUT) and (ROOT / name).is_file()]


def check_files(files: list[str]) -> None:
    """Names and kinds.

    Raises:
        PackageError: naming the file.
    """
    for name in files:
        suffix = Path(name).suffix.lower()
        if suffix not in (OF_SAMPLES if name.startswith(SAMPLE) else TEXT | PICTURES):
            raise PackageError(f"{name}: {suffix} files are binaries or scripts to the plugin repository")
        if suffix in TEXT and not name.startswith(SAMPLE):
            try:
                (ROOT / name).read_text(encoding="utf-8")
            except UnicodeDecodeError:
                raise PackageError(f"{name}: is not text in UTF-8") from None
        for part in Path(name).parts[:-1]:
            if not part.isidentifier():
                raise PackageError(f"{name}: the folder {part!r} is no Python identifier")
    for name in SINGLE:
        if name not in files:
            raise PackageError(f"{name}: is missing")


def check_metadata(release: bool = False) -> dict[str, str]:
    """metadata.txt, after checking it as the repository reads it (interpolation on: a bare % is an error).

    release: what is to be uploaded. Whether its addresses answer is asked last (:func:`check_addresses`).

    Raises:
        PackageError: a key is missing, or does not agree with the library.
    """
    parser = configparser.ConfigParser()
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read(ROOT / "metadata.txt", encoding="utf-8")
    general = dict(parser["general"])
    missing = [key for key in REQUIRED if not general.get(key, "").strip()]
    if missing:
        raise PackageError(f"metadata.txt: lacks {', '.join(missing)}")
    if "supportsQt6" in general:
        raise PackageError("metadata.txt: supportsQt6 is gone from QGIS; qgisMaximumVersion says it")
    own = re.search(r'__version__ = "([^"]+)"', (ROOT / "treedgs_geo" / "__init__.py").read_text(encoding="utf-8"))
    if not own or own.group(1) != general["version"]:
        raise PackageError(f"metadata.txt: version {general['version']}, the library says {own and own.group(1)}")
    for key in ADDRESSES:
        if not general[key].startswith("https://"):
            raise PackageError(f"metadata.txt: {key} is not an https address")
    if release and general.get("experimental", "").lower() == "true":
        # Meant, and no reason to refuse: it stays until real Windows and Mac machines have run it (docs/windows.md).
        print("note: metadata.txt says experimental=True; users see it only with 'Show also experimental plugins'")
    return general


def check_addresses(general: dict[str, str], release: bool) -> None:
    """Homepage, repository, tracker and mailbox are real, and the first three answer: asked of a release only.

    Raises:
        PackageError: naming those that are not.
    """
    made_up = [key for key in (*ADDRESSES, "email") if PLACEHOLDER.search(general[key])]
    if made_up and release:
        raise PackageError(
            f"metadata.txt: {', '.join(made_up)} still hold placeholders; a release needs the public repository's "
            "addresses and a mailbox that is read (the plugin repository asks each address for an answer)"
        )
    if made_up:
        print(
            f"warning: metadata.txt: {', '.join(made_up)} are placeholders; 'make package release=1' will refuse them"
        )
    elif release:
        for key in ADDRESSES:
            check_address(key, general[key])


def check_address(key: str, address: str) -> None:
    """As the plugin repository does on upload: an answer below 400 within 10 s.

    Raises:
        PackageError: no such answer.
    """
    request = urllib.request.Request(address, method="GET", headers={"User-Agent": "treedgs-package"})
    try:
        with urllib.request.urlopen(request, timeout=ANSWER_S) as answer:
            code = answer.status
    except urllib.error.HTTPError as problem:
        code = problem.code
    except (OSError, ValueError) as problem:
        raise PackageError(f"metadata.txt: {key} {address} gives no answer within {ANSWER_S} s ({problem})") from None
    if code >= 400:
        raise PackageError(f"metadata.txt: {key} {address} answers {code}, expected less than 400")


def write_zip(files: list[str], target: Path) -> None:
    """The zip, the same bytes for the same files.

    Raises:
        PackageError: too large.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(f"{NAME}/{name}", date_time=(2026, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, (ROOT / name).read_bytes())
    if target.stat().st_size > MAX_BYTES:
        raise PackageError(f"{target.name}: {target.stat().st_size / 1e6:.1f} MB, at most 25 MB are taken")


def tools_python(folder: Path) -> Path:
    """The Python of a small environment with the scanners; made on first use."""
    python = folder / "bin" / "python"
    marker = folder / "scanners"
    if not marker.exists() or marker.read_text() != str(SCANNERS):
        venv.create(folder, with_pip=True, clear=True)
        subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *SCANNERS], check=True)
        marker.write_text(str(SCANNERS))
    return python


def scan(archive: Path, python: Path) -> None:
    """Bandit and detect-secrets over what is in the zip.

    Raises:
        PackageError: a finding that blocks, or a secret.
    """
    with tempfile.TemporaryDirectory() as folder:
        with zipfile.ZipFile(archive) as packed:
            for entry in packed.infolist():
                packed.extract(entry, folder)
        command = [python, "-m", "bandit", "-q", "-r", f"{folder}/{NAME}/", "-f", "json", "--ini", os.devnull]
        done = subprocess.run(command, capture_output=True, text=True)
        report = json.loads(done.stdout[done.stdout.index("{") :])
        found = report["results"]
        counts: dict[str, int] = {}
        for finding in found:
            counts[finding["test_id"]] = counts.get(finding["test_id"], 0) + 1
        parser = configparser.ConfigParser()
        parser.read(WAIVED, encoding="utf-8")
        waived = {name.strip() for name in parser["bandit"]["skips"].split(",")}
        unknown = [f for f in found if f["test_id"] not in waived - BLOCKING]
        for finding in unknown:
            place = Path(finding["filename"]).relative_to(Path(folder) / NAME)
            print(f"  {finding['test_id']} {place}:{finding['line_number']}: {finding['issue_text'].splitlines()[0]}")
        shown = ", ".join(f"{number} x {name}" for name, number in sorted(counts.items())) or "nothing"
        print(f"bandit: {shown}; errors: {len(report['errors'])}")
        if report["errors"] or any(f["test_id"] in BLOCKING for f in found) or unknown:
            raise PackageError("bandit: see the findings above; those that are meant belong into .bandit with a reason")
        done = subprocess.run(
            [python, "-m", "detect_secrets", "scan", "--all-files", "."],
            cwd=Path(folder) / NAME,
            capture_output=True,
            text=True,
            check=True,
        )
        secrets = json.loads(done.stdout)["results"]
        for name, entries in secrets.items():
            for entry in entries:
                print(f"  {name}:{entry['line_number']}: {entry['type']}")
        print(f"detect-secrets: {sum(map(len, secrets.values()))} findings")
        if secrets:
            raise PackageError("detect-secrets: see the findings above")


def check_wheel(wheel: Path, files: list[str]) -> None:
    """Every file of the library is in the wheel, its data too, and nothing of the plugin.

    Raises:
        PackageError: naming what is missing or too much.
    """
    with zipfile.ZipFile(wheel) as packed:
        there = {name for name in packed.namelist() if ".dist-info/" not in name and ".data/" not in name}
    wanted = {name for name in files if name.startswith(("treedgs_geo/", "treedgs_lab/"))}
    if there != wanted:
        odd = ", ".join(sorted(wanted ^ there)[:5])
        raise PackageError(f"{wheel.name}: and the library differ in {odd}; correct package-data in pyproject.toml")


def check_figures() -> None:
    """Figures of README and docs are those of their files, and none is too old for a release.

    Raises:
        PackageError: some are not.
    """
    words = [sys.executable, "-m", "treedgs_lab.benchmarks.figures", "--check", "--release"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise PackageError(f"figures of the docs; run their commands again, or take them out:\n{done.stdout.strip()}")


def carry_out(command: list[str | Path]) -> None:
    """Run a program.

    Raises:
        PackageError: it failed, with the end of what it said.
    """
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        said = f"{done.stdout}\n{done.stderr}".strip()[-800:]
        raise PackageError(f"{' '.join(map(str, command[1:4]))} ends with {done.returncode}: {said}")


def main() -> int:
    """Zip, scans, wheel and sdist into ``dist/``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "dist")
    parser.add_argument("--no-scan", action="store_true", help="zip only: no scanners, no wheel, no network")
    parser.add_argument(
        "--release", action="store_true", help="for upload: refuses placeholders, dead addresses, old figures"
    )
    chosen = parser.parse_args()
    archive: Path | None = None
    try:
        general = check_metadata(chosen.release)
        version = general["version"]
        files = chosen_files()
        check_files(files)
        # Whatever is not for upload says so in its name.
        archive = chosen.output / f"{NAME}-{version}{'' if chosen.release else '-trial'}.zip"
        write_zip(files, archive)
        print(f"{archive}: {len(files)} files, {archive.stat().st_size / 1e6:.2f} MB")
        if chosen.no_scan:
            check_addresses(general, chosen.release)
            if chosen.release:
                check_figures()
            return 0
        python = tools_python(ROOT / ".setup" / "release")
        scan(archive, python)
        # Built from a copy, so that no build folder is left in the repository.
        with tempfile.TemporaryDirectory() as folder:
            for name in [*files, "pyproject.toml"]:
                target = Path(folder) / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / name, target)
            docs = [sys.executable, "-m", "sphinx", "-q", "-b", "man", "-d", ROOT / "build" / "docs" / ".doctrees"]
            carry_out([*docs, ROOT / "docs", Path(folder) / "share" / "man" / "man1"])
            carry_out([python, "-m", "build", "--outdir", chosen.output.resolve(), folder])
        wheel = max(chosen.output.glob("*.whl"), key=lambda path: path.stat().st_mtime)
        carry_out([python, "-m", "twine", "check", "--strict", wheel, *chosen.output.glob("*.tar.gz")])
        check_wheel(wheel, files)
        # Last: what else there is to correct is known by then.
        check_addresses(general, chosen.release)
        if chosen.release:
            check_figures()
    except PackageError as problem:
        if archive is not None and chosen.release:
            archive.unlink(missing_ok=True)  # nobody may upload what was refused
        print(f"error: {problem}", file=sys.stderr)
        return 1
    for wheel in sorted(chosen.output.glob("*.whl")):
        print(f"{wheel}: {wheel.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
