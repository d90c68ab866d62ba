#!/usr/bin/env bash
# Names the C++ sources that clang-format would change, and fails if there are any.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
git ls-files -z '*.h' '*.cpp' | xargs -0 --no-run-if-empty clang-format --dry-run --Werror
