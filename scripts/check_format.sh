#!/usr/bin/env bash
# Fails, naming the files, when C++ sources are not as clang-format leaves them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
git ls-files -z '*.h' '*.cpp' | xargs -0 --no-run-if-empty clang-format --dry-run --Werror
