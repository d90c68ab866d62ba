#!/usr/bin/env bash
# From nothing to range maps: installs, builds, simulates a short drive of a car with four fisheye cameras, computes
# range maps and judges them against the truth, builds a sparse map, a height map, an OctoMap and obstacle maps, replays the
# drive through the nodelets with rviz, and leaves pictures in demo/. What is already in demo/ is kept: delete the folder to
# start over.
#   demo.sh [--no-rviz] [--bag DRIVE.bag --rig rig.yaml]    the second form runs on a recording of your own
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin

bag="" rig="" with_rviz=true
while [ $# -gt 0 ]; do
  case "$1" in
    --bag) bag=$(realpath "${2:?--bag needs a file}"); shift 2 ;;
    --rig) rig=$(realpath "${2:?--rig needs a file}"); shift 2 ;;
    --no-rviz) with_rviz=false; shift ;;
    -h | --help) sed -n '2,6s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "demo.sh: unknown argument '$1' (see --help)" >&2; exit 2 ;;
  esac
done
if { [ -n "$bag" ] && [ -z "$rig" ]; } || { [ -z "$bag" ] && [ -n "$rig" ]; }; then
  echo "demo.sh: --bag and --rig go together" >&2
  exit 2
fi

step() { printf '\n== %s (%d s)\n' "$1" "$((SECONDS - started))"; }
started=$SECONDS

step "1/9 packages and build"
scripts/install_dependencies.sh
scripts/build.sh
# shellcheck disable=SC1091
set +u && . build/devel/setup.bash && set -u
tools=build/devel/lib
mkdir -p demo
started=$SECONDS  # the steps from here on are the demo itself

truth=""
if [ -z "$bag" ]; then
  step "2/9 a simulated drive through a parking lot"
  bag=$PWD/demo/drive.bag rig=$PWD/demo/rig_truth.yaml truth=$PWD/demo/drive_truth
  if [ ! -e "$bag" ]; then
    "$tools/vcharge_simulation/simulate_drive" --scene lot --drive short --truth-range --output "$bag"
  else
    echo "kept: $bag"
  fi
else
  step "2/9 your drive: $bag"
fi

step "3/9 range maps"
if [ ! -e demo/range/complete ]; then
  rm -rf demo/range
  "$tools/vcharge_dense/compute_range_maps" --bag "$bag" --rig "$rig" --output demo/range
  touch demo/range/complete
else
  echo "kept: demo/range"
fi

if [ -n "$truth" ]; then
  step "4/9 errors against the truth"
  "$tools/vcharge_evaluation/evaluate_range" --range demo/range --truth "$truth" --bag "$bag" --rig "$rig" \
    --report demo/evaluation | tee demo/range_errors.txt
else
  step "4/9 no truth for a drive of your own"
fi

step "5/9 pictures"
/usr/bin/python3 scripts/draw_demo.py --bag "$bag" --rig "$rig" --range demo/range ${truth:+--truth "$truth"} \
  --output demo

step "6/9 a sparse map"
if [ ! -e demo/map.vmap ]; then
  "$tools/vcharge_mapping/build_map" --bag "$bag" --rig "$rig" --output demo/map.vmap --trajectory demo/map.tum \
    --options config/mapping.yaml --report demo/map
else
  echo "kept: demo/map.vmap"
fi
# Awk reads to the end: one that leaves early breaks the pipe.
camera=$("$tools/vcharge_mapping/map_info" --map demo/map.vmap |
  awk '/^camera / && !found { found = 1; next } found == 1 { print $1; found = 2 }')
"$tools/vcharge_mapping/draw_landmarks" --map demo/map.vmap --bag "$bag" --camera "$camera" --output demo/landmarks.png
if [ -n "$truth" ]; then
  "$tools/vcharge_evaluation/evaluate_map" --map demo/map.vmap --truth "$truth/trajectory.tum" --report demo/map |
    tee demo/map_errors.txt
fi

step "7/9 a height map and an OctoMap"
# Range maps are kept until the folder is there: a run that was stopped goes on.
height_map() {  # BAG RIG OUTPUT [--trajectory FILE]
  if [ ! -e "$3" ]; then
    "$tools/vcharge_dense/build_height_map" --bag "$1" --rig "$2" --output "$3" --options config/height_map.yaml "${@:4}"
  else
    echo "kept: $3"
  fi
  /usr/bin/python3 scripts/draw_height_map.py --map "$3" --output "$3.png"
}
height_map "$bag" "$rig" demo/height_map --trajectory demo/map.tum
with_real=false
if [ -d "${VCHARGE_DATA:-}/vcharge_left" ]; then
  with_real=true
  echo "The published images of the V-Charge car:"
  if [ ! -e demo/real.bag ]; then
    "$tools/vcharge_ros/import_vcharge_images" --folder "$VCHARGE_DATA/vcharge_left" --output demo/real.bag \
      --rig demo/real.yaml
  fi
  height_map demo/real.bag demo/real.yaml demo/height_map_real
fi

step "8/9 obstacles and free ground around the vehicle"
obstacles() {  # BAG RIG OUTPUT [TRUTH]; the options name cameras that another rig may not have
  if [ ! -e "$3" ]; then
    "$tools/vcharge_obstacles/detect_obstacles" --bag "$1" --rig "$2" ${4:+--options config/obstacles.yaml} \
      --range-options config/dense_obstacles.yaml --output "$3"
  else
    echo "kept: $3"
  fi
  /usr/bin/python3 scripts/draw_obstacles.py --bag "$1" --rig "$2" --obstacles "$3" ${4:+--truth "$4"} --output "$3.png"
}
obstacles "$bag" "$rig" demo/obstacles "$truth"
if [ "$with_real" = true ]; then
  obstacles demo/real.bag demo/real.yaml demo/obstacles_real
fi

step "9/9 the same drive through the nodelets"
if [ "$with_rviz" = false ]; then
  echo "left out (--no-rviz)"
elif [ -n "${DISPLAY:-}" ]; then
  roslaunch vcharge_launch drive_replay.launch bag:="$bag" rig:="$rig" rviz:=true
else
  echo "no display: rviz runs on a virtual one and leaves demo/rviz.png and demo/rviz_height_map.png"
  scripts/rviz_screenshot.sh "$bag" "$rig" demo/rviz.png
  scripts/rviz_screenshot.sh demo/height_map demo/rviz_height_map.png
fi

step "done"
echo "Pictures:"
ls demo/*.png demo/evaluation/*.png demo/map/*.png demo/map/*.html 2>/dev/null || true
