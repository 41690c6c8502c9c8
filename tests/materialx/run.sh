#!/usr/bin/env bash
# Runs shaders that MaterialX generates, and lets its OslRenderer drive this program: see docs/materialx.md.
# Installs MaterialX from PyPI into target/materialx, or says "left out".
#   tests/materialx/run.sh [nodes|headers|docs|pictures] [FILE.mtlx ...]     all four without a word
set -euo pipefail
cd "$(dirname "$0")/../.."
export PYTHONDONTWRITEBYTECODE=1
python=target/materialx/python
if [ ! -x "$python/bin/python" ] || ! "$python/bin/python" -c 'import MaterialX' 2>/dev/null; then
    if ! { python3 -m venv "$python" && timeout 60 "$python/bin/pip" install -q materialx==1.39.5; } >/dev/null 2>&1; then
        echo "left out: MaterialX, because pip cannot install materialx==1.39.5"
        exit 0
    fi
fi
cargo build --workspace --bin oslrun --quiet
program=${CARGO_TARGET_DIR:-target}/debug/oslrun
what=${1:-all}
shift || true
for part in nodes headers docs pictures; do
    if [ "$what" = all ] || [ "$what" = "$part" ]; then
        "$python/bin/python" tests/materialx/materialx_osl.py "$part" target/materialx "$program" "$@"
    fi
done
