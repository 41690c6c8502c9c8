#!/usr/bin/env bash
# The tests of machine code, of noise, of values and of the seed shaders on aarch64, emulated: the same recorded bits as on
# x86-64.
# On Debian it installs what it needs if it may (a compiler with the target, a linker, an emulator), and says what is missing.
# Takes as long as a build of the workspace, and half a minute: it is no part of .ci/run. tests/aarch64.sh [CARGO TEST ARGUMENTS]
set -euo pipefail
cd "$(dirname "$0")/.."
target=aarch64-unknown-linux-gnu
if [ "$(id -u)" = 0 ] && ! command -v qemu-aarch64 >/dev/null; then
    dpkg --add-architecture arm64
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends qemu-user gcc-aarch64-linux-gnu \
        libc6-dev-arm64-cross rustc-web libstd-rust-web-dev:arm64
fi
for tool in qemu-aarch64 aarch64-linux-gnu-gcc; do
    command -v "$tool" >/dev/null || { echo "left out: there is no $tool"; exit 77; }
done
# The usual toolchain if it has the target (rustup target add aarch64-unknown-linux-gnu), else that of the distribution.
if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target" ]; then
    [ -d "/usr/lib/rustlib/$target" ] || { echo "left out: no compiler here has the target $target"; exit 77; }
    export RUSTC=/usr/bin/rustc RUSTDOC=/usr/bin/rustdoc
fi
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target/aarch64}
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
# One C library: where the system has one for aarch64 too, the loader of the one with the other never ends making a thread.
cross=/usr/aarch64-linux-gnu
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L $cross -E LD_LIBRARY_PATH=$cross/lib"
if [ $# -gt 0 ]; then exec cargo test --target "$target" "$@"; fi
# From small to large, so that a difference shows early.
cargo test --target "$target" -p osl-simd -p osl-native
OSL_BLOCKS=100000 cargo test --target "$target" -p osl-native --test blocks millions -- --ignored
cargo test --target "$target" -p osl-noise
cargo test --target "$target" -p osl-numeric --test numeric_vectors --test numeric_laws
cargo test --target "$target" -p osl-exec --lib
cargo test --target "$target" -p osl-tests --test values --test seeds
