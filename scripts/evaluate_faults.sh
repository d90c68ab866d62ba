#!/usr/bin/env bash
# The simulator's faults through the whole online path: what each stage says and when, and that no wrong pose is called good.
# See --help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
# shellcheck disable=SC1091
set +u && . build/devel/setup.bash && set -u
exec /usr/bin/python3 scripts/evaluate_faults.py "$@"
