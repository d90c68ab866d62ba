#!/usr/bin/env bash
# Installs missing packages, builds, and runs every test.
#   test.sh [--sanitize | --sanitize-threads] [ctest arguments, e.g. -R PlaneSweep]
# Tests on real images need $VCHARGE_DATA and are counted as skipped without it.
# --sanitize: all unit tests, and the integration tests that run tools, built by clang with AddressSanitizer and
# UndefinedBehaviorSanitizer (build_sanitize/). Debian's nodelet manager cannot load such libraries.
# --sanitize-threads: all unit tests with ThreadSanitizer (build_sanitize_threads/; test/thread_sanitizer/README.md).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin

folder=build
if [ "${1:-}" = "--sanitize" ]; then
  shift
  folder=build_sanitize
  set -- --timeout 14400 -R '_gtest_|rostest_(tools|offline|mapping|mapping_faults|faults|determinism)\.test' "$@"
  # Debian's libraries are not instrumented: containers passed to them would be reported, and memory they keep too.
  export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_container_overflow=0:detect_leaks=0} UBSAN_OPTIONS=print_stacktrace=1
  export VCHARGE_TIME_LIMIT_FACTOR=10
elif [ "${1:-}" = "--sanitize-threads" ]; then
  shift
  folder=build_sanitize_threads
  set -- --timeout 14400 -R '_gtest_' "$@"
  # Debian's libraries are not instrumented: races inside them are false alarms.
  export TSAN_OPTIONS=ignore_noninstrumented_modules=1:second_deadlock_stack=1
fi

scripts/install_dependencies.sh
scripts/ci/check_format.sh
case "$folder" in
  build) scripts/build.sh --tests ;;
  build_sanitize) scripts/ci/build_sanitized.sh all tests ;;
  build_sanitize_threads) scripts/ci/build_sanitized.sh --threads tests ;;
esac

export ROS_HOSTNAME=localhost
ROS_HOME=$(mktemp -d)
export ROS_HOME
trap 'rm -rf "$ROS_HOME"' EXIT
[ -n "${VCHARGE_DATA:-}" ] || echo "VCHARGE_DATA is not set: the tests on real images are skipped."

rm -rf "$folder/test_results"
status=0
(cd "$folder" && ctest -j"$(nproc)" --output-on-failure "$@") || status=$?
/usr/bin/python3 scripts/ci/count_tests.py "$folder/test_results" || status=1
exit "$status"
