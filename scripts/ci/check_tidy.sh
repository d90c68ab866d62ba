#!/usr/bin/env bash
# Runs clang-tidy over the C++ sources changed since a commit: check_tidy.sh [BASE, default HEAD~1]; 'all' checks every file.
# Needs a build (compile_commands.json).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
base=${1:-HEAD~1}
if [ "$base" = all ]; then
  files=$(git ls-files '*.cpp')
elif git rev-parse --verify --quiet "$base" >/dev/null; then
  files=$(git diff --name-only --diff-filter=d "$base" -- '*.cpp')
else
  files=""
fi
[ -n "$files" ] || { echo "clang-tidy: no C++ source changed."; exit 0; }
# clang cannot read GCC's precompiled headers, and sources must do without them.
mkdir -p build/tidy
sed -E 's/-Winvalid-pch -include [^ ]*cmake_pch\.hxx//' build/compile_commands.json >build/tidy/compile_commands.json
echo "clang-tidy on $(wc -l <<<"$files") files"
xargs -P "$(nproc)" -n 1 clang-tidy -p build/tidy --quiet <<<"$files" 2>/dev/null
