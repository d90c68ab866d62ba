#!/usr/bin/env bash
# Runs a command in the repository's root and the environment of the built tree: in_build.sh COMMAND...
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
[ -f build/devel/setup.bash ] || { echo "in_build.sh: build/devel/setup.bash is missing: run scripts/build.sh" >&2; exit 1; }
command=("$@")
set --  # a sourced script would read the arguments
# shellcheck disable=SC1091
set +u && . build/devel/setup.bash && set -u
export PYTHONPATH=$PWD/src/vcharge_evaluation/python:$PWD/src/vcharge_python/python:${PYTHONPATH:-}
exec "${command[@]}"
