#!/usr/bin/env bash
# Builds the suite into build/ with CMake and Ninja: build.sh [--tests]. VCHARGE_CMAKE_OPTIONS holds further CMake options.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Debian's ROS scripts and catkin need the system's python3 first on PATH.
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin

targets=(all)
[ "${1:-}" = "--tests" ] && targets+=(tests)
# shellcheck disable=SC2086 # several options in one variable
cmake -S . -B build -G Ninja ${VCHARGE_CMAKE_OPTIONS:-} >build_configure.log 2>&1 || {
  cat build_configure.log >&2
  exit 1
}
mv build_configure.log build/configure.log
cmake --build build --target "${targets[@]}"
