"""Write every library with its hashes: ``treedgs_qgis/requirements-locked.txt`` (the engine) and
``tools/requirements-dev-locked.txt`` (what ``make setup`` adds for the tests): ``make lock``.

Resolved by uv for every system and Python 3.10 or newer, wheels only, from ``requirements.txt`` (without torch, which
no step needs), all extras together, so that each fits beside the others. A line ``# [simulate reports]`` begins what
only these extras need. ``treedgs:setupengine`` installs the first list as far as it is chosen, ``make setup`` both.
``treedgs_qgis/uv-locked.txt`` is uv itself, with which the plugin gets a Python where there is none.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RANGES = ROOT / "treedgs_qgis" / "requirements.txt"
LOCKED = ROOT / "treedgs_qgis" / "requirements-locked.txt"
#: Warp's wheels of 1.18 and newer ask for a driver of 2025 and a card of 2018; 1.17 takes those of 2022 and 2014.
OLDER_CARDS = "warp-lang<1.18"
DEV = ROOT / "tools" / "requirements-dev-locked.txt"
UV_LOCKED = ROOT / "treedgs_qgis" / "uv-locked.txt"
UV = "uv>=0.9,<1"
#: Installs the library itself, without a build environment from the network.
SETUPTOOLS = "setuptools>=77"
HEAD = (
    "# Written from {source} by make lock; treedgs_qgis/locked.py reads it. One line a library and platform.\n"
    "# The hashes are those of the package index, no secrets.\n"
)


def extra(name: str) -> list[str]:
    """The ranges of an extra of ``pyproject.toml``, without those that it takes from other extras."""
    found = re.search(rf"^{name} = \[(.*?)\]$", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M | re.S)
    assert found, f"pyproject.toml has no extra {name}"
    return [item for item in re.findall(r'"([^"]+)"', found.group(1)) if not item.startswith("treedgs-geo")]


def wanted() -> dict[str, list[str]]:
    """The engine's ranges: '' what every step needs, and each extra's."""
    found: dict[str, list[str]] = {"": []}
    part = ""
    for line in RANGES.read_text(encoding="utf-8").splitlines():
        if named := re.fullmatch(r"# \[(\w+)\]", line):
            part = named[1]
        elif line and line[0] != "#" and part != "torch":
            found.setdefault(part, []).append(line)
    found["gpu"].append(OLDER_CARDS)
    return found


def wanted_by_developers() -> list[str]:
    """What the tests need beside the engine."""
    return extra("test") + extra("docs") + [SETUPTOOLS]


def name_of(line: str) -> str:
    """The library of a locked line."""
    return line.partition("==")[0]


def by_extra(uv: Path, everything: list[str]) -> list[str]:
    """The lines of ``everything``, what all need first, then under a heading what some extras need."""
    parts = wanted()
    base = {name_of(line) for line in resolve(uv, parts[""], everything)}
    users: dict[str, list[str]] = {}
    for extra_name in [name for name in parts if name]:
        for name in {name_of(line) for line in resolve(uv, parts[""] + parts[extra_name], everything)} - base:
            users.setdefault(name, []).append(extra_name)
    groups: dict[tuple[str, ...], list[str]] = {(): []}
    for line in everything:
        groups.setdefault(tuple(users.get(name_of(line), ())), []).append(line)
    lines = groups.pop(())
    for names, found in sorted(groups.items()):
        lines += [f"# [{' '.join(names)}]", *found]
    return lines


def one_line_each(text: str) -> list[str]:
    """uv's list with each library on one line."""
    joined = re.sub(r"\s*\\\n\s*", " ", text)
    return [line.strip() for line in joined.splitlines() if line.strip() and not line.startswith("#")]


def resolve(uv: Path, ranges: list[str], fixed: list[str]) -> list[str]:
    """One line a library and platform, with hashes. fixed: lines of another list whose versions are to be kept.

    Raises:
        RuntimeError: what uv said.
    """
    with tempfile.TemporaryDirectory() as scratch:
        given, kept, found = (Path(scratch) / name for name in ("ranges.in", "kept.txt", "locked.txt"))
        given.write_text("\n".join(ranges) + "\n", encoding="utf-8")
        kept.write_text("\n".join(line.partition(" --hash=")[0] for line in fixed) + "\n", encoding="utf-8")
        command: list[str | Path] = [uv, "pip", "compile", "-q", "--universal", "--python-version", "3.10", "-c", kept]
        command += ["--generate-hashes", "--no-annotate", "--no-header", "--only-binary", ":all:", given, "-o", found]
        # setuptools is left out by uv unless it is asked for.
        done = subprocess.run([*command, "--allow-unsafe"], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr.strip()[-800:])
        return one_line_each(found.read_text(encoding="utf-8"))


def write(path: Path, source: str, lines: list[str]) -> None:
    """Write one list, marked for the scan for secrets."""
    marked = [line if line[0] == "#" else f"{line}  # pragma: allowlist secret" for line in lines]
    text = HEAD.format(source=source) + "\n".join(marked) + "\n"
    path.write_text(text, encoding="utf-8")
    print(f"{path.relative_to(ROOT)}: {len(lines)} lines, {text.count('sha256:')} hashes")


def uv_program() -> Path:
    """uv, in an environment of its own."""
    folder = ROOT / ".setup" / "uv"
    if not (folder / "bin" / "uv").exists():
        venv.create(folder, with_pip=True, clear=True)
        command: list[str | Path] = [
            folder / "bin" / "python",
            "-m",
            "pip",
            "install",
            "-q",
            "--disable-pip-version-check",
            "uv",
        ]
        subprocess.run(command, check=True)
    return folder / "bin" / "uv"


def main() -> int:
    """Resolve and write. ``--dev``: only the developers' list, beside the engine's as it is."""
    uv = uv_program()
    try:
        if "--dev" in sys.argv[1:]:
            listed = LOCKED.read_text(encoding="utf-8").splitlines()
            engine = [line.partition("  #")[0] for line in listed if line and line[0] != "#"]
        else:
            engine = resolve(uv, [line for part in wanted().values() for line in part], [])
            write(LOCKED, "requirements.txt", by_extra(uv, engine))
            write(UV_LOCKED, "tools/write_lock.py", resolve(uv, [UV], []))
        names = {name_of(line) for line in engine}
        dev = resolve(uv, wanted_by_developers(), engine)
        write(DEV, "pyproject.toml", [line for line in dev if name_of(line) not in names])
    except RuntimeError as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
