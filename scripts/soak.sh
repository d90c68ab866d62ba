#!/usr/bin/env bash
# Replays a drive over and over through vcharge.launch (all nodelets in one manager) and watches the manager's memory:
#   soak.sh DRIVE.bag rig.yaml LOT.vmap [MINUTES, 60 by default] [RATE, 1.0]
# Prints its memory once a minute, and the growth per hour over the second half. The exit status is 1 where it grows by more than
# 20 MB an hour, or where the manager died.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[ $# -ge 3 ] || { sed -n '2,5s/^# \{0,1\}//p' "$0" >&2; exit 2; }
exec scripts/in_build.sh /usr/bin/python3 scripts/soak.py "$@"
