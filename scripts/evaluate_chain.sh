#!/usr/bin/env bash
# The whole chain from unknown calibration, end to end, on three cars in two scenes: lenses from boards, places from a drive, a
# map, another day's pose, heights and obstacles, and what the errors of each stage add to the next. See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
# shellcheck disable=SC1091
set +u && . build/devel/setup.bash && set -u
exec /usr/bin/python3 scripts/evaluate_chain.py "$@"
