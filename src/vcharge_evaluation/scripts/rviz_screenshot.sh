#!/usr/bin/env bash
# Takes a picture of rviz on a virtual display, of a drive replayed through the nodelets or of a saved map:
#   rviz_screenshot.sh DRIVE.bag rig.yaml OUTPUT.png            range maps and point clouds
#   rviz_screenshot.sh DRIVE.bag rig.yaml OUTPUT.png around     obstacles, free ground, steps and moving objects
#   rviz_screenshot.sh DRIVE.bag rig.yaml OUTPUT.png LOT.vmap   the pose in a map
#   rviz_screenshot.sh DRIVE.bag rig.yaml OUTPUT.png LOT.vmap obstacles    obstacles and free ground, the whole car running
#   rviz_screenshot.sh LOT.vmap OUTPUT.png                      a sparse map and what changed in its newest version
#   rviz_screenshot.sh MAP OUTPUT.png                           a height map with its OctoMap (folder of build_height_map)
set -euo pipefail
views=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../../../config/rviz")
[ $# -ge 2 ] && [ $# -le 5 ] || { sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
if [ $# -eq 2 ] && [ "${1##*.}" = vmap ]; then
  output=$2
  wait_s=20
  launch=(view_map.launch map:="$(realpath "$1")")
elif [ $# -eq 2 ]; then
  output=$2
  wait_s=40  # a mesh of some hundred thousand triangles
  launch=(view_map.launch height_map:="$(realpath "$1")")
  centre_on=$1
else
  output=$3
  wait_s=20
  if [ "${5:-}" = obstacles ]; then
    launch=(vcharge.launch map:="$4")
    wait_s=35  # the drive starts after 5 s and is replayed once
  elif [ "${4:-}" = around ]; then
    launch=(obstacles.launch objects:=true)
    wait_s=30
  elif [ $# -eq 4 ]; then
    launch=(localization.launch map:="$4" loop:=true)
  else
    launch=(drive_replay.launch loop:=true)
  fi
  launch+=(bag:="$1" rig:="$2" rate:=0.25)
fi
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin ROS_HOSTNAME=localhost
scratch=$(mktemp -d)
export ROS_HOME=$scratch
if [ -n "${centre_on:-}" ]; then
  # Centre the view on the map.
  /usr/bin/python3 - "$centre_on/height_map.yaml" "$views/height_map.rviz" "$scratch/view.rviz" <<'END'
import sys, yaml
grid, view = yaml.safe_load(open(sys.argv[1])), yaml.safe_load(open(sys.argv[2]))
current = view["Visualization Manager"]["Views"]["Current"]
size = [grid["cell_size_m"] * cells for cells in grid["size_cells"]]
current["Focal Point"].update(X=grid["origin_m"][0] + 0.5 * size[0], Y=grid["origin_m"][1] + 0.5 * size[1])
current["Distance"] = max(size)
yaml.safe_dump(view, open(sys.argv[3], "w"))
END
  launch+=(rviz_config:="$scratch/view.rviz")
fi
pids=()
cleanup() {
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf "$scratch"
}
trap cleanup EXIT

Xvfb -displayfd 3 -screen 0 1600x1000x24 3>"$scratch/display" >"$scratch/xvfb.log" 2>&1 &
pids+=($!)
display=
for _ in $(seq 100); do { read -r display <"$scratch/display"; } 2>/dev/null && break; sleep 0.1; done
[ -n "$display" ] || { cat "$scratch/xvfb.log" >&2; exit 1; }
export DISPLAY=:$display LIBGL_ALWAYS_SOFTWARE=1

roslaunch -p $((20000 + RANDOM % 20000)) vcharge_launch "${launch[@]}" rviz:=true >"$scratch/roslaunch.log" 2>&1 &
pids+=($!)
# rviz starts slowly with a software renderer, so the drive is replayed in a loop meanwhile.
for _ in $(seq "$wait_s"); do
  sleep 1
  kill -0 "${pids[1]}" 2>/dev/null || { cat "$scratch/roslaunch.log" >&2; exit 1; }
done
import -window root "$scratch/rviz.png"
mv "$scratch/rviz.png" "$output"
echo "written: $output"
