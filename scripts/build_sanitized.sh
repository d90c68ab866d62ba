#!/usr/bin/env bash
# Builds into build_sanitize/ by clang with AddressSanitizer, UndefinedBehaviorSanitizer and what libFuzzer needs:
# build_sanitized.sh TARGET... Further CMake options come through VCHARGE_CMAKE_OPTIONS.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
command -v clang++ >/dev/null || { echo "build_sanitized.sh: clang is missing: scripts/install_dependencies.sh" >&2; exit 1; }
# shellcheck disable=SC2086 # the options are words
cmake -S . -B build_sanitize -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_C_COMPILER=clang -DVCHARGE_FUZZ=ON \
  -DVCHARGE_SANITIZE=address,undefined,fuzzer-no-link ${VCHARGE_CMAKE_OPTIONS:-} >build_sanitize_configure.log 2>&1 || {
  cat build_sanitize_configure.log >&2
  exit 1
}
mv build_sanitize_configure.log build_sanitize/configure.log
cmake --build build_sanitize --target "$@"
