#!/usr/bin/env bash
# The table of what height maps reach: simulates drives (or takes those that --work has from an earlier run), maps them with
# build_map, makes height maps with those poses and config/height_map.yaml, and judges them by the scene. See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
# shellcheck disable=SC1091
set +u && . build/devel/setup.bash && set -u
exec /usr/bin/python3 scripts/evaluate_height_map.py "$@"
