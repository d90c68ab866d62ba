#!/usr/bin/env bash
# The whole chain from unknown calibration, end to end, on three cars in two scenes: lenses from boards, places from a drive, a
# map, another day's pose, heights and obstacles, and what the errors of each stage add to the next. See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec scripts/in_build.sh /usr/bin/python3 scripts/evaluate_chain.py "$@"
