#!/usr/bin/env bash
# Measures a stage: simulates drives (or uses those of an earlier run in --work), runs the tools, and judges the results.
#   evaluate.sh STAGE [arguments; --help]
# STAGE: masks, calibration, monitor (a rig watched), mapping, living_map (over days), pose_graphs (false loops), localization,
# shutters (rolling, and clocks), ranges, height_map, bays, surround_view (from above), obstacles, standing (five minutes), steps (kerbs,
# holes), objects (moving), conditions, faults, odometry (a real car's CAN), images (beside real ones), chain (all stages from unknown
# cameras), online (the nodelets live), soak (their memory).
# --publish puts the figures into doc/results and doc/results.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case "${1:-}" in "" | -h | --help) sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
scripts/in_build.sh /usr/bin/python3 -m vcharge_evaluation "$@"
case " $* " in *" --publish "*) exec scripts/in_build.sh /usr/bin/python3 -m vcharge_evaluation.page ;; esac
