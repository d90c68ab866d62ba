#!/usr/bin/env bash
# Installs, builds, and takes a simulated car with unknown cameras through every step: chessboards -> intrinsics; a drive -> masks and
# extrinsics; a drive -> sparse map, height map, OctoMap; another day, with people -> pose in the map, range maps and obstacles,
# offline and through the nodelets. Ends with the page demo/report.html. Steps that an earlier run finished are kept: delete
# demo/ to start over.
#   demo.sh [--quick] [--no-rviz] [--scene lot|garage] [--seed N]
#   demo.sh --boards BOARDS --bag DRIVE.bag [--other-bag OTHER.bag]     your own recordings; BOARDS/CAMERA: pictures of a chessboard
#   demo.sh --rig rig.yaml --bag DRIVE.bag [--other-bag OTHER.bag]      the same with known intrinsics (and extrinsics)
# --quick: images of half the size, shorter drives (about 12 minutes on two cores instead of an hour).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
case " $* " in *" -h "* | *" --help "*)
  sed -n '2,10s/^# \{0,1\}//p' "$0"
  PYTHONPATH=src/vcharge_evaluation/python:src/vcharge_python/python exec /usr/bin/python3 -m vcharge_evaluation.chain.steps --help ;;
esac

scripts/install_dependencies.sh
scripts/build.sh
if [ -n "${DISPLAY:-}" ] && [ $# -eq 0 ]; then
  scripts/in_build.sh /usr/bin/python3 -m vcharge_evaluation.chain.steps
  exec scripts/in_build.sh roslaunch vcharge_launch vcharge.launch rviz:=true bag:="$PWD/demo/other_day/drive.bag" \
    rig:="$PWD/demo/extrinsics/rig.yaml" map:="$PWD/demo/map/map.vmap"
fi
exec scripts/in_build.sh /usr/bin/python3 -m vcharge_evaluation.chain.steps "$@"
