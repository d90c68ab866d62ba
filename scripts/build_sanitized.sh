#!/usr/bin/env bash
# Builds by clang into build_sanitize/ with AddressSanitizer, UndefinedBehaviorSanitizer and what libFuzzer needs, or into
# build_sanitize_threads/ with ThreadSanitizer: build_sanitized.sh [--threads] TARGET... Further CMake options come through
# VCHARGE_CMAKE_OPTIONS.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
command -v clang++ >/dev/null || { echo "build_sanitized.sh: clang is missing: scripts/install_dependencies.sh" >&2; exit 1; }
folder=build_sanitize options=(-DVCHARGE_FUZZ=ON -DVCHARGE_SANITIZE=address,undefined,fuzzer-no-link)
if [ "${1:-}" = --threads ]; then
  shift
  folder=build_sanitize_threads options=(-DVCHARGE_SANITIZE=thread "-DCMAKE_CXX_FLAGS=-I$PWD/test/thread_sanitizer")
fi
# shellcheck disable=SC2086 # the options are words
cmake -S . -B "$folder" -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_C_COMPILER=clang "${options[@]}" \
  ${VCHARGE_CMAKE_OPTIONS:-} >"${folder}_configure.log" 2>&1 || {
  cat "${folder}_configure.log" >&2
  exit 1
}
mv "${folder}_configure.log" "$folder/configure.log"
cmake --build "$folder" --target "$@"
