#!/usr/bin/env bash
# The tables of what obstacle detection reaches: simulates drives (or takes those that --work has from an earlier run), detects
# obstacles with config/dense_obstacles.yaml and config/obstacles.yaml and compares them with the truth.
#   evaluate_obstacles.sh [--work DIR] [--small] [--seed N] [--rig-seed R] [--drives "course lot pitch garage"]
# Images of 1280x800, or with --small of 512x320, which render faster; the range maps have 384x240 pixels either way.
# pitch is the lot's drive on a soft suspension; lot_other_day and garage_other_day are drives as the whole chain has them
# (scripts/chain.py): 640x400, brighter, with the random rig of --rig-seed. Seeds below 50 are for choosing settings.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin

work=/tmp/vcharge_obstacles scale=1.0 seed=108 rig_seed=1 drives="course lot pitch garage"
while [ $# -gt 0 ]; do
  case "$1" in
    --work) work=${2:?--work needs a folder}; shift 2 ;;
    --seed) seed=${2:?--seed needs a number}; shift 2 ;;
    --rig-seed) rig_seed=${2:?--rig-seed needs a number}; shift 2 ;;
    --drives) drives=${2:?--drives needs names}; shift 2 ;;
    --small) scale=0.4; shift ;;
    -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "evaluate_obstacles.sh: unknown argument '$1' (see --help)" >&2; exit 2 ;;
  esac
done
tools=$PWD/build/devel/lib
mkdir -p "$work"

scenario() {
  local own="--seed ${seed}1 --image-scale $scale"
  case "$1" in
    course) echo "--scene obstacles --drive creep --duration-s 19.5 $own" ;;
    lot) echo "--scene lot --drive stop_and_go --duration-s 6 $own" ;;
    pitch) echo "--scene lot --drive stop_and_go --duration-s 6 --set faults.soft_suspension.pitch_factor=4 $own" ;;
    garage) echo "--scene garage --drive short --duration-s 4 $own" ;;
    lot_other_day | garage_other_day)
      echo "--scene ${1%_other_day} --drive other_day --duration-s 8 --seed $((seed + 400)) --rig random --rig-seed $rig_seed" \
        "--image-scale 0.5 --exposure-gain 1.2 --set odometer.scale_error=-0.0005 --set odometer.left_right_error=0.0003" ;;
    *) echo "evaluate_obstacles.sh: unknown drive '$1': expected course, lot, pitch, garage, lot_other_day or" \
         "garage_other_day" >&2; exit 2 ;;
  esac
}

for drive in $drives; do
  words=$(scenario "$drive")
  read -r -a arguments <<<"$words"
  name=${drive}_seed${seed}
  case "$drive" in
    *_other_day) name+=_rig$rig_seed ;;
    *) [ "$scale" = 1.0 ] || name+=_small ;;
  esac
  bag=$work/$name.bag truth=$work/${name}_truth
  if [ ! -e "$bag" ]; then
    "$tools/vcharge_simulation/simulate_drive" "${arguments[@]}" --scene-seed "$seed" --cameras front left right \
      --truth-range --output "$bag"
  fi
  "$tools/vcharge_obstacles/detect_obstacles" --bag "$bag" --rig "$truth/rig.yaml" \
    --options config/obstacles.yaml --range-options config/dense_obstacles.yaml --output "$work/$name"
  echo "== $name"
  "$tools/vcharge_evaluation/evaluate_obstacles" --obstacles "$work/$name" --truth "$truth" --report "$work/report_$name"
done
