#!/usr/bin/env bash
# Every performance figure in one run, as ratios and as JSON: builds, runs the suite's benchmarks, prints a table.
#   bench.sh [--output BENCH.json] [--repetitions N] [--quick] [BENCHMARK...]
# Ratios compare two things measured in the same run (the plain reference, OpenGV, OpenCV, one core against two), so that they
# mean something on a busy machine too. --quick leaves out what takes more than a minute. bench_compare A.json B.json
# (scripts/bench_compare.py) tells what became slower beyond noise.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
case " $* " in *" -h "* | *" --help "*) sed -n '2,6s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
[ -d build/devel/lib ] || scripts/build.sh
exec scripts/in_build.sh /usr/bin/python3 scripts/bench.py "$@"
