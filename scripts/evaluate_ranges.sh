#!/usr/bin/env bash
# The tables of what range maps reach: simulates drives (or takes those that --work has from an earlier run) and compares their
# range maps with the truth, of all cameras of a drive, and with --parts settings by setting and poses. See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec scripts/in_build.sh /usr/bin/python3 scripts/evaluate_ranges.py "$@"
