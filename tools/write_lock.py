"""Write ``treedgs_qgis/requirements-locked.txt``, every library of the engine with its hashes: ``make lock``.

Resolved by uv for every system and Python 3.10 or newer, wheels only, from ``requirements.txt`` (without torch, which
no step needs) and the ``gpu`` extra of ``pyproject.toml``. ``treedgs:setupengine`` installs exactly this list.
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
HEAD = (
    "# Written from requirements.txt by make lock; treedgs_qgis/locked.py reads it. One line a library and platform.\n"
    "# The hashes are those of the package index, no secrets.\n"
)


def wanted() -> list[str]:
    """The ranges that are resolved."""
    lines = [line for line in RANGES.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]
    gpu = re.search(r"^gpu = \[(.*?)\]", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)
    assert gpu, "pyproject.toml has no extra gpu"
    return (
        [line for line in lines if not line.startswith("torch")]
        + re.findall(r'"([^"]+)"', gpu.group(1))
        + [OLDER_CARDS]
    )


def one_line_each(text: str) -> str:
    """uv's list with each library on one line, marked for the scan for secrets."""
    joined = re.sub(r"\s*\\\n\s*", " ", text)
    lines = [line.strip() for line in joined.splitlines() if line.strip() and not line.startswith("#")]
    return HEAD + "".join(f"{line}  # pragma: allowlist secret\n" for line in lines)


def main() -> int:
    """Resolve and write."""
    folder = ROOT / ".setup" / "lock"
    python = folder / "bin" / "python"
    if not (folder / "bin" / "uv").exists():
        venv.create(folder, with_pip=True, clear=True)
        subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", "uv"], check=True)
    with tempfile.TemporaryDirectory() as scratch:
        ranges, found = Path(scratch) / "ranges.in", Path(scratch) / "locked.txt"
        ranges.write_text("\n".join(wanted()) + "\n", encoding="utf-8")
        command = [folder / "bin" / "uv", "pip", "compile", "-q", "--universal", "--python-version", "3.10"]
        command += ["--generate-hashes", "--no-annotate", "--no-header", "--only-binary", ":all:", ranges, "-o", found]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            print(f"error: {done.stderr.strip()[-800:]}", file=sys.stderr)
            return 1
        text = one_line_each(found.read_text(encoding="utf-8"))
    LOCKED.write_text(text, encoding="utf-8")
    print(f"{LOCKED.relative_to(ROOT)}: {text.count('==')} lines, {text.count('sha256:')} hashes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
