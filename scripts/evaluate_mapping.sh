#!/usr/bin/env bash
# The table of what mapping reaches: simulates drives (or takes those that --work has from an earlier run), maps them with
# config/mapping.yaml, and judges the maps by the truth. See --help; the whole of it takes an hour and 10 GB per drive.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec scripts/in_build.sh /usr/bin/python3 scripts/evaluate_mapping.py "$@"
