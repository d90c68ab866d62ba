#!/usr/bin/env bash
# Measures every stage on the test scenes and makes doc/results.md: renders the drives, runs the tools, judges the results.
# A run that was interrupted goes on where it ended.
#   evaluate_everything.sh [--quick] [--stages STAGE...] [--work FOLDER] [--no-publish] [--drop-old]
# --quick: small images and short drives (40 minutes on two cores); otherwise a night.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case "${1:-}" in -h | --help) sed -n '2,5s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
exec scripts/in_build.sh /usr/bin/python3 -m vcharge_evaluation.everything "$@"
