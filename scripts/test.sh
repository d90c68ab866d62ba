#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test: test.sh [ctest arguments, e.g. -R PlaneSweep].
# Tests on real images look for them in $VCHARGE_DATA and are skipped, and counted as skipped, without it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin

scripts/install_dependencies.sh
scripts/check_format.sh
scripts/build.sh --tests

export ROS_HOSTNAME=localhost
ROS_HOME=$(mktemp -d)
export ROS_HOME
trap 'rm -rf "$ROS_HOME"' EXIT
[ -n "${VCHARGE_DATA:-}" ] || echo "VCHARGE_DATA is not set: the tests on real images are skipped."

rm -rf build/test_results
status=0
(cd build && ctest -j"$(nproc)" --output-on-failure "$@") || status=$?
/usr/bin/python3 scripts/count_tests.py build/test_results || status=1
exit "$status"
