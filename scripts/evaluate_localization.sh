#!/usr/bin/env bash
# The table of what localization reaches: simulates mapping drives and other days' drives (or takes those that --work has
# from an earlier run, also of evaluate_mapping.sh), maps the ones and localizes the others, with config/mapping.yaml and
# config/localization.yaml. See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec scripts/in_build.sh /usr/bin/python3 scripts/evaluate_localization.py "$@"
