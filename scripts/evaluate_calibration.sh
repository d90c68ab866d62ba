#!/usr/bin/env bash
# The tables of what extrinsic calibration reaches: simulates calibration drives (or takes those that --work has from an
# earlier run), calibrates rigs from them and in maps, and spoils drives to see the verdicts. See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec scripts/in_build.sh /usr/bin/python3 scripts/evaluate_calibration.py "$@"
