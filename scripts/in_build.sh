#!/usr/bin/env bash
# Runs a command from the project's root in the environment of the built tree: in_build.sh COMMAND...
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
[ -f build/devel/setup.bash ] || { echo "in_build.sh: build/devel/setup.bash is missing; scripts/build.sh makes it" >&2; exit 1; }
command=("$@")
set --  # what is sourced would take the arguments for its own
# shellcheck disable=SC1091
set +u && . build/devel/setup.bash && set -u
exec "${command[@]}"
