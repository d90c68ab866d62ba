#!/usr/bin/env bash
# The simulator's faults through the whole online path: what each stage says and when, and that no wrong pose is called good.
# See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec scripts/in_build.sh /usr/bin/python3 scripts/evaluate_faults.py "$@"
