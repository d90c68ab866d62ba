#!/usr/bin/env bash
# Measures performance: builds, runs the benchmarks, prints ratios as a table and writes all times as JSON.
#   bench.sh [--json BENCH.json] [--repetitions N] [--quick] [BENCHMARK...]
# A ratio compares two measurements of the same run (with a plain reference, OpenGV, OpenCV, Ceres, one core), so that it is
# valid on a busy machine too. --quick leaves out benchmarks that take more than a minute.
#   bench.sh --compare A.json B.json     which benchmarks became slower beyond noise
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
case " $* " in *" -h "* | *" --help "*) sed -n '2,6s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
if [ "${1:-}" = --compare ]; then
  shift
  exec scripts/in_build.sh /usr/bin/python3 -m vcharge_evaluation.benchmarks.compare "$@"
fi
[ -d build/devel/lib ] || scripts/build.sh
exec scripts/in_build.sh /usr/bin/python3 -m vcharge_evaluation.benchmarks.run "$@"
