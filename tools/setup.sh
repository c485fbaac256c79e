#!/bin/sh
# Everything that make demo and make test need: system packages, .venv with the engine, a private QGIS profile.
# Run again, it finds its stamp and ends at once. Nothing outside .venv, .setup and the system's packages is touched.
#   TREEDGS_BASE_PYTHON=/path  build with this Python        TREEDGS_TORCH=cuda  do not insist on the CPU build
set -eu
cd "$(dirname "$0")/.."
umask 022

say() { printf '%s\n' "$*"; }
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

# The stamp holds what the set-up depends on; it is looked at without starting any program that is slow.
key=$(cat pyproject.toml tools/setup.sh tools/qgis_run.py treedgs_qgis/environment.py treedgs_qgis/locked.py metadata.txt \
    treedgs_qgis/requirements-locked.txt tools/requirements-dev-locked.txt | cksum | tr ' ' '-')
stamp=.setup/stamp
if [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$key $PWD" ] && [ -x .venv/bin/treedgs ] && .venv/bin/python -c '' \
   && [ -e .setup/plugins/treedgs/metadata.txt ] && command -v qgis_process >/dev/null; then
    exit 0
fi
mkdir -p .setup
if command -v flock >/dev/null; then
    exec 9>.setup/lock
    flock -n 9 || { say "Another set-up is running; waiting for it."; flock 9; }
fi

good_python() { "$1" -I -c 'import sys; assert (3, 10) <= sys.version_info[:2] <= (3, 14); import ensurepip, venv' 2>/dev/null; }
find_python() {
    for candidate in ${TREEDGS_BASE_PYTHON:-} python3 /usr/bin/python3 python3.12 python3.13 python3.11 python3.14 python3.10; do
        if command -v "$candidate" >/dev/null && good_python "$candidate"; then printf '%s\n' "$candidate"; return; fi
    done
}

# 1. System packages, by what they bring rather than by name; the engine's wheels need libGL, libgomp and X11.
missing=""
command -v qgis_process >/dev/null && /usr/bin/python3 -c 'import qgis.core' 2>/dev/null || missing="$missing qgis python3-qgis qgis-providers"
command -v Xvfb >/dev/null || missing="$missing xvfb"
command -v xauth >/dev/null || missing="$missing xauth"
# RINEX files and corrected EXIF/XMP copies are worked on by the first two programs; the tests
# run them, and read the stand table's PDF with the third.
command -v rnx2rtkp >/dev/null || missing="$missing rtklib"
command -v exiftool >/dev/null || missing="$missing libimage-exiftool-perl"
command -v pdftotext >/dev/null || missing="$missing poppler-utils"
for pair in libGL.so.1:libgl1 libgomp.so.1:libgomp1 libX11.so.6:libx11-6 libEGL.so.1:libegl1 libusb-1.0.so.0:libusb-1.0-0; do
    { ldconfig -p 2>/dev/null || /sbin/ldconfig -p 2>/dev/null; } | grep -q "${pair%%:*}" || missing="$missing ${pair#*:}"
done
[ -n "$(find_python)" ] || missing="$missing python3 python3-venv"
if [ -n "$missing" ]; then
    command -v apt-get >/dev/null || fail "this system has no apt-get; install with its own package manager what stands for:$missing; then run this again."
    root=""
    if [ "$(id -u)" != 0 ]; then
        command -v sudo >/dev/null || fail "system packages are missing ($missing ) and there is no sudo; run as root: apt-get install$missing"
        root=sudo
    fi
    say "Installing system packages:$missing"
    # A broken third-party list must not stop us: what counts is whether the packages can be installed.
    $root env DEBIAN_FRONTEND=noninteractive apt-get update -q >.setup/apt.log 2>&1 || say "  apt-get update had problems (.setup/apt.log), going on"
    # shellcheck disable=SC2086
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing >>.setup/apt.log 2>&1 \
        || { tail -n 15 .setup/apt.log >&2; fail "apt-get could not install$missing (all of it in .setup/apt.log)."; }
fi

# 2. The engine environment.
python=$(find_python)
[ -n "$python" ] || fail "no Python 3.10 to 3.14 with venv was found; install python3 and python3-venv, or set TREEDGS_BASE_PYTHON."
# Every library in its locked version with its hashes, as treedgs:setupengine installs them; what pip prints is in .setup/pip.log.
"$python" -m treedgs_qgis.environment --target .venv --key "$key" --python "$(command -v "$python")" --log .setup/pip.log \
    || fail "the engine environment .venv is not complete; read the lines above and run this again."

# 3. What jobs run compiled, once for this processor; a job compiles what is missing.
say "Compiling what jobs run compiled, once for this processor"
.venv/bin/treedgs doctor --compile --log-format plain >.setup/compile.log 2>&1 \
    || say "  that failed (.setup/compile.log); the first job takes some minutes longer"

# 4. QGIS with this repository as its plugin, in a profile of its own.
.venv/bin/python tools/qgis_run.py --make-profile || fail "the private QGIS profile in .setup could not be made."

printf '%s\n' "$key $PWD" >"$stamp"
say "Set up: .venv/bin/treedgs, and QGIS with the plugin in .setup (make qgis opens it)."
