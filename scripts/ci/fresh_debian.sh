#!/usr/bin/env bash
# Runs and times the README's two commands, scripts/demo.sh --quick and scripts/test.sh, on a clone of the last commit in a
# fresh Debian 12 made by debootstrap.
#   fresh_debian.sh FOLDER [--mirror URL] [-- COMMAND...]
# FOLDER: for the new system and its logs; 12 GB. A system of an earlier run is kept; the clone is always new.
# --mirror: Debian mirror to install from; default: the first of this machine's apt sources.
# COMMAND: a command to run instead. Needs root, debootstrap, and the right to mount.
set -euo pipefail
source_folder=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

[ $# -ge 1 ] || { sed -n '2,7s/^# \{0,1\}//p' "$0" >&2; exit 2; }
[ "$(id -u)" -eq 0 ] || { echo "fresh_debian.sh: has to be run as root" >&2; exit 1; }
# A mount namespace of its own: nothing stays mounted however the script ends.
[ -n "${VCHARGE_FRESH_DEBIAN:-}" ] || exec env VCHARGE_FRESH_DEBIAN=1 unshare --mount "$0" "$@"

fail() { echo "fresh_debian.sh: $*" >&2; exit 1; }
command -v debootstrap >/dev/null || fail "debootstrap is not installed (apt-get install debootstrap)"
mkdir -p "$1"
folder=$(cd "$1" && pwd)
shift
mirror=
if [ "${1:-}" = --mirror ]; then
  mirror=${2:?fresh_debian.sh: --mirror wants a URL}
  shift 2
fi
[ "${1:-}" = -- ] && shift
if [ -z "$mirror" ]; then
  mirror=$(apt-get indextargets --format '$(SITE)' 'Codename: bookworm' 'Component: main' | head -n 1)
  [ -n "$mirror" ] || fail "no bookworm among this machine's apt sources: give --mirror URL"
fi

if [ ! -e "$folder/system.done" ]; then
  debootstrap --variant=minbase bookworm "$folder/system" "$mirror" >"$folder/debootstrap.log" 2>&1 ||
    fail "debootstrap failed: $folder/debootstrap.log"
  touch "$folder/system.done"
fi
attach() { mkdir -p "$folder/system$2" && mount --rbind "$1" "$folder/system$2"; }
attach /proc /proc
attach /dev /dev
attach /sys /sys
cp /etc/resolv.conf /etc/hosts "$folder/system/etc/"

rm -rf "$folder/system/root/vcharge"
git clone -q "$source_folder" "$folder/system/root/vcharge"
settings=(HOME=/root LANG=C.UTF-8 TERM=dumb PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin)
if [ -n "${VCHARGE_DATA:-}" ]; then
  attach "$VCHARGE_DATA" /data
  settings+=(VCHARGE_DATA=/data)
fi

run() { # NAME COMMAND...: runs it in the new system, its output in NAME.log; prints how long it took
  local name=$1 status=0 start=$SECONDS
  shift
  chroot "$folder/system" env -i "${settings[@]}" bash -c 'cd /root/vcharge && exec "$@"' bash "$@" \
    >"$folder/$name.log" 2>&1 || status=$?
  local seconds=$((SECONDS - start))
  printf '%s: %d min %02d s, exit status %d (%s)\n' "$*" $((seconds / 60)) $((seconds % 60)) "$status" "$folder/$name.log"
  return "$status"
}
if [ $# -gt 0 ]; then
  run command "$@"
  exit
fi
failures=0
run install scripts/install_dependencies.sh || failures=1
run build scripts/build.sh --tests || failures=1
run demo scripts/demo.sh --quick || failures=1
run test scripts/test.sh || failures=1
exit "$failures"
