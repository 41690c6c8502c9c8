#!/usr/bin/env bash
# Fuzzes every door: tests/fuzz/all.sh SECONDS [SEED], or tests/fuzz/all.sh RUNSx for a number of executions, such as 10000000x.
# With cargo-fuzz (and seconds) it runs the targets of libFuzzer one after the other, else the plain fuzzer, which also
# measures. Corpora stay in tests/fuzz/corpus, failing inputs in tests/fuzz/artifacts or tests/fuzz/corpus/plain/failing.
set -euo pipefail
cd "$(dirname "$0")/../.."
amount=${1:?SECONDS or RUNSx}
seed=${2:-1}
if [[ $amount != *x ]] && cargo fuzz --version >/dev/null 2>&1; then
    export RUSTC_BOOTSTRAP=1
    cd tests
    doors=$(cargo fuzz list)
    each=$((amount / $(wc -w <<<"$doors") + 1))
    failed=0
    for door in $doors; do
        mkdir -p "fuzz/corpus/$door"
        (cd .. && cargo run --quiet --profile fuzz -p osl-tests --example fuzz -- --seeds "tests/fuzz/corpus/$door" "$door")
        cargo fuzz run -s none --no-trace-compares "$door" -- -seed="$seed" -max_total_time="$each" -timeout=5 -rss_limit_mb=500 \
            -max_len=4000 || failed=1
    done
    exit "$failed"
fi
cargo build --profile fuzz -p osl-tests --example fuzz
if [[ $amount == *x ]]; then how=(--runs "${amount%x}"); else how=(--time "$amount"); fi
# Below this an allocation that nothing bounds fails, which ends a process: the parent notes the input.
ulimit -v 8000000
exec target/fuzz/examples/fuzz "${how[@]}" --seed "$seed"
