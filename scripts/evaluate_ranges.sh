#!/usr/bin/env bash
# Range maps of a simulated drive against the truth, with odometry's poses (all cameras) and with true poses (front and left):
#   evaluate_ranges.sh [--work DIR]       the drive that DIR has from an earlier run is used again
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
work=build/range_evaluation
case "${1:-}" in
  --work) work=${2:?--work needs a folder} ;;
  "") ;;
  *) sed -n '2,3s/^# \{0,1\}//p' "$0"; exit 2 ;;
esac
tools=$PWD/build/devel/lib
mkdir -p "$work"
bag=$work/drive.bag rig=$work/rig_truth.yaml truth=$work/drive_truth
[ -e "$bag" ] || "$tools/vcharge_simulation/simulate_drive" --scene lot --drive short --truth-range --output "$bag"
"$tools/vcharge_dense/compute_range_maps" --bag "$bag" --rig "$rig" --output "$work/odometry" --no-pictures
"$tools/vcharge_evaluation/evaluate_range" --range "$work/odometry" --truth "$truth" --bag "$bag" --rig "$rig" \
  --report "$work/odometry_report"
"$tools/vcharge_dense/compute_range_maps" --bag "$bag" --rig "$rig" --cameras front left --trajectory "$truth/trajectory.tum" \
  --output "$work/truth" --no-pictures
"$tools/vcharge_evaluation/evaluate_range" --range "$work/truth" --truth "$truth" --bag "$bag" --rig "$rig" \
  --report "$work/truth_report"
