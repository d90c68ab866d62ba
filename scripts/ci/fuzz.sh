#!/usr/bin/env bash
# Fuzzes every reader of external data with libFuzzer, AddressSanitizer and UBSan (build_fuzz/):
#   fuzz.sh [--seconds N] [--corpus DIR] [TARGET...]        all targets by default, 60 s each; --list names them
# Interesting inputs stay in DIR (build_fuzz/corpus), failing ones in build_fuzz/findings; the exit status is 1 if any fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin

seconds=60 corpus=$PWD/build_fuzz/corpus list=false targets=()
while [ $# -gt 0 ]; do
  case "$1" in
    --seconds) seconds=${2:?--seconds needs a number}; shift 2 ;;
    --corpus) mkdir -p "${2:?--corpus needs a folder}"; corpus=$(realpath "$2"); shift 2 ;;
    --list) list=true; shift ;;
    -h | --help) sed -n '2,4s/^# \{0,1\}//p' "$0"; exit 0 ;;
    -*) echo "fuzz.sh: unknown argument '$1' (see --help)" >&2; exit 2 ;;
    *) targets+=("$1"); shift ;;
  esac
done

scripts/ci/build_sanitized.sh --fuzz fuzz_reader
reader=$(find build_fuzz/devel/lib -name fuzz_reader -type f)
# Debian's libraries are not instrumented: containers passed to them would be reported.
export ASAN_OPTIONS=detect_container_overflow=0:allocator_may_return_null=1:detect_leaks=0
[ "$list" = false ] || { "$reader"; exit 0; }
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <("$reader")

findings=$PWD/build_fuzz/findings status=0
mkdir -p "$findings"
for target in "${targets[@]}"; do
  mkdir -p "$corpus/$target" "$findings/$target"
  FUZZ_TARGET=$target FUZZ_SEEDS=$corpus/$target "$reader" >/dev/null
  log=$findings/$target.log
  if FUZZ_TARGET=$target "$reader" -max_total_time="$seconds" -max_len=65536 -rss_limit_mb=4096 -timeout=20 -seed=1 \
    -artifact_prefix="$findings/$target/" "$corpus/$target" >"$log" 2>&1; then
    printf '%-28s sound: %s\n' "$target" "$(grep -E '^Done|#[0-9]+.*DONE' "$log" | tail -1)"
  else
    printf '%-28s BROKEN: %s\n' "$target" "$(grep -aE 'ERROR|SUMMARY|runtime error|what\(\)' "$log" | head -2 | tr '\n' ' ')"
    status=1
  fi
done
exit "$status"
