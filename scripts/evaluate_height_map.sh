#!/usr/bin/env bash
# The table of what height maps reach: simulates drives (or takes those that --work has from an earlier run), maps them with
# build_map, makes height maps with those poses and config/height_map.yaml, and judges them by the scene. See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec scripts/in_build.sh /usr/bin/python3 scripts/evaluate_height_map.py "$@"
