#!/usr/bin/env bash
# Builds with clang and sanitizers: build_sanitized.sh [--fuzz | --threads] TARGET...
# Default: AddressSanitizer and UndefinedBehaviorSanitizer, in build_sanitize/. --fuzz: also libFuzzer's instrumentation, which
# makes tests five times slower, in build_fuzz/. --threads: ThreadSanitizer, in build_sanitize_threads/.
# VCHARGE_CMAKE_OPTIONS holds further CMake options.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
command -v clang++ >/dev/null || { echo "build_sanitized.sh: clang is missing: scripts/install_dependencies.sh" >&2; exit 1; }
folder=build_sanitize options=(-DVCHARGE_SANITIZE=address,undefined)
case "${1:-}" in
  --fuzz)
    shift
    folder=build_fuzz options=(-DVCHARGE_FUZZ=ON -DVCHARGE_SANITIZE=address,undefined,fuzzer-no-link)
    ;;
  --threads)
    shift
    folder=build_sanitize_threads options=(-DVCHARGE_SANITIZE=thread "-DCMAKE_CXX_FLAGS=-I$PWD/test/thread_sanitizer")
    ;;
esac
# shellcheck disable=SC2086 # the options are words
cmake -S . -B "$folder" -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_C_COMPILER=clang "${options[@]}" \
  ${VCHARGE_CMAKE_OPTIONS:-} >"${folder}_configure.log" 2>&1 || {
  cat "${folder}_configure.log" >&2
  exit 1
}
mv "${folder}_configure.log" "$folder/configure.log"
cmake --build "$folder" --target "$@"
