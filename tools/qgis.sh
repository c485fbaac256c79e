#!/bin/sh
# The plugin's tests with another QGIS: a Debian suite in a folder of its own, this repository and its Python seen inside.
#   tools/qgis.sh 3.40 [arguments of pytest]     3.40: trixie, 3.44: sid (what sid has by then), 3.22: this system's own
# Needs root (debootstrap, chroot) and, the first time, the network (about 3 GB).
#   TREEDGS_SYSTEMS=/path  the folder of the systems (default /var/tmp)      TREEDGS_MIRROR=http://…  Debian's mirror
set -eu
cd "$(dirname "$0")/.."
mirror=${TREEDGS_MIRROR:-http://deb.debian.org/debian}
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

version=${1:-}
[ $# -eq 0 ] || shift
[ -x .venv/bin/python ] || fail "the engine is not set up; run make setup first"
case $version in
    3.40) suite=trixie ;;
    3.44) suite=sid ;;
    3.22)
        QT_QPA_PLATFORM=offscreen /usr/bin/python3 tools/qgis_run.py --version | head -n 1
        exec .venv/bin/python -m pytest -q "${@:-tests/qgis}" ;;
    *) fail "'$version' is no version that a Debian suite has: give 3.22 (bookworm, here), 3.40 (trixie) or 3.44 (sid)" ;;
esac
root=${TREEDGS_SYSTEMS:-/var/tmp}/treedgs-$suite
[ "$(id -u)" = 0 ] || fail "root is needed for a system in a folder (debootstrap, chroot): sudo tools/qgis.sh $version"
packages="qgis python3-qgis qgis-providers xvfb xauth libgl1 libgomp1 libx11-6 libegl1 libusb-1.0-0 fonts-dejavu-core \
    poppler-utils libssl3t64 libffi8 libsqlite3-0 liblzma5 libbz2-1.0 zlib1g procps git"
if [ "$(cat "$root/.treedgs-ready" 2>/dev/null)" != "$packages" ]; then
    command -v debootstrap >/dev/null || apt-get install -y -q --no-install-recommends debootstrap debian-archive-keyring
    [ -e "$root/etc/debian_version" ] || debootstrap --variant=minbase --include=ca-certificates "$suite" "$root" "$mirror"
    cp -L /etc/resolv.conf "$root/etc/resolv.conf" 2>/dev/null || :
    # A mirror may be weeks behind, as snapshots are; what it signed is checked all the same.
    chroot "$root" apt-get -o Acquire::Check-Valid-Until=false update -q
    # shellcheck disable=SC2086
    chroot "$root" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $packages
    printf '%s\n' "$packages" >"$root/.treedgs-ready"
fi
# A machine behind a proxy: its certificates are known inside too.
for file in ${SSL_CERT_FILE:-} ${PIP_CERT:-}; do
    [ ! -f "$file" ] || { mkdir -p "$root$(dirname "$file")"; cp -L "$file" "$root$file"; }
done
# Seen inside at their own paths: the repository, what its links lead to, the shared data beside it, and the Python that
# .venv was made from.
python=$(.venv/bin/python -c 'import os, sys; print(os.path.realpath(sys.base_prefix))')
[ "$python" = /usr ] && fail ".venv is built with the system's Python, which $suite does not have; build it with another (TREEDGS_BASE_PYTHON)"
mounts="$PWD $python"
for link in .venv .setup .git; do
    case $(readlink -f "$link") in "$PWD"/*) ;; *) mounts="$mounts $(readlink -f "$link")" ;; esac
done
common=$(git rev-parse --path-format=absolute --git-common-dir 2>/dev/null || :)
case $common in "" | "$PWD"/*) ;; *) mounts="$mounts $common" ;; esac
[ -d "$(dirname "$PWD")/shared" ] && mounts="$mounts $(dirname "$PWD")/shared"
# A private mount namespace: nothing stays mounted when this ends.
exec unshare --mount --propagation private sh -eu -c '
    root=$1 work=$2 mounts=$3; shift 3
    for folder in $mounts; do mkdir -p "$root$folder"; mount --rbind "$folder" "$root$folder"; done
    mount -t proc proc "$root/proc"; mount --rbind /dev "$root/dev"
    exec chroot "$root" env -i HOME=/root PATH=/usr/bin:/bin:/usr/sbin LANG=C.UTF-8 ${PYTHONPATH:+PYTHONPATH=$PYTHONPATH} \
        ${OMP_NUM_THREADS:+OMP_NUM_THREADS=$OMP_NUM_THREADS} ${TREEDGS_PICTURES:+TREEDGS_PICTURES=$TREEDGS_PICTURES} \
        ${SSL_CERT_FILE:+SSL_CERT_FILE=$SSL_CERT_FILE} ${PIP_CERT:+PIP_CERT=$PIP_CERT} \
        sh -c "cd \"\$0\" && qgis_process --version | head -n 1 && exec .venv/bin/python -m pytest -q \"\$@\"" "$work" "$@"
' sh "$root" "$PWD" "$mounts" "${@:-tests/qgis}"
