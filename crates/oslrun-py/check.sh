#!/usr/bin/env bash
# Builds the package for Python in a virtual environment and runs its tests, or says "left out".
set -euo pipefail
cd "$(dirname "$0")/../.."
if python3 -m venv target/python && target/python/bin/pip install --quiet maturin pytest numpy 2>/dev/null; then
    source target/python/bin/activate
    cd crates/oslrun-py
    cargo fmt --check
    maturin develop --quiet
    pytest --quiet
else
    echo "left out: the package for Python, which needs maturin, pytest and numpy from PyPI"
fi
