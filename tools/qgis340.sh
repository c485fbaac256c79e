#!/bin/sh
# The plugin's tests with QGIS 3.40: Debian trixie in a folder of its own, this repository and its Python seen inside.
# Needs root (debootstrap, chroot) and, the first time, the network (about 3 GB). Arguments go to pytest.
#   TREEDGS_TRIXIE=/path  where the system lives (default /var/tmp/treedgs-trixie)
set -eu
cd "$(dirname "$0")/.."
root=${TREEDGS_TRIXIE:-/var/tmp/treedgs-trixie}
mirror=${TREEDGS_MIRROR:-http://deb.debian.org/debian}
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

[ "$(id -u)" = 0 ] || fail "root is needed for a system in a folder (debootstrap, chroot): sudo make qgis340"
[ -x .venv/bin/python ] || fail "the engine is not set up; run make setup first"
if [ ! -e "$root/.treedgs-ready" ]; then
    command -v debootstrap >/dev/null || apt-get install -y -q --no-install-recommends debootstrap debian-archive-keyring
    [ -e "$root/etc/debian_version" ] || debootstrap --variant=minbase --include=ca-certificates trixie "$root" "$mirror"
    chroot "$root" apt-get update -q
    chroot "$root" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
        qgis python3-qgis qgis-providers xvfb xauth libgl1 libgomp1 libx11-6 libegl1 libusb-1.0-0 fonts-dejavu-core \
        libssl3t64 libffi8 libsqlite3-0 liblzma5 libbz2-1.0 zlib1g procps
    touch "$root/.treedgs-ready"
fi
# Seen inside at their own paths: the repository, the shared data beside it, and the Python that .venv was made from.
python=$(.venv/bin/python -c 'import os, sys; print(os.path.realpath(sys.base_prefix))')
mounts="$PWD"
[ "$python" = /usr ] && fail ".venv is built with the system's Python, which trixie does not have; build it with another (TREEDGS_BASE_PYTHON)"
mounts="$mounts $python"
[ -d "$(dirname "$PWD")/shared" ] && mounts="$mounts $(dirname "$PWD")/shared"
# A private mount namespace: nothing stays mounted when this ends.
exec nice unshare --mount --propagation private sh -eu -c '
    root=$1 work=$2 mounts=$3; shift 3
    for folder in $mounts; do mkdir -p "$root$folder"; mount --rbind "$folder" "$root$folder"; done
    mount -t proc proc "$root/proc"; mount --rbind /dev "$root/dev"
    exec chroot "$root" env -i HOME=/root PATH=/usr/bin:/bin:/usr/sbin LANG=C.UTF-8 ${OMP_NUM_THREADS:+OMP_NUM_THREADS=$OMP_NUM_THREADS} \
        sh -c "cd \"\$0\" && qgis_process --version | head -n 1 && exec .venv/bin/python -m pytest -q \"\$@\"" "$work" "$@"
' sh "$root" "$PWD" "$mounts" "${@:-tests/qgis}"
