#!/usr/bin/env bash
# Fuzzes one target with libFuzzer, or all of them in sequence: fuzz/run.sh TARGET|all SECONDS [flags of libFuzzer].
#
# The compiler is the stable one: coverage is a pass of LLVM (sancov) and needs no nightly flag. No sanitizer is enabled, because the code has no
# `unsafe` of its own; overflow checks and debug assertions are enabled. libFuzzer itself is C++, so it needs a C++ compiler.
# The corpus grows in fuzz/corpus/TARGET, findings are files in fuzz/found/TARGET.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -ge 2 ] || { sed -n '2,7p' "$0"; exit 2; }
wanted=$1 seconds=$2
shift 2

host=$(rustc -vV | sed -n 's/^host: //p')
# A separate target folder, because these flags would rebuild everything else.
build=${EMU_FUZZ_TARGET_DIR:-${CARGO_TARGET_DIR:-target}/fuzz}
flags="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters"
flags+=" -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing"
# With --target the flags do not apply to build scripts.
RUSTFLAGS=$flags cargo build --release --manifest-path fuzz/libfuzzer/Cargo.toml --target "$host" --target-dir "$build"
fuzzer=$build/$host/release/emu-libfuzzer
driver() { cargo run --quiet --release -p emu-fuzz -- "$@"; }

found=0
targets=$wanted
[ "$wanted" != all ] || targets=$(driver list | cut -d' ' -f1)
for target in $targets; do
    corpus=fuzz/corpus/$target
    mkdir -p "$corpus" "fuzz/found/$target"
    driver seeds "$target" "$corpus"
    driver dictionary "$target" > "fuzz/corpus/$target.dict"
    # libFuzzer refuses an empty file.
    words=()
    [ ! -s "fuzz/corpus/$target.dict" ] || words=(-dict="fuzz/corpus/$target.dict")
    echo "== $target, $seconds s"
    EMU_FUZZ_TARGET=$target "$fuzzer" "$corpus" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1536 -max_len=65536 \
        "${words[@]}" -artifact_prefix="fuzz/found/$target/" -print_final_stats=1 "$@" \
        2> "fuzz/corpus/$target.log" || found=1
    grep -E '^stat::number_of_executed|^stat::peak_rss|^SUMMARY|ERROR|panicked' "fuzz/corpus/$target.log" || true
    find "fuzz/found/$target" -type f -printf "  replay: cargo run --release -p emu-fuzz -- replay $target %p\n"
done
exit $found
