#!/usr/bin/env bash
# Fuzzes every door with cargo-fuzz: tests/fuzz/all.sh SECONDS [SEED]. Corpora stay in tests/fuzz/corpus, failing inputs in
# tests/fuzz/artifacts.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:?SECONDS}
seed=${2:-1}
cargo fuzz --version >/dev/null 2>&1 || cargo install cargo-fuzz --locked
export RUSTC_BOOTSTRAP=1
doors=$(cargo fuzz list)
each=$((seconds / $(wc -w <<<"$doors") + 1))
failed=0
for door in $doors; do
    mkdir -p "fuzz/corpus/$door"
    (cd .. && cargo run --quiet --profile fuzz -p osl-tests --example door -- seeds "$door" "tests/fuzz/corpus/$door")
    cargo fuzz run -s none --no-trace-compares "$door" -- -seed="$seed" -max_total_time="$each" -timeout=5 -rss_limit_mb=500 \
        -max_len=4000 || failed=1
done
exit "$failed"
